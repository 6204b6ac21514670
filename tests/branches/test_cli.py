"""``ribbon COMMAND``: the same as ``python -m branches.COMMAND``."""

import contextlib
import importlib.util
import io
import os
import platform
import shutil
import subprocess
import sys

import pytest

from branches import cli
from branches.scene.parse import found
from branches.strip import __main__ as strip

PROGRAM = ("-m", "branches.cli")


def test_every_command_is_a_module_and_every_program_is_a_command(root):
    assert all(importlib.util.find_spec(module) for module, _ in cli.COMMANDS.values())
    programs = {path.stem for path in (root / "branches").glob("*.py") if '__name__ == "__main__"' in path.read_text()}
    programs |= {path.parent.name for path in (root / "branches").glob("*/__main__.py")}
    assert programs - {"cli"} == set(cli.COMMANDS)


def test_help_lists_all_and_imports_nothing_heavy(command):
    done = command("--help", program=PROGRAM)
    assert done.returncode == 0 and all(f"  {name} " in done.out for name in cli.COMMANDS)
    assert all(len(line) < 100 for line in done.out.splitlines())
    code = (
        "import sys; from branches import cli; cli.main(['--help']); print('numpy' in sys.modules, 'argparse' in sys.modules)"
    )
    environment = {**os.environ, "PYTHONPATH": str(os.path.dirname(os.path.dirname(cli.__file__)))}
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment).stdout
    assert said.endswith("False False\n")


@pytest.mark.sample(1)
@pytest.mark.parametrize("words", ["run none.yaml", "paper --out p nix", "export x.h5", "strip --width x"])
def test_a_command_does_the_same_as_its_module(command, words):
    name, *rest = words.split()
    ours = command(name, *rest, program=PROGRAM)
    theirs = command(*rest, program=("-m", f"branches.{name}"))
    assert (ours.returncode, ours.out, ours.err) == (theirs.returncode, theirs.out, theirs.err)
    assert ours.returncode == 2


def test_an_unknown_command_is_answered_in_one_sentence(call):
    done = call(cli.main, "rum")
    assert done.returncode == 2 and done.err.startswith(
        "error: there is no command 'rum' (did you mean 'run'?); the commands are run, "
    )
    assert call(cli.main, "frobnicate").err.startswith("error: there is no command 'frobnicate'; the commands are run, ")
    assert call(cli.main).err.startswith("error: a command is needed; the commands are run, ")


def test_a_negative_number_with_a_unit_is_a_value(call):
    words = ["--width", "5mm", "--thickness", "0.1mm", "--length", "1m", "--poisson-ratio", "0.3", "--youngs-modulus", "1GPa"]
    done = call(strip.main, *words, "--natural-radius", "-30mm")
    assert done.returncode == 2 and "--natural-radius: -0.03 must be positive" in done.err


@pytest.mark.full
def test_a_mistake_is_answered_with_what_to_type(command):
    said = command("run", "m1_n2", "nu=0.2", program=PROGRAM).err
    assert said.startswith("error: unrecognized arguments: nu=0.2; a field of a scene is changed by --set KEY=VALUE")
    said = command("run", "m1_n2", "--outt", "x", program=PROGRAM).err
    assert said.startswith("error: there is no option --outt (did you mean '--out'?)")
    said = command("plot", "fig12", program=PROGRAM).err
    assert said == "error: cannot read 'fig12': there is no such file; it is the name of a scene: ribbon run fig12\n"
    assert command("help", "scenes", program=PROGRAM).out == command("scenes", "--help", program=PROGRAM).out != ""


@pytest.fixture(scope="module")
def completion():
    """What bash evaluates, written once."""
    with contextlib.redirect_stdout(io.StringIO()) as written:
        assert cli.main(["completion", "bash"]) == 0
    return written.getvalue()


