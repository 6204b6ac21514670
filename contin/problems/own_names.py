"""Names of the parameters that kinds of problem bring themselves."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from contin import checks
from contin.errors import ProblemError

#: The period of a cycle: of an autonomous field a parameter, of a forced one a column.
PERIOD = "period"
#: Of a forced field, the parameter that says after how many periods of the forcing the cycle closes; of a map, after how many
#: rounds.
ROUNDS = "rounds"
#: The time that the computed part of a connecting orbit takes.
TIME = "time"


def rounds_of(free: Sequence[str], parameters: Mapping[str, float]) -> int:
    """Return the number of rounds after which a cycle of a forced system, or of a map, closes.

    Raises
    ------
    ProblemError
        It is no whole number, or free.
    """
    rounds = parameters[ROUNDS]
    if ROUNDS in free:
        raise ProblemError(f"free: {ROUNDS} must not be free, as it is a whole number")
    if not (rounds >= 1 and rounds == int(rounds)):
        raise ProblemError(f"parameters: {ROUNDS} = {checks.shown(rounds)} must be a whole number from 1")
    return int(rounds)


def unused(name: str, taken: Collection[str]) -> str:
    """Return a name that is not taken."""
    while name in taken:
        name += "_"
    return name
