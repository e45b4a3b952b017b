"""Modes of many postures at once are those of each posture's plant."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.model.model_cases import KINDS, some_postures
from zwidth.loop import Controller, Loop, rows_response, section_rows
from zwidth.model import MODELS, GivenDamping, ModalDamping, ProportionalDamping, reduce_mechanism, solve_posture
from zwidth.model.rendered_modes import rendered_modes

DAMPING = (ModalDamping(0.05), ModalDamping(1.4), ProportionalDamping(0.7, 2e-4), GivenDamping())


def responses(mechanism, posture, direction, model, damping, encoders="motor", delay=0.0):
    """The sampled plant's response at some points, of all postures by their rows and of each by its loop."""
    controller = Controller(0.0008, delay)
    modes = rendered_modes(mechanism, posture, direction, model, damping, encoders)
    rows, used = section_rows(modes.pairs, controller)
    z = 1.02 * np.exp(1j * np.linspace(0.05, 3.0, 7))
    together = np.array([rows_response(own[:n], delay > 0.0, z) for own, n in zip(rows, used, strict=True)])
    alone = []
    for k in range(len(posture.status)):
        one = solve_posture(mechanism, posture.position[k])
        plant = reduce_mechanism(mechanism, one, direction[k], model, damping, encoders)
        alone.append(rows_response(Loop(plant, controller).sections.rows, delay > 0.0, z))
    return together, np.array(alone)


@pytest.mark.parametrize("damping", DAMPING, ids=lambda damping: type(damping).__name__)
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("kind", KINDS)
def test_rows_of_many_postures_respond_like_each_posture_alone(kind, model, damping):
    rng = np.random.default_rng(3)
    mechanism = KINDS[kind](rng)
    posture = some_postures(mechanism, rng, 4)
    direction = np.einsum("kid,kd->ki", posture.jacobian, rng.normal(size=posture.jacobian[:, 0].shape))
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    delay = float(rng.choice([0.0, 0.4]))
    together, alone = responses(mechanism, posture, direction, model, damping, delay=delay)
    assert np.abs(together / alone - 1.0).max() < 1e-9


def test_encoders_on_the_links_and_a_rigid_drive():
    rng = np.random.default_rng(8)
    mechanism = KINDS["spatial arm"](rng) if "spatial arm" in KINDS else next(iter(KINDS.values()))(rng)
    stiffness = mechanism.drives.stiffness.copy()
    stiffness[0] = np.inf
    mechanism = replace(mechanism, drives=replace(mechanism.drives, stiffness=stiffness))
    posture = some_postures(mechanism, rng, 3)
    direction = posture.jacobian[:, :, -1] / np.linalg.norm(posture.jacobian[:, :, -1], axis=-1, keepdims=True)
    for encoders in ("motor", "link"):
        together, alone = responses(mechanism, posture, direction, "full", ModalDamping(0.05), encoders)
        assert np.abs(together / alone - 1.0).max() < 1e-9


def test_dampers_that_couple_the_modes_are_left_to_the_single_plant():
    rng = np.random.default_rng(1)
    mechanism = next(iter(KINDS.values()))(rng)
    uneven = np.linspace(1e-4, 5e-4, len(mechanism.drives.names))
    mechanism = replace(mechanism, drives=replace(mechanism.drives, damping=uneven))
    posture = some_postures(mechanism, rng, 2)
    direction = np.broadcast_to([1.0, 0.0, 0.0], (2, 3))
    coupled = rendered_modes(mechanism, posture, direction, "full", GivenDamping())
    assert np.isnan(coupled.input).all()
    assert section_rows(coupled.pairs, Controller(0.001))[1].tolist() == [0, 0]
    assert np.isfinite(rendered_modes(mechanism, posture, direction, "full", ModalDamping(0.1)).input).all()


def test_a_direction_without_motion_has_no_modes():
    rng = np.random.default_rng(1)
    mechanism = next(iter(KINDS.values()))(rng)
    posture = some_postures(mechanism, rng, 1)
    still = replace(posture, jacobian=np.zeros_like(posture.jacobian))
    modes = rendered_modes(mechanism, still, np.array([[1.0, 0.0, 0.0]]), "full", ModalDamping(0.05))
    assert np.isnan(modes.input).all()
    assert section_rows(modes.pairs, Controller(0.001))[1].tolist() == [0]
