"""Labels of special points: AUTO's two letters, and those of MatCont where AUTO has none."""

from __future__ import annotations

import enum


class Label(enum.StrEnum):
    """Labels that contin itself gives; each is a string, too. Events of users may have others."""

    REGULAR = ""
    END = "EP"
    FAILED = "MX"
    USER_ZERO = "UZ"
    EXTREMUM = "EX"
    CORNER = "BC"
    GRAZING = "GR"
    SLIDING = "SL"
    FOLD = "LP"
    BRANCH_POINT = "BP"
    HOPF = "HB"
    PERIOD_DOUBLING = "PD"
    TORUS = "TR"
    CUSP = "CP"
    BOGDANOV_TAKENS = "BT"
    ZERO_HOPF = "ZH"
    DOUBLE_HOPF = "HH"
    GENERALIZED_HOPF = "GH"
    GENERALIZED_DOUBLING = "GPD"
    CHENCINER = "CH"
    FOLD_FLIP = "LPPD"
    FOLD_TORUS = "LPTR"
    RESONANCE_1 = "R1"
    RESONANCE_2 = "R2"
    RESONANCE_3 = "R3"
    RESONANCE_4 = "R4"
    NEUTRAL_SADDLE = "NSS"
    NEUTRAL_SADDLE_FOCUS = "NSF"
    NEUTRAL_BIFOCUS = "NFF"
    NON_CENTRAL = "NCH"
    SHILNIKOV_HOPF = "SH"
    DOUBLE_REAL_STABLE = "DRS"
    DOUBLE_REAL_UNSTABLE = "DRU"
    DIVERGENT_STABLE = "NDS"
    DIVERGENT_UNSTABLE = "NDU"
    ORBIT_FLIP_STABLE = "OFS"
    ORBIT_FLIP_UNSTABLE = "OFU"
    INCLINATION_FLIP_STABLE = "IFS"
    INCLINATION_FLIP_UNSTABLE = "IFU"

    __repr__ = str.__repr__


#: Those where F_x has a kernel beyond the tangent: an index may change there.
SINGULAR = frozenset((Label.FOLD, Label.BRANCH_POINT, Label.CUSP))
#: Those of points that are in doubt where they are not found again on a finer mesh; others keep theirs with ± NaN.
CONFIRMED = frozenset((Label.FOLD, Label.BRANCH_POINT, Label.HOPF, Label.PERIOD_DOUBLING, Label.TORUS))
