"""`zwidth simulate`: what happens on contact, held to eigenvalues, harmonic balance and the options typed."""

from __future__ import annotations

import csv
import re
from math import log

import numpy as np
import pytest

import zwidth as package
from tests.cli.command_runner import MECHANISM, ONE_MASS, TWO_MASS, document_of, parse_strict_json, run_command
from zwidth.contact import SOURCES, limit_cycles
from zwidth.show import SimulateCommand

WALL = ("--stiffness", 4000, "--damping", 10)
SOFT = ("--stiffness", 500, "--damping", 1)
SERIES = ("time_s", "position_m", "penetration_m", "velocity_m_per_s", "force_N", "handle_m", "energy_J")
RUBBING = """
name = "rubbing"
[plant]
mass_kg = 0.05
damping_Ns_per_m = 0.2
handle = 1.0
[friction]
coulomb_N = 0.05
[loop]
sampling_period_s = 0.001
"""
ENCODER = "[loop.encoder]\nresolution_m = 2e-5\nnoise_m = 1e-5\n"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rubbing.toml").write_text(RUBBING)
    return tmp_path


def simulate_document(*words):
    return document_of("simulate", *words)


def test_the_promised_keys_with_their_units():
    document = simulate_document(TWO_MASS, *WALL)
    assert set(SimulateCommand.keys) <= set(document)
    assert "left_out" not in document
    count = len(document["time_s"])
    assert all(len(document[key]) == count for key in SERIES)
    assert document["time_s"][1] == pytest.approx(0.00125)
    assert document["position_m"][0] == pytest.approx(0.001)
    assert document["force_N"][0] == pytest.approx(-4.0)  # K times 1 mm, at rest
    assert document["penetration_m"] == document["position_m"]
    assert document["stable"] is True
    assert document["behaviour"] == "decaying"
    assert set(document["ledger_J"]) == {name.replace(" ", "_") for name in SOURCES}
    assert sum(document["ledger_J"].values()) == pytest.approx(document["energy_J"][-1], abs=1e-12)
    assert document["ledger_imbalance"] < 1e-10


@pytest.mark.parametrize(("device", "operator"), [(TWO_MASS, "none"), (MECHANISM, "thesis-arm")])
def test_random_walls_are_stable_and_unstable_as_the_eigenvalues_say_and_grow_so_fast(device, operator, tmp_path):
    given = package.load(device, operator=operator)
    held = (device, "--operator", operator)
    loop = given.at().loop
    chart = package.stability_chart(loop, decay=False)
    rng = np.random.default_rng(12)
    walls = [(rng.uniform(0.0, 1.6) * chart.stiffness_max, rng.uniform(0.0, 1.1) * chart.damping_max)
             for _ in range(12)]  # fmt: skip
    (tmp_path / "walls.csv").write_text(
        "stiffness_N_per_m,damping_Ns_per_m\n" + "".join(f"{K!r},{B!r}\n" for K, B in walls)
    )
    points = document_of("check", *held, "--points", tmp_path / "walls.csv")["points"]
    assert {point["verdict"] for point in points} == {"stable", "unstable"}
    compared = 0
    for (K, B), point in zip(walls, points, strict=True):
        document = simulate_document(*held, "--stiffness", K, "--damping", B)
        assert document["stable"] is (point["verdict"] == "stable"), (K, B)
        rate = log(point["spectral_radius"])
        assert document["predicted_growth_per_sample"] == pytest.approx(rate, rel=1e-9)
        if abs(rate) < 0.01:  # hundreds of samples, in which the slowest motion is left alone
            longer = simulate_document(
                *held, "--stiffness", K, "--damping", B, "--duration", 15 * loop.period / abs(rate)
            )
            assert longer["growth_per_sample"] == pytest.approx(rate, rel=0.01)
            compared += 1
    assert compared


