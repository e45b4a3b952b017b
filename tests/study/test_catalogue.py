"""Axes that choose parts from a catalogue."""

import numpy as np
import pytest

from tests.study.study_cases import study_document
from zwidth.device.load import load
from zwidth.errors import DeviceError
from zwidth.study import run_study, study_of

MOTORS = """name,inertia_kg_m2,torque_Nm,price
small,6e-7,0.02,40
"large, geared",1.2e-6,0.06,90
"""
RIGHT, LEFT = (f"drives.motor-{side}.motor_inertia_kg_m2" for side in ("right", "left"))


def document_with(folder, text=MOTORS, **changes):
    (folder / "motors.csv").write_text(text)
    axis = {"key": "motor", "catalogue": "motors.csv", "set": {RIGHT: "inertia_kg_m2", LEFT: "inertia_kg_m2"}}
    return study_document({**axis, **changes}, measures=["motor_side_mass", "stiffness_max"])


def told(folder, *arguments, **changes):
    with pytest.raises(DeviceError) as caught:
        study_of(document_with(folder, *arguments, **changes), str(folder / "my.toml"))
    return [f"{fault.key}: {fault.message}" for fault in caught.value.faults]


def test_a_design_has_the_numbers_of_the_part_that_it_chooses(tmp_path):
    swept = run_study(study_of(document_with(tmp_path), str(tmp_path / "my.toml")))
    assert swept.design(1) == {"motor": "large, geared", RIGHT: 1.2e-6, LEFT: 1.2e-6}
    for row, inertia in zip(swept.cells.values, (6e-7, 1.2e-6), strict=True):
        point = load("five-bar", {RIGHT: inertia, LEFT: inertia}).at()
        assert row.tolist() == [float(point.measure(name)) for name in ("motor_side_mass", "stiffness_max")]
    dataset = swept.dataset()
    assert dataset["motor"].values.tolist() == ["small", "large, geared"]
    assert dataset[RIGHT].values.tolist() == [6e-7, 1.2e-6]
    assert np.isfinite(dataset["stiffness_max"].values).all()


def test_each_fault_of_a_catalogue_has_its_line(tmp_path):
    has = "it has 'name', 'inertia_kg_m2', 'torque_Nm', 'price'"
    cases = [
        ({"set": {RIGHT: "inertia"}}, f"axis.0.catalogue: motors.csv: has no column 'inertia'; {has}"),
        ({"catalogue": "none.csv"}, "axis.0.catalogue: none.csv: no such file"),
        ({"set": {}}, "axis.0: has a catalogue and no set"),
        ({"set": {"drives.x.y": "price"}}, "axis.0.set.drives.x.y: 'drives.x.y' "),
        ({"values": [1]}, "axis.0.values: does not go with a catalogue"),
        ({"key": "operator"}, "axis.0.key: 'operator' is a circumstance"),
    ]
    for changes, line in cases:
        assert any(one.startswith(line) for one in told(tmp_path, **changes)), (told(tmp_path, **changes), line)
    texts = [
        ("", "is empty"),
        ("name,inertia_kg_m2\n", "holds no part"),
        ("name;inertia_kg_m2\na;1\n", "separates its columns by ';'"),
        (MOTORS.replace("6e-7", "6e-7 kg"), "part 'small': inertia_kg_m2 must be a number, got '6e-7 kg'"),
        (MOTORS.replace("small,", ","), "part 1 has no name"),
        (MOTORS + "small,1,1,1\n", "part 3 is called 'small', as one before it"),
        (MOTORS + "huge,1,1\n", "part 3 has 3 cells, the line of headings 4"),
        (MOTORS.replace("price", "name"), "has several columns 'name'"),
    ]
    for text, line in texts:
        (one,) = told(tmp_path, text)
        assert one.startswith(f"axis.0.catalogue: motors.csv: {line}"), (one, line)


def test_a_number_is_set_by_one_axis_alone(tmp_path):
    document = document_with(tmp_path)
    document["axis"].append({"key": RIGHT, "values": [1e-7]})
    with pytest.raises(DeviceError, match=r"axis 'motor'"):
        study_of(document, str(tmp_path / "my.toml"))
