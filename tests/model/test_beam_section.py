"""Sections against closed forms and a stress function, and what is refused in which words."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.linalg import spsolve

from zwidth.model.beam_section import (
    TYPICAL_MATERIALS,
    CrossSection,
    Material,
    beam_properties,
    rectangle,
    rectangular_tube,
    round_rod,
    tube,
)


def moments_by_strips(inside, width, height, count=1500):
    """Area, I_y and I_z of the points of a box that are `inside`, on a grid."""
    y, z = (np.linspace(-0.5, 0.5, 2 * count + 1)[1::2] * side for side in (width, height))
    Y, Z = np.meshgrid(y, z, indexing="ij")
    cell = np.where(inside(Y, Z), width * height / count**2, 0.0)
    return cell.sum(), (cell * Z**2).sum(), (cell * Y**2).sum()


def torsion_by_stress_function(width, height, wall, cells):
    """J of a rectangle, or of a box with a wall, by Prandtl's stress function f on a grid: where its sum of
    -|grad f|^2 + 4 f is largest, which it is with one value over the hole, that sum is J."""
    d = width / cells
    across, up = cells, round(height / d)
    i, j = np.meshgrid(np.arange(across + 1), np.arange(up + 1), indexing="ij")
    edge = (i == 0) | (i == across) | (j == 0) | (j == up)
    number = np.full(i.shape, -1)
    number[~edge] = 1 + np.arange(np.count_nonzero(~edge))
    if wall:
        depth = np.minimum(np.minimum(i, across - i), np.minimum(j, up - j))
        number[depth >= round(wall / d)] = 0
    known, number = np.unique(number, return_inverse=True)
    number = number.reshape(i.shape)  # 0 on the edge, where f is 0
    one = np.concatenate([number[:-1].ravel(), number[:, :-1].ravel()])
    other = np.concatenate([number[1:].ravel(), number[:, 1:].ravel()])
    value = np.ones(len(one))
    n = len(known)
    rows, columns = np.concatenate([one, other, one, other]), np.concatenate([one, other, other, one])
    A = coo_array((np.concatenate([value, value, -value, -value]), (rows, columns)), shape=(n, n)).tocsr()
    load = 2.0 * d * d * np.bincount(number.ravel(), minlength=n)
    f = spsolve(A[1:, 1:].tocsc(), load[1:])
    return float(f @ load[1:])


def test_round_sections():
    rod, pipe = round_rod(0.02), tube(0.02, 0.003)
    area, I_y, I_z = moments_by_strips(lambda y, z: np.hypot(y, z) < 0.01, 0.02, 0.02)
    assert (rod.area, rod.second_moment_y, rod.second_moment_z) == pytest.approx((area, I_y, I_z), rel=1e-4)
    area, I_y, I_z = moments_by_strips(lambda y, z: abs(np.hypot(y, z) - 0.0085) < 0.0015, 0.02, 0.02)
    assert (pipe.area, pipe.second_moment_y, pipe.second_moment_z) == pytest.approx((area, I_y, I_z), rel=3e-4)
    for section in (rod, pipe):
        assert section.torsion_constant == section.polar_moment


def test_a_tube_is_between_a_rod_and_a_thin_ring():
    rod, closed = round_rod(0.02), tube(0.02, 0.01)
    for name in ("area", "second_moment_y", "torsion_constant"):
        assert getattr(closed, name) == pytest.approx(getattr(rod, name), rel=1e-14)
    # a ring of wall t and mean radius r: A = 2 pi r t, J = 2 pi r^3 t (1 + t^2 / (4 r^2))
    t, r = 1e-8, 0.01 - 0.5e-8
    assert tube(0.02, t).area == pytest.approx(2 * np.pi * r * t, rel=1e-8)
    assert tube(0.02, t).torsion_constant == pytest.approx(2 * np.pi * r**3 * t, rel=1e-8)


def test_a_width_is_along_y_and_a_height_along_z():
    flat, box = rectangle(0.03, 0.004), rectangular_tube(0.03, 0.012, 0.002)
    found = moments_by_strips(lambda y, z: y > -1.0, 0.03, 0.004)
    assert (flat.area, flat.second_moment_y, flat.second_moment_z) == pytest.approx(found, rel=1e-6)
    found = moments_by_strips(lambda y, z: (abs(y) > 0.013) | (abs(z) > 0.004), 0.03, 0.012)
    assert (box.area, box.second_moment_y, box.second_moment_z) == pytest.approx(found, rel=1e-3)
    assert flat.second_moment_z > 50 * flat.second_moment_y
    assert rectangle(0.004, 0.03).torsion_constant == flat.torsion_constant


# Timoshenko and Goodier's table of J / (a b^3), to its three digits
@pytest.mark.parametrize(
    ("sides", "printed"),
    [(1.0, 0.141), (1.5, 0.196), (2.0, 0.229), (2.5, 0.249), (3.0, 0.263), (4.0, 0.281), (10.0, 0.312)],
)
def test_torsion_of_a_rectangle(sides, printed):
    ours = rectangle(sides, 1.0).torsion_constant / sides
    assert ours == pytest.approx(printed, abs=5.1e-4)

    def term(k):
        n = 2 * int(k) + 1
        return mpmath.tanh(n * mpmath.pi * sides / 2) / n**5

    series = (1 - 192 / (mpmath.pi**5 * sides) * mpmath.nsum(term, [0, mpmath.inf])) / 3
    assert ours == pytest.approx(float(series), rel=1e-13)


def test_torsion_of_a_very_flat_rectangle():
    """A strip has J = a b^3 / 3 (1 - 0.63025 b / a), and no overflow."""
    with np.errstate(all="raise"):
        flat = rectangle(1.0, 1e-4).torsion_constant
    assert flat == pytest.approx(1e-12 / 3.0 * (1.0 - 0.63024846e-4), rel=1e-12)


def test_torsion_by_a_stress_function():
    assert torsion_by_stress_function(1.0, 1.0, 0.0, 60) == pytest.approx(
        rectangle(1.0, 1.0).torsion_constant, rel=1e-3
    )
    assert torsion_by_stress_function(1.0, 2.0, 0.0, 40) == pytest.approx(
        rectangle(1.0, 2.0).torsion_constant, rel=2e-3
    )


@pytest.mark.parametrize(("wall", "low"), [(0.05, 0.024), (0.1, 0.054), (0.2, 0.133)])
def test_torsion_of_a_box_is_as_much_too_small_as_its_docstring_says(wall, low):
    # errors at the inner corners fall with the 4/3rd power of the grid
    coarse, fine = (torsion_by_stress_function(1.0, 1.0, wall, cells) for cells in (60, 120))
    J = fine + (fine - coarse) / (2.0 ** (4.0 / 3.0) - 1.0)
    assert rectangular_tube(1.0, 1.0, wall).torsion_constant / J == pytest.approx(1.0 - low, abs=1.5e-3)
    assert f"{100 * low:.2g} %" in rectangular_tube.__doc__


def test_torsion_is_never_stiffer_than_of_a_round_section():
    rng = np.random.default_rng(11)
    for _ in range(20):
        width, height = rng.uniform(0.001, 0.1, 2)
        wall = rng.uniform(0.01, 0.5) * min(width, height)
        for section in (rectangle(width, height), rectangular_tube(width, height, wall)):
            assert section.torsion_constant < section.polar_moment
        assert rectangular_tube(width, height, wall).area < rectangle(width, height).area


def test_beams_of_sections_and_materials():
    section, material = CrossSection(1e-4, 2e-9, 3e-9, 4e-9), Material(1e11, 4e10, 2000.0)
    beam = beam_properties(0.3, section, material)
    numbers = (beam.length, beam.EI_y, beam.EI_z, beam.GJ, beam.EA)
    assert numbers == pytest.approx((0.3, 200.0, 300.0, 160.0, 1e7), rel=1e-14)
    assert beam.mass_per_length == pytest.approx(0.2, rel=1e-14)
    assert beam.torsional_inertia_per_length == pytest.approx(1e-5, rel=1e-14)


def test_typical_materials_are_possible_ones():
    """Poisson's ratio E / (2 G) - 1 of what is alike in all directions is that of metals and plastics."""
    for name, material in TYPICAL_MATERIALS.items():
        if name != "carbon-fibre-tube":
            assert 0.25 < material.youngs_modulus / (2.0 * material.shear_modulus) - 1.0 < 0.42, name
        assert 1000.0 < material.density < 9000.0
    speed = {name: (one.youngs_modulus / one.density) ** 0.5 for name, one in TYPICAL_MATERIALS.items()}
    assert max(speed, key=speed.get) == "carbon-fibre-tube"
    assert speed["steel"] == pytest.approx(5050.0, rel=0.01)  # m/s, of sound along a rod
