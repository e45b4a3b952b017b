"""`zwidth map`: what it prints and writes, what it refuses, and where it has no answer."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy.io import loadmat

from tests.cli.command_runner import MECHANISM, TWO_MASS, document_of, refusal_lines, run_command
from zwidth.device.load import load
from zwidth.measures import MEASURES, STATUS
from zwidth.show.cli.options import EXTREMES
from zwidth.study.workspace import extreme_direction
from zwidth.unit_text import unit_text

FEW = ("--cells", "7,5")
DOCS = Path(__file__).parents[2] / "docs"


def test_values_stand_at_their_places():
    document = document_of("map", MECHANISM, "--measure", "rigid_mass", "--direction", "1,1", *FEW)
    assert (document["measure"], document["unit"]) == ("rigid_mass", "kg")
    assert (len(document["x_m"]), len(document["y_m"])) == (7, 5)
    values, status = np.array(document["values"], dtype=float), np.array(document["status"])
    assert values.shape == status.shape == (5, 7)
    assert set(status.ravel()) == {"ok", "out of reach"}
    assert (np.isnan(values) == (status != "ok")).all()
    device = load(MECHANISM)
    for i, j in ((1, 3), (2, 1), (3, 4)):
        place = device.at((document["x_m"][j], document["y_m"][i], 0.0), (1.0, 1.0))
        assert values[i, j] == pytest.approx(float(MEASURES["rigid_mass"].compute(place)), rel=1e-9)
    assert document["plane"] == "xy"
    assert "position_m" not in document
    assert "measures" not in document


def test_several_measures_are_under_their_names():
    document = document_of(
        "map", MECHANISM, "--measure", "rigid_mass", "--measure", "isotropy", "--direction", "lowest", *FEW
    )
    assert list(document["measures"]) == ["rigid_mass", "isotropy"]
    for key in ("values", "status", "unit", "overall", "directions"):
        assert document[key] == document["measures"]["rigid_mass"][key]
    assert document["direction"] == "lowest"
    assert "directions" not in document["measures"]["isotropy"]
    u = np.array(document["directions"], dtype=float)
    assert u.shape == (5, 7, 3)
    given = document_of("map", MECHANISM, "--measure", "rigid_mass", *FEW)
    low, one = (np.array(d["values"], dtype=float) for d in (document, given))
    assert (low[np.isfinite(low)] <= one[np.isfinite(one)] + 1e-12).all()
    assert 0.0 < document["measures"]["isotropy"]["overall"]["conditioning_index"] < 1.0
    assert document["overall"]["count"] == np.isfinite(low).sum()


def test_requirements_and_their_common_area():
    """The numbers of thesis Fig. 5.4; Fig. 5.4's own common area is not printed."""
    document = document_of(
        "map", MECHANISM, "--require", "rigid_mass_kg>=0.2", "--require", "isotropy<=1.3", "--cells", "41,21"
    )
    assert [r["requirement"] for r in document["requirements"]] == ["rigid_mass>=0.2", "isotropy<=1.3"]
    areas = [r["area_m2"] for r in document["requirements"]]
    assert 0.0 < document["common_area_m2"] < min(areas) < document["reachable_area_m2"] < 0.6 * 0.3
    assert document["common_share"] == pytest.approx(document["common_area_m2"] / document["reachable_area_m2"])
    assert set(document["measures"]) == {"rigid_mass", "isotropy"}


def test_a_share_of_directions_is_mapped_and_required():
    document = document_of(
        "map",
        MECHANISM,
        "--share",
        "rigid_mass>=0.2",
        "--require",
        "share_of_directions>=0.7",
        *FEW,
    )
    assert document["measure"] == "share_of_directions"
    values = np.array(document["values"], dtype=float)
    assert 0.4 < np.nanmin(values) < np.nanmax(values) <= 1.0
    assert 0.0 < document["common_share"] < 1.0


OWN = """
from zwidth import measure

@measure(unit="N", better="lower")
def inertial_force(place):
    if place.posture.position[0] > 0.0:
        raise RuntimeError("not on the right")
    return 10.0 * place.effective.rigid_mass

@measure()
def never(place):
    return None
"""


def test_a_measure_of_one_s_own(tmp_path):
    (tmp_path / "my.py").write_text(OWN)
    own = ("--measures-file", tmp_path / "my.py", "--measure")
    document = document_of("map", MECHANISM, *own, "inertial_force", "--measure", "rigid_mass", *FEW)
    force, mass = (np.array(document["measures"][n]["values"], dtype=float) for n in document["measures"])
    np.testing.assert_allclose(force[:, :4], 10.0 * mass[:, :4])
    assert np.isnan(force[:, 4:]).all()
    assert {"failed", "ok", "out of reach"} == {s for row in document["status"] for s in row}
    assert any("raised RuntimeError" in note for note in document["notes"])
    ran = run_command("map", MECHANISM, *own, "never", *FEW, "--json")
    assert ran.code == 1
    assert ran.document["reason"].startswith("no cell")
    assert "returned None" in ran.document["reason"]
    assert set(np.ravel(ran.document["values"])) == {None}


def test_no_stable_wall_anywhere_is_no_answer():
    unstable = ("--set", "loop.delay_samples=1", "--set", "mechanism.damping.mode_ratio=0")
    ran = run_command("map", MECHANISM, "--measure", "stiffness_max", "--cells", "3,2", *unstable, "--json")
    assert ran.code == 1
    assert "is stable" in ran.document["reason"]
    assert {s for row in ran.document["status"] for s in row} <= {"no value", "out of reach"}


