"""A map's document and table: the keys and columns that are printed, from its dataset alone."""

from __future__ import annotations

import numpy as np
import pytest

from tests.cli.command_runner import document_of, run_command
from zwidth.device.load import load
from zwidth.errors import NoValueError
from zwidth.measures import Measure
from zwidth.show import csv_text, json_value
from zwidth.study import (
    common_area,
    map_document,
    map_job,
    map_table,
    parse_requirement,
    plane_of,
    why_no_cell,
    workspace_map,
)
from zwidth.study.workspace.map import measures_of

DEVICE = "five-bar"
COUNTS = (7, 5)
WORDS = (
    "map",
    DEVICE,
    "--measure",
    "stiffness",
    "--direction",
    "worst",
    "--require",
    "isotropy<=2",
    "--cells",
    "7,5",
)


@pytest.fixture(scope="module")
def device():
    return load(DEVICE)


@pytest.fixture(scope="module")
def map_dataset(device):
    return workspace_map(device, ["stiffness", "isotropy"], plane_of(device, cells=COUNTS), "worst", workers=1)


@pytest.fixture(scope="module")
def area(map_dataset):
    return common_area(map_dataset, [parse_requirement("isotropy<=2")])


def test_the_document_is_what_the_command_prints(device, map_dataset, area):
    printed = document_of(*WORDS)
    document = json_value(map_document(map_dataset, device, area))
    assert document == {key: printed[key] for key in document}
    assert set(printed) - set(document) == {
        "name",
        "device",
        "projected_m",
        "direction",
        "assembly",
        "model",
        "operator",
        "sampling_period_s",
        "delay_samples",
        "left_out",
    }


def test_without_a_device_what_needs_its_postures_is_left_out(device, map_dataset):
    with_it, without = map_document(map_dataset, device), map_document(map_dataset)
    missing = with_it["measures"]["isotropy"]["overall"].keys() - without["measures"]["isotropy"]["overall"].keys()
    assert missing == {"isotropy_index"}


def test_the_table_is_what_the_command_writes(map_dataset, tmp_path):
    assert run_command(*WORDS, "--output", tmp_path / "map.csv").code == 0
    assert csv_text(map_table(map_dataset)) == (tmp_path / "map.csv").read_text()


def test_one_measure_needs_no_list(device):
    plane = plane_of(device, cells=COUNTS)
    one = workspace_map(device, "isotropy", plane, workers=1)
    assert one.equals(workspace_map(device, ["isotropy"], plane, workers=1))
    assert measures_of(one) == ["isotropy"]
    assert "measures" not in map_document(one)
    own = Measure("half", "Half", "", None, "", lambda point: np.full(point.shape, 0.5), along=False)
    assert float(workspace_map(device, own, plane, workers=1)["half"].max()) == 0.5


def test_a_folder_keeps_a_map(device, tmp_path):
    plane, seen = plane_of(device, cells=COUNTS), []
    first = workspace_map(device, "isotropy", plane, store=str(tmp_path / "cells"), workers=1)
    again = workspace_map(
        device,
        "isotropy",
        plane,
        store=tmp_path / "cells",
        progress=lambda *now: seen.append(now),
        workers=1,
    )
    assert again.equals(first)
    assert seen == [("mapping", 35, 35)], "nothing is computed again"


def test_why_no_cell_has_a_value(device, map_dataset):
    assert why_no_cell(map_dataset) is None

    def refuses(point):
        raise NoValueError("never here")

    never = Measure("never", "Never", "", None, "", refuses, each=True)
    none = workspace_map(device, never, plane_of(device, cells=(3, 3)), workers=1)
    told = why_no_cell(none)
    assert told is not None
    assert told.startswith("no cell ")
    assert "never here" in told


def test_what_they_show_of_themselves_is_short(device, area):
    common = area.common
    assert repr(area).startswith(f"CommonArea: {common.area:.4g} m², {100 * common.share:.4g} % ")
    assert repr(area).endswith("with isotropy<=2")
    assert repr(common).startswith(f"PlaneArea: {common.area:.4g} m², {100 * common.share:.4g} % ")
    job = map_job(device, ["stiffness", "isotropy"], plane_of(device, cells=COUNTS))
    assert repr(job).startswith("MapJob: stiffness, ")


def test_areas_as_attributes_are_text_and_numbers(area):
    attributes = area.attributes()
    assert attributes["requirements"] == "isotropy<=2"
    assert attributes["required_area_m2"] == [area.regions[0].area]
    assert attributes["common_share"] == area.document()["common_share"]
