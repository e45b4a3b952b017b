"""Links that bend under load: Euler's loads, stiffening, static bending, and where the handle then is."""

from __future__ import annotations

import numpy as np
import pytest

from tests.model.beam_devices import (
    device,
    drive,
    five_bar,
    light_five_bar,
    link,
    numbers,
    planar_arm,
    slides,
    spatial_arm,
    spatial_loop,
    with_beams,
)
from tests.model.frame_elements import modes_of
from tests.model.framed_devices import framed
from zwidth.device import from_document
from zwidth.errors import EquilibriumError
from zwidth.model import Load, loaded_postures

L, SOFT, STIFF = 0.3, 8.0, 20.0
EULER = np.pi**2 * SOFT / L**2


def column():
    """A beam on a slide that pushes along it, with a free end: clamped."""
    return device(
        [link("pusher", "base", "prismatic", axis=[1.0, 0.0, 0.0], length_m=L, beam=numbers([STIFF, SOFT], 0.1))],
        [drive("pusher", transmission_ratio=150.0)],
        {"pusher": 0.02},
        (1.0, 0.0, 0.0),
    )


def strut(hinge="axis"):
    """A beam between a slide that pushes and one that is guided, on a hinge at either end."""
    body = {"mass_kg": 0.1, "inertia_kg_m2": [1e-4, 1e-4, 1e-4], "axis": [1.0, 0.0, 0.0]}
    return device(
        [
            link("pusher", "base", "prismatic", **body),
            link("strut", "pusher", origin_m=[0.0, 0.0, 0.0], length_m=L, beam=numbers([STIFF, SOFT], 0.1)),
            link("guided", "base", "prismatic", **body),
        ],
        [drive("pusher", transmission_ratio=150.0)],
        {"pusher": 0.02, "strut": 0.0, "guided": L + 0.02},
        (1.0, 0.0, 0.0),
        loops=[{"name": "end", "links": ["strut", "guided"], "closes": hinge}],
        handle={"link": "guided", "point_m": [0.0, 0.0, 0.0]},
    )


# --- buckling ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(("make", "euler"), [(column, EULER / 4.0), (strut, EULER)])
def test_eulers_loads(make, euler):
    """Below them the device is in balance, above it is not, and is told by how much."""
    found = from_document(with_beams(make(), modes=4))
    calm = found.at(load=(-0.999 * euler, 0.0, 0.0)).equilibrium
    assert np.max(np.abs(calm.handle_place[1:])) < 1e-12
    for factor in (1.001, 1.5):
        with pytest.raises(EquilibriumError, match="links buckle") as caught:
            _ = found.at(load=(-factor * euler, 0.0, 0.0)).equilibrium
        share = float(str(caught.value).partition("they bear ")[2].split()[0])
        assert share == pytest.approx(1.0 / factor, rel=2e-4)
    _ = found.at(load=(3.0 * euler, 0.0, 0.0)).equilibrium  # pulled


def test_a_single_lump_buckles_as_its_shape_does():
    """The deflection under a force at the tip, s^2 (3 L - s): EI int w''^2 / int w'^2 is 2.5 EI/L^2."""
    found = from_document(with_beams(column(), method="lumped"))
    with pytest.raises(EquilibriumError, match="buckle") as caught:
        _ = found.at(load=(-SOFT / L**2 * 5.0, 0.0, 0.0)).equilibrium
    assert float(str(caught.value).partition("they bear ")[2].split()[0]) == pytest.approx(2.5 / 5.0, rel=1e-3)


def test_a_load_above_the_buckling_one_has_no_posture_either():
    found = from_document(column())
    at = found.at()
    load = Load(force=np.array([-EULER, 0.0, 0.0]))
    screw = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    with pytest.raises(EquilibriumError, match="buckle"):
        loaded_postures(found.mechanism, at.posture, screw, load, True)


# --- frequencies under an axial load ----------------------------------------------------------------


def squared(plant):
    """Squared frequencies of a plant under load, ascending [1/s^2]."""
    stiffness = plant.stiffness if plant.circulatory is None else plant.stiffness + plant.circulatory
    return np.sort(np.linalg.eigvals(np.linalg.solve(plant.mass, stiffness)).real)


@pytest.mark.parametrize("make", [column, strut])
@pytest.mark.parametrize("share", [-0.8, -0.2, 0.3, 2.0])
def test_frequencies_of_a_pressed_or_pulled_beam(make, share):
    """Bending modes of both planes, against elements under the same axial force, of any size: the load is along
    the beam and shifts nothing."""
    document = with_beams(make(), modes=6)
    found = from_document(document)
    force = share * (EULER if make is strut else EULER / 4.0)
    at = found.at(load=(force, 0.0, 0.0))
    plant = at.loaded_plants.loaded
    frame = framed(found, document, at, elements=16)
    expected, _ = modes_of(frame.under_axial_forces([force]).K, frame.M)
    own = squared(plant)
    bends = expected[expected > 1.0][:3]
    for each in bends:
        assert np.min(np.abs(own / each - 1.0)) < 1e-4
    unloaded, _ = modes_of(frame.K, frame.M)
    assert np.max(np.abs(bends / unloaded[unloaded > 1.0][:3] - 1.0)) > 0.02


