"""Numbers with units, as in ``5 mm``, in SI units."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from decimal import Decimal, InvalidOperation

#: The SI unit of each dimension of a strip.
STRIP_UNITS = {
    "width": "m", "thickness": "m", "length": "m", "natural_radius": "m", "poisson_ratio": "", "youngs_modulus": "Pa",
}  # fmt: skip
#: Usual sizes of strips, in SI units: from a film of 100 nm to a plate of 50 mm, from a gel to graphene.
_USUAL = {
    "width": (1e-5, 2.0), "thickness": (1e-7, 0.05), "length": (1e-4, 100.0), "natural_radius": (1e-5, 1e3),
    "youngs_modulus": (1e3, 2e12),
}  # fmt: skip
#: Units by the SI unit; the sign of a micrometre is one of two characters in Unicode.
UNITS = {
    "m": {"m": "1", "cm": "1e-2", "mm": "1e-3", "um": "1e-6", "\u00b5m": "1e-6", "\u03bcm": "1e-6", "in": "0.0254"},
    "Pa": {"Pa": "1", "kPa": "1e3", "MPa": "1e6", "GPa": "1e9"},
    "J": {"J": "1", "mJ": "1e-3", "uJ": "1e-6"},
    "N": {"N": "1", "mN": "1e-3", "kN": "1e3"},
    "rad": {"rad": "1", "deg": "0.017453292519943295"},
    "": {"%": "1e-2"},
}


def quantity(text: str, unit: str) -> float:
    """Return a number as it is, or one with a unit in the SI ``unit``; raise ValueError for another text.

    Examples
    --------
    >>> quantity("5mm", "m"), quantity(" .2 ", "m"), quantity("210 GPa", "Pa"), quantity("inf", "m")
    (0.005, 0.2, 210000000000.0, inf)
    """
    units = UNITS[unit]
    try:
        return float(text)
    except ValueError:
        digits, name = re.fullmatch(r"(.*?)\s*([^\W\d]*|%)\s*", text, re.DOTALL).groups()
    if name in units:
        try:
            return float(Decimal(digits) * Decimal(units[name]))  # as if it were written in SI units
        except InvalidOperation:
            pass
    known = [name for name in units if name.isascii()]
    more = f" (in {unit}), or one with a unit: {', '.join(known[:-1])} or {known[-1]}" if unit else ""
    raise ValueError(f"{text!r} must be a number{more}")


def unusual(values: Mapping[str, float]) -> list[str]:
    """Return a sentence for each dimension of a strip, in SI units, that looks like a number in another unit.

    Examples
    --------
    >>> unusual({"width": 5.0, "poisson_ratio": 0.3})
    ['width = 5 m is unusual (1e-05 to 2 m); 5 millimetres are written 5mm']
    """
    found = []
    for name, value in values.items():
        least, most = _USUAL.get(name, (-math.inf, math.inf))
        if math.isfinite(value) and not least <= value <= most:
            unit = STRIP_UNITS[name]
            small, words = ("mm", "millimetres") if unit == "m" else ("GPa", "gigapascals")
            other = f"{value:g} {words} are written {value:g}{small}"
            found.append(f"{name} = {value:g} {unit} is unusual ({least:g} to {most:g} {unit}); {other}")
    return found
