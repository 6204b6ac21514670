"""Numbers in printed texts, compared as numbers.

A number that was rounded for print may come out one unit in its last printed place away, however well it is known.
"""

import doctest
import re

import numpy as np

NUMBER = re.compile(r"([-+]?\d+\.?\d*(?:[eE][-+]?\d+)?)")


def unit(number):
    """Return one unit in the last place of a printed number; none where there are fewer than four places, as in 2.5."""
    digits, _, exponent = number.lower().partition("e")
    places = len(digits.partition(".")[2]) - int(exponent or 0)
    return 10.0**-places if places >= 4 else 0.0


def same(said, stated, tolerance):
    """Tell whether two texts have the same words, apart from spaces, and the same numbers up to ``tolerance * (1 + size)``.

    >>> same("fold at 4.0823", "fold at 4.0824", 1e-9), same("fold at 4.0823", "fold at 4.0825", 1e-9)
    (True, False)
    """
    words, numbers = ([NUMBER.split(text)[start::2] for text in (said, stated)] for start in (0, 1))
    if "#".join(words[0]).split() != "#".join(words[1]).split():
        return False
    return all(
        abs(float(found) - float(wanted)) <= tolerance * (1 + abs(float(wanted))) + min(unit(found), unit(wanted)) * (1 + 1e-9)
        for found, wanted in zip(*numbers)
    )


class UpToRoundOff(doctest.OutputChecker):
    """Takes numbers as equal that differ by round-off: -2.9999999999999996 and -3.0, or 0.33333 and 0.33334."""

    def check_output(self, want, got, optionflags):
        return super().check_output(want, got, optionflags) or same(got, want, 1e-13)


def check_examples(module):
    """Run the examples of a module, each with what the module holds, and numpy as np.

    One of a method that imports nothing goes on from that of its class.
    """
    runner = doctest.DocTestRunner(UpToRoundOff())
    every = doctest.DocTestFinder(exclude_empty=True).find(module, extraglobs={"np": np})
    found = {one.name: one for one in every if one.examples}
    for name, one in found.items():
        owner = found.get(name.rpartition(".")[0])
        if owner is not None and name.count(".") > module.__name__.count(".") + 1 and "import " not in one.examples[0].source:
            one.examples = [*owner.examples, *one.examples]
    for one in found.values():
        runner.run(one)
    assert runner.failures == 0
