"""Labelled arrays as files: what is read back is what was written."""

import time

import numpy as np
import pytest
import xarray as xr
from scipy.io import loadmat

from zwidth.errors import OutputError
from zwidth.show.dataset import write_dataset


def dataset():
    status = xr.Variable(
        ("y_m", "x_m"),
        np.array([[0, 255, 1], [2, 3, 0]], np.uint8),
        {"flag_values": np.array([0, 255], np.uint8), "flag_meanings": "ok not_computed"},
    )
    values = xr.Variable(
        ("y_m", "x_m"), np.array([[1.0, np.nan, np.inf], [0.1, -2.0, 3.0]]), {"unit": "N/m", "title": "größte"}
    )
    return xr.Dataset(
        {"stiffness_max": values, "stiffness_max_status": status},
        coords={"y_m": [0.0, 1.0], "x_m": [0.1, 0.2, 0.3], "assembly": ("y_m", ["elbows-out", "in"])},
        attrs={"name": "Five-bar", "through": [0.0, 0.25, 0.0], "cells": 6},
    )


def test_netcdf_gives_back_what_was_written(tmp_path):
    write_dataset(tmp_path / "map.nc", dataset())
    with xr.open_dataset(tmp_path / "map.nc", engine="scipy") as read:
        np.testing.assert_array_equal(read.stiffness_max, dataset().stiffness_max)
        np.testing.assert_array_equal(read.stiffness_max_status, dataset().stiffness_max_status)
        assert read.stiffness_max_status.attrs["flag_values"].tolist() == [0, 255]
        assert read.stiffness_max.attrs == dataset().stiffness_max.attrs
        assert read.assembly.values.tolist() == ["elbows-out", "in"]
        assert (read.attrs["name"], read.attrs["cells"]) == ("Five-bar", 6)
        assert read.stiffness_max.dims == ("y_m", "x_m")


def test_matlab_gives_back_what_was_written(tmp_path):
    write_dataset(tmp_path / "map.mat", dataset())
    read = loadmat(tmp_path / "map.mat", simplify_cells=True)
    np.testing.assert_array_equal(read["stiffness_max"], dataset().stiffness_max)
    assert read["stiffness_max_status"].dtype == np.uint8
    assert read["x_m"].tolist() == [0.1, 0.2, 0.3]
    assert read["assembly"].tolist() == ["elbows-out", "in"]
    assert read["about"]["name"] == "Five-bar"
    assert read["about_variables"]["stiffness_max"]["unit"] == "N/m"
    assert read["about_variables"]["stiffness_max"]["axes"] == "y_m x_m"


@pytest.mark.parametrize("ending", [".nc", ".mat"])
def test_the_same_numbers_give_the_same_bytes(tmp_path, monkeypatch, ending):
    write_dataset(tmp_path / f"a{ending}", dataset())
    monkeypatch.setattr(time, "asctime", lambda *_: "another day")
    write_dataset(tmp_path / f"b{ending}", dataset())
    assert (tmp_path / f"a{ending}").read_bytes() == (tmp_path / f"b{ending}").read_bytes()


def test_what_cannot_be_written(tmp_path):
    with pytest.raises(ValueError, match=r"\.nc, \.mat"):
        write_dataset(tmp_path / "map.h5", dataset())
    long = dataset().rename(stiffness_max="stiffness_max_" * 5)
    with pytest.raises(OutputError, match="63 letters"):
        write_dataset(tmp_path / "map.mat", long)
    assert list(tmp_path.iterdir()) == []
