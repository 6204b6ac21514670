"""Open strips of segments: energies of laws, the index of the continuous strip, and what lies beside a saddle."""

import numpy as np
import pytest

import contin
from ribbon_model.barriers import KICK_OPEN, apart, ways_down
from ribbon_model.changed_supports import with_supports
from ribbon_model.descent import descend, modes
from ribbon_model.ends import BALL, CLAMP, End, Roller, hinge
from ribbon_model.network_segments import cut, unsupported
from ribbon_model.open_strip import OpenStrip
from ribbon_model.section import section_of

ROD = section_of("rod", {"B1": 1.0, "B2": 4.0, "C": 0.8, "kappa_n": 0.5})


@pytest.mark.sample(4)
@pytest.mark.parametrize(
    ("law", "numbers"),
    [
        ("rod", {"B1": 1.0, "B2": 3.0, "C": 0.8, "tau_n": 0.2}), ("flat rod", {"nu": 0.3, "kappa_n": 0.4}),
        ("flat rod", {"nu": 0.3, "softness": 0.1}), ("isotropic rod", {"nu": 0.3, "kappa_2": 0.1}),
        ("ribbon", {"nu": 0.3, "kappa_n": 0.2}), ("finite width", {"nu": 0.3, "Gamma": 2.0, "kappa_n": 0.2}),
        ("ribbon", {"D11": 3.0, "D12": 0.4, "D22": 1.0, "D66": 0.5}),
        ("finite width", {"D11": 3.0, "D12": 0.4, "D22": 1.0, "D66": 0.5, "Gamma": 2.0}),
    ],
)  # fmt: skip
def test_the_energy_is_that_of_the_hamiltonian(law, numbers):
    """U(w) and the largest M.w - H belong together: dH/dM at M = dU/dw is w, and U = M.w - H."""
    material = section_of(law, numbers, {"width": "1 - s/4"} if law == "finite width" else {})
    p, t = contin_numbers(material), np.array([0.2, 0.7])
    strains = np.array([[0.9, 0.05, 0.3], [1.2, -0.1, -0.4]])
    U, moment, stiffness = material.strain_energy(t, strains, p)
    H = material.hamiltonian()
    for s, w, energy, M, matrix in zip(t, strains, U, moment, stiffness):
        w = np.where(np.diag(matrix) > 0, w, 0.0)
        assert energy == pytest.approx(M @ w - H(s, *M, p), rel=1e-10)
        step = 1e-5
        slopes = [(H(s, *(M + d), p) - H(s, *(M - d), p)) / (2 * step) for d in step * np.eye(3)]
        free = np.diag(matrix) > 0
        np.testing.assert_allclose(np.array(slopes)[free], w[free], atol=1e-8)
        moved = material.strain_energy(np.full(6, s), w + step * np.vstack([np.eye(3), -np.eye(3)]), p)[1]
        difference = (moved[:3] - moved[3:]) / (2 * step)
        np.testing.assert_allclose(difference[free][:, free], matrix[free][:, free], rtol=1e-6, atol=1e-7)


def contin_numbers(material):
    return type("Numbers", (), material.parameters)()


@pytest.mark.full
@pytest.mark.parametrize("finish", ["clamped", "hinged"])
def test_the_index_and_the_energy_are_those_of_the_continuous_strip(finish):
    """Along the arch whose end is bent: the number of negative eigenvalues, and the energy, whose error falls by four."""
    rod = section_of("rod", {"B1": 1.0, "B2": 4.0, "C": 0.8})
    if finish == "clamped":
        name, strip = "bend", OpenStrip(rod, numbers={"distance": 0.9, "bend": 0.0})
    else:
        name, strip = "moment", OpenStrip(rod, finish=hinge(), numbers={"distance": 0.9, "moment": 0.0})
    options = {"free": [name], "limits": {name: (-9, 9)}, "direction": -1 if name == "bend" else 1, "max_points": 40}
    branch = contin.trace(strip.first_point(strip.arch()), **options)
    indices = set()
    for point in [point for point in branch if not point.label][3::4]:
        index = point.second_variation().index()
        errors = [cut(strip, point.system, point.x, segments).energy - strip.potential(point) for segments in (64, 128)]
        values = modes(cut(strip, point.system, point.x, 128))[0]
        if min(abs(values)) > 0.3:  # of stiffnesses of one; nearer to zero the segments may change a sign
            assert np.count_nonzero(values < 0) == index
            indices.add(index)
        assert 3 < errors[0] / errors[1] < 5
    assert {0, 1} <= indices


@pytest.mark.full
def test_both_sides_of_the_saddle_between_two_arches():
    """The second mode of a clamped arch has index 1 and leads to both first modes, mirror images of equal energy."""
    strip = OpenStrip(section_of("rod", {"B1": 1.0, "B2": 4.0, "C": 0.8}), numbers={"distance": 0.9})
    arches = [strip.first_point(strip.arch(side=side)) for side in (1.0, -1.0)]

    column = OpenStrip(strip.section, finish=End(held=CLAMP.held[:2]), numbers={"force_tangent": -70.0})
    straight = contin.trace(column.first_point(), free=["force_tangent"], limits={"force_tangent": (-90, -60)}, direction=-1)
    (start, *_) = straight.labelled("BP")
    mode = contin.trace(start, branch=1, zeros={"distance": [0.9]}, limits={"distance": (0.85, 1.1)})
    system, x = with_supports(strip, mode.labelled("UZ")[0], "distance", [])
    saddle = contin.lowlevel.point_of(system, x)
    assert saddle.second_variation().index() == 1
    found = ways_down(lambda segments: cut(strip, saddle.system, saddle.x, segments), apart, KICK_OPEN)
    rests = [descend(cut(strip, arch.system, arch.x, len(found[0].strains))).end for arch in arches]
    assert all(any(not apart(end, rest) for end in found) for rest in rests) and apart(*rests)
    assert found[0].energy == pytest.approx(found[1].energy, rel=1e-9)


def test_what_is_not_cut_into_segments():
    assert unsupported(OpenStrip(ROD, hinge("normal"), BALL, {"weight": 2.0, "foundation": 3.0})) == ""
    assert "phases" in unsupported(OpenStrip(ROD, phases=("spin",)))
    with pytest.raises(ValueError, match="a strip with a roller is not cut into segments"):
        cut(OpenStrip(ROD, roller=Roller(0.5, (0, 1, 0))), None, None, 10)
