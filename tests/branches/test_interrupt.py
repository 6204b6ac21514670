"""Ctrl-C at every command: one line, exit code 130, no traceback, no half-written file; and what the mechanism promises."""

import os
import shlex
import signal
import time

import pytest

from branches.store import interrupt

PRIMARY = "{m: 3, n: 1, stability: true, limits: {kappa_n: [-120, 100]}, stride: 50}"
STRIP = shlex.split(
    "--width .016 --thickness .00012 --length .6 --natural-radius .03 --poisson-ratio .3 --youngs-modulus 200e9"
)
MANY = "{m: [1, 3, 5, 7], n: [1, 2, 3, 4, 5, 6, 7], limits: {kappa_n: [-100, 100]}, stride: 20}"
#: The command's arguments, what its line says, and the module after whose import it computes.
COMMANDS = {
    "run": (["many.yaml", "--out", "many"], "finished branches are kept", "branches.run.runner"),
    "secondary": (["primary.h5", "--out", "all"], "finished branches are kept", "branches.scene.index"),
    "paper": (["--out", "page", "fig11"], "finished items are on the page", "branches.paper.page"),
    "strip": (STRIP, "this command writes no files", "ribbon_model.seeds"),
    "explore": (["primary.h5", "--out", "page.html"], "no page was written", "branches.explore.gather"),
    "shell": (["--out", "shell.h5"], "finished cases are kept", "branches.paper.shell_run"),
    "graph": (["many.yaml"], "this command writes no files", "branches.graph.closed"),
    "plot": (["many.yaml", "--out", "picture.pdf"], "no picture was written", "branches.graph.closed"),
}


@pytest.fixture(scope="module")
def primary(tmp_path_factory):
    """The image of a branch with secondary bifurcations."""
    from branches.run.display import Display
    from branches.run.runner import compute_scene
    from branches.scene.parse import parse

    return compute_scene(parse(PRIMARY, "scene"), Display(silent=True)).image


def interrupted(process, module: str, delay: float, number=signal.SIGINT) -> list[str]:
    """Send a signal when a module is imported (Python says so on standard error); what else was written there."""
    rest = []
    for line in process.stderr:
        if not line.startswith("import time:"):
            rest.append(line)
        elif line.rpartition("|")[2].strip().startswith(module):
            break
    time.sleep(delay)
    process.send_signal(number)
    _, err = process.communicate(timeout=60)
    return [*rest, *(line for line in err.splitlines() if not line.startswith("import time:"))]


@pytest.mark.sample(2)
@pytest.mark.posix("Windows sends Ctrl-C in another way")
@pytest.mark.parametrize("moment", ["importing", "computing"])
@pytest.mark.parametrize("name", COMMANDS)
def test_ctrl_c(command, primary, name, moment):
    folder = command.folder
    (folder / "primary.h5").write_bytes(primary)
    (folder / "many.yaml").write_text(MANY)
    fake = folder / "bin" / "ccx"  # CalculiX would compute for minutes
    fake.parent.mkdir()
    fake.write_text('#!/bin/sh\n[ "$1" = -v ] && echo Version 2.20 && exit\nexec sleep 60\n')
    fake.chmod(0o755)
    arguments, kept, module = COMMANDS[name]
    path = {"PATH": f"{fake.parent}{os.pathsep}{os.environ['PATH']}"}
    process = command.start(*arguments, program=("-X", "importtime", "-m", f"branches.{name}"), env=path)
    early = moment == "importing"
    fast = early or name == "explore"  # which computes for a tenth of a second
    said = interrupted(process, "branches.store.interrupt" if early else module, 0.02 if fast else 0.1)
    assert process.returncode == 130, said
    assert len(said) == 1 and said[0].startswith("interrupted")
    if name == "explore" and (folder / "page.html").exists():  # it was fast
        kept = "the page is complete"
    assert kept in said[0] or (name == "run" and early)
    assert not list(folder.rglob("*.part"))


@pytest.mark.posix("Windows sends Ctrl-C in another way")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_before_the_first_point_is_told_what_is_kept(command, root, number):
    arguments = [str(root / "configs" / "network_hexagram.yaml"), "--out", "star.h5"]
    process = command.start(*arguments, program=("-X", "importtime", "-m", "branches.run"))
    said = interrupted(process, "ribbon_model.network_first", 0.02, number)
    assert process.returncode == 130
    assert said == ["interrupted; nothing new is in star.h5; the same command starts again"]
    assert not [*command.folder.glob("*star.h5*")]


@pytest.fixture
def pressed(monkeypatch):
    """A function that presses Ctrl-C; ``left`` lists what would have ended the process."""
    left = []
    monkeypatch.setattr(interrupt.os, "_exit", left.append)
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    signal.signal(signal.SIGINT, signal.default_int_handler)
    interrupt.begin("nothing")

    def press():
        signal.raise_signal(signal.SIGINT)
        time.sleep(0.01)

    press.left = left
    yield press
    for number, handler in before.items():
        signal.signal(number, handler)


def test_a_file_is_written_to_its_end(pressed, capfd):
    with interrupt.held():
        pressed()
        assert pressed.left == []
    assert pressed.left == [130] and capfd.readouterr().err == "interrupted; nothing\n"
    pressed()
    assert pressed.left == [130, 130]


def test_code_that_unwinds_gets_an_exception_once(pressed, capfd):
    def main():
        with interrupt.unwinding():
            try:
                pressed()
            finally:
                pressed()

    assert interrupt.run(main) == 130 and pressed.left == [130]  # the process ends there, not in the interpreter's own way
    assert capfd.readouterr().err == "interrupted; nothing\n"


def test_another_error_that_is_made_of_the_exception_is_no_traceback(pressed, capfd):
    """Compiled code may do so: Matplotlib says "Invalid bounding box"."""

    def main():
        with interrupt.unwinding():
            try:
                pressed()
            except KeyboardInterrupt:
                raise RuntimeError("Invalid bounding box") from None

    assert interrupt.run(main) == 130 and pressed.left == [130]
    assert capfd.readouterr().err == "interrupted; nothing\n"


def test_a_shell_that_ignores_ctrl_c_has_its_way():
    numbers = signal.SIGINT, signal.SIGTERM
    before = [signal.signal(number, signal.SIG_IGN) for number in numbers]
    interrupt.begin("nothing")
    assert [signal.getsignal(number) for number in numbers] == [signal.SIG_IGN] * 2
    for number, handler in zip(numbers, before):
        signal.signal(number, handler)
