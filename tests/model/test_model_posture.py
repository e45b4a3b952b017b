"""Postures: reached or not, on which side of the singularities, alone and in batches."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from tests.model.model_cases import (
    KINDS,
    NO_CLOSURES,
    Z,
    closures_of,
    drives_on,
    five_bar,
    links_of,
    planar_inertia,
    random_five_bar,
    random_rotation,
    same_angles,
    some_postures,
    spatial_arm,
    two_bar_angles,
)
from zwidth.errors import LoopOpen, OutOfReach, Singular
from zwidth.model import OK, OUT_OF_REACH, Mechanism, inertia_terms, pack, solve_posture
from zwidth.model.handle_position import check_mobility, drives_fit
from zwidth.model.posture import SINGULAR, _references


def paddle(length=0.1):
    """One driven link that turns about z."""
    return Mechanism(
        links_of(["paddle"], [-1], [[0, 0, 0]], [Z], [0.1], [[0.05, 0, 0]], [planar_inertia(1e-4)], [length]),
        NO_CLOSURES,
        drives_on([0]),
        0,
        np.array([length, 0.0, 0.0]),
        {"only": np.zeros(1)},
        np.array([length, 0.0, 0.0]),
        np.full((3, 2), np.nan),
    )


def four_bar():
    """A crank that turns fully, its coupler carrying the handle: the handle moves on a closed curve."""
    ground, crank, coupler, rocker = 0.12, 0.04, 0.11, 0.09
    return Mechanism(
        links_of(
            ["crank", "coupler", "rocker"],
            [-1, 0, -1],
            [[0, 0, 0], [crank, 0, 0], [ground, 0, 0]],
            [Z] * 3,
            [0.1, 0.2, 0.15],
            [[0.02, 0.001, 0], [0.05, 0.01, 0], [0.04, 0, 0]],
            [planar_inertia(i) for i in (1e-4, 3e-4, 2e-4)],
            [crank, coupler, rocker],
        ),
        closures_of(("rocker", 1, [coupler, 0, 0], 2, [rocker, 0, 0])),
        drives_on([0]),
        1,
        np.array([0.05, 0.04, 0.0]),
        {"open": np.array([1.0, -0.5, 1.9])},
        np.array([0.0, 0.0, 0.0]),
        np.full((3, 2), np.nan),
    )


def arm_on_a_four_bar():
    """An arm on the coupler that nothing drives: crank and rocker both drive the loop's one freedom."""
    loop = four_bar()
    links = links_of(
        ["crank", "coupler", "rocker", "arm"],
        [-1, 0, -1, 1],
        [*loop.links.origin, [0.11, 0, 0]],
        [Z] * 4,
        [0.1, 0.2, 0.15, 0.05],
        [*loop.links.center_of_mass, [0.02, 0, 0]],
        [planar_inertia(i) for i in (1e-4, 3e-4, 2e-4, 1e-5)],
        [0.04, 0.11, 0.09, 0.05],
    )
    return replace(
        loop,
        links=links,
        drives=drives_on([0, 2]),
        handle_link=3,
        assemblies={"open": np.array([1.0, -0.5, 1.9, 0.3])},
    )


