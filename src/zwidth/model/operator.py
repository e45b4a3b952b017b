"""The operator's hand and arm at the handle: thesis 3.3, and what others have used instead."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from zwidth.arrays import Floats
from zwidth.errors import OperatorError
from zwidth.model.argument_checks import check_choice, check_kind, check_number
from zwidth.model.design_axes import Number, stack_numbers
from zwidth.model.plant import Plant

ABOUT_AN_AXIS: Final = (
    "is a hand in N/m, N s/m and kg, which holds the handle along a direction; about an axis it would have to be "
    'in N m/rad, N m s/rad and kg m², which an operator cannot be given in. Name "none" as the '
    "operator, or render a direction"
)


@dataclass(frozen=True)
class Operator:
    """Arm and grasp as five numbers (thesis eq. 3.23-3.24): a mass, tied to the ground by the arm and to the
    handle by the grasp, all along the rendered direction.

        m_a x_a'' = -k_a x_a - b_a x_a' - k_g (x_a - x_h) - b_g (x_a' - x_h')

    arm_mass, arm_stiffness, arm_damping  m_a [kg], k_a [N/m], b_a [N s/m], not negative
    grasp_stiffness, grasp_damping        k_g [N/m], b_g [N s/m]; None: the grasp is rigid, and mass, spring and
                                          damper act on the handle itself (Hulin, Preusche and Hirzinger 2006)
    directions  "rendered": along the rendered direction alone; "all": the same in every direction in which the
                handle of a mechanism's full model moves, each by itself
    """

    arm_mass: Number
    arm_stiffness: Number
    arm_damping: Number
    grasp_stiffness: Number | None = None
    grasp_damping: Number | None = None
    directions: Literal["rendered", "all"] = "rendered"

    def __post_init__(self) -> None:
        """Raise ValueError for other directions than rendered or all, or a number out of range."""
        check_choice("directions", self.directions, ("rendered", "all"))
        units = {"mass": "kg", "stiffness": "N/m", "damping": "N s/m"}
        for part, unit in units.items():
            check_number(f"arm_{part}", getattr(self, f"arm_{part}"), unit, least=0.0)
        for part in ("stiffness", "damping"):
            value = getattr(self, f"grasp_{part}")
            if value is not None:
                check_number(f"grasp_{part}", value, units[part], least=0.0)

    @property
    def rigid_grasp(self) -> bool:
        """Whether the arm is rigidly attached to the handle."""
        return self.grasp_stiffness is None


def attach(plant: Plant, operator: Operator, across: Floats | None = None) -> Plant:
    """The plant with an operator at its handle.

    across   (k, n)  other motions of the handle by which he holds it in the same way; None: none
    Returns  Plant; an elastic grasp adds the arm as the last coordinate, and one more for each of `across`, a
             rigid one adds none
    Raises   OperatorError  for a plant without a handle, or an elastic grasp of an arm without mass

    >>> one = np.ones(1)
    >>> paddle = Plant(np.array([[0.03]]), np.zeros((1, 1)), np.zeros((1, 1)), one, one, one)
    >>> float(attach(paddle, Operator(0.5, 500.0, 10.0)).mass[0, 0])
    0.53
    """
    check_kind("plant", plant, Plant)
    check_kind("operator", operator, Operator)
    held = _held(plant, operator)
    for motion in () if across is None else across:
        # arms that were added before do not move along it
        row = np.append(motion, np.zeros(held.size - plant.size))
        beside = _held(replace(held, handle=row), operator)
        # what a force sensor at the handle reads is the force along the rendered direction
        handle, hand_force = [
            np.append(part, np.zeros((*part.shape[:-1], beside.size - held.size)), axis=-1)
            for part in _handle_and_hand_force(held)
        ]
        held = replace(beside, handle=handle, hand_force=hand_force)
    return held


def _handle_and_hand_force(plant: Plant) -> tuple[Floats, Floats]:
    """The plant's `handle` (n,) and `hand_force` (3, n), both of which a plant that is held has."""
    assert plant.handle is not None
    assert plant.hand_force is not None
    return plant.handle, plant.hand_force


def _held(plant: Plant, operator: Operator) -> Plant:
    """The plant with an operator who holds it along one motion, `plant.handle`; arguments, errors of `attach`."""
    h = plant.handle
    if h is None:
        raise OperatorError("an operator needs a handle to hold; give the plant's `handle`, or leave him out")
    if operator.grasp_stiffness is None:
        along_handle = np.outer(h, h)
        return replace(
            plant,
            mass=plant.mass + operator.arm_mass * along_handle,
            damping=plant.damping + operator.arm_damping * along_handle,
            stiffness=plant.stiffness + operator.arm_stiffness * along_handle,
            hand_force=_hand_force(plant, -h, (operator.arm_mass, operator.arm_damping, operator.arm_stiffness)),
        )
    if not operator.arm_mass > 0.0:
        raise OperatorError(f"an arm held by an elastic grasp needs a mass, got {operator.arm_mass:g} kg")
    arm, slip = np.append(np.zeros(plant.size), 1.0), np.append(h, -1.0)

    grown = plant.padded(("arm",))
    grasp_damping = operator.grasp_damping or 0.0
    return replace(
        grown,
        mass=grown.mass + operator.arm_mass * np.outer(arm, arm),
        damping=grown.damping + operator.arm_damping * np.outer(arm, arm) + grasp_damping * np.outer(slip, slip),
        stiffness=grown.stiffness
        + operator.arm_stiffness * np.outer(arm, arm)
        + operator.grasp_stiffness * np.outer(slip, slip),
        hand_force=_hand_force(plant, -slip, (0.0, grasp_damping, operator.grasp_stiffness)),
    )


def _hand_force(plant: Plant, along: Floats, impedance: tuple[Number, Number, Number]) -> Floats:
    """`Plant.hand_force` (..., 3, n), with the forces of another mass, damper and spring along a motion (..., n).

    impedance  that mass [kg], damper [N s/m] and spring [N/m]
    """
    rows = stack_numbers(impedance)[..., None] * along[..., None, :]
    if plant.hand_force is None:
        return np.asarray(rows)
    grown = along.shape[-1] - plant.hand_force.shape[-1]
    return np.asarray(rows + np.pad(plant.hand_force, [(0, 0)] * (plant.hand_force.ndim - 1) + [(0, grown)]))
