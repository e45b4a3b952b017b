"""Jobs of one question in one folder: whose folder it is, and what is left of a run that ended at any moment."""

import json

import pytest

from tests.study.executor_cases import RootsJob
from zwidth.errors import StoreError
from zwidth.study import JobSeries
from zwidth.study.jobs.series import remove_stores


def computed(folder, question="first", cells=33, name="1"):
    """Compute a job of a question into a folder; returns the ranges that were not there."""
    job = RootsJob(cells)
    with JobSeries(folder, workers=1) as series:
        series.begin(question)
        series.compute(name, job, "computing")
    return job.computed_ranges


def test_a_folder_is_kept_for_one_question(tmp_path):
    folder = tmp_path / "kept"
    assert computed(folder)
    assert computed(folder) == []
    before = sorted(path.name for path in folder.iterdir())
    # the job is the same: only the question tells that others follow from it
    with pytest.raises(StoreError, match=rf"^{folder}: keeps finished"):
        computed(folder, "second")
    assert sorted(path.name for path in folder.iterdir()) == before
    assert computed(folder) == []


@pytest.mark.parametrize("left", ["nothing", "folder", "draft", "header"])
def test_a_folder_without_a_store_keeps_no_work(tmp_path, left):
    """What a run leaves that ended before its first batch."""
    folder = tmp_path / "kept"
    if left != "nothing":
        folder.mkdir()
    if left == "draft":
        (folder / ".series.json").write_text('{"zwidth": "ser')
    if left == "header":
        with JobSeries(folder) as series:
            series.begin("first")
    assert computed(folder, "second")
    with pytest.raises(StoreError):
        computed(folder, "first")


def test_a_folder_of_an_older_layout_is_told_by_its_stores(tmp_path):
    folder = tmp_path / "kept"
    computed(folder)
    (folder / "series.json").unlink()
    assert computed(folder) == []
    assert not (folder / "series.json").exists()
    with pytest.raises(StoreError, match=rf"^{folder}: keeps finished"):
        computed(folder, cells=34)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda header: header[:20], "series.json is damaged"),
        (lambda header: json.dumps(json.loads(header) | {"version": 3}), "version is 3, "),
        (lambda header: json.dumps(json.loads(header) | {"version": 1}), "version is 1, "),
    ],
)
def test_a_fingerprint_that_cannot_be_read_is_refused(tmp_path, change, said):
    computed(tmp_path / "kept")
    header = tmp_path / "kept" / "series.json"
    header.write_text(change(header.read_text()))
    with pytest.raises(StoreError) as caught:
        computed(tmp_path / "kept")
    assert str(caught.value).startswith(f"{tmp_path / 'kept'}: ")
    assert said in str(caught.value)


def test_a_folder_in_use_is_refused_and_stays_locked(tmp_path):
    with JobSeries(tmp_path / "kept", workers=1) as first:
        first.begin("first")
        for _ in range(2):  # the one that is refused does not take the lock away
            with pytest.raises(StoreError, match="computing into"):
                computed(tmp_path / "kept")
    assert computed(tmp_path / "kept")


def test_what_is_not_of_the_series_stays(tmp_path):
    folder = tmp_path / "kept"
    computed(folder)
    (folder / "notes.txt").write_text("mine")
    remove_stores(folder)
    assert [path.name for path in folder.iterdir()] == ["notes.txt"]
    (folder / "notes.txt").unlink()
    remove_stores(folder)
    assert not folder.exists()