@pytest.mark.posix("on Windows, bash may be that of another system")
@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
@pytest.mark.parametrize(
    ("line", "wanted"),
    [
        ("ribbon se", "secondary"),
        ("ribbon run --over", "--overwrite"),
        ("ribbon paper --qu", "--quiet"),
        ("ribbon run scen", "scene.yaml"),
    ],
)
def test_bash_completes(line, wanted, completion, tmp_path):
    (tmp_path / "scene.yaml").touch()
    (tmp_path / "completion.sh").write_text(completion)
    words = " ".join(f"'{word}'" for word in line.split())
    program = (
        f"source completion.sh; COMP_WORDS=({words}); COMP_CWORD={len(line.split()) - 1}; COMP_LINE='{line}'; "
        "COMP_POINT=${#COMP_LINE}; _shtab_ribbon; echo ${COMPREPLY[@]}"
    )
    assert subprocess.run(["bash", "-c", program], capture_output=True, text=True, cwd=tmp_path).stdout == wanted + "\n"


@pytest.mark.full
def test_completion_of_other_shells(command):
    assert "--overwrite" in command("completion", "zsh", program=PROGRAM).out
    wrong = command("completion", "pwsh", program=PROGRAM)
    assert wrong.returncode == 2 and wrong.err.startswith("error: completion: must be followed by one of bash, zsh")


@pytest.mark.parametrize("prefix", ["ribbon ", "python -m branches."])
@pytest.mark.parametrize("name", cli.COMMANDS)
def test_help_of_every_command_names_it(name, prefix, monkeypatch):
    monkeypatch.setattr("branches.store.command.prefix", prefix)
    parser = importlib.import_module(cli.COMMANDS[name][0]).parser()
    assert parser.format_help().startswith(f"usage: {prefix}{name} ")


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", cli.COMMANDS)
def test_help_names_the_command_that_was_typed(command, name):
    assert command(name, "--help", program=PROGRAM).out.startswith(f"usage: ribbon {name} ")
    assert command("--help", program=("-m", f"branches.{name}")).out.startswith(f"usage: python -m branches.{name} ")


@pytest.mark.full
def test_scenes_of_the_package_are_listed_and_run_by_name(command, call, root, monkeypatch):
    monkeypatch.setattr("branches.store.command.prefix", "ribbon ")  # which the program sets, for the rest of its process
    listed = call(cli.main, "scenes").out
    assert all(len(line.split()) > 1 for line in listed.splitlines())
    assert call(cli.main, "scenes", "--help").out.startswith("usage: ribbon scenes")
    assert call(cli.main, "scenes", "x").err == "error: unrecognized arguments: x (--help shows what there is)\n"
    unknown = command("run", "m1_n22", program=PROGRAM).err
    assert unknown.endswith(" (did you mean 'm1_n2'?); 'ribbon scenes' lists those of the package\n")
    assert [line.split()[0] for line in listed.splitlines()] == sorted(file.stem for file in (root / "configs").glob("*.yaml"))
    (command.folder / "m1_n2").mkdir()  # as a diagram leaves it: the name still means the scene
    done = command("run", "m1_n2", "--quiet", "--set", "steps.max_points=3", program=PROGRAM)
    assert done.returncode == 0 and (command.folder / "m1_n2.h5").exists()


def test_a_folder_of_results_does_not_hide_a_scene_of_its_name(tmp_path, monkeypatch, root):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "fig12").mkdir()
    assert found("fig12") == str(root / "configs" / "fig12.yaml") and found("fig12/") == "fig12/"


def test_version_tells_what_a_report_of_a_fault_needs(call):
    told = call(cli.main, "--version").out
    assert all(word in told for word in ("ribbon-continuation ", "Python ", "numpy ", platform.system()))


def test_it_is_installed_as_ribbon(root):
    import tomllib

    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["scripts"] == {"ribbon": "branches.cli:main"}


@pytest.mark.full
def test_a_variable_of_the_environment_that_contin_does_not_know_is_one_line(command):
    (command.folder / "scene.yaml").write_text("{m: 1, n: 2}")
    done = command("run", "scene.yaml", program=PROGRAM, env={"CONTIN_PROCESSOR": "x86-64-v4"})
    assert done.returncode == 2
    assert done.err == "error: CONTIN_PROCESSOR: 'x86-64-v4' must be one of x86-64, x86-64-v3, generic\n"
    assert [path.name for path in command.folder.iterdir()] == ["scene.yaml"]
