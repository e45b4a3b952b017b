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
from zwidth.device.read import LARGEST_FILE, parse_document
from zwidth.device.text_file import decode
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


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "is empty"),
        (b"# only a comment\n", "is empty"),
        (b"name = \n", "is not TOML: invalid value (at line 1, column 8)"),
        (b"[plant]\nmass_kg = 1\nmass_kg = 2\n", "line 3"),
        (b'{"name": "json"}', "is not TOML"),
        (b"\x89PNG\r\n\x1a\n\x00", "is not UTF-8 text (byte 0 is 0x89)"),
        (b"name = 'a'\x00", "is a binary file (byte 10 is zero)"),
        (GOOD.decode().encode("utf-16"), "is UTF-16 text, not UTF-8"),
        ("name = 'Gerät'".encode("latin-1"), "is not UTF-8 text (byte 11 is 0xe4)"),
        (b"a = " + b"[" * 10_000 + b"]" * 10_000, "nested too deeply"),
        (b"a = " + b"{a=" * 10_000 + b"1" + b"}" * 10_000, "nested too deeply"),
        (b".".join([b"a"] * 10_000) + b" = 1", "nested too deeply"),
        (b"[" + b".".join([b"a"] * 10_000) + b"]", "nested too deeply"),
        (b"a = " + b"[" * 30 + b"]" * 30, "nested too deeply; at most 20"),
        (b"a = " + b"1" * 10_000, "holds a number that cannot be read"),
        (b"#" * (LARGEST_FILE + 1), "is larger than 10 MB"),
    ],
    ids=lambda value: None if isinstance(value, str) else f"{value[:12]!r}",
)
def test_what_is_no_device_file_is_refused_in_one_line(tmp_path, data, words):
    path = tmp_path / "device.toml"
    path.write_bytes(data)
    assert words in message(path)


def test_a_directory_is_no_device(tmp_path):
    assert "is a directory" in message(tmp_path)


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("fivebar", "did you mean 'five-bar'?"),
        ("./five-bar.toml", "did you mean 'five-bar'?"),
        ("nothing/like/it.toml", "is neither a file nor a bundled device; bundled: da-vinci-mtm, five-bar, "),
        ("a" * 5000, "cannot be read: file name too long"),
        ("five-bar/x\\y", "is neither"),
    ],
)
def test_a_missing_file_leads_to_the_bundled_ones(path, words):
    assert words in message(path)


def test_an_empty_name_is_called_one():
    with pytest.raises(
        DeviceError,
        match=r"^device: the name is empty; give a device file, or a bundled name: da-vinci-mtm, five-bar",
    ):
        load("")


def test_a_zero_byte_in_the_name_is_no_crash():
    with pytest.raises(DeviceError, match="cannot be read"):
        load("a\x00b")


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


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ("[plant]\nmass_kg = 0,045\n", "line 2: 0,045 has a decimal comma; write 0.045"),
        ("[plant]\nactuator = [1.0, 0,5]\n[plant]", "line 3: [plant] is there twice"),
        ("[plant]\nmass_kg = 1\n\nmass_kg = 2", "line 4: mass_kg is there twice; keep one of them"),
        ("[mechanism.loops]\na = 1\n[mechanism.loops]\n", "line 3: [mechanism.loops] is there twice"),
        (
            'device = "five-bar"\nmeasures = ["stiffness"]\n',
            "is a study file; use zwidth sweep",
        ),
    ],
)
def test_what_was_probably_meant_is_said(tmp_path, data, words):
    path = tmp_path / "device.toml"
    path.write_text(data)
    assert words in message(path)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("sampling_frequency_Hz", 800, "give sampling_period_s = 0.00125"),
        ("sampling_rate_kHz", 4.0, "give sampling_period_s = 0.00025"),
        ("sampling_rate_Hz", 0, "give sampling_period_s, in seconds"),
        ("sampling_period_ms", 1.25, "give sampling_period_s = 0.00125"),
        ("delay_us", 300, "give delay_s = 0.0003"),
        ("sampling_perod_s", 1, "did you mean 'sampling_period_s'?"),
    ],
)
def test_a_number_in_another_unit_is_converted(tmp_path, key, value, words):
    path = tmp_path / "device.toml"
    path.write_bytes(GOOD)
    path.write_text(path.read_text().replace("[loop]", f"[loop]\n{key} = {value}"))
    assert words in message(path)
