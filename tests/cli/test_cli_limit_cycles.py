"""`zwidth limit-cycles`: what is predicted, what the simulation finds there, and when there is no answer."""

from __future__ import annotations

import csv

import pytest

from tests.cli.command_runner import (
    MECHANISM,
    ONE_MASS,
    TWO_MASS,
    document_of,
    parse_strict_json,
    run_command,
)
from tests.cli.test_cli_docs import PAGE, keys
from tests.paddle import LENGTH, paddle
from zwidth.contact import limit_cycles
from zwidth.device.load import load

LIMITED = ("--set", "loop.saturation.force_N=5")
WALL = ("--stiffness", "8000", "--damping", "10")
ROUGH = ("--set", "loop.encoder.resolution_m=2e-5", "--set", "friction.coulomb_N=0.03")
SLIPPERY = ("--set", "friction.coulomb_N=0.01")
ROUGH_AND_LIMITED = (*ROUGH, *LIMITED, "--stiffness", "2600", "--damping", "0")


@pytest.fixture(scope="module")
def cycle_prediction(tmp_path_factory):
    """What is predicted of everything at once, and the two files of it."""
    folder = tmp_path_factory.mktemp("cycles")
    table, plane = folder / "cycles.csv", folder / "plane.svg"
    document = document_of(
        "limit-cycles", ONE_MASS, *ROUGH_AND_LIMITED, "--no-simulation", "--output", table, "--plane", plane
    )
    return document, table, plane


def test_a_limited_force_holds_a_growing_vibration_as_predicted():
    document = document_of("limit-cycles", TWO_MASS, *WALL, *LIMITED)
    assert (document["verdict"], document["nonlinear"]) == ("unstable", ["the force limit"])
    (cycle,) = document["limit_cycles"]
    assert cycle["stable"] is True
    assert cycle["force_N"] > 5.0
    assert cycle["velocity_m_per_s"] == pytest.approx(6.283185307 * cycle["frequency_Hz"] * cycle["amplitude_m"])
    met = cycle["simulated"]
    assert met["behaviour"] == "limit cycle"
    assert met["amplitude_m"] == pytest.approx(cycle["amplitude_m"], rel=0.01)
    assert met["frequency_Hz"] == pytest.approx(cycle["frequency_Hz"], rel=0.002)
    assert "16 odd harmonics" in document["predicted_by"]
    assert document["resting_limit_N_per_m"] is None


def test_the_numbers_are_those_of_the_package(cycle_prediction):
    document, *_ = cycle_prediction
    settings = [word for word in (*ROUGH, *LIMITED) if word != "--set"]
    device = load(ONE_MASS, settings)
    expected = limit_cycles(device.at().loop, 2600.0, 0.0)
    told = document["limit_cycles"]
    assert [cycle["amplitude_m"] for cycle in told] == pytest.approx([cycle.amplitude for cycle in expected])
    assert [cycle["stable"] for cycle in told] == [False, True]
    assert [cycle["simulated"] for cycle in told] == [None, None]
    assert document["resting_limit_N_per_m"] == pytest.approx(2.0 * 0.03 / 2e-5)
    assert document["quiet_limit_N_per_m"] == pytest.approx(2.0 * 0.03 / 2e-5)
    assert len(document["growth"]["amplitude_m"]) == len(document["growth"]["growth_per_s"])


def test_between_two_counts_beyond_the_resting_limit_it_hunts():
    document = document_of(
        "limit-cycles", ONE_MASS, *ROUGH, "--stiffness", 4500, "--damping", 0, "--offset", 0.5, *SLIPPERY
    )
    assert document["offset_steps"] == 0.5
    persisting = [cycle for cycle in document["limit_cycles"] if cycle["stable"]]
    (predicted,) = [cycle["predicted"]["amplitude_m"] for cycle in persisting if cycle["predicted"]]
    assert all(cycle["simulated"]["behaviour"] == "limit cycle" for cycle in persisting)
    # locked to the samples, which the prediction knows nothing of
    assert all(0.5 < cycle["amplitude_m"] / predicted < 2.0 for cycle in persisting)


