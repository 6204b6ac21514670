"""``ribbon COMMAND ...``: all commands under one name; each does what ``python -m branches.COMMAND`` does.

Only the imports that start a command are here, so that ``ribbon --help`` answers at once.
"""

from __future__ import annotations

import importlib
import sys

#: Commands: the module, and a description. The module has ``parser()``, which returns its command line.
COMMANDS = {
    "run": ("branches.run.__main__", "follow a branch, or all branches of a diagram, to result files"),
    "secondary": ("branches.secondary", "follow the branches that leave at secondary bifurcations"),
    "curve": ("branches.curve", "follow a fold against a second number: nu, Gamma, a load, one of a law of your own"),
    "plot": ("branches.plot", "draw a result: a branch with its strips, a diagram, any column against any other"),
    "graph": ("branches.graph.__main__", "list branches, states and folds of a bifurcation diagram"),
    "explore": ("branches.explore.__main__", "write results as one page for a browser"),
    "export": ("branches.export.__main__", "write a strip for 3D printing, Blender, ParaView or a table; a branch as a film"),
    "strip": ("branches.strip.__main__", "compute the states of a strip of given dimensions, in SI units"),
    "paper": ("branches.paper.__main__", "compute the tables and figures of Audoly & Seffen (2015)"),
    "shell": ("branches.shell", "compute the unfolding strip as a solid by finite elements (CalculiX)"),
}
EXIT_BAD_INPUT = 2
_COMPLETION = 'The tab key completes after: eval "$(ribbon completion bash)" (or zsh, fish, ...).\n'


def help_text() -> str:
    """Return the list of all commands."""
    lines = [f"  {name:<10} {what}" for name, (_, what) in COMMANDS.items()]
    lines.append(f"  {'scenes':<10} list the scenes of the package, which 'ribbon run NAME' runs")
    head = "usage: ribbon COMMAND ...\n\nBuckled equilibria of closed and open elastic strips.\n\n"
    return head + "\n".join(lines) + "\n\n'ribbon COMMAND --help' lists the options of a command.\n" + _COMPLETION


def main(argv=None) -> int:
    """Start a command with its arguments; return the exit code, unless the command ends the process itself."""
    words = list(sys.argv[1:] if argv is None else argv)
    if words[:1] == ["help"] and words[1:2]:
        words = [words[1], "--help"]
    if words[:1] in (["--help"], ["-h"], ["help"]):
        sys.stdout.write(help_text())
        return 0
    if words[:1] == ["--version"]:
        import platform

        import numpy

        import contin

        parts = (f"Python {platform.python_version()}", f"numpy {numpy.__version__}", platform.platform())
        sys.stdout.write(f"ribbon-continuation {contin.__version__} ({', '.join(parts)})\n")
        return 0
    if words[:1] == ["completion"]:
        return _complete(words[1:])
    if not words or words[0] not in (*COMMANDS, "scenes"):
        problem, known = "a command is needed", (*COMMANDS, "scenes")
        if words:
            from contin.lowlevel import meant

            problem = f"there is no command {words[0]!r}{meant(words[0], known)}"
        sys.stderr.write(f"error: {problem}; the commands are {', '.join(known)} (--help describes them)\n")
        return EXIT_BAD_INPUT
    import runpy

    from branches.store import command

    command.prefix = "ribbon "
    if words[0] == "scenes":
        return _scenes(words[1:])
    sys.argv = [f"ribbon {words[0]}", *words[1:]]
    runpy.run_module(COMMANDS[words[0]][0], run_name="__main__", alter_sys=True)  # as python -m does: ends by SystemExit
    return 0


def _scenes(words: list[str]) -> int:
    """List the scenes of the package with their titles, or what else tells them apart."""
    from branches.scene.parse import read, scenes
    from branches.store import command

    command.Parser("scenes", "List the scenes of the package.").parse_args(words)
    for file in scenes():
        stated = read(file.read_text(encoding="utf-8"), file.name)
        told = [f"{name} = {stated[name]}" for name in ("law", "m", "n") if name in stated]
        command.write_output(f"{file.stem:<18} {stated.get('title') or ', '.join(told)}\n")
    return 0


def _complete(words: list[str]) -> int:
    """Write what a shell evaluates to complete commands, their options and names of files."""
    import argparse

    import shtab

    if len(words) != 1 or words[0] not in shtab.SUPPORTED_SHELLS:
        sys.stderr.write(f"error: completion: must be followed by one of {', '.join(shtab.SUPPORTED_SHELLS)}\n")
        return EXIT_BAD_INPUT
    parser = argparse.ArgumentParser("ribbon", description="Buckled equilibria of elastic strips.")
    commands = parser.add_subparsers()
    for name, (module, what) in COMMANDS.items():
        own = importlib.import_module(module).parser()
        for action in own._actions:
            if action.nargs != 0 and not action.choices:
                action.complete = shtab.FILE
        commands.add_parser(name, help=what, parents=[own], add_help=False, conflict_handler="resolve")
    commands.add_parser("scenes", help="list the scenes of the package")
    sys.stdout.write(shtab.complete(parser, words[0]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