@pytest.mark.parametrize("closes", ["axis", "point"])
@pytest.mark.parametrize("posture", [(0.0, 0.25), (0.04, 0.2)])
def test_a_five_bar_under_load_against_axial_forces_in_a_frame(closes, posture):
    """To the first order in the load: what links, hand and drives add to the squared frequencies in the plane.

    The frame knows axial forces alone. In the plane bending moments add what is of the order of (h/L)^2 of it.
    """
    document = with_beams(light_five_bar(closes), modes=4)
    found = from_document(document)
    force = np.array([0.3, -1.0, 0.0]) * 0.05
    at = found.at(posture, force[:2], load=Load(force=force))
    plants = at.loaded_plants
    frame = framed(found, document, at)
    m = len(frame.T.T)
    axial = []
    moved = frame.static_response(at.equilibrium.hand_force)
    for element in frame.frame.elements:
        longer = (moved[element.end, :3] - moved[element.start, :3]) @ element.axes[0]
        length = np.linalg.norm(frame.frame.points[element.end] - frame.frame.points[element.start])
        axial.append((element.member, element.beam.EA * longer / length))
    mean = [np.mean([N for member, N in axial if member == i]) for i in range(len(frame.frame.members))]
    before, shapes = modes_of(frame.K, frame.M)
    added = frame.under_axial_forces(mean).K - frame.K
    flat = [
        k
        for k in range(12)
        if np.max(np.abs((frame.T @ shapes[:m, k]).reshape(-1, 6)[:, 2])) < 1e-6 and before[k] > 0
    ]
    expected = {k: shapes[:, k] @ added @ shapes[:, k] for k in flat[:4]}
    own, V = np.linalg.eigh(
        np.linalg.solve(
            np.linalg.cholesky(plants.unloaded.mass),
            np.linalg.solve(np.linalg.cholesky(plants.unloaded.mass), plants.unloaded.stiffness).T,
        )
    )
    V = np.linalg.solve(np.linalg.cholesky(plants.unloaded.mass).T, V)
    change = np.einsum("ik,ij,jk->k", V, plants.loaded.stiffness - plants.unloaded.stiffness, V)
    for k, value in expected.items():
        near = int(np.argmin(np.abs(own / before[k] - 1.0)))
        assert own[near] == pytest.approx(before[k], rel=1e-4)
        assert change[near] == pytest.approx(value, rel=2e-3, abs=1e-6 * before[k])


# --- static bending ---------------------------------------------------------------------------------


def one_arm(stiffness=None):
    return device(
        [link("arm", "base", length_m=L, beam=numbers([STIFF, SOFT], 0.1))],
        [drive("arm", stiffness)],
        {"arm": 0.3},
        (-np.sin(0.3), np.cos(0.3)),
        spatial=False,
    )


@pytest.mark.parametrize("method", ["assumed-modes", "finite-elements", "lumped"])
@pytest.mark.parametrize("stiffness", [None, 0.8])
def test_a_handle_gives_way_by_the_bending_of_its_link_and_drive(stiffness, method):
    """F L^3 / (3 EI), and F L^2 / (n^2 k) of the drive, behind motors that are asked to stand where they do."""
    found = from_document(with_beams(one_arm(stiffness), method=method))
    force = 0.4
    way = np.array([-np.sin(0.3), np.cos(0.3), 0.0])
    at = found.at(load=Load(force=force * way, posture_of="motors"))
    moved = at.equilibrium.handle_place - found.at().posture.position
    drive_gives = 0.0 if stiffness is None else force * L**2 / (15.0**2 * stiffness)
    expected = force * L**3 / (3.0 * SOFT) + drive_gives
    assert moved @ way == pytest.approx(expected, rel=2e-3)
    # and shorter by what it bends: 3/5 d^2/L of a tip that is pushed across
    if stiffness is None:
        assert moved @ np.array([np.cos(0.3), np.sin(0.3), 0.0]) == pytest.approx(-0.6 * expected**2 / L, rel=0.02)


