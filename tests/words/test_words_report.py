"""Each sentence of a report follows from its numbers."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from math import nan
from types import SimpleNamespace

import numpy as np
import pytest

from tests.show.test_show_report import Page
from tests.undrawn_figures import leave_undrawn
from zwidth.device import from_document
from zwidth.device.load import load
from zwidth.loop.motion_names import group_names
from zwidth.show import gather
from zwidth.show.report import sentences
from zwidth.show.report.report import page
from zwidth.study import Variant, limiting_change
from zwidth.study.sensitivity.result import Sensitivity

FILTER = "loop.velocity.filter={type='butterworth', order=2, cutoff_Hz=20.0}"
FIRST_ORDER = "loop.velocity.filter={type='first-order', time_constant_s=0.002}"
RIGID = tuple(f"drives.motor-{side}.stiffness_Nm_per_rad=unset" for side in ("right", "left"))
LATE = "loop.delay_samples=1"
UNDAMPED = "plant.damping_Ns_per_m=unset"


@cache
def facts(name, *changes, **question):
    return gather(device := load(name, changes), device.at(**question))


@cache
def one_mass(mass, damping=0.0, stiffness=0.0, period=0.001, delay=0.0):
    plant = {"mass_kg": mass, "damping_Ns_per_m": damping, "stiffness_N_per_m": stiffness}
    loop = {"sampling_period_s": period, "delay_samples": delay}
    return gather(from_document({"name": "one mass", "plant": plant, "loop": loop}))


@cache
def far_sensor(stiffness=2000.0):
    plant = {
        "mass_kg": [[0.2, 0.0], [0.0, 0.1]],
        "damping_Ns_per_m": [[0.6, -0.1], [-0.1, 0.1]],
        "stiffness_N_per_m": [[2 * stiffness, -stiffness], [-stiffness, stiffness]],
        "actuator": [1.0, 0.0],
        "sensor": [0.0, 1.0],
    }
    return gather(from_document({"name": "far", "plant": plant, "loop": {"sampling_period_s": 0.001}}))


@cache
def reversed_sensor_facts():
    """A wall of reversed sign takes away the spring to the ground: K = 500 N/m, whatever else is changed."""
    plant = {"mass_kg": 0.1, "damping_Ns_per_m": 2.0, "stiffness_N_per_m": 500.0, "sensor": [-1.0]}
    return gather(from_document({"name": "back", "plant": plant, "loop": {"sampling_period_s": 0.001}}))


@cache
def unstable_mode_facts(damping=1.0, stiffness=-50.0):
    plant = {
        "mass_kg": [[0.1, 0.0], [0.0, 0.2]],
        "damping_Ns_per_m": [[1.0, 0.0], [0.0, damping]],
        "stiffness_N_per_m": [[0.0, 0.0], [0.0, stiffness]],
        "actuator": [1.0, 0.0],
        "sensor": [1.0, 0.0],
    }
    return gather(from_document({"name": "away", "plant": plant, "loop": {"sampling_period_s": 0.001}}))


def plain(text):
    return text.replace("\u00a0", " ")


FIVE_BAR_OPENING = "Along y at (0, 0.25) m this device renders walls of up to"
BY_DRIVES = (
    "What limits it is the flexibility of the drives, at 101.3 Hz and 130.8 Hz: with rigid drives, which cannot "
    "be built, it would reach"
)
BY_SPRING = "it is its flexibility, at 130.7 Hz: with a rigid structure, which cannot be built, it would reach"
ONE_LATE = "with one sample of delay it would"
STIFFNESS_SENTENCES = [
    (lambda: facts("five-bar"), f"{FIVE_BAR_OPENING} 7.849 kN/m, at 10.82 N s/m of virtual damping."),
    (lambda: facts("five-bar", LATE), f"{FIVE_BAR_OPENING} 1.708 kN/m, at 3.216 N s/m of virtual damping."),
    (
        lambda: facts("five-bar", position=(0.02, 0.2), direction=(-1.0, 0.0)),
        "Along −x at (0.02, 0.2) m this device renders walls of up to ",
    ),
    (
        lambda: facts("five-bar", model="rigid"),
        "Along y at (0, 0.25) m the rigid model of this device renders walls of up to 126.0 kN/m,",
    ),
    (
        lambda: facts("hapkit-course"),
        "This device renders walls of up to 21.94 kN/m, at 24.66 N s/m of virtual damping.",
    ),
    (
        lambda: facts("hapkit-course", FILTER),
        "This device renders walls of up to 2.011 kN/m, at no virtual damping; any damping lowers the largest",
    ),
    (
        lambda: facts("published-two-mass", UNDAMPED, LATE),
        "This device renders no wall: no wall with positive stiffness",
    ),
]


@pytest.mark.parametrize(("of", "text"), STIFFNESS_SENTENCES)
def test_what_it_renders(of, text):
    assert plain(sentences.largest_stiffness(of())).startswith(text)


LIMIT = [
    (lambda: facts("five-bar"), f"{BY_DRIVES} 126.0 kN/m; {ONE_LATE} fall to 1.708 kN/m."),
    (lambda: facts("published-two-mass"), f"What limits {BY_SPRING} 126.1 kN/m; {ONE_LATE} fall to 1.101 kN/m."),
    (lambda: facts("five-bar", LATE), f"{BY_DRIVES} 26.53 kN/m."),
    (
        lambda: facts("five-bar", *RIGID),
        "What limits it is the sampling of its mass of 0.2870 kg at 800 Hz: sampled twice as fast it would "
        "reach 504.2",
    ),
    (
        lambda: facts("five-bar", *RIGID, LATE),
        "What limits it is the delay of 1 sample (1.25 ms): without any delay, which can only be approached, it "
        "would reach 126.0 kN/m.",
    ),
    (
        lambda: facts("five-bar", FILTER),
        "What limits it is the filter of the velocity: without this filter it would reach 7.849 kN/m;",
    ),
    (
        lambda: one_mass(0.1, 9.347, 1669590.0),
        "What limits it is its low structural damping: with twice the structural damping it",
    ),
    (lambda: reversed_sensor_facts(), "None of the single changes tried lets it render a stiffer wall"),
    (
        lambda: far_sensor(),
        "What limits it is that the sensor is not where the wall acts: with the sensor at the actuator it "
        "would reach",
    ),
    (
        lambda: facts("published-two-mass", UNDAMPED),
        f"What limits {BY_SPRING} 126.1 kN/m; {ONE_LATE} render no wall at all.",
    ),
    (lambda: facts("published-two-mass", UNDAMPED, LATE), f"What prevents {BY_SPRING} 26.54 kN/m."),
]


@pytest.mark.parametrize(("of", "text"), LIMIT)
def test_what_limits_it(of, text):
    assert plain(sentences.limit(of())).startswith(text)


OSCILLATION = [
    (lambda: facts("five-bar"), "At the limit it oscillates at 170.5 Hz."),
    (
        lambda: facts("published-two-mass", LATE),
        "At the limit two oscillations begin at once, at 9.628 Hz and 135.3 Hz.",
    ),
    (lambda: one_mass(0.03, 300.0), "At the limit the force alternates from sample to sample, at 500.0 Hz."),
    (lambda: reversed_sensor_facts(), "Beyond the limit the handle drifts away without oscillating."),
    (lambda: facts("published-two-mass", UNDAMPED, LATE), ""),
]


@pytest.mark.parametrize(("of", "text"), OSCILLATION)
def test_what_happens_at_the_limit(of, text):
    assert plain(sentences.oscillation(of())) == text


NEXT_CHANGE_SENTENCES = [
    (
        lambda: facts("five-bar"),
        "The best of the changes tried that can be made, half the sampling period, would reach 42.08 kN/m.",
    ),
    (
        lambda: facts("five-bar", LATE),
        "The best of the changes tried that can be made, half the sampling period, would reach 6.127 kN/m.",
    ),
    (
        lambda: facts("hapkit-course"),
        "The next best single change, twice the friction, would reach 23.34 kN/m.",
    ),
    (lambda: facts("five-bar", *RIGID), ""),
    (lambda: reversed_sensor_facts(), ""),
]


@pytest.mark.parametrize(("of", "text"), NEXT_CHANGE_SENTENCES)
def test_the_best_change_that_can_be_made(of, text):
    assert plain(sentences.next_best(of())) == text


def test_the_next_best_change_may_be_ideal_or_none_may_gain():
    here = facts("five-bar", FILTER)
    assert limiting_change(here.variants).key == "no-filter"

    def of(**stiffest):
        changed = [
            replace(v, chart=SimpleNamespace(stiffness_max=stiffest[key]))
            for v in here.variants
            if (key := v.key.replace("-", "_")) in stiffest
        ]
        return SimpleNamespace(variants=(here.base, *changed), base=here.base)

    best = here.base.stiffness_max
    ideal = of(half_period=3.0 * best, no_delay=2.0 * best)
    assert sentences.next_best(ideal).startswith(
        "The next best single change, no delay (which can only be approached), would reach"
    )
    only_ideal = of(rigid_drives=3.0 * best, no_delay=2.0 * best, half_period=1.001 * best)
    assert plain(sentences.next_best(only_ideal)) == "None of the changes tried that can be made gains 1 %."


def test_separate_regions_are_counted():
    assert sentences.regions(facts("five-bar")) == ""
    apart = one_mass(0.1976, 4.687, 277934.0, 0.00761, 0.5)
    assert sentences.regions(apart) == "The stable walls lie in 2 separate regions."


def test_unobserved_motions_are_named():
    assert sentences.unobserved(facts("hapkit-course")) == ""
    assert sentences.unobserved(facts("five-bar")) == (
        "The rigid motion (0 Hz) is not affected by a wall in this direction and left out of the stability test."
    )
    stable = unstable_mode_facts(1.0, 50.0)
    assert re.fullmatch(
        r"The mode at \S+ Hz.* is not affected by a wall and left out of the stability test\.",
        plain(sentences.unobserved(stable)),
    )
    both = SimpleNamespace(
        runs_away=False, posture=None, chart=SimpleNamespace(unobserved_modes=["mode at 9 Hz"] * 2)
    )
    assert sentences.unobserved(both).startswith("2 modes at 9 Hz are not affected by a wall and left out")


def test_equal_motions_are_counted():
    assert group_names(["rigid motion (0 Hz)"] * 2) == ["2 rigid motions (0 Hz)"]
    assert group_names(["mode at 9 Hz (x)", "mode at 8 Hz"]) == ["mode at 9 Hz (x)", "mode at 8 Hz"]


def test_a_device_that_runs_away_is_warned_of_first():
    for of in (unstable_mode_facts(), unstable_mode_facts(-1.0, 50.0), unstable_mode_facts(-1.0, 0.0)):
        assert sentences.summary(of)[0].startswith("Warning: this device is unstable with any wall")
        assert sentences.unobserved(of) == ""
    for of in (unstable_mode_facts(1.0, 50.0), unstable_mode_facts(1.0, 0.0), facts("five-bar")):
        assert sentences.warning(of) == ""


def test_what_happens_outside_depends_on_the_edge():
    at_zero = plain(sentences.outside(facts("five-bar")))
    assert "the straight edge at K = 0 (0 Hz), the handle drifts away" in at_zero
    assert "at K = −5.000 kN/m (0 Hz)" in plain(sentences.outside(one_mass(0.1, 1.0, 5000.0)))


@pytest.mark.parametrize("of", [lambda: facts("five-bar"), lambda: facts("five-bar", LATE), far_sensor])
def test_up_to_is_the_limit_in_four_digits(of):
    found = of()
    (kilo,) = re.search(r"up to ([\d.]+) kN/m", plain(sentences.largest_stiffness(found))).groups()
    assert 1e3 * float(kilo) == pytest.approx(float(f"{found.base.stiffness_max:.3e}"), rel=1e-12)


def test_the_nearest_model():
    full = sentences.models(facts("five-bar"))
    assert plain(full) == (
        "Of the simpler models, motor mass with damping comes nearest: 7.976 kN/m, 1.617 % above the device "
        "as described."
    )
    assert "rigid without damping comes nearest: 20.59 kN/m, 6.171 % below" in plain(
        sentences.models(facts("hapkit-course"))
    )
    assert sentences.models(facts("published-two-mass", UNDAMPED, LATE)) == ""


@pytest.mark.parametrize(
    ("ratio", "text"),
    [(1.0, "just as"), (1.02, "2.000 % above"), (0.5, "50.00 % below"), (16.0, "16.00 times that of")],
)
def test_differences_in_words(ratio, text):
    assert plain(sentences.difference(ratio)) == text


def test_the_fastest_wall():
    assert plain(sentences.decay(facts("five-bar"))) == (
        "A wall of 500.0 N/m and 22.50 N s/m comes to rest fastest: a tenth is left after 48.33 ms."
    )
    negative = plain(sentences.decay(facts("five-bar", model="motor-mass")))
    assert re.match(r"A wall of 0 N/m and \S+ N s/m comes to rest fastest: a tenth is left after", negative)
    assert "; with negative stiffness or damping allowed, a wall of -" in negative.replace("\u2212", "-")
    assert sentences.decay(facts("published-two-mass", UNDAMPED, LATE)) == ""


def test_conditions_that_apply_are_named():
    assert sentences.conditions(facts("five-bar")) == (
        "None of these 18 published conditions applies to this device."
    )
    assert "“passive wall”" in sentences.conditions(facts("hapkit-course"))
    assert "“rigid mass”" in sentences.conditions(facts("five-bar", *RIGID))
    holds, fails = SimpleNamespace(name="a", holds=True), SimpleNamespace(name="b", holds=False)
    one = sentences.conditions(SimpleNamespace(bounds=(holds, fails)))
    assert one == "1 of these 2 published conditions applies to this device: “a”."


def test_conditions_that_do_not_apply_are_counted():
    assert sentences.conditions_not_met(facts("five-bar")).startswith("18 of 18 do not apply: what they would")
    holding = sum(bound.holds for bound in facts("hapkit-course").bounds)
    assert sentences.conditions_not_met(facts("hapkit-course")).startswith(f"{18 - holding} of 18 do not apply")
    holds, fails = SimpleNamespace(holds=True), SimpleNamespace(holds=False)
    assert sentences.conditions_not_met(SimpleNamespace(bounds=(holds, fails))).startswith(
        "1 of 2 does not apply: what it would promise"
    )
    assert sentences.conditions_not_met(SimpleNamespace(bounds=(holds,))) == ""


SETTING = [
    (
        lambda: facts("five-bar"),
        "Assembly elbows-out, full model; sampled every 1.25 ms, no delay, velocity not filtered.",
    ),
    (
        lambda: facts("five-bar", "load.push_N=-5"),
        "Assembly elbows-out, full model, under a push of −5 N along the direction; "
        "sampled every 1.25 ms, no delay, velocity not filtered.",
    ),
    (
        lambda: facts("hapkit-course", FILTER),
        "Plant as given; sampled every 1 ms, no delay, "
        "velocity through a Butterworth filter of order 2 at 20 Hz (tustin).",
    ),
    (
        lambda: facts("hapkit-course", "loop.delay_samples=1.5", FIRST_ORDER),
        "Plant as given; sampled every 1 ms, a delay of 1.5 samples (1.5 ms), "
        "velocity through a first-order filter of 2 ms.",
    ),
]


@pytest.mark.parametrize(("of", "text"), SETTING)
def test_the_setting(of, text):
    assert plain(sentences.setting(of())) == text


@pytest.mark.parametrize(
    ("direction", "name"),
    [((0, 1, 0), "y"), ((-1, 0, 0), "−x"), ((0, 0, 1), "z"), ((0.6, 0.8, 0), "(0.6, 0.8)")],
)
def test_directions(direction, name):
    assert sentences.direction_name(np.array(direction, dtype=float)) == name


def test_the_summary_leads_with_what_and_why():
    said = sentences.summary(facts("five-bar"))
    assert said[0] == sentences.largest_stiffness(facts("five-bar"))
    assert said[1] == sentences.limit(facts("five-bar"))
    assert all(sentence.endswith(".") for sentence in said)


FIRST_CHANGE_SENTENCES = [
    (
        lambda: facts("five-bar"),
        "What to change first is loop.sampling_period_s: 1 % less of it gives 2.661 % more stiffness, 208.8 N/m; "
        "then mechanism.links.upper-left.length_m (1 % less gives 1.553 %) and "
        "mechanism.links.upper-right.length_m (1 % less gives 1.550 %).",
    ),
    (
        lambda: facts("five-bar", LATE),
        "What to change first is mechanism.drives.motor-left.transmission_ratio: 1 % more of it gives 1.802 %",
    ),
    (
        lambda: facts("published-two-mass"),
        "What to change first is loop.sampling_period_s: 1 % less of it gives 2.850 % more stiffness, 203.3 N/m; "
        "then plant.mass_kg (1 % more gives 1.202 %) and plant.stiffness_N_per_m (1 % less gives 0.6483 %).",
    ),
    (
        lambda: reversed_sensor_facts(),
        "What to change first is plant.stiffness_N_per_m: 1 % more of it gives 1.000 % more stiffness, 5.000 N/m.",
    ),
    (lambda: facts("published-two-mass", UNDAMPED, LATE), ""),
]


@pytest.mark.parametrize(("of", "text"), FIRST_CHANGE_SENTENCES)
def test_what_to_change_first(of, text):
    said = plain(sentences.first_change(of()))
    assert said.startswith(text)
    assert bool(said) == bool(text)


COMPARISONS = [
    (
        lambda: facts("five-bar"),
        "“What limits it” asks for the cause and names another: the flexibility of the drives, at 101.3 Hz and "
        "130.8 Hz. No drives are rigid, and with 1 % stiffer drives the largest stiffness falls by 0.3303 %.",
    ),
    (
        lambda: facts("published-two-mass"),
        "“What limits it” asks for the cause and names another: its flexibility, at 130.7 Hz. No structure is "
        "rigid, and with a 1 % stiffer structure the largest stiffness falls by 0.6483 %.",
    ),
    (lambda: facts("hapkit-course"), "“What limits it” names the same cause."),
    (
        lambda: one_mass(0.1, 9.347, 1669590.0),
        "“What limits it” asks for the cause and names another: its low structural damping. With 1 % more "
        "structural damping the largest stiffness rises by",
    ),
    (
        lambda: far_sensor(),
        "“What limits it” asks for the cause and names another: that the sensor is not where the wall acts.",
    ),
    (lambda: reversed_sensor_facts(), ""),
    (lambda: facts("published-two-mass", UNDAMPED, LATE), ""),
]


@pytest.mark.parametrize(("of", "text"), COMPARISONS)
def test_the_cause_and_the_change_are_compared(of, text):
    said = plain(sentences.compare_answers(of()))
    assert said.startswith(text)
    assert bool(said) == bool(text)


STEPS = [
    ("no-delay", "loop.delay_samples", -0.5, "A delay can be shortened but not removed, and with 1 % less delay"),
    ("no-filter", "loop.velocity.filter.time_constant_s", -0.5, "With a 1 % faster filter"),
    ("no-filter", "loop.velocity.filter.cutoff_Hz", 0.5, "With a 1 % faster filter"),
    ("half-period", "loop.sampling_period_s", -0.5, "With a 1 % shorter sampling period"),
    ("twice-damping", "mechanism.damping.mode_ratio", 0.5, "With 1 % more structural damping"),
]


@pytest.mark.parametrize(("key", "path", "slope", "text"), STEPS)
def test_a_first_step_towards_the_cause(key, path, slope, text):
    here = facts("five-bar", LATE)

    def said(slope):
        chart = SimpleNamespace(stiffness_max=9.0 * here.base.stiffness_max)
        variant = Variant(key, "twice the structural damping", None, chart)
        number = Sensitivity(path, 1.0, "", slope, nan, 0.0)
        found = SimpleNamespace(ranking=(("plant.mass_kg", 5.0),), numbers=(number,))
        of = SimpleNamespace(
            variants=(here.base, variant), sensitivities=found, loop=here.loop, device=here.device,
            natural_frequencies=here.natural_frequencies, effective=here.effective,
        )  # fmt: skip
        return plain(sentences.compare_answers(of))

    assert said(slope).endswith(f"{text} the largest stiffness rises by 0.5000 %.")
    assert said(-slope).endswith("the largest stiffness falls by 0.5000 %.")
    assert said(0.0).endswith("the largest stiffness stays the same.")
    assert "the largest stiffness" not in said(nan)


def test_the_same_number_in_the_other_direction_is_another_cause():
    here = facts("five-bar")
    path = "mechanism.drives.motor-left.stiffness_Nm_per_rad"
    for slope, same in ((9.0, True), (-9.0, False)):
        number = Sensitivity(path, 1.0, "", slope, 1.0, 0.0)
        found = SimpleNamespace(ranking=((path, slope),), numbers=(number,))
        of = SimpleNamespace(
            variants=here.variants, sensitivities=found, loop=here.loop, device=here.device,
            natural_frequencies=here.natural_frequencies, effective=here.effective,
        )  # fmt: skip
        assert (sentences.compare_answers(of) == "“What limits it” names the same cause.") == same


def test_another_peak_is_mentioned_where_it_is_nearly_as_high():
    here = facts("published-two-mass")
    assert sentences.second_peak(here) == ""
    for share, text in (
        (0.85, ""),
        (0.95, "Another peak of the edge is at 6.777 kN/m: "),
        (1.0, "The edge has two equal peaks"),
    ):
        found = replace(here.sensitivities, second_peak=share * here.base.stiffness_max)
        of = SimpleNamespace(base=here.base, sensitivities=found)
        assert plain(sentences.second_peak(of)).startswith(text)
        assert bool(sentences.second_peak(of)) == bool(text)


FELT = [
    (
        lambda: facts("five-bar"),
        "At rest the stiffest wall is felt as 4.713 kN/m, 60.04 % of its stiffness; whatever is "
        "commanded, nothing stiffer than 11.79 kN/m can be felt.",
    ),
    (lambda: facts("published-two-mass"), "At rest the stiffest wall is felt as 4.897 kN/m, 68.65 % of"),
    (lambda: facts("hapkit-course"), "Nothing between wall and handle is flexible: at rest a wall is felt as"),
    (lambda: facts("five-bar", model="motor-mass"), ""),
    (lambda: facts("published-two-mass", UNDAMPED, LATE), ""),
]


@pytest.mark.parametrize(("of", "text"), FELT)
def test_what_the_hand_feels(of, text):
    said = plain(sentences.felt(of()))
    assert said.startswith(text)
    assert bool(said) == bool(text)


ALIKE = "within 10 % in stiffness, damping and frequency"
AGREEING = f"Simpler models that agree with it {ALIKE}:"
MODEL_SENTENCES = [
    (
        lambda: facts("published-two-mass"),
        "Along its edge the full model oscillates at up to 212.1 Hz, 1.623 times its first natural frequency of "
        f"130.7 Hz. {AGREEING} rigid below 20.29 Hz (15.52 % of that); motor mass with damping above 144.9 Hz "
        "(110.9 % of that); motor mass without damping nowhere.",
    ),
    (
        lambda: facts("five-bar", LATE),
        "Along its edge the full model oscillates at up to 138.2 Hz, 1.364 times its first natural frequency of "
        f"101.3 Hz. {AGREEING} rigid below 17.46 Hz (17.23 % of that); two masses with damping below 9.959 Hz "
        "(9.831 % of that); motor mass with damping, motor mass without damping and two masses "
        "without damping nowhere.",
    ),
    (lambda: facts("hapkit-course"), ""),
    (lambda: facts("published-two-mass", UNDAMPED, LATE), ""),
]


@pytest.mark.parametrize(("of", "text"), MODEL_SENTENCES)
def test_which_model_where(of, text):
    assert plain(sentences.which_model(of())) == text


def test_a_model_that_agrees_everywhere_between_or_not_at_all():
    here = facts("published-two-mass").validity
    low, high = float(here.frequency[0]), float(here.frequency[-1])

    def said(*ranges, natural=here.first_natural):
        fit = replace(here.fits[0], valid_ranges=ranges)
        changed = replace(here, fits=(fit,), first_natural=natural)
        return plain(sentences.which_model(SimpleNamespace(validity=changed)))

    assert said((low, high)).endswith(f"{AGREEING} rigid everywhere.")
    assert said((3.0, 9.0)).endswith("rigid between 3.000 Hz and 9.000 Hz.")
    both = said((low, 5.0), (150.0, high))
    assert both.endswith("below 5.000 Hz (3.825 % of that) and above 150.0 Hz (114.7 % of that).")
    assert said().endswith(f"None of the simpler models agrees with it {ALIKE}, at any frequency.")
    assert "natural" not in said((low, 5.0), natural=np.nan)
    assert said((low, 5.0), natural=np.nan).endswith("rigid below 5.000 Hz.")


def test_what_is_not_linear_is_said_to_be_left_out():
    assert sentences.left_out(facts("hapkit-course")) == ""
    said = sentences.left_out(facts("hapkit-course", "friction.coulomb_N=0.1"))
    assert said == "All of this is linear and leaves out dry friction, which zwidth simulate includes."
    both = facts("hapkit-course", "friction.coulomb_N=0.1", "loop.saturation.force_N=5")
    assert "leaves out dry friction and the force limit," in sentences.left_out(both)
    assert sentences.summary(both)[-1] == sentences.left_out(both)


def test_the_page_says_which_question_each_answer_is_to(monkeypatch):
    leave_undrawn(monkeypatch)
    shown, late = (Page(page(facts(*of))).text for of in (("five-bar",), ("hapkit-course", LATE)))
    assert "This asks for the cause: one thing at a time is changed, whether or not that can be built" in shown
    assert "This asks what can be done: each number of the device file is changed by 1 %" in shown
    assert "“What limits it” asks for the cause and names another: the flexibility of the drives" in shown
    for label in ("rigid drives (ideal)", "no delay", "half the sampling period"):
        assert label in shown
    assert "half the sampling period (ideal)" not in shown
    assert "no delay (ideal)" in late
