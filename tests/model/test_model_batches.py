"""Batches of postures and of parameter sets give what their members give alone."""

from dataclasses import replace

import numpy as np
import pytest

from tests.model.model_cases import KINDS, five_bar, random_five_bar, same_angles, some_postures
from zwidth.model import OK, OUT_OF_REACH, inertia_terms, link_points, solve_posture


@pytest.mark.parametrize("kind", KINDS)
def test_a_batch_equals_its_members(kind):
    rng = np.random.default_rng(7)
    mechanism = KINDS[kind](rng)
    batch = some_postures(mechanism, rng, 70)
    for k in (0, 33, 69):
        alone = solve_posture(mechanism, batch.position[k])
        assert alone.angles == pytest.approx(batch.angles[k], abs=1e-11)
        assert alone.mass_matrix == pytest.approx(batch.mass_matrix[k], rel=1e-9)


def test_parameter_sets_broadcast_with_positions():
    """Five lengths of the driven arms times three positions, one set of positions behind the hole."""
    lengths = np.linspace(0.13, 0.16, 5)
    one = five_bar()
    tip = np.broadcast_to(one.links.tip, (5, 1, 4, 3)).copy()
    tip[:, 0, 0, 0] = tip[:, 0, 2, 0] = lengths
    origin = np.broadcast_to(one.links.origin, (5, 1, 4, 3)).copy()
    origin[:, 0, 1, 0] = origin[:, 0, 3, 0] = lengths
    many = replace(one, links=replace(one.links, tip=tip, origin=origin))
    positions = np.array([[0.02, 0.25], [0.05, -0.2], [0.5, 0.0]])
    posture = solve_posture(many, positions)
    assert posture.status.tolist() == [[OK, OK, OUT_OF_REACH]] * 5
    terms = inertia_terms(many, posture, [1.0, -2.0])
    places = link_points(many, posture)
    for i, length in enumerate(lengths):
        member = replace(
            one,
            links=five_bar(lengths=(length, 0.199, length, 0.199)).links,
        )
        for k in range(2):
            alone = solve_posture(member, positions[k])
            assert same_angles(posture.angles[i, k], alone.angles)
            assert posture.mass_matrix[i, k] == pytest.approx(alone.mass_matrix, rel=1e-9)
            assert terms[i, k] == pytest.approx(inertia_terms(member, alone, [1.0, -2.0]), rel=1e-9)
            assert places.tip[i, k] == pytest.approx(link_points(member, alone).tip, abs=1e-12)
    assert np.isnan(terms[:, 2]).all()


def test_many_designs_at_one_position():
    rng = np.random.default_rng(3)
    designs = [random_five_bar(rng) for _ in range(40)]
    links = {
        name: np.stack([getattr(d.links, name) for d in designs])
        for name in ("origin", "tip", "mass", "center_of_mass", "inertia")
    }
    many = replace(
        designs[0],
        links=replace(designs[0].links, **links),
        closures=replace(
            designs[0].closures,
            point_a=np.stack([d.closures.point_a for d in designs]),
            point_b=np.stack([d.closures.point_b for d in designs]),
        ),
        handle_point=np.stack([d.handle_point for d in designs]),
        assemblies={"outward": np.stack([d.assemblies["outward"] for d in designs])},
    )
    posture = solve_posture(many, (0.01, 0.24))
    assert posture.status.shape == (40,)
    for p, design in enumerate(designs):
        assert posture.mass_matrix[p] == pytest.approx(solve_posture(design, (0.01, 0.24)).mass_matrix, rel=1e-9)


def test_link_points_close_the_loop():
    mechanism = five_bar()
    places = link_points(mechanism, solve_posture(mechanism, [(0.0, 0.25), (0.05, 0.2)]))
    assert places.tip[:, 1] == pytest.approx(np.array([[0, 0.25, 0], [0.05, 0.2, 0]]), abs=1e-14)
    assert places.tip[:, 3] == pytest.approx(places.tip[:, 1], abs=1e-14)
    assert places.of(1, [0.199, 0, 0]) == pytest.approx(places.tip[:, 1])
    assert places.origin[:, 1] == pytest.approx(places.tip[:, 0])
