"""Records of measurements: what is read, and what is wrong with what cannot be."""

from __future__ import annotations

import io

import numpy as np
import pytest
import scipy.io
import xarray as xr

from zwidth.errors import DeviceError
from zwidth.identify import Columns, read_record, record_of
from zwidth.identify.records import record as record_module
from zwidth.identify.records.record import averaged_rows

WANTED = Columns(("time_s", ("force_N", "torque_Nm")), optional=("position_m",), text=("joint",))


def written(tmp_path, text, name="record.csv"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def fault_of(path, wanted=WANTED):
    with pytest.raises(DeviceError) as caught:
        read_record(path, wanted).columns()
    return str(caught.value).replace(str(path), "FILE")


def test_numbers_and_words_come_back_as_they_were_written(tmp_path):
    path = written(tmp_path, "time_s, force_N ,joint,other\n0.0, 1.5, upper,x\n\n0.1,,2,y\n")
    record = read_record(path, WANTED)
    columns = record.columns()
    assert record.names == ("time_s", "force_N", "joint")
    np.testing.assert_array_equal(columns["time_s"], [0.0, 0.1])
    np.testing.assert_array_equal(columns["force_N"], [1.5, np.nan])
    assert columns["joint"].tolist() == ["upper", "2"]


def test_the_line_of_a_row_counts_blank_lines(tmp_path):
    record = read_record(written(tmp_path, "\ntime_s,force_N\n0,1\n\n\n1,2\n"), WANTED)
    assert [record.place(0), record.place(1)] == ["line 3", "line 6"]


def test_pieces_are_the_whole_in_order(tmp_path):
    rows = np.random.default_rng(1).normal(size=(257, 2))
    text = "time_s,force_N\n" + "".join(f"{a!r},{b!r}\n" for a, b in rows.tolist())
    record = read_record(written(tmp_path, text), WANTED)
    pieces = list(record.pieces(rows=50))
    assert [len(piece["time_s"]) for piece in pieces] == [50] * 5 + [7]
    np.testing.assert_array_equal(np.concatenate([piece["force_N"] for piece in pieces]), rows[:, 1])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ["is empty", "time_s, force_N or torque_Nm"]),
        ("time_s;force_N\n1;2\n", ["separated by ';'", "use commas"]),
        ("time_s,position_m\n1,2\n", ["force_N or torque_Nm is missing"]),
        ("time_ms,force_N\n1,2\n", ["time_s is missing", "time_ms is there", "multiply by 0.001"]),
        ("time_s,force_mN\n1,2\n", ["force_mN is there", "name it force_N"]),
        ("Time [s],Force (mN)\n1,2\n", ["'Time [s]' is there: name it time_s", "multiply by 0.001"]),
        ("time_s,force_N,position_mm\n1,2,3\n", ["position_m is missing", "position_mm is there"]),
        ("1,2\n1,2\n", ["line 1", "holds numbers", "write the names"]),
        ("# of May\ntime_s,force_N\n1,2\n", ["line 1", "is a comment", "begin with the line that names"]),
        ("time_s,force_N,torque_Nm\n1,2,3\n", ["alternatives", "keep one"]),
        ("time_s,force_N,force_N\n1,2,3\n", ["more than once"]),
        ("time_s,force_N\n1,2\n2,three\n", ["FILE: line 3: force_N: must be a number, got 'three'"]),
        ("time_s,force_N\n0,1,2\n", ["line 2", "3 cells", "decimal point"]),
        ("time_s,force_N\n0,1_000\n", ["line 2", "got '1_000'"]),
    ],
)
def test_what_is_wrong_with_a_table_is_said_with_its_line(tmp_path, text, words):
    message = fault_of(written(tmp_path, text))
    assert all(word in message for word in words), message


def test_what_is_no_table_is_refused(tmp_path):
    binary = tmp_path / "picture.csv"
    binary.write_bytes(b"\x89PNG\x00\x00")
    assert "CSV or .mat" in fault_of(binary)
    assert "directory" in fault_of(tmp_path)
    assert "such file" in fault_of(tmp_path / "none.csv")