# --- what can be reached ------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", [0, 1, 3, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 4, 5))])
def test_reachable_in_the_assembly_is_connected_with_the_reference(seed):
    """Over a grid: a five-bar has closed-form postures, and an assembly is one connected piece of the plane.

    The elbows' sides never change in it, and neither does the sign of the distal links' crossing angle.
    """
    rng = np.random.default_rng(seed)
    mechanism = five_bar() if seed == 0 else random_five_bar(rng)
    L1, L2, L3, L4 = mechanism.links.tip[:, 0]
    half = mechanism.links.origin[0, 0]
    axis = np.linspace(-0.42, 0.4202, 85)  # misses the base joints
    x, y = np.meshgrid(axis, axis)
    with np.errstate(invalid="ignore"):
        one, two = two_bar_angles(L1, L2, half, (x, y), 1), two_bar_angles(L3, L4, -half, (x, y), -1)
        q = np.concatenate([one, two])
        crossing = np.sin(q[2] + q[3] - q[0] - q[1])
    side = np.sign(np.sin(np.dot([-1, -1, 1, 1], mechanism.assemblies["outward"])))
    allowed = crossing * side > 0
    seed_cell = (np.argmin(np.abs(axis - 0.25)), np.argmin(np.abs(axis)))
    # cells are joined more finely than the grid shows only near an edge: those are left out below
    pieces = ndimage.label(allowed)[0]
    inside = pieces == pieces[seed_cell]
    clear = ndimage.binary_erosion(inside, iterations=2)
    outside = ~ndimage.binary_dilation(inside, np.ones((3, 3)), iterations=2)

    posture = solve_posture(mechanism, np.stack([x, y], axis=-1))
    assert posture.status.shape == x.shape
    assert clear.sum() > 500
    assert (posture.status[clear] == OK).all()
    assert (posture.status[outside] == OUT_OF_REACH).all()
    reached = posture.status == OK
    assert same_angles(posture.angles[reached], np.moveaxis(q, 0, -1)[reached], 1e-7)
    assert np.isnan(posture.mass_matrix[~reached]).all()
    assert np.isnan(posture.angles[~reached]).all()

    # alone, a posture starts from the reference and not from a roadmap: it must end in the same place
    for i, j in rng.choice(np.argwhere(clear | outside), 30):
        if posture.status[i, j] == OK:
            alone = solve_posture(mechanism, (x[i, j], y[i, j]))
            assert same_angles(alone.angles, posture.angles[i, j])
        else:
            with pytest.raises(OutOfReach):
                solve_posture(mechanism, (x[i, j], y[i, j]))


