"""Files as they come: encodings, line ends, and everything that is no device file."""

from __future__ import annotations

import contextlib
import os
import stat
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from zwidth.device import bundled
from zwidth.device.load import load
from zwidth.device.read import decode, parse_document
from zwidth.errors import DeviceError, FileError

GOOD = b'name = "a mass"\n[plant]\nmass_kg = 0.1\n[loop]\nsampling_period_s = 0.001\n'


def message(path: object) -> str:
    with pytest.raises(DeviceError) as caught:
        load(path)
    (fault,) = caught.value.faults
    assert fault.file == str(path)
    assert len(str(caught.value).splitlines()) == 1
    return fault.message


@pytest.mark.parametrize(
    "data", [GOOD, b"\xef\xbb\xbf" + GOOD, GOOD.replace(b"\n", b"\r\n"), "# Gerät µ\n".encode() + GOOD]
)
def test_byte_order_marks_and_line_ends_do_not_matter(tmp_path, data):
    path = tmp_path / "device.toml"
    path.write_bytes(data)
    device = load(path)
    assert device.given_plant.mass == pytest.approx(0.1)
    assert load(str(path)).controller.sampling_period == 0.001


def test_a_file_that_may_not_be_read(tmp_path):
    path = tmp_path / "device.toml"
    path.write_bytes(GOOD)
    path.chmod(stat.S_IWUSR)
    if not os.access(path, os.R_OK):
        said = message(path)
    else:  # the superuser reads everything: ask as nobody
        program = (
            "import os, sys; from zwidth.device.load import load; load('hapkit-course'); os.setuid(65534)\n"
            "try: load(sys.argv[1])\n"
            "except ValueError as error: print(error)"
        )
        command = [sys.executable, "-c", program, str(path)]
        said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert "permission denied" in said


@given(st.binary(max_size=60))
def test_whatever_the_bytes_only_device_errors_come_out(data):
    with contextlib.suppress(DeviceError, FileError):
        parse_document(decode(data), "my.toml")


def test_listing_the_bundled_devices_needs_no_numerics():
    program = (
        "import sys; from zwidth.device.read import bundled; bundled(); print(*sys.modules);"
        "from zwidth.device.load import load; load('published-two-mass'); print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    listing, loading = done.stdout.splitlines()
    assert not {"numpy", "pydantic", "numba"} & set(listing.split())
    assert not {"numba", "scipy"} & set(loading.split())
    assert all(all(entry) for entry in bundled())