def test_a_matlab_file_is_read_as_a_table(tmp_path):
    path = tmp_path / "record.mat"
    scipy.io.savemat(path, {"time_s": [[0.0], [0.1]], "force_N": [1.0, 2.0], "name": "bench"})
    np.testing.assert_array_equal(read_record(path, WANTED).columns()["force_N"], [1.0, 2.0])
    path.write_bytes(b"MATLAB 7.3 MAT-file" + b" " * 200)
    assert "-v7" in fault_of(path)
    path.write_bytes(b"no such thing" * 30)
    assert "no .mat file" in fault_of(path)


def test_arrays_tables_and_datasets_make_the_same_record():
    time, force = np.arange(4.0), np.arange(4.0) ** 2
    dataset = xr.Dataset({"force_N": ("time_s", force)}, coords={"time_s": time})
    for given in ({"time_s": time, "force_N": force}, dataset, dataset.to_dataframe().reset_index()):
        columns = record_of(given, WANTED).columns()
        np.testing.assert_array_equal(columns["time_s"], time)
        np.testing.assert_array_equal(columns["force_N"], force)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"time_s": [0.0, 1.0], "force_N": [1.0]}, ["one length", "force_N (1,)"]),
        ({"time_s": [0.0], "force_N": [[1.0]]}, ["one dimension"]),
        ({"time_s": [0.0], "force_N": ["a"]}, ["force_N", "numbers"]),
        ({"force_N": [0.0]}, ["time_s is missing"]),
    ],
)
def test_arrays_that_are_no_table_are_refused(given, words):
    with pytest.raises(DeviceError) as caught:
        record_of(given, WANTED)
    assert all(word in str(caught.value) for word in words), caught.value


def test_a_long_record_is_averaged_to_the_wanted_length():
    values = np.arange(10_007.0)
    values[5] = np.nan
    record = record_of({"time_s": np.arange(10_007.0), "force_N": values}, WANTED)
    rows = averaged_rows(record, most=1000)
    assert (rows.together, rows.left_out) == (16, 1)
    kept = np.delete(np.arange(10_007.0), 5)[: 625 * 16].reshape(-1, 16).mean(axis=1)
    np.testing.assert_allclose(rows.columns["force_N"], kept, rtol=1e-13)
    assert averaged_rows(record, most=20_000).together == 1


LONG = "time_s,force_N,joint\n" + "".join(
    f"{0.1 * i!r},{'' if i == 70 else i}, {'ab'[i % 2]} \n" for i in range(400)
)


@pytest.mark.parametrize("in_memory", [0, 10**6])
def test_a_file_is_read_as_text_once(tmp_path, monkeypatch, in_memory):
    monkeypatch.setattr(record_module, "IN_MEMORY", in_memory)
    path = written(tmp_path, LONG)
    record = read_record(path, WANTED)
    before = record.columns()
    path.unlink()
    together = list(zip(record.pieces(rows=90), record.pieces(rows=90), strict=True))  # two passes in turn
    assert [len(piece["time_s"]) for piece, _ in together] == [90] * 4 + [40]
    for which in (0, 1):
        for name, values in before.items():
            read = np.concatenate([pair[which][name] for pair in together])
            np.testing.assert_array_equal(read, values)
            assert read.dtype == values.dtype


def test_a_pass_that_ends_early_leaves_the_file_to_the_next(tmp_path):
    record = read_record(written(tmp_path, LONG), WANTED)
    next(record.pieces(rows=90))
    assert len(record.columns()["time_s"]) == 400


@pytest.mark.parametrize(("name", "value"), [("MOST_WORDS", 1), ("SpooledTemporaryFile", None)])
def test_what_cannot_be_kept_is_read_again(tmp_path, monkeypatch, name, value):
    class FullDisk(io.BytesIO):
        def __init__(self, **options: object) -> None:
            super().__init__()

        def write(self, data: object) -> int:
            raise OSError("no space left on device")

    monkeypatch.setattr(record_module, name, value or FullDisk)
    record = read_record(written(tmp_path, LONG), WANTED)
    first, second = record.columns(), record.columns()
    for column, values in first.items():
        np.testing.assert_array_equal(second[column], values)
    assert record._copy is None