@pytest.mark.parametrize("seed", range(4))
def test_far_goals_never_land_on_another_branch(seed):
    """Arm with axes z, y, y: two singularities passed at once (over the back, and the elbow turned inside out)
    leave every determinant's sign as it was. Small batches start at the reference, large ones at a roadmap."""
    rng = np.random.default_rng(seed)
    mechanism = spatial_arm(rng)
    _, upper, fore = mechanism.links.tip[:, 0]
    shoulder = mechanism.links.origin[1]

    def sides(angles):
        radius = upper * np.cos(angles[..., 1]) + fore * np.cos(angles[..., 1] + angles[..., 2])
        return np.sign(radius), np.sign(np.sin(angles[..., 2]))

    goals = shoulder + rng.uniform(-1, 1, (400, 3)) * (upper + fore)
    distance = np.linalg.norm(goals - shoulder, axis=1)
    edges = np.array([abs(upper - fore), upper + fore])
    inside = (distance > edges[0] + 0.01) & (distance < edges[1] - 0.01)
    inside &= np.hypot(*goals[:, :2].T) > 0.02
    outside = (distance < edges[0] - 1e-6) | (distance > edges[1] + 1e-6)
    expected = sides(mechanism.assemblies["up"])
    for size in (10, 400):
        for goal, within, without in zip(
            *(np.array_split(values, 400 // size) for values in (goals, inside, outside)), strict=True
        ):
            posture = solve_posture(mechanism, goal)
            assert (posture.status[within] == OK).all()
            assert (posture.status[without] == OUT_OF_REACH).all()
            for side, wanted in zip(sides(posture.angles[posture.status == OK]), expected, strict=True):
                assert (side == wanted).all()


def test_a_hole_in_the_workspace_is_gone_round():
    """With both base axes in one place the handle cannot pass the middle; behind it it gets by going round."""
    there = solve_posture(five_bar(), (0.0, -0.25))
    here = solve_posture(five_bar(), (0.0, 0.25))
    assert same_angles(there.angles[[0, 2]], here.angles[[0, 2]] + np.pi)
    assert there.angles[[1, 3]] == pytest.approx(here.angles[[1, 3]], abs=1e-12)


@pytest.mark.parametrize(("edge", "beyond"), [(0.147 + 0.199, 1), (0.199 - 0.147, -1)])
@pytest.mark.parametrize("angle", [0.3, np.pi / 2, -2.0])
def test_the_edge_of_the_workspace_is_singular_and_beyond_it_out_of_reach(edge, beyond, angle):
    u = np.array([np.cos(angle), np.sin(angle)])
    mechanism = five_bar()
    with pytest.raises(Singular):
        solve_posture(mechanism, edge * u)
    with pytest.raises(OutOfReach, match="cannot reach"):
        solve_posture(mechanism, (edge + beyond * 1e-9) * u)
    assert solve_posture(mechanism, (edge - beyond * 1e-9) * u).status == OK
    batch = solve_posture(mechanism, np.array([edge + beyond * s for s in (-1e-6, 0, 1e-6)])[:, None] * u)
    assert batch.status.tolist() == [OK, SINGULAR, OUT_OF_REACH]


def test_where_the_drives_lose_the_handle_is_singular():
    """Distal links in one line: the handle can move with the drives at rest."""
    base, L1, L2 = 0.3, 0.1, 0.2
    mechanism = replace(
        five_bar(lengths=(L1, L2, L1, L2), base=base), reference_position=np.array([0.0, 0.15, 0.0])
    )
    # both elbows at height h above the base axes, a span of 2 L2 apart: distal links in line at height h
    spread = (2 * L2 - base) / 2
    height = np.sqrt(L1**2 - spread**2)
    angles = {
        "outward": np.concatenate(
            [two_bar_angles(L1, L2, base / 2, (0, 0.15), 1), two_bar_angles(L1, L2, -base / 2, (0, 0.15), -1)]
        )
    }
    mechanism = replace(mechanism, assemblies=angles)
    with pytest.raises(Singular):
        solve_posture(mechanism, (0.0, height))
    assert solve_posture(mechanism, (0.0, height + 1e-4)).status == OK
    with pytest.raises(OutOfReach):
        solve_posture(mechanism, (0.0, height - 0.01))


def test_over_its_own_axis_an_arm_is_singular():
    mechanism = spatial_arm(np.random.default_rng(1))
    over = mechanism.links.origin[1] + np.array([0, 0, 0.8 * mechanism.links.tip[1:, 0].sum()])
    with pytest.raises(Singular):
        solve_posture(mechanism, over)
    assert solve_posture(mechanism, over + np.array([1e-3, 0, 0])).status == OK


def test_a_goal_off_the_plane_is_out_of_reach():
    assert solve_posture(five_bar(), np.array([[0, 0.25, 0], [0, 0.25, 1e-6]])).status.tolist() == [
        OK,
        OUT_OF_REACH,
    ]


def test_a_paddle_goes_all_the_way_round_and_nowhere_else():
    angles = np.linspace(-np.pi, np.pi, 200, endpoint=False)
    circle = 0.1 * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    posture = solve_posture(paddle(), circle)
    assert (posture.status == OK).all()
    assert same_angles(posture.angles[:, 0], angles)
    assert solve_posture(paddle(), circle[20]).angles == pytest.approx(angles[20])
    assert (solve_posture(paddle(), 1.001 * circle).status == OUT_OF_REACH).all()
    assert posture.mass_matrix.ravel() == pytest.approx(1e-4 + 0.1 * 0.05**2)


def test_a_four_bar_follows_its_coupler_curve():
    """The reference position is not on the curve: the loops close with the handle where it must be."""
    mechanism = four_bar()
    with pytest.raises(OutOfReach):
        solve_posture(mechanism, mechanism.reference_position)
    curve, angles = [], []
    for turn in np.linspace(0, 2 * np.pi, 60):
        crank = 0.04 * np.exp(1j * turn)
        to_base = 0.12 - crank
        cosine = (abs(to_base) ** 2 + 0.11**2 - 0.09**2) / (2 * abs(to_base) * 0.11)
        open_angle = np.angle(to_base) + np.arccos(cosine)
        handle = crank + (0.05 + 0.04j) * np.exp(1j * open_angle)
        curve.append([handle.real, handle.imag])
        angles.append([turn, open_angle - turn])
    posture = solve_posture(mechanism, curve)
    assert (posture.status == OK).all()
    assert same_angles(posture.angles[:, :2], np.array(angles))
    alone = solve_posture(mechanism, curve[25])
    assert same_angles(alone.angles, posture.angles[25])


# --- physics that needs no judge ----------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(2))
def test_nonlinear_terms_are_lagranges(kind, seed):
    """c_k = sum_ij (dM_ki/dp_j - dM_ij/dp_k / 2) p_i' p_j', with differences along the handle's motion.

    Contracted with p' it is the power identity d/dt (p'^T M p' / 2) = p'^T c at p'' = 0.
    """
    rng = np.random.default_rng(seed)
    mechanism = KINDS[kind](rng)
    here = some_postures(mechanism, rng, 1)
    d = here.jacobian.shape[-1]
    rates = rng.uniform(-2, 2, d)
    J, step = here.jacobian[0], 2e-4
    plane = np.linalg.svd(J)[0][:, :d]  # an orthonormal basis of the handle's motions
    ahead = np.array([-2, -1, 1, 2])
    near = solve_posture(mechanism, here.position[0] + step * ahead[:, None, None] * plane.T)
    along = np.tensordot(np.array([1, -8, 8, -1]) / (12 * step), near.mass_matrix, axes=1)  # dM/d(plane)
    slope = np.einsum("eij,ek->kij", along, plane.T @ J)  # dM/dp_k
    expected = np.einsum("jki,i,j->k", slope, rates, rates) - 0.5 * np.einsum("kij,i,j->k", slope, rates, rates)
    terms = inertia_terms(mechanism, here, rates)[0]
    assert terms == pytest.approx(expected, rel=1e-6, abs=1e-6 * np.max(np.abs(expected)))


@pytest.mark.parametrize("kind", KINDS)
def test_turning_the_base_turns_the_jacobian_and_nothing_else(kind):
    rng = np.random.default_rng(11)
    mechanism = KINDS[kind](rng)
    R, shift = random_rotation(rng), rng.uniform(-0.2, 0.2, 3)
    links = mechanism.links
    roots = links.parent < 0
    turned = replace(
        mechanism,
        links=replace(
            links,
            origin=np.where(roots[:, None], links.origin @ R.T + shift, links.origin),
            rotation=np.where(roots[:, None, None], R @ links.rotation, links.rotation),
        ),
        reference_position=R @ mechanism.reference_position + shift,
    )
    postures = some_postures(mechanism, rng)
    others = solve_posture(turned, postures.position @ R.T + shift)
    assert others.angles == pytest.approx(postures.angles, abs=1e-11)
    assert others.mass_matrix == pytest.approx(postures.mass_matrix, rel=1e-9, abs=1e-12)
    assert others.jacobian == pytest.approx(R @ postures.jacobian, rel=1e-9, abs=1e-11)


# --- questions without an answer ----------------------------------------------------------------------


def test_a_loop_that_cannot_close_is_named_with_its_gap():
    short = five_bar()
    origin = short.links.origin.copy()
    origin[2, 0] = -0.9  # 0.9 m between base joints, 0.692 m of links
    with pytest.raises(LoopOpen, match=r"'handle' .*'outward': .* 0\.208 m"):
        solve_posture(replace(short, links=replace(short.links, origin=origin)), (0.0, 0.25))


def test_an_unknown_assembly_is_named():
    with pytest.raises(ValueError, match=r"'crossed'; .*'outward'"):
        solve_posture(five_bar(), (0, 0.25), "crossed")


@pytest.mark.parametrize("assembly", ["right", "left"])
def test_an_assembly_may_be_singular_throughout(assembly):
    """Arms of equal lengths from one place lie on each other with both elbows on one side: one angle is lost.

    The drives fit the mechanism, so that this is no fault of it, and with its base joints apart all is well.
    """
    assert solve_posture(five_bar(), (0.0, 0.25), "outward").status == OK
    with pytest.raises(Singular, match=f"'{assembly}' .* other joints"):
        solve_posture(five_bar(), (0.0, 0.25), assembly)
    only = replace(five_bar(), assemblies={assembly: five_bar().assemblies[assembly]})
    with pytest.raises(Singular):  # known from the mechanism itself, not from the assemblies it names
        solve_posture(only, (0.0, 0.25))
    several = solve_posture(five_bar(), [[0.0, 0.25], [0.1, 0.2], [0.5, 0.5]], assembly)
    assert several.status.tolist() == [SINGULAR] * 3
    assert np.isnan(several.mass_matrix).all()
    apart = five_bar(base=0.05)
    assert solve_posture(apart, (0.0, 0.25), assembly).status == OK


@pytest.mark.parametrize("position", [0.25, [0.25], [0.0, 0.25, 0.0, 0.0]])
def test_a_position_has_two_or_three_coordinates(position):
    with pytest.raises(ValueError, match="three coordinates"):
        solve_posture(five_bar(), position)


def test_nan_is_out_of_reach_in_a_batch():
    assert solve_posture(five_bar(), [[np.nan, 0.25], [0.0, 0.25]]).status.tolist() == [OUT_OF_REACH, OK]


def test_a_reference_position_out_of_reach_is_called_that():
    """Its file is to be checked, and for other positions the nearest is named."""
    mechanism = five_bar()
    far = replace(mechanism, reference_position=np.array([0.0, 9.0, 0.0]))
    with pytest.raises(OutOfReach, match="reference position") as caught:
        solve_posture(far, [0.0, 9.0])
    assert "nearer" not in str(caught.value)
    with pytest.raises(OutOfReach, match="answered position"):
        solve_posture(mechanism, [0.0, 9.0])


def test_the_drives_of_many_designs_fit_where_each_alone_fits():
    arm = spatial_arm(np.random.default_rng(0))
    singular, misfit = (
        ("outward", "right", "left"),
        (
            replace(five_bar(), drives=drives_on([0])),
            arm_on_a_four_bar(),
            replace(arm, handle_link=1, handle_point=np.zeros(3)),
        ),
    )
    cases = [(five_bar(), name) for name in singular] + [
        (one, next(iter(one.assemblies))) for one in (*misfit, arm)
    ]
    fit = []
    for mechanism, name in cases:
        mech = pack(mechanism)
        reference, _ = _references(mechanism, mech, name)
        fit.append(bool(drives_fit(mechanism, mech, np.zeros(1, dtype=np.int64), reference)[0]))
        try:
            assert (check_mobility(mechanism, mech, 0, reference[0]) is None) == fit[-1]
        except ValueError:  # the drives fit nowhere
            assert not fit[-1]
    assert fit == [True, False, False, False, False, False, True]


@pytest.mark.parametrize("side", [1, -1])
def test_an_arm_of_other_lengths_keeps_its_elbow_on_its_side(side):
    """From the same rough angles: the reference may be nearer for an elbow on the other side."""
    lower, reference = 0.18, np.array([0.08, 0.24, 0.0])
    rough = np.array([np.arctan2(0.24, 0.08) - 0.79 * side, 1.67 * side])
    lengths = np.linspace(0.06, 0.45, 100)
    tip = np.zeros((100, 2, 3))
    tip[:, 0, 0], tip[:, 1, 0] = lengths, lower
    origin = np.zeros((100, 2, 3))
    origin[:, 1, 0] = lengths
    one = links_of(
        ["upper", "lower"],
        [-1, 0],
        origin[0],
        [[0.0, 0.0, 1.0]] * 2,
        [0.2, 0.1],
        np.zeros((2, 3)),
        [1e-4 * np.eye(3)] * 2,
        [lengths[0], lower],
    )
    handle = np.array([lower, 0.0, 0.0])
    arms = Mechanism(
        replace(one, tip=tip, origin=origin),
        NO_CLOSURES,
        drives_on([0, 1]),
        1,
        handle,
        {"elbow": rough},
        reference,
        np.full((3, 2), np.nan),
    )
    found = solve_posture(arms, reference)
    away = np.linalg.norm(reference)
    reached = (lengths > away - lower + 1e-6) & (lengths < away + lower - 1e-6)
    assert np.array_equal(found.status == OK, reached)
    cosine = (away**2 - lengths**2 - lower**2) / (2.0 * lengths * lower)
    assert found.angles[reached, 1] == pytest.approx(side * np.arccos(cosine[reached]), abs=1e-9)