def test_the_default_lasts_a_tenfold_change():
    document = simulate_document(TWO_MASS, "--stiffness", 7500, "--damping", 10)
    tenfold = log(10.0) / document["predicted_growth_per_sample"]
    assert document["stable"] is False
    assert document["behaviour"] == "growing"
    assert document["duration_s"] / 0.00125 == pytest.approx(tenfold, abs=1.0)
    edge = document_of("chart", TWO_MASS)
    K, B = edge["stiffness_max_N_per_m"], edge["damping_at_stiffness_max_Ns_per_m"]
    document = simulate_document(TWO_MASS, "--stiffness", K, "--damping", B, "--substeps", 1)
    assert document["duration_s"] == 60.0
    assert document["stable"] is None


def test_a_wall_far_beyond_the_edge_grows_and_stays_a_number():
    for K in (20_000, 1e9):
        document = simulate_document(TWO_MASS, "--stiffness", K, "--damping", 1)
        assert document["stable"] is False
        assert document["behaviour"] == "growing"
        assert document["amplitude_m"] is not None


def test_friction_gives_the_limit_cycle_of_harmonic_balance(folder):
    """Beyond the linear edge small motions stick and large ones grow; between them is the one predicted."""
    wall = (1500.0, 0.2)
    device = package.load("rubbing.toml")
    (predicted,) = limit_cycles(device.at().loop, *wall)
    assert not predicted.stable
    words = ("rubbing.toml", "--stiffness", wall[0], "--damping", wall[1], "--duration", 1.5, "--start-position")
    assert simulate_document(*words, 0.96 * predicted.amplitude)["stable"] is True
    assert simulate_document(*words, 1.04 * predicted.amplitude)["behaviour"] == "growing"


def test_a_force_limit_gives_the_limit_cycle_of_harmonic_balance(folder):
    """The limit stops growth where the balance says; it is good to a few per cent where little is cut off."""
    (folder / "limited.toml").write_text(RUBBING + "[loop.saturation]\nforce_N = 10.0\n")
    limited = package.load("limited.toml")
    cycles = limit_cycles(limited.at().loop, 900.0, 0.2)
    (stable,) = [cycle for cycle in cycles if cycle.stable]
    assert stable.force_amplitude < 1.25 * 10.0
    words = ("limited.toml", "--stiffness", 900, "--damping", 0.2, "--duration", 5)
    document = simulate_document(*words, "--start-position", 0.011)
    assert (document["stable"], document["behaviour"]) == (False, "limit cycle")
    assert document["amplitude_m"] == pytest.approx(stable.amplitude, rel=0.03)
    assert document["dominant_frequency_Hz"] == pytest.approx(stable.frequency_Hz, rel=0.01)
    assert 0.2 < document["limited_share"] < 0.5
    assert document["ledger_J"]["friction"] < 0.0 < document["ledger_J"]["hold"]


def test_a_one_sided_wall_starts_outside_and_is_pushed():
    document = simulate_document(ONE_MASS, *SOFT, "--wall", "one-sided")
    start = {"position_m": -0.001, "velocity_m_per_s": 0.0, "off_the_path_m": None, "inside": False}
    assert document["start"] == start
    assert document["hand"]["push_N"] == 2.0
    assert (document["stable"], document["behaviour"]) == (True, "converged")
    assert document["predicted_growth_per_sample"] is None
    assert document["handle_m"][-1] == pytest.approx(2.0 / 500.0, rel=1e-6)
    assert max(f for f, x in zip(document["force_N"], document["position_m"], strict=True) if x <= 0.0) == 0.0
    bouncing = simulate_document(ONE_MASS, "--stiffness", 2500, "--damping", 0, "--wall", "one-sided")
    assert (bouncing["stable"], bouncing["behaviour"]) == (False, "bouncing")
    assert 0.0 < bouncing["contact_share"] < 1.0
    away = simulate_document(ONE_MASS, *SOFT, "--wall", "one-sided", "--push", 0, "--start-position", 0.001)
    assert (away["stable"], away["behaviour"]) == (False, "lost contact")
    assert away["start"]["inside"] is True