def test_an_assembly_that_is_singular_throughout_is_no_answer():
    ran = run_command("map", MECHANISM, "--measure", "isotropy", "--assembly", "elbows-right", "--json")
    assert ran.code == 1
    assert "singular wherever" in ran.document["reason"]
    assert ran.document["values"] is None


def test_files(tmp_path):
    asked = ("map", MECHANISM, "--measure", "stiffness", "--direction", "worst", "--require", "isotropy<=2", *FEW)
    for ending in (".csv", ".json", ".nc", ".mat", ".svg"):
        assert run_command(*asked, "--output", tmp_path / f"m{ending}").code == 0
    document = document_of(*asked)
    values = np.array(document["values"], dtype=float)
    rows = list(csv.DictReader((tmp_path / "m.csv").read_text().splitlines()))
    assert len(rows) == 35
    assert list(rows[0]) == [
        "x_m",
        "y_m",
        "stiffness_N_per_m",
        "stiffness_status",
        "stiffness_direction_x",
        "stiffness_direction_y",
        "stiffness_direction_z",
        "isotropy",
        "isotropy_status",
    ]
    table = np.array([float(row["stiffness_N_per_m"] or "nan") for row in rows]).reshape(5, 7)
    np.testing.assert_array_equal(table, values)
    assert [float(row["x_m"]) for row in rows[:7]] == document["x_m"]
    with xr.open_dataset(tmp_path / "m.nc", engine="scipy") as read:
        np.testing.assert_array_equal(read.stiffness, values)
        assert read.attrs["common_area_m2"] == document["common_area_m2"]
        assert read.attrs["requirements"] == "isotropy<=2"
        named = dict(
            zip(read.stiffness_status.flag_values, read.stiffness_status.flag_meanings.split(), strict=True)
        )
        assert named == {k: text.replace(" ", "_") for k, text in STATUS.items()}
    np.testing.assert_array_equal(loadmat(tmp_path / "m.mat")["stiffness"], values)
    assert "<svg" in (tmp_path / "m.svg").read_text()


def test_another_plane_has_the_base_frame_s_coordinates_in_its_table(tmp_path):
    turned = ("--plane", "1,1,0,-1,1,0", "--x", "0.1,0.2", "--y", "0.1,0.2", "--cells", "2,2")
    assert (
        run_command("map", MECHANISM, "--measure", "isotropy", *turned, "--output", tmp_path / "m.csv").code == 0
    )
    rows = list(csv.DictReader((tmp_path / "m.csv").read_text().splitlines()))
    assert float(rows[1]["position_x_m"]) == pytest.approx((0.2 - 0.1) / np.sqrt(2))
    assert float(rows[1]["position_y_m"]) == pytest.approx((0.2 + 0.1) / np.sqrt(2))


def test_a_plant_has_no_workspace():
    (line,) = refusal_lines("map", TWO_MASS, "--measure", "stiffness_max")
    assert "no [mechanism]" in line


def test_the_heading_says_what_matters_to_the_measures():
    """Of the arm with friction, encoders and limits: neither a direction nor the loop matters to each measure."""
    rubs = ("--set", "mechanism.drives.motor-left.coulomb_Nm=0.001")

    def heading(*names):
        measures = [word for name in names for word in ("--measure", name)]
        document = document_of("map", MECHANISM, *measures, *rubs, "--direction", "1,0", "--cells", "3,3")
        ran = run_command("map", MECHANISM, *measures, *rubs, "--direction", "1,0", "--cells", "3,3")
        said = ran.out.split("\n\n")[0]
        assert ("dry friction" in said) == (document["left_out"] == ["dry friction"])
        return "along (1, 0)" in said, "leaves out" in said

    assert heading("isotropy") == (False, False)
    assert heading("friction_force") == (True, False)
    assert heading("stiffness_max") == (True, True)
    assert heading("isotropy", "stiffness_max") == (True, True)


def test_the_help_lists_every_measure_with_its_unit():
    out = run_command("map", "--help").out
    for measure in MEASURES.values():
        line = next(line for line in out.splitlines() if line.split()[:1] == [measure.name])
        assert measure.title in line
        assert not measure.unit or f"[{unit_text(measure.unit)}]" in line


def test_the_extremes_offered_are_those_there_are():
    assert EXTREMES == extreme_direction.EXTREMES


def test_the_page_s_python_says_what_it_comes_to(tmp_path, monkeypatch):
    page = (DOCS / "maps.md").read_text(encoding="utf-8")
    own, script = re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    names: dict[str, object] = {}
    told = 0
    for line in script.splitlines():
        code, comment, value = line.partition("  # ")
        if comment:
            assert eval(code, names) == pytest.approx(float(value.split()[0]), rel=1e-3)
            told += 1
        else:
            exec(line, names)
    assert told == 2
    (tmp_path / "my.py").write_text(own)
    monkeypatch.chdir(tmp_path)
    for words in re.findall(r"^    zwidth (map .*)$", page, re.MULTILINE):
        split = [word.strip("'") for word in words.split()]
        if "stiffness_max" not in split:
            ran = run_command(*split)
            assert (ran.code, ran.err) == (0, "")
    assert "379 cm²" in page
    assert (
        "378.9 cm², 25.73 %"
        in run_command(
            "map",
            "five-bar",
            *(part for text in re.findall(r"--require '(.*?)'", page) for part in ("--require", text)),
        ).out
    )
