"""Linear answers on a device that is not linear: the same numbers as without, and a line on what is missing."""

from __future__ import annotations

import pytest

from tests.cli.command_runner import MECHANISM, ONE_MASS, TWO_MASS, document_of, run_command

FRICTION_AND_ENCODER = ("--set", "friction.coulomb_N=[0.0, 0.1]", "--set", "loop.encoder.resolution_m=1e-5")
LIMITED = (*FRICTION_AND_ENCODER, "--set", "loop.saturation.force_N=20")
LEFT_OUT_MESSAGE = "linear: leaves out dry friction, encoder steps, the force limit; `zwidth simulate` has them"
WORDS = ["dry friction", "encoder steps", "the force limit"]
COMMANDS = {
    "chart": (),
    "check": ("--stiffness", 4000, "--damping", 10),
    "felt": ("--stiffness", 4000, "--damping", 10),
    "show": (),
    "bounds": (),
    "guarantees": ("--model", "rigid"),
    "robust": ("--range", "loop.delay_samples=0,0.2", "--members", 3, "--unseen", 1),
    "sensitivity": (),
}


@pytest.mark.parametrize("command", COMMANDS)
def test_every_linear_answer_says_what_it_leaves_out_and_stays_what_it_was(command):
    options = COMMANDS[command]
    told = run_command(command, TWO_MASS, *options, *LIMITED)
    assert told.code == 0
    assert told.out.splitlines()[2] == LEFT_OUT_MESSAGE
    assert "leaves out" not in run_command(command, TWO_MASS, *options).out
    plain, document = document_of(command, TWO_MASS, *options), document_of(command, TWO_MASS, *options, *LIMITED)
    if command == "sensitivity":  # there the key lists numbers
        reasons = {entry["path"]: entry["reason"] for entry in document["left_out"]}
        assert reasons["friction.coulomb_N.1"] == "dry friction, which the chart leaves out: it is linear"
        assert "loop.saturation.force_N" in reasons
        same = {n["path"]: n for n in document["sensitivities"]}
        assert all(same[n["path"]] == n for n in plain["sensitivities"])
        assert same["loop.encoder.resolution_m"]["d_ln_stiffness_max_d_ln_value"] == 0.0
        return
    assert document["left_out"] == WORDS
    assert plain["left_out"] == []
    for key in plain.keys() - {"left_out", "bounds"}:
        assert document[key] == plain[key], key


def test_all_directions_of_a_mechanism_say_so_too():
    rubbing = ("--set", "drives.motor-left.coulomb_Nm=0.001", "--set", "drives.motor-left.torque_limit_Nm=0.2")
    told = run_command("polar", MECHANISM, "--count", 8, *rubbing).out
    assert "linear: leaves out dry friction, the force limit; `zwidth simulate` has them" in told
    assert "sampled every 1.25 ms" in told
    document = document_of("chart", MECHANISM, "--with-direction", "1,0", *rubbing)
    assert document["left_out"] == ["dry friction", "the force limit"]
    assert (
        document["stiffness_max_N_per_m"]
        == document_of("chart", MECHANISM, "--with-direction", "1,0")["stiffness_max_N_per_m"]
    )


def test_the_conditions_on_friction_and_steps_get_their_numbers():
    settings = ("--set", "friction.coulomb_N=0.002", "--set", "loop.encoder.resolution_m=1e-4")
    bounds = document_of("bounds", ONE_MASS, "--damping", 0, *settings)["bounds"]
    told = {bound["name"]: bound for bound in bounds if "coulomb_friction_N" in bound["taken"]}
    assert len(told) == 2
    for bound in told.values():
        assert bound["lacking"] == []
        assert bound["taken"]["coulomb_friction_N"] == 0.002
        assert bound["taken"]["resolution_m"] == 1e-4
        assert bound["stiffness_max_N_per_m"] == pytest.approx(40.0)  # 2 C/Delta
    still = document_of("bounds", ONE_MASS, "--damping", 0, *settings[:2])["bounds"]
    assert {tuple(b["lacking"]) for b in still if b["name"] in told} == {("resolution_m",)}
    # two drives: both motors' steps, weighed by how far they move the handle
    counts = [
        f"drives.motor-{side}.{key}"
        for side in ("left", "right")
        for key in ("coulomb_Nm=0.001", "encoder_counts_per_rev=2000")
    ]
    arm = document_of("bounds", MECHANISM, *(word for count in counts for word in ("--set", count)))["bounds"]
    (taken, *_) = [bound["taken"] for bound in arm if "resolution_m" in bound["taken"]]
    assert taken["resolution_m"] == pytest.approx(2 * 0.0908347672 * 2 * 3.14159265359 / (2000 * 18.6), rel=1e-8)
    assert taken["coulomb_friction_N"] == pytest.approx(18.6 * 0.002 * 0.5 / 0.0908347672, rel=1e-6)


def test_the_report_says_so_and_gives_the_conditions_their_numbers(tmp_path):
    file = tmp_path / "r.html"
    sentence = "All of this is linear and leaves out {}, which zwidth simulate includes."
    settings = ("--set", "friction.coulomb_N=0.002", "--set", "loop.encoder.resolution_m=1e-4")
    told = run_command("report", ONE_MASS, "--output", file, *settings)
    assert sentence.format("dry friction and encoder steps") in told.out
    assert sentence.format("dry friction and encoder steps") in file.read_text()
    assert "40" in file.read_text()
    document = document_of("report", ONE_MASS, "--output", file, *settings[:2])
    assert document["left_out"] == ["dry friction"]
    assert sentence.format("dry friction") in file.read_text()
    assert "leaves out" not in run_command("report", ONE_MASS, "--output", file).out
    assert "All of this is linear" not in file.read_text()