OPTIONS = [
    (("--wall-position", 0.002), lambda d: d["position_m"][-1], lambda old, new: abs(new - old - 0.002) < 1e-8),
    (("--push", 1.0), lambda d: d["handle_m"][-1], lambda plain, new: new == pytest.approx(plain / 2.0, rel=1e-6)),
    (("--ramp", 1.0), lambda d: max(d["handle_m"]), lambda plain, new: new < 0.9 * plain),
    (("--start-position", 0.0005), lambda d: d["position_m"][0], lambda _, new: new == 0.0005),
    (("--start-velocity", 0.1), lambda d: d["handle_m"][1], lambda plain, new: new > plain),
    (("--tremor", "1,8"), lambda d: d["amplitude_m"], lambda plain, new: new > 1e-5 > plain),
    (("--duration", 0.5), lambda d: d["time_s"][-1], lambda _, new: new == pytest.approx(0.5)),
    (("--no-pull",), lambda d: max(d["force_N"]), lambda plain, new: new == 0.0 < plain),
    (("--passivity", 5), lambda d: d["ledger_J"]["passivity_controller"], lambda plain, new: new < plain == 0.0),
]  # fmt: skip


@pytest.mark.parametrize(("words", "number", "holds"), OPTIONS, ids=[words[0] for words, *_ in OPTIONS])
def test_an_option_changes_what_it_says(words, number, holds):
    touched = (ONE_MASS, "--stiffness", 500, "--damping", 1.5, "--wall", "one-sided")
    if words[0] == "--no-pull":
        touched = (ONE_MASS, "--stiffness", 500, "--damping", 15, "--wall", "one-sided", "--push", 0,
                   "--start-position", 0.004)  # fmt: skip
    if words[0] == "--passivity":
        touched = (ONE_MASS, "--stiffness", 2500, "--damping", 0, "--wall", "one-sided")
    plain, new = number(simulate_document(*touched)), number(simulate_document(*touched, *words))
    assert holds(plain, new), (plain, new)


def test_the_passivity_controller_is_held_against_the_same_without_it():
    words = (ONE_MASS, "--stiffness", 2500, "--damping", 0, "--wall", "one-sided")
    told = simulate_document(*words, "--passivity", 5)
    plain = simulate_document(*words)
    assert plain["passivity"] is None
    without = told["passivity"]["without"]
    assert (without["stable"], without["behaviour"]) == (plain["stable"], plain["behaviour"])
    assert without["amplitude_m"] == plain["amplitude_m"]
    assert without["rendered_stiffness_N_per_m"] == pytest.approx(2500.0)
    assert 0.0 < told["passivity"]["rendered_stiffness_N_per_m"] != pytest.approx(2500.0)
    assert told["amplitude_m"] < plain["amplitude_m"]


def test_an_arm_reaches_and_stiffens():
    words = (ONE_MASS, *SOFT, "--wall", "one-sided", "--operator", "thesis-arm")
    alone, reaching = simulate_document(*words, "--push", 0), simulate_document(*words, "--reach", "0.02,0.1,0.4")
    assert reaching["hand"]["reach"] == {"distance_m": 0.02, "start_s": 0.1, "duration_s": 0.4}
    assert reaching["hand"]["push_N"] == 0.0
    assert max(reaching["handle_m"]) > 0.002 > max(alone["handle_m"])
    pushed = simulate_document(*words, "--push", 5)
    stiff = simulate_document(*words, "--push", 5, "--reflex", "0.5,4000,40,0.02,0.02")
    assert stiff["hand"]["reflex"]["latency_s"] == 0.02
    assert stiff["handle_m"][:20] == pytest.approx(pushed["handle_m"][:20], rel=1e-9)
    assert abs(stiff["handle_m"][-1]) < 0.95 * abs(pushed["handle_m"][-1])


def test_noise_is_seeded_and_substeps_are_taken(folder):
    (folder / "counted.toml").write_text(RUBBING.replace("[loop]", "[loop]") + ENCODER)
    words = ("counted.toml", *SOFT, "--duration", 0.2)
    first, again, other = (simulate_document(*words, "--seed", seed)["position_m"] for seed in (1, 1, 2))
    assert first == again != other
    coarse, fine = (simulate_document("rubbing.toml", *words[1:], "--substeps", n)["handle_m"] for n in (1, 40))
    assert coarse != fine
    assert coarse == pytest.approx(fine, abs=2e-5)