@pytest.mark.parametrize("make", [planar_arm, spatial_arm, five_bar, spatial_loop, slides])
def test_the_handle_stays_where_it_is_asked_for(make):
    """Whatever the links bend; of what the drives can make up for."""
    found = from_document(make())
    free = found.at()
    u = free.direction
    at = found.at(load=Load(push=-1.0))
    away = at.equilibrium.handle_place - free.posture.position
    moves = np.linalg.svd(at.posture.jacobian)
    moves = moves[0][:, : np.count_nonzero(moves[1] > 1e-9)]
    assert np.max(np.abs(moves.T @ away)) < 1e-9
    assert at.equilibrium.handle_place == pytest.approx(at.posture.position, abs=1e-12)
    bent = at.equilibrium.motions.handle.speed[:, at.equilibrium.motions.joint_count :] @ at.equilibrium.bending
    assert np.max(np.abs(bent)) > 1e-7
    assert float(at.equilibrium.hand_force @ u) == pytest.approx(-1.0, rel=1e-9)


@pytest.mark.parametrize("posture_of", ["handle", "motors"])
def test_a_handle_on_bent_links_settles_on_the_surface(posture_of):
    """Where a force is in balance 4 mm along the surface, the handle slides there and stays on the surface."""
    found = from_document(planar_arm())
    start = found.at(load=Load(push=-3.0, posture_of=posture_of)).equilibrium
    way = np.array([0.004, 0.0, 0.0])
    force = found.at(start.handle_place + way, load=Load(push=-3.0)).equilibrium.hand_force
    at = found.at(load=Load(force=force, settle=True, posture_of=posture_of))
    assert at.equilibrium.hand_force == pytest.approx(force, abs=1e-9)
    assert at.posture.position == pytest.approx(at.equilibrium.handle_place, abs=1e-12)
    if posture_of == "handle":
        assert at.equilibrium.handle_place == pytest.approx(start.handle_place + way, abs=1e-9)


def test_the_posture_has_its_handle_where_bent_links_leave_it():
    at = from_document(planar_arm()).at(load=Load(push=-3.0, posture_of="motors"))
    assert at.posture.position == pytest.approx(at.equilibrium.handle_place, abs=1e-12)


def test_bending_under_a_load_is_that_of_a_frame():
    """To the first order in the load, the motors held: of a device in space with all kinds of offsets."""
    document = with_beams(spatial_arm(), modes=4)
    found = from_document(document)
    judge = framed(found, document)
    for name, EI in (("upper", 18.0), ("lower", 9.0)):
        assert (
            min(found.document["mechanism"]["links"][1 + (name == "lower")]["beam"]["bending_stiffness_Nm2"]) == EI
        )
    F = 1e-4
    at = found.at(load=Load(push=F, posture_of="motors"))
    force = at.equilibrium.hand_force
    moved = at.equilibrium.handle_place - found.at().posture.position
    assert moved == pytest.approx(judge.deflection(force), rel=1e-5, abs=1e-5 * np.max(np.abs(moved)))


def test_gravity_bends_a_beam_by_its_own_weight():
    """m g L^3 / (8 EI) at the tip, of rho A g L^4 / (8 EI)."""
    document = one_arm()
    document["mechanism"]["gravity_compensation"] = "computed"
    found = from_document(document)
    free, g = found.at(), 2.0
    at = found.at(load=Load(gravity=np.array([0.0, 0.0, -g]), posture_of="motors"))
    sag = (at.equilibrium.handle_place - free.posture.position)[2]
    assert sag == pytest.approx(-0.1 * g * L**4 / (8.0 * STIFF), rel=1e-6)


# --- the sampled loop under load --------------------------------------------------------------------


@pytest.mark.parametrize("make", [five_bar, planar_arm])
def test_a_small_load_is_none_and_turns_its_sign(make):
    """K_max is smooth in the load: the mean of a push and a pull misses that without load by its square."""
    found = from_document(make())
    calm = found.at().chart(decay=False).stiffness_max

    def charted(F):
        return found.at(load=Load(push=F)).chart(decay=False).stiffness_max

    slopes, curves = [], []
    for F in (0.2, 0.4):
        up, down = charted(F), charted(-F)
        slopes.append((up - down) / (2.0 * F))
        curves.append((up + down) / 2.0 - calm)
    assert charted(-1e-6) == pytest.approx(calm, rel=1e-8)
    assert slopes[0] == pytest.approx(slopes[1], rel=0.02)
    assert abs(slopes[0]) * 0.2 > 1e-5 * calm
    assert abs(curves[0]) < 0.3 * abs(curves[1]) + 1e-8 * calm
    assert abs(curves[0]) < 0.1 * abs(slopes[0]) * 0.2


def test_all_methods_agree_under_load():
    charts = [
        from_document(with_beams(five_bar(), **keys)).at(load=Load(push=-2.0)).chart(decay=False).stiffness_max
        for keys in (
            {"method": "assumed-modes", "modes": 3},
            {"method": "finite-elements", "elements": 6, "modes": 8},
            {"method": "lumped"},
        )
    ]
    assert charts[1] == pytest.approx(charts[0], rel=1e-6)
    assert charts[2] == pytest.approx(charts[0], rel=2e-3)
