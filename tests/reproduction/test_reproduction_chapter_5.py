"""The figures of chapter 5: numbers known twice, by zwidth and by hand, and what the thesis states of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.lazy_module import LazyModule
from zwidth.device.load import load

five_bar = LazyModule("gallery.five_bar")
designs = LazyModule("gallery.five_bar_designs")
maps = LazyModule("gallery.fig_5_1_workspace")
common = LazyModule("gallery.fig_5_4_common_area")
base = LazyModule("gallery.fig_5_5_base_distance")
assemblies = LazyModule("gallery.fig_5_6_assemblies")
link = LazyModule("gallery.fig_5_8_link_length")
motor = LazyModule("gallery.fig_5_9_motor")
across = LazyModule("gallery.fig_5_10_eigenvalues")
radii = LazyModule("gallery.fig_5_11_spectral_radii")
over_mass = LazyModule("gallery.fig_5_12_eigenvalue_paths")
optimal = LazyModule("gallery.optimal_mass")
wall = LazyModule("gallery.fig_3_7_bilateral_wall")

FELT = ("link_side_mass", "motor_side_mass", "rigid_mass", "stiffness")
ASSEMBLIES = ("elbows-out", "elbows-in", "elbows-right", "elbows-left")


def assert_same_values(place, felt, rel=1e-10):
    """What zwidth feels in many places is what the arms written out by hand feel."""
    for name in FELT:
        np.testing.assert_allclose(getattr(place.effective, name), getattr(felt, name), rtol=rel)


# The judge and the batches


def test_the_five_bar_by_hand():
    position = np.stack(np.meshgrid([-0.2, -0.03, 0.11], [0.07, 0.15, 0.27]), axis=-1)
    in_space = np.concatenate([position, np.zeros((3, 3, 1))], axis=-1)
    for name in ("elbows-out", "elbows-in"):
        place = load("five-bar").at(in_space, assembly=name)
        felt = five_bar.bundled().at(position, name)
        assert_same_values(place, felt)
        np.testing.assert_allclose(place.mass_matrix, felt.mass_matrix, rtol=1e-10, atol=1e-16)
        np.testing.assert_allclose(place.jacobian[..., :2, :], felt.jacobian, rtol=1e-10, atol=1e-14)


@pytest.mark.parametrize("name", ASSEMBLIES)
def test_many_designs_at_once_are_the_designs_one_by_one(name):
    lengths, apart = np.array([0.12, 0.19]), np.array([-0.15, 0.3])
    for law in designs.LAWS:
        batch = designs.operating_points(designs.with_lengths(lengths, designs.LENGTH, law), name).effective
        for n, length in enumerate(lengths):
            alone = load("five-bar", settings_of(length, law)).mechanism.links
            links = designs.with_lengths(lengths, designs.LENGTH, law).mechanism.links
            for part in ("origin", "tip", "mass", "center_of_mass", "inertia"):
                numbers = getattr(links, part)[n]
                if part == "inertia":  # about other axes a file need not tell it
                    numbers, told = numbers[:, 2, 2], getattr(alone, part)[:, 2, 2]
                else:
                    told = getattr(alone, part)
                np.testing.assert_allclose(numbers, told, rtol=1e-12, atol=1e-18)
        if law == "kept":
            felt = replace(five_bar.bundled(), driven_length=(lengths, designs.LENGTH)).at(designs.REFERENCE, name)
            np.testing.assert_allclose(batch.rigid_mass, felt.rigid_mass, rtol=1e-10)
    assert_same_values(
        designs.operating_points(designs.with_base_distance(apart), name),
        replace(five_bar.bundled(), base=(apart / 2.0, -apart / 2.0)).at(designs.REFERENCE, name),
    )


def settings_of(length, law):
    """The same design as a user would ask for it."""
    share = float(length / designs.LENGTH)
    links = {one["name"]: one for one in load("five-bar").document["mechanism"]["links"]}
    arm = links["upper-right"]
    told = {"length_m": float(length)}
    if law == "grown":
        told["mass_kg"] = arm["mass_kg"] * share
        told["center_of_mass_m"] = [share * value for value in arm["center_of_mass_m"]]
        told["inertia_kg_m2"] = arm["inertia_kg_m2"] * share**3
    found = [(f"mechanism.links.upper-right.{key}", value) for key, value in told.items()]
    if law == "as Appendix B":
        for name in ("distal-right", "distal-left"):
            inertia = links[name]["mass_kg"] * links[name]["length_m"] ** 2 / 12.0
            found.append((f"mechanism.links.{name}.inertia_kg_m2", inertia))
    return found


# Figs. 5.1 to 5.4


def test_dexterity_over_the_workspace():
    for by_zwidth, by_hand in maps.at_reference.values():
        assert by_zwidth == pytest.approx(by_hand, rel=1e-12)
    position = np.stack(np.meshgrid(maps.plane.x, maps.plane.y), axis=-1)
    felt = five_bar.bundled().at(position, maps.ASSEMBLY)
    ok = maps.reached
    assert ok.sum() == np.isfinite(felt.manipulability).sum() == 5969
    np.testing.assert_allclose(maps.values["w"][ok], felt.manipulability[ok], rtol=1e-9)
    np.testing.assert_allclose(maps.values["kappa"][ok], felt.condition_number[ok], rtol=1e-9)
    # no direction in it: rings about the base
    on_the_line = np.interp(maps.radius[ok], maps.r, maps.line.manipulability)
    np.testing.assert_allclose(maps.values["w"][ok], on_the_line, rtol=2e-2, atol=1e-5)
    assert (maps.largest_w, maps.kappa_there) == pytest.approx((0.2660, 1.538), abs=5e-4)
    assert (maps.most_isotropic, maps.kappa_least) == pytest.approx((0.0982, 1.0), abs=1e-4)


@pytest.mark.parametrize("model", ["rigid", "links", "motor-mass", "full"])
def test_largest_stiffness_at_the_reference(model):
    assert maps.stiffest[model] == pytest.approx(maps.stiffness_by_brute_force(model), rel=1e-11)


def test_impedance_range_over_the_workspace():
    position = np.stack(np.meshgrid(maps.plane.x, maps.plane.y), axis=-1)
    felt, ok = five_bar.bundled().at(position, maps.ASSEMBLY), maps.reached
    rigid = 4.0 * (np.sqrt(2.0) - 1.0) ** 2 * felt.rigid_mass / maps.PERIOD**2
    np.testing.assert_allclose(maps.values["rigid"][ok], rigid[ok], rtol=1e-9)
    flexible = five_bar.closed_form(felt.motor_side_mass, felt.stiffness, maps.PERIOD)
    np.testing.assert_allclose(maps.values["flexible"][ok], flexible[ok], rtol=1e-8)
    assert max(maps.asymmetries[name] for name in ("w", "w_d", "kappa", "rigid", "rigid area")) < 1e-11
    assert min(maps.asymmetries[name] for name in ("flexible", "flexible area", "exact")) > 0.1


def test_rank_correlations():
    from scipy.stats import spearmanr

    for (model, measure), found in maps.contrast.items():
        pair = [maps.values[name][maps.reached] for name in (model, measure)]
        assert found == pytest.approx(spearmanr(*pair)[0], abs=1e-5)  # cells alike but for rounding


def test_the_common_area():
    for mass, area in (("link_side_mass", 351.54), ("rigid_mass", 379.24)):
        assert 1e4 * common.by_integration[mass] == pytest.approx(area, abs=0.01)
        assert common.areas[mass].common.area == pytest.approx(common.by_integration[mass], rel=5e-4)
    # one requirement less
    ring = (
        common.areas["link_side_mass"]
        .regions[0]
        .shape.intersection(common.areas["link_side_mass"].regions[1].shape)
    )
    assert ring.area > 1.01 * common.areas["rigid_mass"].common.area
    assert common.at_reference["isotropy"] == pytest.approx(1.376, abs=5e-4)
    assert common.distance_from_reference == pytest.approx(9.3e-3, abs=1e-4)


# Figs. 5.5 to 5.9


def test_base_distance():
    positions = np.stack([base.x, np.full_like(base.x, base.Y)], axis=-1)
    for d in base.DISTANCES:
        felt = replace(five_bar.bundled(), base=(d / 2.0, -d / 2.0)).at(positions, "elbows-out")
        rigid, flexible = base.by_distance["rigid"][d], base.by_distance["flexible"][d]
        by_hand = five_bar.closed_form(felt.motor_side_mass, felt.stiffness, base.PERIOD)
        assert np.array_equal(np.isfinite(rigid), np.isfinite(felt.rigid_mass))
        ok = np.isfinite(rigid)
        np.testing.assert_allclose(
            rigid[ok] / rigid[ok][0], felt.rigid_mass[ok] / felt.rigid_mass[ok][0], rtol=1e-9
        )
        np.testing.assert_allclose(flexible[ok], by_hand[ok], rtol=1e-7)
        exact = base.by_distance["exact"][d]
        assert np.isfinite(exact[ok]).all()
        assert (exact[ok] < rigid[ok]).all()
    # the thesis's factor of three, and over which range
    assert base.factors["rigid"][-0.2] == pytest.approx(3.100, abs=5e-4)
    assert base.factors["links"][-0.2] == pytest.approx(2.854, abs=5e-4)
    assert base.factor(base.by_distance["rigid"][-0.2], base.three_within["rigid"] - 1e-3) < 3.0
    assert base.factor(base.by_distance["rigid"][-0.2], base.three_within["rigid"] + 1e-3) > 3.0
    assert base.reach_of_factor(base.by_distance["rigid"][0.0], 3.0) == np.inf
    assert base.three_within["flexible"] == pytest.approx(0.0474, abs=5e-4)


def test_symmetry_comes_from_the_drives_alone():
    assert base.asymmetries["rigid"] < 1e-11
    assert base.asymmetries["links"] < 1e-11
    assert (base.asymmetries["flexible"], base.asymmetries["exact"]) == pytest.approx((0.56, 0.21), abs=5e-3)
    assert max(base.asymmetries_with_equal_drives.values()) < 1e-9


def test_one_distance_by_brute_force():
    felt = replace(five_bar.bundled(), base=(-0.1, 0.1)).at((0.05, base.Y), "elbows-out")
    at = int(np.argmin(np.abs(base.x - 0.05)))
    for curve, model in (("rigid", "rigid"), ("links", "links"), ("flexible", "motor-mass"), ("exact", "full")):
        found = float(base.by_distance[curve][-0.2][at])
        judge = five_bar.brute_force_loop(felt, model, 0.05, base.PERIOD)
        assert found == pytest.approx(judge.largest_stiffness(2.0 * found, 600.0)[0], rel=1e-9)


def test_assemblies():
    for name, found in assemblies.curves.items():
        d = assemblies.distance
        felt = replace(five_bar.bundled(), base=(d / 2.0, -d / 2.0)).at(designs.REFERENCE, name)
        ok = np.isfinite(found.rigid)
        # nothing holds the handle where both arms coincide
        assert np.flatnonzero(~ok).tolist() == ([] if name in ASSEMBLIES[:2] else [95])
        by_hand = five_bar.closed_form(felt.motor_side_mass, felt.stiffness, assemblies.PERIOD)
        np.testing.assert_allclose(found.flexible[ok], by_hand[ok], rtol=1e-6)
        np.testing.assert_allclose(found.isotropy[ok], felt.condition_number[ok], rtol=1e-6)
    assert assemblies.mirrored["flexible"] < 1e-11
    assert assemblies.mirrored["flexible_area"] < 1e-11
    assert assemblies.least["elbows-out"]["flexible"] == pytest.approx((0.275, 2824.8), abs=0.1)


def test_the_rigid_body_is_mirrored_too_without_offsets():
    d = np.array([-0.3, -0.1, 0.2])
    centers = tuple((along, 0.0) for along, _ in five_bar.bundled().center)
    straight = replace(five_bar.bundled(), center=centers)
    out, inwards = (
        replace(straight, base=(sign * d / 2.0, -sign * d / 2.0)).at(designs.REFERENCE, name).rigid_mass
        for sign, name in ((1.0, "elbows-out"), (-1.0, "elbows-in"))
    )
    np.testing.assert_allclose(out, inwards, rtol=1e-12)
    assert assemblies.mirrored["rigid"] > 0.01


def test_no_minimum_at_the_length_as_built():
    for key, lows in link.low_points.items():
        tie, _, assembly = key
        if assembly in ("elbows-out", "elbows-in"):
            assert [at for each in lows.values() for at in each if at < 0.3] == []
            assert link.curves[key].singular == (() if tie == "L1 alone" else (round(link.both_in_line, 9),))
        else:
            # a zero of the flexible models, where both arms coincide
            assert tie == "L1 alone"
            assert link.curves[key].singular == (link.LENGTH,)
            for model in ("flexible", "exact"):
                assert lows[model] == pytest.approx([link.LENGTH], abs=1.1e-3)
                assert link.minima[(*key, model)] == []
            (at,) = lows["rigid"]
            assert 0.181 < at < 0.2
    # with both lengths alike and both elbows on one side there is no device at any length
    assert {key[2] for key, found in link.curves.items() if found.always_singular} == {
        "elbows-right",
        "elbows-left",
    }


def test_stiffness_falls_with_the_square_of_the_distance_from_the_singularity():
    longer = designs.LENGTH + np.array([1e-5, 2e-5, 4e-5])
    near = replace(five_bar.bundled(), driven_length=(longer, designs.LENGTH))
    felt = near.at(designs.REFERENCE, "elbows-right")
    K = five_bar.closed_form(felt.motor_side_mass, felt.stiffness, link.PERIOD)
    assert K[1:] / K[:-1] == pytest.approx([4.0, 4.0], rel=1e-2)
    # the rigid body does not notice
    assert felt.rigid_mass == pytest.approx(felt.rigid_mass[0], rel=1e-3)


def test_lengths_by_hand():
    for tie, assembly in ((t, a) for t in link.TIES for a in ("elbows-out", "elbows-in")):
        other = link.length if tie == "L1 = L3" else np.full_like(link.length, designs.LENGTH)
        felt = replace(five_bar.bundled(), driven_length=(link.length, other)).at(designs.REFERENCE, assembly)
        found = link.curves[tie, "kept", assembly]
        by_hand = five_bar.closed_form(felt.motor_side_mass, felt.stiffness, link.PERIOD)
        np.testing.assert_allclose(found.flexible, by_hand, rtol=1e-5)
        np.testing.assert_allclose(found.rigid / found.rigid[0], felt.rigid_mass / felt.rigid_mass[0], rtol=1e-8)


def test_the_motors():
    for W in (0.2, 0.9, 1.3):
        assert np.interp(W, motor.W, motor.p_max) == pytest.approx(motor.p_max_by_brute_force(W), rel=2e-4)
    assert motor.falls
    assert np.isnan(motor.beyond).all()
    assert motor.limit_rigid == pytest.approx(0.686292, abs=1e-6)
    assert motor.p_of_the_device == pytest.approx(motor.p_max_by_brute_force(motor.W_of_the_device), rel=1e-10)
    # arms outward and inward have the same motors; links differ by the offsets of their centres
    np.testing.assert_allclose(motor.flexible, motor.flexible_outward, rtol=1e-11)
    assert 1e-5 < np.abs(motor.exact / motor.exact_outward - 1.0).max() < 0.01
    assert motor.flexible[motor.at_present] == pytest.approx(maps.stiffest["motor-mass"], rel=1e-9)


def test_another_motor_by_hand():
    bar = five_bar.bundled()
    felt = replace(bar, rotor=(3.0 * bar.rotor[0], bar.rotor[1])).at(designs.REFERENCE, "elbows-in")
    place = motor.with_first_motor(3.0 * motor.BUNDLED).at(motor.POSITION, assembly="elbows-in")
    assert_same_values(place, felt)
    asked = load("five-bar", [("mechanism.drives.motor-right.motor_inertia_kg_m2", 3.0 * motor.BUNDLED)])
    assert asked.at(motor.POSITION, assembly="elbows-in").effective.rigid_mass == pytest.approx(felt.rigid_mass)


# Figs. 5.10 to 5.14


def test_eigenvalues_across_the_chart():
    edges = wall.edges_at_4000
    assert (across.slow_in.value, across.fast_out.value) == pytest.approx(edges, rel=1e-9)
    assert [found.outwards for found in across.crossings] == [False, False, True]
    assert across.frequency(across.slow_in) == pytest.approx(17.0754, abs=1e-4)
    assert across.frequency(across.fast_out) == pytest.approx(200.6816, abs=1e-4)
    assert across.beyond_the_axis == pytest.approx(0.3067, abs=1e-4)
    assert across.slow_at_first == pytest.approx(1.006420, abs=1e-6)
    assert across.moves == pytest.approx({"fast pair": 0.407, "slow pair": 0.029, "real": 0.429}, abs=1e-3)


def test_point_A_has_two_equal_real_eigenvalues():
    assert across.real_at_A[1:] == pytest.approx([0.9454836] * 2, abs=1e-6)
    assert abs(across.pair_at_A) == pytest.approx(0.9454836, abs=1e-6)


def test_points_B_C_and_D():
    two, one = radii.radius["two masses"], radii.radius["motor's mass"]
    assert two == pytest.approx({"B": 0.978148, "C": 0.987492, "D": 1.041899}, abs=1e-6)
    assert one == pytest.approx({"B": 0.983275, "C": 1.030852, "D": 1.085783}, abs=1e-6)
    assert radii.areas["two masses"][0.98] < radii.areas["two masses"][0.99] < radii.areas["two masses"][1.0]
    assert (radii.area_ratio, radii.stiffness_ratio) == pytest.approx((12.0, 3.51), abs=5e-3)


@pytest.mark.parametrize("name", ["B", "C", "D"])
def test_ways_over_the_mass(name):
    for model, way in over_mass.model_paths[name].items():
        assert way.stable_from == pytest.approx(over_mass.judged_stable_from(model, name), rel=1e-9)
    assert over_mass.model_paths[name]["motor's mass"].fastest == pytest.approx(optimal.optimum[name], abs=1e-6)
    # along the way nothing is faster than the fastest
    for way in over_mass.model_paths[name].values():
        assert way.paths.spectral_radius.min() >= way.fastest[1] - 1e-9
        masses = way.paths.values[way.paths.values > way.stable_from * 1.001]
        radius = way.paths.spectral_radius[way.paths.values > way.stable_from * 1.001]
        assert len(masses) > 10
        assert (radius < 1.0).all()


def test_figures_are_drawn():
    from zwidth.show import context, figure

    for script, width, height in (
        (maps, 9.0, 11.0),
        (common, 6.4, 4.8),
        (base, 6.2, 7.6),
        (assemblies, 7.2, 7.4),
        (link, 7.2, 7.4),
        (motor, 7.2, 3.4),
        (across, 7.4, 4.6),
        (radii, 7.4, 3.8),
        (over_mass, 7.6, 2.7),
    ):
        made, ax = figure(width, height)
        ax.remove()
        with context():
            script.draw(made)
        assert all(ax.has_data() for ax in made.axes[:2])
