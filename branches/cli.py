"""``ribbon COMMAND ...``: all commands under one name; each does what ``python -m branches.COMMAND`` does.

Only the imports that start a command are here, so that ``ribbon --help`` answers at once.
"""

from __future__ import annotations

import sys

#: Commands with a description. Each is the module of this package with its name.
COMMANDS = {
    "run": "follow a branch, or all branches of a diagram, to result files",
    "secondary": "follow the branches that leave at secondary bifurcations",
    "graph": "list branches, states and folds of a bifurcation diagram",
    "explore": "write results as one page for a browser",
    "export": "write a strip for 3D printing, Blender, ParaView or a table; a branch as a film",
    "strip": "compute the states of a strip of given dimensions, in SI units",
    "paper": "compute the tables and figures of Audoly & Seffen (2015)",
    "shell": "compute the unfolding strip as a solid by finite elements (CalculiX)",
}
EXIT_BAD_INPUT = 2
_COMPLETION = 'The tab key completes after: eval "$(ribbon completion bash)" (or zsh; fish: ... | source).\n'


def help_text() -> str:
    """Return the list of all commands."""
    lines = [f"  {name:<10} {what}" for name, what in COMMANDS.items()]
    head = "usage: ribbon COMMAND ...\n\nBuckled equilibria of closed elastic strips.\n\n"
    return head + "\n".join(lines) + "\n\n'ribbon COMMAND --help' lists the options of a command.\n" + _COMPLETION


def main(argv=None) -> int:
    """Start a command with its arguments; return the exit code, unless the command ends the process itself."""
    words = list(sys.argv[1:] if argv is None else argv)
    if words[:1] in (["--help"], ["-h"], ["help"]):
        sys.stdout.write(help_text())
        return 0
    if words[:1] == ["--version"]:
        from importlib.metadata import version

        sys.stdout.write(f"ribbon-continuation {version('ribbon-continuation')}\n")
        return 0
    if words[:1] == ["completion"]:
        return _complete(words[1:])
    if not words or words[0] not in COMMANDS:
        problem = f"there is no command {words[0]!r}" if words else "a command is needed"
        sys.stderr.write(f"error: {problem}; the commands are {', '.join(COMMANDS)} (--help describes them)\n")
        return EXIT_BAD_INPUT
    import runpy

    sys.argv = [f"ribbon {words[0]}", *words[1:]]
    runpy.run_module(f"branches.{words[0]}", run_name="__main__", alter_sys=True)  # as python -m does: ends by SystemExit
    return 0


def _complete(words: list[str]) -> int:
    from branches.completion import SHELLS, script

    if len(words) != 1 or words[0] not in SHELLS:
        sys.stderr.write(f"error: completion: must be followed by one of {', '.join(SHELLS)}\n")
        return EXIT_BAD_INPUT
    sys.stdout.write(script(words[0], COMMANDS))
    return 0


if __name__ == "__main__":
    sys.exit(main())