def test_where_nothing_is_predicted_a_start_some_counts_off_is_simulated():
    document = document_of("limit-cycles", ONE_MASS, *ROUGH, "--stiffness", 500, "--damping", 1)
    assert document["limit_cycles"] == []
    assert document["otherwise"]["behaviour"] == "converged"
    assert document["otherwise"]["start_m"] == pytest.approx(1e-4)
    assert (
        "no limit"
        in run_command("limit-cycles", ONE_MASS, *ROUGH, "--stiffness", 500, "--damping", 1, "--no-simulation").out
    )


def test_a_linear_device_has_no_answer_and_hears_what_to_add(tmp_path):
    file = tmp_path / "cycles.csv"
    ran = run_command("limit-cycles", TWO_MASS, *WALL, "--json", "--output", file)
    assert ran.code == 1
    document = parse_strict_json(ran.out)
    assert document["limit_cycles"] is None
    for key in ("friction.coulomb_N", "loop.encoder.resolution_m", "loop.saturation.force_N"):
        assert key in document["reason"]
    assert not file.exists()
    assert "mechanism.drives.*.coulomb_Nm" in run_command("limit-cycles", MECHANISM, *WALL).err
    assert run_command("limit-cycles", MECHANISM, *WALL, *LIMITED, "--at", "5,5").code == 1


def test_a_simulation_that_vibrates_otherwise_is_said_to():
    """Far beyond the edge the slow vibration wins, which a sine that grows fastest does not show."""
    ran = run_command(
        "limit-cycles", TWO_MASS, *LIMITED, "--set", "loop.delay_samples=0.5", "--stiffness", 7000, "--damping", 10
    )
    assert "disagrees" in ran.out
    assert "disagrees" not in run_command("limit-cycles", TWO_MASS, *WALL, *LIMITED).out


def test_files(cycle_prediction, tmp_path):
    (document, table, plane), figure = cycle_prediction, tmp_path / "growth.svg"
    assert document["plane_file"] == str(plane)
    with table.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [float(row["amplitude_m"]) for row in rows] == [
        cycle["amplitude_m"] for cycle in document["limit_cycles"]
    ]
    assert [row["stable"] for row in rows] == ["false", "true"]
    document_of("limit-cycles", TWO_MASS, *WALL, *LIMITED, "--no-simulation", "--output", figure)
    assert "<svg" in figure.read_text()
    assert "<svg" in plane.read_text()


def test_the_keys_that_come_out_are_those_explained():
    document = document_of("limit-cycles", ONE_MASS, *ROUGH_AND_LIMITED)
    last = document["limit_cycles"][-1]
    assert {*document, *last, "plane_file"} - keys("What comes out") == keys("limit-cycles")
    assert all(f"`{key}`" in PAGE for key in (*last["simulated"], *document["growth"]))


def test_a_vibration_larger_than_the_handle_can_move_is_not_what_is_seen(tmp_path):
    words = (paddle(tmp_path), "--stiffness", 3000, "--damping", 1)
    document = document_of("limit-cycles", *words)
    edge, far = document["limit_cycles"]
    assert document["largest_motion_m"] == pytest.approx(LENGTH, rel=1e-3)
    assert (edge["within_range"], far["within_range"]) == (True, False)
    assert far["amplitude_m"] > LENGTH
    assert far["simulated"] is None
    assert document["otherwise"]["behaviour"] == "converged"
    out = " ".join(run_command("limit-cycles", *words, "--no-simulation").out.split())
    assert "is seen" not in out
    assert "moves 90.00 mm" in out
    assert "this range" in out


def test_a_given_plant_moves_a_metre_at_most():
    limited = ("--set", "loop.saturation.force_N=5000", "--stiffness", 2600, "--damping", 0, "--no-simulation")
    document = document_of("limit-cycles", ONE_MASS, *limited)
    assert document["largest_motion_m"] == 1.0
    assert [cycle["within_range"] for cycle in document["limit_cycles"]] == [False]