def test_another_environment_and_one_of_my_own(folder):
    slot = simulate_document(ONE_MASS, "--environment", "slot", "--parameter", "width=0.004", "--damping", 1)
    assert slot["environment"] == "slot"
    assert slot["parameters"] == {"width": 0.004, "stiffness": 1000.0, "damping": 1.0, "no_pull": 0.0}
    (folder / "own.py").write_text(
        "from zwidth.contact.environments import Parameter, environment\n\n"
        '@environment([Parameter("gain", "N/m", 300.0)], linear=True)\n'
        "def spring(position, velocity, time, period, parameters, memory):\n"
        "    return -parameters[0] * position\n"
    )
    own = simulate_document(ONE_MASS, "--environment", "own.py:spring", "--parameter", "gain=200")
    wall = simulate_document(ONE_MASS, "--stiffness", 200, "--damping", 0, "--duration", own["duration_asked_s"])
    assert own["handle_m"] == wall["handle_m"]
    assert own["wall_stiffness_N_per_m"] is None


def test_a_nonlinear_estimate_is_simulated_though_it_has_no_chart():
    levant = ("--set", "loop.velocity.method=levant", "--set", "loop.velocity.acceleration_max_m_per_s2=30")
    document = simulate_document(ONE_MASS, *SOFT, *levant)
    assert document["predicted_growth_per_sample"] is None
    assert document["duration_s"] == 2.0


def test_a_device_that_goes_with_a_tremor_is_not_called_unstable():
    document = simulate_document(TWO_MASS, *WALL, "--tremor", "1,10")
    assert (document["stable"], document["behaviour"]) == (None, "forced")
    assert document["dominant_frequency_Hz"] == pytest.approx(10.0, abs=0.05)


def test_the_table_holds_what_the_object_does(tmp_path):
    file = tmp_path / "motion.csv"
    document = simulate_document(TWO_MASS, *WALL, "--output", file)
    with file.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert list(rows[0]) == [*SERIES, *(f"{name}_J" for name in document["ledger_J"])]
    for key in SERIES:
        assert [float(row[key]) for row in rows] == document[key]
    assert {name: float(rows[-1][f"{name}_J"]) for name in document["ledger_J"]} == document["ledger_J"]
    told = tmp_path / "motion.json"
    simulate_document(TWO_MASS, *WALL, "--output", told)
    assert parse_strict_json(told.read_text()) | {"file": str(file)} == document


@pytest.mark.parametrize("words", [WALL, (*WALL, "--duration", 10.0)], ids=["short", "long"])
def test_a_figure_has_its_four_panels(tmp_path, words):
    file = tmp_path / "motion.svg"
    simulate_document(TWO_MASS, *words, "--output", file)
    assert "<svg" in file.read_text()


def test_the_sound_is_told_and_silence_is_no_answer(tmp_path):
    file = tmp_path / "motion.wav"
    document = simulate_document(TWO_MASS, *WALL, "--output", file)
    sound = document["sound"]
    assert sound["speed"] == 8.0
    assert sound["frequency_Hz"] == pytest.approx(8.0 * document["dominant_frequency_Hz"], rel=0.05)
    assert sound["seconds"] >= 1.0
    assert file.read_bytes()[:4] == b"RIFF"
    out = run_command("simulate", TWO_MASS, *WALL, "--output", file).out
    assert re.search(r"17\.\d+ Hz sounds as 13\d\.\d Hz", out)
    file.unlink()
    ran = run_command("simulate", TWO_MASS, *WALL, "--start-position", 0, "--json", "--output", file)
    assert ran.code == 1
    assert "nothing vibrates" in ran.document["reason"]
    assert "file" not in ran.document
    assert not file.exists()


@pytest.mark.parametrize(("start", "said"), [(0.005, "3.000 mm inside"), (0.0005, "1.500 mm outside")])
def test_the_start_is_told_from_the_walls_surface_wherever_it_is(start, said):
    place = ("--wall-position", 0.002, "--start-position", start)
    assert said in run_command("simulate", ONE_MASS, *SOFT, "--wall", "one-sided", *place).out
