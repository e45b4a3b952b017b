"""The devices that a page has opened: bundled ones, and files that it has sent, which lie in a folder."""

from __future__ import annotations

from collections import OrderedDict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from zwidth.device.device import Device
from zwidth.device.faults import fail
from zwidth.device.load import document_held_by, from_document
from zwidth.device.read import OPERATORS, bundled_names, parse_document, read
from zwidth.model.operator import Operator
from zwidth.show.app.request import State

if TYPE_CHECKING:
    from zwidth.loop.operating_point import OperatingPoint

MOST_KEPT: Final = 8  # devices kept as they were loaded


class OpenedDevices:
    """Devices by their names; files that the page sends lie in the working folder of this process, and no others
    are ever read.

    folder  an empty folder, the working folder of the computing process: a device file's label is then its bare
            name, and the files that it names lie beside it
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.texts: dict[str, str] = {}
        self._kept: OrderedDict[tuple[Any, ...], Device] = OrderedDict()

    def add(self, name: str, text: str) -> None:
        """Keep a file that the page has sent; it replaces one of the same name."""
        with open(self.folder / name, "w", encoding="utf-8") as file:
            file.write(text)
        self.texts[name] = text
        self._kept.clear()

    def document(self, state: State) -> dict[str, Any]:
        """The tables of a device as its file has them. Raises DeviceError."""
        if state.from_file:
            if state.device not in self.texts:
                raise fail(state.device, "", "has not been sent by the page; open the file once more")
            return parse_document(self.texts[state.device], state.device)
        if state.device not in bundled_names():
            raise fail(state.device, "", "is no bundled device; choose one of the list, or open a file")
        return read(state.device)[0]

    def device(self, state: State) -> Device:
        """The device of a state, its numbers changed and checked. Raises DeviceError with every fault."""
        key = (state.device, state.from_file, state.operator, state.hand)
        device = self._kept.get(key)
        if device is None:
            operator = self._operator(state)
            device = from_document(document_held_by(self.document(state), operator), state.device)
            self._kept[key] = device
            while len(self._kept) > MOST_KEPT:
                self._kept.popitem(last=False)
        else:
            self._kept.move_to_end(key)
        return device.with_(changes(state.settings)) if state.settings else device

    def point(self, state: State, device: Device | None = None) -> OperatingPoint:
        """The operating point of a state. Raises what `Device.at` raises."""
        device = device or self.device(state)
        if device.mechanism is None:
            return device.at(model=state.model)
        return device.at(
            state.position, state.direction, axis=state.axis, assembly=state.assembly, model=state.model
        )

    def _operator(self, state: State) -> Operator | str | None:
        """The state's operator: of its own numbers or bundled; "none": nobody, None: that of the device file."""
        if state.hand is not None:
            hand = state.hand
            # a rigid grasp, which has no stiffness, has no damping
            grasp = None if hand.grasp_stiffness is None else hand.grasp_damping
            return Operator(hand.arm_mass, hand.arm_stiffness, hand.arm_damping, hand.grasp_stiffness, grasp)
        name = state.operator
        if name is None or name == "none":
            return name
        if name not in bundled_names(OPERATORS):
            raise fail(name, "", "is no bundled operator; choose one of the list")
        return name


def changes(settings: dict[str, Any]) -> list[str | tuple[str, Any]]:
    """Settings as `address.apply` takes them; None removes a key."""
    return [f"{path}=unset" if value is None else (path, value) for path, value in settings.items()]
