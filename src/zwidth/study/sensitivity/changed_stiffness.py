"""The largest stiffness of a device with one number changed, by its exact chart: for many values at once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.chart import largest_stiffness
from zwidth.chart.chart_batch import STIFFEST, chart_numbers
from zwidth.chart.edge_by_eigenvalues import ChartError
from zwidth.chart.edge_memory import DOUBTFUL
from zwidth.device import address
from zwidth.device.design_batch import takes_arrays
from zwidth.device.device import Device
from zwidth.device.faults import DeviceError, KeyPath, dotted
from zwidth.device.load import from_document
from zwidth.loop.operating_point import OperatingPoint
from zwidth.study.designs.built_designs import build_at_point
from zwidth.study.designs.design_groups import DesignColumn, DesignGroup, DesignGrouping

Change = tuple[str, float]  # a number by its path, and the value that it gets


class ChangedStiffness:
    """Largest stiffnesses of a device at an operating point, with one number or another changed.

    places    the steps of each number that may be changed, by its path, and of those that move with it
    refusals  path -> why the device cannot be built, or not charted, with the value that was tried last
    """

    def __init__(self, device: Device, point: OperatingPoint, places: Mapping[str, tuple[KeyPath, ...]]) -> None:
        self.device, self.point, self.places = device, point, places
        self.refusals: dict[str, str] = {}
        document = {key: part for key, part in device.document.items() if key != "sources"}
        self._grouping = DesignGrouping(document, device.label, {})

    def stiffnesses(self, changes: Sequence[Change]) -> Floats:
        """Largest stiffness [N/m] with each change alone; 0 where no wall with K > 0, B >= 0 is stable, nan where
        there is no such device, or no chart of it. Of those that cannot be built together with others a number's
        are built in the order given, to either side of its own value up to the first that is none: to learn that
        a place is out of reach takes longest of all.
        """
        K = np.full(len(changes), np.nan)
        charted = np.zeros(len(changes), dtype=bool)
        together = [n for n, (path, _) in enumerate(changes) if all(map(takes_arrays, self.places[path]))]
        for built in build_at_point(self._groups([changes[n] for n in together]), self.point):
            if built.table is None:
                continue
            numbers = chart_numbers(built.table, STIFFEST)
            certain = numbers.status != DOUBTFUL
            rows = np.array(together, dtype=np.int64)[built.rows[certain]]
            K[rows] = np.nan_to_num(numbers.stiffness[certain])
            charted[rows] = True
        ended = set[tuple[str, bool]]()  # numbers, and to which side of the device's own value there is none left
        for n in np.flatnonzero(~charted).tolist():
            path, value = changes[n]
            side = path, value > self._own(path)
            if side not in ended:
                K[n] = self._alone(path, value)
                ended |= {side} if np.isnan(K[n]) else set()
        return K

    def _alone(self, path: str, value: float) -> float:
        document = self.device.document
        settings = [(dotted(steps, document), value) for steps in self.places[path]]
        try:
            changed = from_document(address.assign_all(document, settings), skip_assembly_check=True)
            peak = largest_stiffness(changed.at_point(self.point).loop)
        except DeviceError as error:
            self.refusals[path] = error.faults[0].message
        except (ValueError, ChartError, np.linalg.LinAlgError) as error:
            self.refusals[path] = str(error)
        else:
            return 0.0 if peak is None else peak.stiffness
        return np.nan

    def _groups(self, changes: Sequence[Change]) -> Iterator[DesignGroup]:
        return self._grouping.groups(list(self._columns(changes))) if changes else iter(())

    def _columns(self, changes: Sequence[Change]) -> Iterator[DesignColumn]:
        """Each number that is changed somewhere: as in the device but in the rows of its own changes."""
        document = self.device.document
        for path in dict.fromkeys(path for path, _ in changes):
            rows = [n for n, (other, _) in enumerate(changes) if other == path]
            at = np.zeros(len(changes), dtype=np.int64)
            at[rows] = np.arange(1, len(rows) + 1)
            own = self._own(path)
            for steps in self.places[path]:
                yield DesignColumn(dotted(steps, document), [own, *(changes[n][1] for n in rows)], at)

    def _own(self, path: str) -> float:
        """The number's value in the device; 0 where the file leaves it out."""
        document = self.device.document
        return float(address.get(document, path)) if address.exists(document, path) else 0.0
