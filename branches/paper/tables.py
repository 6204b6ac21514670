"""Tables 1 to 3 of Audoly & Seffen (2015)."""

from __future__ import annotations

import math
from pathlib import Path

from branches.paper.page import Row, Section
from ribbon_model import exact
from ribbon_model.laws import FLAT_ROD, ISOTROPIC_ROD, RIBBON
from ribbon_model.linear import stability_interval, thresholds

NU = 0.3
#: Table 3, as printed: K for n = 1 ... 7.
TABLE_3 = {
    1: ("1.", "2.50", "2.93", "3.10", "3.18", "3.23", "3.26"),
    3: ("-1.67", "-0.17", "1.", "1.74", "2.20", "2.50", "2.70"),
    5: ("-2.17", "-1.37", "-0.45", "0.36", "1.", "1.49", "1.85"),
    7: ("-2.33", "-1.86", "-1.24", "-0.58", "0.03", "0.56", "1."),
}


def table1(folder: Path) -> Section:
    """Experiments on a steel blade, beside the thresholds of the models."""
    bound = {m: stability_interval(RIBBON, m, NU) for m in (1, 3, 5)}
    fold = exact.folds(1, 2, NU)[0].kappa_n
    rows = [
        Row("m = 1, κₙr₀ below", "3.50", bound[1][1], "ribbon: the planar loop loses stability (linear theory)", True),
        Row("", "3.50", fold, "ribbon: fold that ends the buckled branch (1, 2)", True),
        Row("", "3.50", stability_interval(FLAT_ROD, 1, NU)[1], "flat rod, linear theory", True),
        Row("", "3.50", stability_interval(ISOTROPIC_ROD, 1, NU)[1], "isotropic rod, linear theory", True),
        Row("m = 3, κₙr₀ above", "0.28", bound[3][0], "ribbon, linear theory", True),
        Row("m = 3, κₙr₀ below", "beyond elastic limit", bound[3][1], "ribbon, linear theory"),
        Row("m = 5, κₙr₀ above", "0.42", bound[5][0], "ribbon, linear theory", True),
        Row("m = 5, κₙr₀ below", "beyond elastic limit", bound[5][1], "ribbon, linear theory"),
        Row("fold of (1, 2), as computed in the paper", "4.08", fold, "section 6.4"),
    ]
    notes = [
        "The published values are measured, except in the last line: the differences are no errors. ν = .3 is assumed.",
        "m = 1: between 2.50 and 4.076 the ribbon has a stable buckled loop, and the measured 3.5 lies between the two; it is "
        "no confirmation of either. m = 3 and 5: the measured bounds are the narrower ones. Contact, friction and gravity "
        "were present and are in none of the models.",
        "The ribbon law is the limit of large w²/(h r₀). For this blade, 5.65 × .65 mm and L ≈ 3 m, it is about "
        f"{5.65**2 / (0.65 * 3000 / (2 * math.pi)):.2f} at m = 1: the blade is not in that limit.",
    ]
    return Section("Table 1: measured regions of stability", rows, notes=notes)


def table2(folder: Path) -> Section:
    """Tangent moduli, from the derivatives of the laws themselves at two circles."""
    rows = []
    for law, formula in ((RIBBON, "2(1 − νκₙr₀)"), (FLAT_ROD, "2/(1 + ν)"), (ISOTROPIC_ROD, "1/(1 + ν)")):
        for ratio in (0.0, 2.0):
            g, t = law.tangent_moduli(ratio, NU)
            _, _, omega_2, omega_3, _ = law.response(1 - ratio, 1e-5, 1e-5, ratio, NU)  # omega_3 is odd in M_3
            where = f"ν = .3, κₙr₀ = {ratio:g}"
            rows.append(Row(f"{law.name}, t at {where}", f"{t:.6f}", 1e-5 / omega_3, f"published: t = {formula}"))
            infinite = omega_2 == 0
            rows.append(Row(f"{law.name}, g at {where}", "∞" if math.isinf(g) else "1", "∞" if infinite else 1e-5 / omega_2))
    notes = ["Ours: M₃/ω₃ and M₂/ω₂ for a small moment, from the complementary energy of each law; not the formula once more."]
    return Section("Table 2: tangent moduli on a circle", rows, notes=notes)


def table3(folder: Path) -> Section:
    """The bifurcations of m-covered circles, ribbon, nu = .3."""
    rows = []
    for m, printed in TABLE_3.items():
        for n, value in enumerate(printed, start=1):
            if n == m:
                rows.append(Row(f"m = {m}, n = {n}", value, "none", "a rigid rotation; (27) gives 1"))
                continue
            bold = "ends the interval of stability" if abs(n - m) == 1 else ""
            rows.append(Row(f"m = {m}, n = {n}", value, thresholds(RIBBON, m, n, NU)[0] / m, bold))
    notes = ["The text after (27) calls the first of these K^{1,1}; it is K^{1,2} = 2.5."]
    return Section("Table 3: thresholds κₙr₀ of the ribbon, ν = .3", rows, notes=notes)
