"""Sensitivities by devices that are built together are those by devices built alone."""

from __future__ import annotations

import numpy as np
import pytest

from tests.systems import random_loop
from zwidth.chart import Tracer, largest_stiffness
from zwidth.device import from_document
from zwidth.device.load import load
from zwidth.errors import ChartError, NoAnswerError
from zwidth.loop import table_of_loops
from zwidth.study import optimum, sensitivities
from zwidth.study.sensitivity import changed_devices
from zwidth.study.sensitivity.changed_devices import ChangedDevices

FILTER = "loop.velocity.filter={type='butterworth', order=2, cutoff_Hz=20.0}"
# Bundled device, changes of it, and where it is asked: positions [m] or joint angles [rad].
DEVICES = {
    "linkage": ("five-bar", (), None),
    "linkage elsewhere": ("five-bar", (), (0.03, 0.24)),
    "linkage by its joints": ("five-bar", (), {"upper-right": 0.7, "upper-left": 2.4}),
    "a whole sample late": ("five-bar", ("loop.delay_samples=1",), None),
    "filtered": ("five-bar", (FILTER,), None),
    "masses": ("published-two-mass", (), None),
    "half a sample late": ("published-two-mass", ("loop.delay_s=0.000625",), None),
    "an edge at B = 0": ("hapkit-course", (FILTER,), None),
}


def asked(kind):
    name, settings, where = DEVICES[kind]
    device = load(name, settings)
    return sensitivities(device, device.at() if where is None else device.at(where))


@pytest.mark.parametrize("kind", DEVICES)
def test_devices_built_together_say_the_same_as_each_alone(kind, monkeypatch):
    together = asked(kind)
    monkeypatch.setattr(ChangedDevices, "_build", lambda self, trial: None)
    alone = asked(kind)
    assert together.peak == alone.peak
    others = {number.path: number for number in alone.numbers}
    assert len(others) == len(together.numbers)
    for number in together.numbers:
        other = others[number.path]
        assert (number.side, number.reason) == (other.side, other.reason)
        assert number.logarithmic == pytest.approx(other.logarithmic, abs=1e-9, nan_ok=True)
        if number.value == 0.0:
            K = together.peak.stiffness
            assert number.derivative == pytest.approx(other.derivative, abs=1e-8 * K, nan_ok=True)
    for group, other in zip(together.groups, alone.groups, strict=True):
        assert (group.path, group.members) == (other.path, other.members)
        assert group.logarithmic == pytest.approx(other.logarithmic, abs=1e-8, nan_ok=True)


def test_only_what_cannot_be_built_together_is_built_alone(monkeypatch):
    """Five-bar numbers but two: a base out of the plane, where the loop does not close; and a delay below 0."""
    built = []

    def counted(document, **options):
        built.append(document)
        return from_document(document, **options)

    monkeypatch.setattr(changed_devices, "from_document", counted)
    found = asked("linkage")
    assert {number.path for number in found.numbers if number.reason and not number.side} == {
        f"mechanism.links.{link}.origin_m.2" for link in ("upper-left", "upper-right")
    }
    origin = load("five-bar").document["mechanism"]["links"][0]["origin_m"]
    for document in built:
        bases = [link["origin_m"] for link in document["mechanism"]["links"] if "origin_m" in link]
        assert document["loop"].get("delay_samples", 0.0) < 0.0 or any(base[2] != origin[2] for base in bases)


def test_the_edge_of_many_loops_moves_as_that_of_each():
    """Loops of all kinds of optimum, read on the edges of each other."""
    rng, pairs = np.random.default_rng(4), []
    while len(pairs) < 30:
        loop = random_loop(rng, ratios=(0.05, 0.3, 1.0, 1.5))
        try:
            peak = largest_stiffness(loop)
            pairs += [] if peak is None else [(loop, optimum(loop, peak))]
        except (ChartError, NoAnswerError):
            continue
    loops = [loop for loop, _ in pairs]
    table = table_of_loops(*loops)
    first = table_of_loops(*loops[:5])
    for n, (_, stiffest) in enumerate(pairs):
        together = stiffest.stiffnesses_to_first_order(table)
        assert together[n] == pytest.approx(stiffest.peak.stiffness, rel=1e-9)
        np.testing.assert_array_equal(together[:5], stiffest.stiffnesses_to_first_order(first))
    smooth = next(stiffest for _, stiffest in pairs if stiffest.kind == "smooth maximum")
    by_curve = [Tracer(loop).wall(smooth.peak.angles[0])[0] for loop in loops]
    np.testing.assert_allclose(smooth.stiffnesses_to_first_order(table), by_curve, rtol=1e-12)
    table.section_count[3] = 0
    assert np.flatnonzero(np.isnan(smooth.stiffnesses_to_first_order(table))).tolist() == [3]
