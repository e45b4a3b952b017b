"""Many designs of one device together: numbers of its file as arrays, from the file's keys to operating points.

What takes arrays is listed (`ARRAYS`). Other keys, and a number that is 0 or infinite in some designs, may change
what a device consists of: designs that differ there are built apart. All designs are checked at once
(`rules.table`); one that is not certain to be valid is built alone, and there gets its reason.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Final, cast

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Flags, Floats
from zwidth.device.address import members, table
from zwidth.device.device import Device
from zwidth.device.faults import KeyPath
from zwidth.device.load import build_device, check
from zwidth.device.mechanism_check import masses_moved
from zwidth.device.rules.table import certainly_valid
from zwidth.device.schema.value_types import Section
from zwidth.errors import DeviceError, PostureError
from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.posed_device import PROJECTION_TOLERANCE
from zwidth.model.design_axes import at_index, change_designs, change_fields, design_shape, differing_fields
from zwidth.model.mechanism import Mechanism
from zwidth.model.posture import UNSOLVED, Posture, join_postures, solve_posture
from zwidth.model.reduction import Model

_DRIVE: Final = [
    "motor_inertia_kg_m2",
    "transmission_ratio",
    "stiffness_Nm_per_rad",
    "damping_Nms_per_rad",
    "torque_constant_Nm_per_A",
    "winding_resistance_ohm",
    "winding_inductance_H",
    "damping_resistance_ohm",
    "torque_limit_Nm",
    "continuous_torque_Nm",
    "encoder_counts_per_rev",
    "encoder_noise_rad",
]
_LINK: Final = ["origin_m", "orientation_rad", "axis", "length_m", "mass_kg", "center_of_mass_m", "inertia_kg_m2"]
_OWNERS: Final[tuple[KeyPath, ...]] = (("mechanism",), ("mechanism", "legs", "*"))
_FILTER: Final = ("time_constant_s", "cutoff_Hz")
_FEEDFORWARD: Final = ("inertia_kg", "inertia_share", "damping_Ns_per_m", "coulomb_N", "deadband_m_per_s")
_PLANT: Final = ["mass_kg", "damping_Ns_per_m", "stiffness_N_per_m", "actuator", "sensor", "handle"]
_OPERATOR: Final = [
    "arm_mass_kg",
    "arm_stiffness_N_per_m",
    "arm_damping_Ns_per_m",
    "grasp_stiffness_N_per_m",
    "grasp_damping_Ns_per_m",
]
ARRAYS: Final[tuple[KeyPath, ...]] = (
    *((*owner, "links", "*", key) for owner in _OWNERS for key in _LINK),
    *((*owner, "drives", "*", key) for owner in _OWNERS for key in _DRIVE),
    *((*owner, "drives", "*", "ratio_table", "ratio") for owner in _OWNERS),
    *((*owner, "loops", "*", "points_m") for owner in _OWNERS),
    ("mechanism", "handle", "point_m"),
    ("mechanism", "assemblies", "*", "joints_rad"),
    ("mechanism", "reference", "position_m"),
    *(
        ("mechanism", "damping", key)
        for key in ("mode_ratio", "mass_coefficient_1_per_s", "stiffness_coefficient_s")
    ),
    *(("loop", key) for key in ("sampling_period_s", "delay_samples", "delay_s")),
    *(("loop", path, "filter", key) for path in ("velocity", "force", "force_sensor") for key in _FILTER),
    *(("loop", "force_sensor", key) for key in ("gain", "mass_beyond_kg")),
    *(("loop", "feedforward", key) for key in _FEEDFORWARD),
    *(("loop", "feedforward", "acceleration_filter", key) for key in _FILTER),
    *(("loop", path, "velocity", "filter", key) for path in ("feedforward", "local") for key in _FILTER),
    *(("loop", "local", key) for key in ("stiffness_N_per_m", "damping_Ns_per_m")),
    ("loop", "actuator", "time_constant_s"),
    *(("plant", key) for key in _PLANT),
    *(("operator", key) for key in _OPERATOR),
)
"""Keys, with * for an element, whose numbers (or the numbers in whose lists) may be arrays over designs."""


@cache
def takes_arrays(steps: KeyPath) -> bool:
    """Whether the number, or the list of numbers, at a resolved path may be an array over designs."""
    return any(
        len(steps) >= len(pattern)
        and all(pattern_step in ("*", step) for pattern_step, step in zip(pattern, steps, strict=False))
        for pattern in ARRAYS
    )


_PARTS: Final = ("mechanism", "given_plant", "controller", "damping", "operator")  # of a device, that hold numbers


@dataclass(frozen=True)
class DesignBatch:
    """P designs that consist of the same parts.

    device  one of them, of which everything but the numbers that differ is taken
    parts   the device with all numbers, arrays (P, ...) where they differ
    count   P
    """

    device: Device
    parts: Device
    count: int

    @property
    def differs(self) -> bool:
        """Whether the designs differ in any number."""
        return bool(differing_fields(self.parts, _PARTS))

    def __getitem__(self, piece: slice) -> DesignBatch:
        """The batch of some of the designs, those of a slice."""
        count = len(range(*piece.indices(self.count)))
        if count == self.count:
            return self
        parts = change_fields(self.parts, _PARTS, at_index(piece), (self.count,))
        return DesignBatch(self.device, replace(self.parts, **parts), count)

    def at(
        self,
        position: Floats | None = None,
        direction: Any = None,
        assembly: str | None = None,
        model: str | None = None,
    ) -> tuple[OperatingPoint, Flags]:
        """The designs with their handles at a position each, or all over a workspace.

        position   (P, 2) or (P, 3), or (..., 2) or (..., 3) of a workspace that has two axes or more; None: the
                   reference of each design
        direction, assembly, model  as for `Device.at`
        Returns    OperatingPoint of shape (P,) or (P, ...), without P where nothing differs; and marks (P,) of the
                   designs to be asked for alone: there may be a way round to the position, or a reason why not.
                   A position that is certain to be out of reach is marked in `status` alone
        Raises     what `Device.at` raises, of what is the same for all designs
        """
        parts, none = self.parts, np.zeros(self.count, dtype=bool)
        # axes of the positions: none, that of the designs, or those of a workspace
        axes = 0 if position is None else np.ndim(position) - 1
        if self.device.mechanism is None or not (design_shape(parts.mechanism) or axes == 1):
            point = self.device.at(position, direction, assembly=assembly, model=model)
            if point.posture is not None and not masses_moved(point.posture).all():
                return point, ~none
            return self._with_parts(point, len(point.shape)), none
        if axes > 1:
            return self._over_workspace(np.asarray(position), direction, assembly, model)
        mechanism = cast(Mechanism, parts.mechanism)
        with self.device.solving(assembly) as name:
            goals = mechanism.reference_position if position is None else self.device.position(position)
            posture = solve_posture(
                mechanism,
                np.broadcast_to(goals, (self.count, 3)),
                name,
                tolerance=PROJECTION_TOLERANCE,
                straight=True,
            )
        alone = (posture.status == UNSOLVED) | ~masses_moved(posture)
        return self._with_posture(posture, direction, model), alone

    def at_point(self, point: OperatingPoint) -> tuple[OperatingPoint, Flags]:
        """The designs at the operating point of a single device, as `Device.at_point` puts each of them; see `at`.

        point   one posture that is given by the handle's position, and one direction; or a plant
        """
        if point.posture is None:
            return self.at(model=point.model)
        where = cast("Floats | None", point.requested_position)
        return self.at(where, point.direction, point.posture.assembly, point.model)

    def _over_workspace(
        self, position: Floats, direction: Any, assembly: str | None, model: str | None
    ) -> tuple[OperatingPoint, Flags]:
        """The operating points of all designs over positions, the postures of each design found by themselves; and
        marks (P,) of the designs that are to be computed alone."""
        mechanism, alone = cast(Mechanism, self.parts.mechanism), np.zeros(self.count, dtype=bool)
        postures: list[Posture | None] = []
        for design in range(self.count):
            one_design = change_designs(mechanism, at_index(design), (self.count,))
            try:
                with self.device.solving(assembly) as name:
                    postures.append(solve_posture(one_design, self.device.position(position), name))
            except (PostureError, DeviceError):
                postures.append(None)
                alone[design] = True
                continue
            alone[design] = not masses_moved(cast(Posture, postures[design])).all()
        # a design that is to be computed alone gets another's postures here, which nobody reads
        solved = next((one for one in postures if one is not None), None)
        if solved is None:
            return self.device.at(model=model), alone
        return self._with_posture(join_postures([one or solved for one in postures]), direction, model), alone

    def _with_posture(self, posture: Posture, direction: Any, model: str | None) -> OperatingPoint:
        """The operating points at postures (P, ...) of P designs, each with its own numbers."""
        shape = posture.status.shape
        vector = self.device.direction(direction)
        rendered = np.broadcast_to(vector, (*shape, vector.shape[-1]))
        point = OperatingPoint(
            controller=self.device.controller,
            mechanism=self.device.mechanism,
            posture=posture,
            directions=rendered[..., None, :],
            model=cast(Model, model or "full"),
            damping=self.device.damping,
            encoders=self.device.encoders,
            operator=self.device.operator,
            operator_name=self.device.operator_name,
            friction_known=self.device.friction_known,
            resolution_known=self.device.resolution_known,
            name=self.device.name,
        )
        return self._with_parts(point, len(shape) - 1)

    def _with_parts(self, point: OperatingPoint, axes: int) -> OperatingPoint:
        """A point with the numbers of all designs on a first axis.

        axes  how many axes of a workspace stand behind that of the designs
        """

        def beside(array: NDArray[Any]) -> NDArray[Any]:
            """Numbers (P, ...) with axes of length 1 in place of those of the workspace."""
            return array.reshape(self.count, *(1,) * axes, *array.shape[1:])

        parts = change_fields(self.parts, _PARTS, beside, (self.count,))
        posture, directions = point.posture, point.directions
        if posture is None or directions is None or posture.status.ndim > axes:
            return replace(point, **parts)  # a posture, if there is one, has the axis of the designs already
        if not any(design_shape(part) for part in parts.values()):
            return point
        shape = (self.count, *point.shape)
        spread = np.broadcast_to(directions, (*shape, *directions.shape[-2:]))
        return replace(point, posture=posture.broadcast_to(shape), directions=spread, **parts)


def design_batch(
    document: dict[str, Any], columns: Mapping[KeyPath, Floats], count: int, label: str
) -> tuple[DesignBatch, Flags]:
    """Designs built together, and marks (P,) of those that are certain to be valid; the rest is to be built alone.

    document  of one of the designs, a valid one
    columns   resolved path -> numbers (P, ...) of all designs, for paths that take arrays
    Raises    DeviceError  where the document is not valid
    """
    checked, cleaned = check(document, label)
    leaves = dict(leaf for steps, numbers in columns.items() for leaf in _leaves(steps, numbers))
    valid = certainly_valid(document, leaves, count)
    if _must_be_built_alone(document):
        valid = np.zeros(count, dtype=np.bool_)
    with_arrays: Any = checked
    for steps, numbers in columns.items():
        # what is not valid stays out of the arithmetic, too
        first_valid = int(np.argmax(valid))
        used = np.where(valid.reshape(-1, *(1,) * (numbers.ndim - 1)), numbers, numbers[first_valid])
        with_arrays = _with_numbers(with_arrays, document, steps, used)
    device = build_device(checked, cleaned, label)
    surplus = device.mechanism.drives.surplus if device.mechanism is not None else ()
    parts = build_device(with_arrays, cleaned, label, surplus) if valid.any() else device
    return DesignBatch(device, parts, count), valid


def _must_be_built_alone(document: dict[str, Any]) -> bool:
    """Whether each design of a document has a balance, an arm or beams of its own, which are computed one by
    one."""
    bends = any("beam" in member.entry for member in members(table(document, "mechanism"), "links"))
    return bends or bool({"load", "arm"} & document.keys())


def _leaves(steps: KeyPath, numbers: Floats) -> Iterator[tuple[KeyPath, Floats]]:
    """Path and numbers (P,) of each single number in an array (P, ...) of designs that stands at a path."""
    if numbers.ndim == 1:
        yield steps, numbers
        return
    for i in range(numbers.shape[1]):
        yield from _leaves((*steps, i), numbers[:, i])


def _with_numbers(value: Any, raw: Any, steps: KeyPath, numbers: Floats) -> Any:
    """A copy of a checked value with arrays over designs in place of the numbers at a path below it.

    value    a section, table, tuple or number as it was checked
    raw      what the document holds there: of a matrix that is written as one number or three moments `value` is
             the whole matrix, and `raw` tells what the numbers stand for
    steps    path below the value;   numbers  (P, ...)
    """
    if isinstance(value, Section):
        key = cast(str, steps[0])
        inner = _with_numbers(getattr(value, key), raw[key], steps[1:], numbers)
        return value.model_copy(update={key: inner})
    if isinstance(value, dict):
        return {**value, steps[0]: _with_numbers(value[steps[0]], raw[steps[0]], steps[1:], numbers)}
    if steps:
        i = cast(int, steps[0])
        # one of three moments stands on the diagonal of a matrix
        place = (i, i) if isinstance(value[0], tuple) and not isinstance(raw[0], list) else (i,)
        if len(place) == 2:
            return tuple(
                tuple(numbers if (r, c) == place else cell for c, cell in enumerate(row))
                for r, row in enumerate(value)
            )
        inner = _with_numbers(value[i], raw[i], steps[1:], numbers)
        return (*value[:i], inner, *value[i + 1 :])
    if isinstance(value, tuple) and not isinstance(raw, list):  # one number that stands for a matrix or a vector
        return ((numbers,),) if isinstance(value[0], tuple) else (numbers,)
    if isinstance(value, tuple) and isinstance(value[0], tuple) and numbers.ndim == 2:  # three moments
        return tuple(tuple(numbers[:, r] if r == c else 0.0 for c in range(3)) for r in range(3))
    return _nested_arrays(numbers)


def _nested_arrays(numbers: Floats) -> Any:
    """Numbers (P, ...) as nested tuples of arrays (P,)."""
    return numbers if numbers.ndim == 1 else tuple(_nested_arrays(numbers[:, i]) for i in range(numbers.shape[1]))
