"""The sampling of a record: its period, its gaps, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from zwidth.identify import Columns, check_sampling, record_of

WANTED = Columns(("time_s", "force_N"))


def record(time, force=None):
    return record_of({"time_s": time, "force_N": np.zeros(len(time)) if force is None else force}, WANTED)


@pytest.mark.parametrize("period", [5e-5, 0.00125, 0.0033])
@pytest.mark.parametrize("digits", [6, 12])
def test_the_period_is_read_off_rounded_stamps(period, digits):
    time = np.round(17.0 + period * np.arange(4000), digits)
    sampling, check = check_sampling(record(time))
    assert check.passed
    assert sampling.period == pytest.approx(period, rel=1e-3 * 10.0 ** (6 - digits) / period * 1e-3 + 1e-9)
    assert sampling.missing == 0
    assert sampling.runs.tolist() == [[0, 4000]]


def test_gaps_and_cells_without_a_number_cut_the_record():
    time = np.delete(np.arange(1000.0), [300, 301, 302]) * 0.001
    force = np.zeros(997)
    force[[500, 600, 601]] = np.nan
    sampling, check = check_sampling(record(time, force))
    assert check.passed
    assert sampling.missing == 6
    assert sampling.runs.tolist() == [[0, 300], [300, 500], [501, 600], [602, 997]]
    assert sampling.longest == 395
    assert "6 samples missing" in check.reason
    rows = np.concatenate([part["row"] for part in sampling.stretches(record(time, force))])
    np.testing.assert_array_equal(rows, np.delete(np.arange(997), [500, 600, 601]))


def test_stretches_are_the_same_however_the_record_is_cut(monkeypatch):
    time = np.delete(np.arange(1000.0), [37, 400]) * 0.001
    whole = record(time)
    sampling, _ = check_sampling(whole)
    short = type(whole).pieces
    monkeypatch.setattr(type(whole), "pieces", lambda self, rows=170: short(self, rows))
    again, check = check_sampling(whole)
    assert check.passed
    np.testing.assert_array_equal(again.runs, sampling.runs)
    assert again.period == pytest.approx(sampling.period, rel=1e-12)
    rows = np.concatenate([part["row"] for part in again.stretches(whole)])
    np.testing.assert_array_equal(rows, np.arange(998))


@pytest.mark.parametrize(
    ("time", "words"),
    [
        (np.arange(50.0), ["50 rows", "at least 100"]),
        (np.zeros(200), ["stands still", "more digits"]),
        (np.round(1e-3 * np.arange(200.0), 2), ["stands still", "more digits"]),
        (-np.arange(200.0), ["falls", "sort"]),
        (np.r_[np.arange(150.0), np.arange(149.0, 300.0)], ["149 s once more", "row 150", "more digits", "twice"]),
        (np.r_[np.arange(150.0), np.arange(150.0)], ["goes from 149 to 0 s", "row 150", "sort"]),
        (np.cumsum(np.random.default_rng(2).uniform(0.2, 1.8, 500)), ["do not follow", "row"]),
    ],
)
def test_time_that_is_no_sampling_is_refused(time, words):
    sampling, check = check_sampling(record(time))
    assert sampling is None
    assert not check.passed
    assert all(word in check.reason for word in words), check.reason


def test_another_period_than_the_computers_is_refused():
    sampling, check = check_sampling(record(0.001 * np.arange(500)), period=0.00125)
    assert sampling is None
    assert "0.001 s" in check.reason
    assert "0.00125 s" in check.reason
    assert "sampling_period_s" in check.reason
    assert check_sampling(record(0.00125 * np.arange(500)), period=0.00125)[1].passed
