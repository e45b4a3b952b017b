"""`zwidth tolerance`: the answer in sentences, and what is refused."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy import stats

from tests.cli.command_runner import document_of, refusal_lines, run_command
from zwidth.measures import OK, UNDECIDED
from zwidth.show import caption_of_result
from zwidth.show.cli.tolerance import wall_sentence
from zwidth.study import run_tolerances

PAGE = (Path(__file__).parents[2] / "docs" / "tolerance.md").read_text(encoding="utf-8")
DEVICE = """
name = "free mass"
[plant]
mass_kg = 0.1
[loop]
sampling_period_s = 0.001
"""
MASS = """
[[tolerance]]
key = "plant.mass_kg"
distribution = "uniform"
plus_minus_percent = 20
"""
PERIOD = """
[[tolerance]]
key = "loop.sampling_period_s"
distribution = "uniform"
plus_minus_percent = 0.1
"""
WALL = "stiffness_N_per_m = 62000\ndamping_Ns_per_m = 90\n"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "mass.toml").write_text(DEVICE)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def study(folder: Path, *tables: str, wall: str = WALL, samples: int = 100, indices: int = 64) -> Path:
    draw = f"draw = {{ samples = {samples}, index_samples = {indices} }}\n"
    (folder / "series.toml").write_text('device = "mass.toml"\n' + wall + draw + "".join(tables or (MASS, PERIOD)))
    return Path("series.toml")


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """The study of `study(folder, indices=0)` with its store "kept", for tests of what is made of it."""
    there = tmp_path_factory.mktemp("tolerance")
    (there / "mass.toml").write_text(DEVICE)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(there)
        document = document_of("tolerance", study(there, indices=0), "--resume", "kept")
    return there / "kept", document


def lines(*words: object, code: int = 0) -> list[str]:
    """What is printed, the rows of tables with their cells parted by one blank."""
    ran = run_command("tolerance", *words)
    assert ran.code == code, ran.err
    return [re.sub(r" {2,}", " ", line).strip() for line in ran.out.splitlines()]


def test_the_answer_in_sentences(folder):
    told = lines(study(folder), "--resume", "kept")
    assert told[0] == "free mass: 100 devices drawn, seed 1"
    assert "plant.mass_kg uniform, 0.08 to 0.12 kg" in told
    (wall,) = [line for line in told if line.startswith("the wall")]
    number = re.fullmatch(
        r"the wall 62\.00 kN/m at 90\.00 N s/m is stable in ([\d.]+) % \(([\d.]+) to ([\d.]+) %\) of those that "
        r"are produced",
        wall,
    )
    share, low, high = map(float, number.groups())
    found = document_of("tolerance", "series.toml", "--resume", "kept")
    assert [share, low, high] == pytest.approx(
        [100.0 * found[key] for key in ("probability", "probability_low", "probability_high")], rel=1e-3
    )
    assert "no index of has_stable_wall: it is 1 for all 256 devices" in told
    assert re.match(r"tighten plant\.mass_kg first: half its tolerance raises \d\d\.\d\d %", told[-1])
    (gain,) = [line for line in told if line.startswith("loop.sampling_period_s") and "percentage" in line]
    assert "0, as far as can be told" in gain


def test_a_wall_that_all_render_or_none(folder):
    told = lines(study(folder, MASS, wall="stiffness_N_per_m = 1000\ndamping_Ns_per_m = 30\n"))
    place = "the wall 1.000 kN/m at 30.00 N s/m"
    assert f"{place} is stable in all of them, so in at least 96.38 % of all that are produced" in told
    assert told[-1] == "every one of 100 devices renders the wall: nothing is to be tightened for it"
    told = lines(study(folder, MASS, wall="stiffness_N_per_m = 300000\ndamping_Ns_per_m = 30\n"))
    place = "the wall 300.0 kN/m at 30.00 N s/m"
    assert f"{place} is stable in none of them, so in at most 3.622 % of all that are produced" in told
    assert told[-1].startswith("no narrower tolerance helps this wall, for it is unstable in the middle")


ON_THE_LIMIT = "within rounding of the stability limit"  # which passes through the wall without stiffness


def test_a_wall_that_is_undecided_is_said_to_be(folder):
    told = lines(study(folder, MASS, wall="stiffness_N_per_m = 0\ndamping_Ns_per_m = 0\n"))
    place = "the wall 0 N/m at 0 N s/m"
    assert f"{place} is undecided in all of them, {ON_THE_LIMIT}: its probability is not known" in told
    assert "no index of wall_is_stable: 192 of 192 verdicts are undecided" in told
    assert told[-1].startswith("which tolerance to tighten first is not known, for the wall lies on the stability")
    assert not any("none of them" in line or "not stable" in line for line in told)


@pytest.fixture(scope="module")
def mass_study(tmp_path_factory):
    """100 devices that differ in their mass."""
    there = tmp_path_factory.mktemp("masses")
    (there / "mass.toml").write_text(DEVICE)
    return run_tolerances(there / study(there, MASS, indices=0))


UNDECIDED_IN_SOME = [
    (4, 0, 96, "stable in 4 of 100 devices and undecided in 96", "at least 1.100 %"),
    (40, 50, 10, "stable in 40 of 100 devices and undecided in 10", "30.33 to 60.17 %"),
    (0, 90, 10, "stable in none of 100 devices and undecided in 10", "at most 17.62 %"),
]


@pytest.mark.parametrize(("stable", "unstable", "undecided", "known", "part"), UNDECIDED_IN_SOME)
def test_a_wall_that_is_undecided_in_some_devices_says_in_how_many(
    mass_study, stable, unstable, undecided, known, part
):
    found = mass_study
    n = [one.name for one in found.question.columns].index("wall_is_stable")
    values, status = found.cells.values.copy(), found.cells.status.copy()
    values[:, n] = np.repeat([1.0, 0.0, np.nan], [stable, unstable, undecided])
    status[:, n] = np.repeat([OK, OK, UNDECIDED], [stable, unstable, undecided])
    some = replace(found, cells=replace(found.cells, values=values, status=status))
    place = "the wall 62.00 kN/m at 90.00 N s/m"
    assert wall_sentence(some) == f"{place} is {known}, {ON_THE_LIMIT}: in {part} of those that are produced"
    assert f"undecided in {undecided} devices" in repr(some)
    labels = [text.get_text() for text in some.plot().get_legend().get_texts()]
    assert any(label.endswith(f"undecided in {undecided} of 100 devices") for label in labels)


def test_without_a_wall_the_spread_of_the_stiffness_says_what_to_tighten(folder):
    told = lines(study(folder, wall="", indices=512))
    assert (
        "no wall is wanted: give stiffness_N_per_m and damping_Ns_per_m for the probability that it is stable"
        in told
    )
    assert re.fullmatch(
        r"tighten plant\.mass_kg first: it has a part in .* % of the spread of stiffness_max", told[-1]
    )
    alike = PERIOD.replace("0.1", "10")
    assert told[-1] != (both := lines(study(folder, MASS, alike, wall="", indices=64))[-1])
    assert both.endswith("cannot be told from it")
    none = lines(study(folder, wall="", indices=0))
    assert none[-1] == "which tolerance to tighten first is not known"


def test_few_devices_do_not_tell_what_helps(folder):
    told = lines(study(folder, PERIOD.replace("0.1", "1"), wall=WALL.replace("62000", "68200"), indices=0))
    assert told[-1] == "100 devices do not tell that half of any tolerance would help; draw more"


def test_devices_without_an_answer_are_told(folder):
    table = MASS.replace("plant.mass_kg", "links.distal-right.length_m").replace("20", "30")
    text = f'device = "five-bar"\nat = [0.0, 0.3]\nstiffness_N_per_m = 500\ndamping_Ns_per_m = 9\n{table}'
    (folder / "series.toml").write_text(text + "[draw]\nsamples = 72\nindex_samples = 0\n")
    told = lines("series.toml", "--resume", "kept")
    found = document_of("tolerance", "series.toml", "--resume", "kept")
    out = found["outcomes"]["out of reach"]
    assert f"{out} of 72 devices do not get to the handle's position; they count as not stable" in told
    assert f"{out} of 72 devices have no chart; in its bands they count as not stable" in told
    (folder / "series.toml").write_text(text.replace("0.3", "0.9") + "[draw]\nsamples = 72\n")
    ran = run_command("tolerance", "series.toml", "--resume", "none", "--json")
    assert ran.code == 1
    assert ran.document["reason"] == "no drawn device has an answer: 72 out of reach"
    assert ran.document["bands"] == []
    assert (
        lines("series.toml", "--resume", "none", code=1)[-1]
        == "72 of 72 devices do not get to the handle's position; they count as not stable"
    )


def test_devices_without_a_stable_wall_are_told_and_a_band_without_a_wall_is_none(folder):
    falls = '[[tolerance]]\nkey = "plant.damping_Ns_per_m"\ndistribution = "uniform"\nlow = -200\nhigh = 60\n'
    told = lines(study(folder, falls, wall="", indices=0), "--resume", "kept")
    found = document_of("tolerance", "series.toml", "--resume", "kept")
    none = found["without_stable_wall"]
    assert (
        f"{none} of 100 devices have no stable wall with K > 0 and B >= 0: their largest stiffness counts as 0"
        in told
    )
    assert found["outcomes"] == {"with a stable wall": 100 - none, "without a stable wall": none}
    assert "95.00 % none none" in told
    assert not any(line.startswith("5.000 % none") for line in told)


def test_a_distribution_is_cut_off_where_no_device_can_be_and_what_is_left_of_it_is_said(folder):
    wide = '[[tolerance]]\nkey = "plant.mass_kg"\ndistribution = "normal"\nstandard_deviation = 0.06\n'
    told = lines(study(folder, wide, indices=0))
    assert "plant.mass_kg normal about 0.1 kg, standard deviation 0.06 kg, cut off below 1e-12 and" in told
    assert "above 0.34 (4.782 %)" in told
    left = stats.truncnorm(-0.1 / 0.06, 4.0, 0.1, 0.06)
    assert (
        f"plant.mass_kg: 4.782 % of its distribution is cut off; what is drawn has a mean of {left.mean():.3g} kg "
        f"and a standard deviation of {left.std():.3g} kg"
    ) in told
    assert not any("could not be built" in line for line in told)
    assert not any("is cut off" in line for line in lines(study(folder, wide.replace("0.06", "0.02"), indices=0)))


def test_a_distribution_that_no_device_can_have_is_refused_before_any_is_drawn(folder):
    (line,) = refusal_lines("tolerance", study(folder, MASS.replace("20", "200"), indices=0))
    assert line == (
        "series.toml: tolerance.0.plus_minus_percent: leads to values of 'plant.mass_kg' from -0.1 to 0.3; it "
        "must be greater than 0, got -0.1; give plus_minus_percent = 99.99 or less"
    )


def test_what_is_for_other_commands_is_said_to_be(folder):
    axis = '[[axis]]\nkey = "loop.delay_samples"\nvalues = [0, 1]\n'
    path = study(folder, MASS, axis, indices=0)
    assert "[[axis]] is not used: the devices are those of the device file" in lines(path)
    path.write_text('measures = ["stiffness_max"]\n' + path.read_text())
    assert (
        "[[tolerance]] is not used: `zwidth tolerance` draws devices within it" in run_command("sweep", path).out
    )


@pytest.mark.parametrize("kind", ["csv", "json", "nc", "mat", "svg", "png", "pdf"])
def test_a_file_of_every_kind_and_nothing_is_left_beside_it(folder, kept, kind):
    """The first is computed; the others are written of what the same study keeps elsewhere."""
    path = study(folder, indices=0)
    resumed = () if kind == "csv" else ("--resume", kept[0])
    document = document_of("tolerance", path, "--output", f"found.{kind}", *resumed)
    assert document["file"].endswith(f"found.{kind}")
    assert {one.name for one in folder.iterdir()} == {"mass.toml", "series.toml", f"found.{kind}"}
    if kind == "csv":
        rows = list(csv.DictReader(Path("found.csv").read_text().splitlines()))
        assert len(rows) == 100
        assert {row["wall_is_stable"] for row in rows} == {"0.0", "1.0"}
    elif kind == "json":
        assert json.loads(Path("found.json").read_text())["probability"] == document["probability"]
    elif kind == "nc":
        with xr.open_dataset("found.nc", engine="scipy") as dataset:
            assert float(dataset["wall_is_stable"].mean()) == document["probability"]


def test_the_same_command_goes_on_from_what_is_kept(folder, kept):
    path, (store, first) = study(folder, indices=0), kept
    whole = document_of("tolerance", path)
    stores = {one.name for one in store.iterdir()}
    assert stores == {"devices", "edges-0", "edges-1", "middle", "narrower", "unseen"}
    values = (store / "devices" / "values").stat().st_mtime_ns
    again = document_of("tolerance", path, "--resume", store)
    assert whole == first == again
    assert (store / "devices" / "values").stat().st_mtime_ns == values
    other = document_of("tolerance", path, "--seed", 2)
    assert other["quantiles"] != whole["quantiles"]


def test_the_store_of_another_study_is_left_alone(folder):
    path = study(folder, indices=0)
    Path("kept").mkdir()
    Path("kept/zarr.json").write_text("{}")
    (line,) = refusal_lines("tolerance", path, "--resume", "kept")
    assert line == "kept: holds the store of another study; name another folder"


def test_everything_wrong_comes_at_once(folder):
    path = study(
        folder, MASS.replace("20", "-20"), PERIOD.replace("loop.", "lop."), wall="stiffness_N_per_m = 3\n"
    )
    assert refusal_lines("tolerance", path, "--samples", 10) == [
        "series.toml: stiffness_N_per_m: needs damping_Ns_per_m beside it: the probability that this wall is "
        "stable",
        "series.toml: draw.samples: 10 devices bound no quantile of 5 %; give 72 or more",
        "series.toml: tolerance.0.plus_minus_percent: must be greater than 0, got -20 (largest difference, of a "
        "uniform or triangular one, in percent of the number)",
        "series.toml: tolerance.1.key: 'lop.sampling_period_s' is not a key of a device file; did you mean "
        "'loop.sampling_period_s'?",
    ]
    assert refusal_lines("tolerance", path, "--seed", -1)
    assert refusal_lines("tolerance", "missing.toml") == ["missing.toml: no such file; give a study file"]
    path = study(folder, MASS, wall='measures = ["isotropy", "decay_time"]\n')
    assert refusal_lines("tolerance", path) == [
        "series.toml: measures: isotropy needs a [mechanism]; this device gives its [plant] only",
        "series.toml: measures: decay_time needs a wanted wall; give stiffness_N_per_m and damping_Ns_per_m",
    ]


def blocks(language: str) -> list[str]:
    found = re.findall(r"^```(\w*)\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    return [text for kind, text in found if kind == language]


def test_the_page_s_study_prints_what_the_page_says(folder, monkeypatch):
    monkeypatch.setenv("ZWIDTH_QUIET", "1")
    (text,), (said,) = blocks("toml"), blocks("")
    Path("series.toml").write_text(text)
    ran = run_command("tolerance", "series.toml")
    assert (ran.code, ran.err) == (0, "")
    assert ran.out == said


def test_the_page_s_python_runs(folder):
    names: dict[str, object] = {}
    for program in blocks("python"):
        exec(compile(program, "tolerance.md", "exec"), names)
    assert names["share"].low < names["share"].value < names["share"].high
    assert names["drawn"].sizes["design"] == 200
    assert names["heavy"] == pytest.approx(1.5 * names["light"])


def test_the_page_names_every_key():
    from zwidth.study.designs.study_schema import DrawSection, ToleranceSection

    for section in (ToleranceSection, DrawSection):
        for key in section.model_fields:
            assert f"`{key}`" in PAGE, key


def test_a_figure_says_what_it_shows(mass_study):
    assert any("plant.mass_kg" in line for line in caption_of_result(mass_study))
    ax = mass_study.plot()
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert [label.replace("\u00a0", " ") for label in labels[:3]] == [
        f"stable in at least {share} % of the devices" for share in (5, 50, 95)
    ]
    assert labels[3] == "edge in the middle of the tolerances"
    assert labels[5].startswith("wanted wall: stable in ")
