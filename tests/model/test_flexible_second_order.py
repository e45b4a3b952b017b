"""Second derivatives of mechanisms whose links bend, in trees and loops, against nonlinear chains."""

from __future__ import annotations

import numpy as np
import pytest

from tests.model.beam_devices import light_five_bar, slides, spatial_arm
from tests.model.bent_chains import Chain, with_elements
from zwidth.device import from_document
from zwidth.model import Motions, pack


def of_beams_alone(document):
    """The device without what its beams carry, whose places need not be at whole steps of a rod."""
    for each in document["mechanism"]["links"]:
        for key in ("mass_kg", "center_of_mass_m", "inertia_kg_m2") if "beam" in each else ():
            each.pop(key, None)
    return document


def arm():
    """The spatial arm with its second link carried at a whole step of the first beam."""
    document = of_beams_alone(spatial_arm())
    document["mechanism"]["links"][2]["origin_m"][0] = 0.165
    return document


CHAINS = {
    "spatial arm": arm,
    "slides": lambda: of_beams_alone(slides()),
    "five-bar, hinge": light_five_bar,
    "five-bar, point": lambda: light_five_bar("point"),
}


def chain_of(make):
    """The chain of a device, its joint coordinates, and some motion of joints and bending alike."""
    at = from_document(make()).at()
    mechanism, rng = with_elements(at.mechanism), np.random.default_rng(11)
    motions = Motions(pack(mechanism), at.posture.angles, mechanism.flexible)
    p = rng.normal(size=motions.count) / np.sqrt(1.0 + np.diag(motions.elastic_stiffness()))
    p[: motions.joint_count] *= 0.3
    return Chain(mechanism, motions), at.posture.angles, p


def differences(chain, angles, p, second=1.0):
    """First and second derivatives of the handle's place and axes and of the loops' gaps, to the 4th power of the
    step."""
    h = 2e-3 / np.max(np.abs(chain.motions.rates @ p))
    times = {s: [part.ravel() for part in chain.after(angles, p, s * h, second)] for s in (-2, -1, 0, 1, 2)}
    values = {s: np.concatenate(parts) for s, parts in times.items()}

    def over(step, order):
        up, down = values[step], values[-step]
        return (up - down) / (2.0 * step * h) if order == 1 else (up - 2.0 * values[0] + down) / (step * h) ** 2

    return [(4.0 * over(1, order) - over(2, order)) / 3.0 for order in (1, 2)], values[0][3:12].reshape(3, 3)


@pytest.mark.parametrize("name", CHAINS)
def test_the_handle_accelerates_as_the_chain(name):
    chain, angles, p = chain_of(CHAINS[name])
    (first, second), R = differences(chain, angles, p)
    own = chain.motions.handle
    place, spun = own.speed_2 @ p @ p, own.spin_2 @ p @ p
    assert first[:3] == pytest.approx(own.speed @ p, rel=2e-5)
    assert second[:3] == pytest.approx(place, rel=2e-4, abs=2e-4 * np.max(np.abs(place)))
    turned, turned_2 = (part[3:12].reshape(3, 3) @ R.T for part in (first, second))
    alpha = turned_2 - turned @ turned  # [alpha]x = R'' R^T + R' R'^T, and R' is skew
    found = np.array([alpha[2, 1] - alpha[1, 2], alpha[0, 2] - alpha[2, 0], alpha[1, 0] - alpha[0, 1]]) / 2.0
    assert found == pytest.approx(spun, rel=5e-4, abs=5e-4 * np.max(np.abs(spun)))


@pytest.mark.parametrize("name", ["five-bar, hinge", "five-bar, point"])
def test_loops_stay_closed_to_the_second_order(name):
    """Points and, of a hinge, axes; without the second derivatives of what hangs on them they part."""
    chain, angles, p = chain_of(CHAINS[name])
    (_, second), _ = differences(chain, angles, p)
    (_, parted), _ = differences(chain, angles, p, second=0.0)
    moved = np.max(np.abs(second[:3]))
    assert np.max(np.abs(second[12:])) < 1e-3 * moved
    assert np.max(np.abs(parted[12:])) > 0.2 * moved
