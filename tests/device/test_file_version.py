"""Versions of files: what is newer than this zwidth reads is refused with one sentence, and left as it is."""

from __future__ import annotations

import json

import numpy as np
import pytest

from zwidth import __version__
from zwidth.device import address, from_document
from zwidth.device.load import load, operator_table, schema
from zwidth.device.read import STORE_VERSION
from zwidth.errors import DeviceError, StoreError
from zwidth.study import CellValues, Journal, Store, StudyFile, fingerprint, read_study

DEVICE = 'name = "m"\n{}\n[plant]\nmass_kg = 0.1\n{}\n[loop]\nsampling_period_s = 0.001\n'
AXIS = '[[axis]]\nkey = "loop.delay_samples"\nvalues = [0]\n'
STUDY = '{}\ndevice = "hapkit-course"\nmeasures = ["stiffness_max"]\n{}\n' + AXIS
OPERATOR = (
    "{}\narm_mass_kg = 0.8\narm_stiffness_N_per_m = 500.0\narm_damping_Ns_per_m = 5.0\ngrasp = 'rigid'\n{}\n"
)
READ = {"device": load, "study": read_study, "operator": operator_table}
TEXT = {"device": DEVICE, "study": STUDY, "operator": OPERATOR}
NEWER = f"is {{}}, and zwidth {__version__} reads up to version 1; upgrade zwidth"
NEWER_STORE = NEWER.replace("version 1", f"version {STORE_VERSION}").format(STORE_VERSION + 1)


@pytest.fixture
def write(tmp_path):
    def written(kind, *parts):
        path = tmp_path / f"{kind}.toml"
        path.write_text(TEXT[kind].format(*parts))
        return path

    return written


def faults(kind, path):
    with pytest.raises(DeviceError) as caught:
        READ[kind](path)
    return [str(fault).replace(str(path), "file") for fault in caught.value.faults]


@pytest.mark.parametrize("kind", READ)
def test_a_file_may_say_its_version(write, kind):
    READ[kind](write(kind, "", ""))
    READ[kind](write(kind, "file_version = 1", ""))


@pytest.mark.parametrize("kind", READ)
@pytest.mark.parametrize("version", ["2", "17", "1.5"])
def test_a_newer_file_is_refused_before_anything_else_of_it(write, kind, version):
    (line,) = faults(kind, write(kind, f"file_version = {version}", "novelty = true"))
    assert line == f"file: file_version: {NEWER.format(version)}"


@pytest.mark.parametrize("kind", READ)
@pytest.mark.parametrize("version", ["0", "-1", "'1'", "true", "[1]"])
def test_a_version_that_is_none_is_a_fault_like_others(write, kind, version):
    found = faults(kind, write(kind, f"file_version = {version}", "novelty = true"))
    assert len(found) == 2
    (line,) = (line for line in found if line.startswith("file: file_version: must be "))
    assert "newer" not in line


def test_a_version_is_no_number_of_the_device(write):
    device = load(write("device", "file_version = 1", ""))
    assert "file_version" not in address.numeric_addresses(device.document)
    assert device.document == load(write("device", "", "")).document
    with pytest.raises(DeviceError, match=r"file_version: is 2"):
        from_document({"file_version": 2})
    with pytest.raises(DeviceError, match=r"file_version: is 3"):
        load("hapkit-course", {"file_version": 3})


def test_the_schemas_know_it():
    for found in (schema(), StudyFile.model_json_schema()):
        own = found["properties"]["file_version"]
        assert (own["minimum"], own["maximum"], own["default"]) == (1, 1, 1)


class Job:
    """Two cells of one measure."""

    count, measures, question = 2, ("a",), "q"


def new_store(path):
    store = Store(path, Job())
    store.begin(2)
    store.write_batch(0, CellValues(np.ones((2, 1)), np.zeros((2, 1), np.uint8), ((), ())))
    return store


def change_attributes(path, **changes):
    """Change the attributes of a store on the disk."""
    file = path / "zarr.json"
    document = json.loads(file.read_text())
    document["attributes"] |= changes
    file.write_text(json.dumps(document))


@pytest.mark.parametrize("changes", [{}, {"question": "another"}, {"batch": "two"}])
def test_a_newer_store_is_refused_and_left_alone(tmp_path, changes):
    path = tmp_path / "store"
    new_store(path)
    assert json.loads((path / "zarr.json").read_text())["attributes"]["version"] == STORE_VERSION
    change_attributes(path, version=STORE_VERSION + 1, **changes)
    before = {file: file.read_bytes() for file in path.rglob("*") if file.is_file()}
    with pytest.raises(StoreError) as caught:
        Store(path, Job())
    assert f"version {NEWER_STORE}" in str(caught.value)
    assert {file: file.read_bytes() for file in path.rglob("*") if file.is_file()} == before


@pytest.mark.parametrize("version", [None, 1])
def test_a_store_of_the_first_version_is_refused_and_left_alone(tmp_path, version):
    """Its cells have no checksums. One that names no version is of the first."""
    path = tmp_path / "store"
    new_store(path)
    document = json.loads((path / "zarr.json").read_text())
    for name in ("digest", "descriptions", "version"):
        document["attributes"].pop(name)
    if version is not None:
        document["attributes"]["version"] = version
    (path / "zarr.json").write_text(json.dumps(document))
    before = {file: file.read_bytes() for file in path.rglob("*") if file.is_file()}
    with pytest.raises(StoreError, match=rf"^store: .* is 1, .* version {STORE_VERSION};"):
        Store(path, Job())
    assert {file: file.read_bytes() for file in path.rglob("*") if file.is_file()} == before


@pytest.mark.parametrize("question", ["how much?", "another"])
def test_a_newer_journal_is_refused_and_left_alone(tmp_path, question):
    path = tmp_path / "journal"
    Journal(path, fingerprint("how much?")).get_or_compute("first", lambda: [1.5])
    head, *lines = path.read_text().splitlines()
    assert json.loads(head)["version"] == STORE_VERSION
    newer = json.dumps(json.loads(head) | {"version": STORE_VERSION + 1})
    path.write_text("\n".join([newer, *lines]) + "\n")
    before = path.read_bytes()
    with pytest.raises(StoreError) as caught:
        Journal(path, fingerprint(question))
    assert f"version {NEWER_STORE}" in str(caught.value)
    assert path.read_bytes() == before


@pytest.mark.parametrize("version", [{}, {"version": 1}])
def test_a_journal_of_the_first_version_is_read_and_gets_checksums(tmp_path, version):
    """One that names no version is of the first. A damaged line of it is dropped with those behind it."""
    path = tmp_path / "journal"
    question = fingerprint("how much?")
    entries = [{"name": "first", "value": [1.5, 1e-320]}, {"name": "second", "value": None}]
    lines = [json.dumps(version | {"question": question}), *map(json.dumps, entries), '{"name": "third", "val']
    path.write_text("\n".join([*lines, lines[-2]]) + "\n")
    known = {"first": [1.5, 1e-320], "second": None}
    assert Journal(path, question).known == known
    text = path.read_text()
    assert json.loads(text.splitlines()[0])["version"] == STORE_VERSION
    assert len(text.splitlines()) == 3
    assert Journal(path, question).known == known
    path.write_text(text.replace("1.5", "1.6"))
    assert Journal(path, question).known == {}
