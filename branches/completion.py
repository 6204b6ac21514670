"""Completion of ``ribbon`` in a shell: commands, their options, and names of files.

A shell evaluates what ``ribbon completion bash`` (or zsh, or fish) prints.
"""

from __future__ import annotations

import contextlib
import io
import re
import runpy
import sys
from collections.abc import Mapping

SHELLS = ("bash", "zsh", "fish")

_BASH = """_ribbon() {{
    local word="${{COMP_WORDS[COMP_CWORD]}}" options=""
    if [ "$COMP_CWORD" -eq 1 ]; then
        COMPREPLY=($(compgen -W "{commands} --help --version" -- "$word"))
        return
    fi
    case "${{COMP_WORDS[1]}}" in
{cases}
    esac
    case "$word" in
        -*) COMPREPLY=($(compgen -W "$options" -- "$word")) ;;
        *) COMPREPLY=($(compgen -f -- "$word")) ;;
    esac
}}
complete -o filenames -F _ribbon ribbon
"""


def options(command: str) -> list[str]:
    """Return the options of a command, from its own help."""
    text, before = io.StringIO(), sys.argv
    sys.argv = [f"ribbon {command}", "--help"]
    try:
        with contextlib.redirect_stdout(text), contextlib.suppress(SystemExit):
            runpy.run_module(f"branches.{command}", run_name="__main__")
    finally:
        sys.argv = before
    return list(dict.fromkeys(re.findall(r"(?<![\w-])--[a-z][a-z-]*", text.getvalue())))


def script(shell: str, commands: Mapping[str, str]) -> str:
    """Return the text that a shell evaluates; ``commands`` have a description each."""
    known = {command: options(command) for command in commands}
    if shell == "fish":
        first = [f"complete -c ribbon -n __fish_use_subcommand -f -a {name} -d {what!r}" for name, what in commands.items()]
        condition = "complete -c ribbon -n '__fish_seen_subcommand_from {}' -l {}"
        return "\n".join([*first, *(condition.format(name, option[2:]) for name in known for option in known[name]), ""])
    cases = "\n".join(f'        {name}) options="{" ".join(words)}" ;;' for name, words in known.items())
    text = _BASH.format(commands=" ".join(commands), cases=cases)
    return text if shell == "bash" else "autoload -U +X bashcompinit && bashcompinit\n" + text
