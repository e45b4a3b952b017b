"""What is said of files that are no device, and of measured responses that cannot be read."""

from __future__ import annotations

import pytest

from tests.device import test_device_response
from tests.device.test_device_reading import GOOD, message
from tests.device.test_device_response import HEAD, PAIR, RECORD, T, faults
from zwidth.device.load import load
from zwidth.device.read import LARGEST_FILE
from zwidth.errors import DeviceError

# --- files as they come: encodings, line ends, and everything that is no device file -----------------


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


# --- reading measured responses: what is taken, and every way a file can be wrong, on one line -------


spectrum = test_device_response.spectrum
write = test_device_response.write


def broken(lines, number, text):
    """The file with one line (counted from 1) replaced; None: removed."""
    return [*lines[: number - 1], *([] if text is None else [text]), *lines[number:]]


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (lambda s: [], "sweep.csv: is empty; its first line must name columns"),
        (lambda s: s[:1], "sweep.csv: holds no numbers"),
        (lambda s: s[:5], "sweep.csv: has 4 frequencies; at least 6 are needed"),
        (lambda s: broken(s, 1, "frequency_Hz,re,imag_m_per_N"), "line 1: column real_m_per_N is missing"),
        (lambda s: broken(s, 1, HEAD + ",sweep,sweep"), "line 1: column sweep is there more than once"),
        (lambda s: broken(s, 4, "12,x,0.0"), "sweep.csv: line 4: real_m_per_N: must be a finite number, got 'x'"),
        (lambda s: broken(s, 4, "12,1e-5"), "line 4: imag_m_per_N: must be a finite number, but it is missing"),
        (lambda s: broken(s, 4, "12,nan,0"), "line 4: real_m_per_N: must be a finite number, got 'nan'"),
        (lambda s: broken(s, 4, "12,0,1,5"), "line 4: has 4 cells, but the header names 3 columns"),
        (lambda s: broken(s, 2, "0,1,0"), "line 2: frequency_Hz: must be greater than 0, got 0"),
        (lambda s: broken(s, 5, s[3]), "line 5: frequency_Hz: 12 is there twice; keep one of them"),
        (lambda s: [*s[:4], s[5], s[4], *s[6:]], "line 6: frequency_Hz: 16 follows 20; sort the lines"),
        (lambda s: [*s, "401,1e-9,0"], "frequency_Hz: 401 is above half the sampling rate, 400; leave it out"),
        (lambda s: [s[0], *(line.split(",")[0] + ",0,0" for line in s[1:])], "is 0 m/N at every frequency"),
        (lambda s: [s[0] + ",coherence", *(line + ",1.5" for line in s[1:2]), *(line + ",1" for line in s[2:])],
         "line 2: coherence: must be from 0 to 1, got 1.5"),
        (lambda s: [HEAD + ",sweep", *(line + ",1" for line in s[1:]), *(line + ",2" for line in s[2:])],
         "sweep: sweep 2 has other frequencies than the first"),
        (lambda s: broken(s, 3, '"8'), "is not CSV"),
        (lambda s: [RECORD, "0,1,0", "0.00125,1,0", "0.0035,1,0", "0.00475,1,0"],
         "line 4: time_s: comes 0.00225 s after the line before, most others 0.00125 s"),
        (lambda s: [RECORD, *(f"{0.001 * j:.3f},{j % 3},0" for j in range(50))],
         "time_s: rises by 0.001 s from line to line, but sampling_period_s is 0.00125"),
        (lambda s: [RECORD, *(f"{T * j!r},{j % 3},0" for j in range(50))], "has 50 samples, too few"),
        (lambda s: [RECORD, "0,1,0"], "has one line only; record a sweep"),
    ],
)  # fmt: skip
def test_a_fault_of_the_file_is_one_line(write, spectrum, change, fault):
    (line,) = faults(write(change(spectrum)))
    assert fault in line


def test_many_faults_are_told_together_and_not_without_end(write, spectrum):
    found = faults(write([spectrum[0], *("a,b,c" for _ in spectrum[1:])]))
    assert len(found) == 3 * 4
    assert found[3] == "sweep.csv: frequency_Hz: and 97 more lines, the last of them line 101"
    backward = faults(write([spectrum[0], *reversed(spectrum[1:5])]))
    assert [line.split(": ")[1] for line in backward] == ["line 3", "line 4", "line 5"]
    assert faults(write([spectrum[0], *reversed(spectrum[1:6])]))[3].endswith(
        "and 1 more line, the last of them line 6"
    )


def test_a_file_that_is_not_there_or_not_text(write, spectrum, tmp_path):
    (line,) = faults(write(spectrum, 'file = "swep.csv"'))
    assert line == "swep.csv: no such file; response.file is a path from the device file's folder"
    path = write(spectrum)
    (tmp_path / "sweep.csv").write_bytes(b"\xff\x00")
    assert "is not UTF-8 text" in faults(path)[0]


@pytest.mark.parametrize(
    ("keys", "fault"),
    [
        ("", "device.toml: response: names no file; give file"),
        ('file = "a.csv"\nfiles = ["a.csv", "b.csv"]', "device.toml: response: names both file and files"),
        ('file = "sweep.csv"\nintegrators = 3', "response.integrators: must be at most 2, got 3"),
        ('file = "sweep.csv"\nintegrators = 1.5', "response.integrators: must be a whole number"),
        ('file = "sweep.csv"\naverages = 0', "response.averages: must be at least 1"),
        ('file = "sweep.csv"\n[plant]\nmass_kg = 1.0', "has [plant] and [response]; only one of them is allowed"),
    ],
)
def test_a_fault_of_the_section(write, spectrum, keys, fault):
    assert any(fault in line for line in faults(write(spectrum, keys)))


def test_what_the_response_holds_already_is_refused(write, spectrum):
    path = write(spectrum)
    text = path.read_text()
    path.write_text(text + "delay_samples = 0.5\n")
    (line,) = faults(path)
    assert "loop.delay_samples: must be a whole number of samples with a [response], got 0.5" in line
    path.write_text(text + "delay_samples = 2\n")
    assert load(path).controller.delay == 2.0
    path.write_text(text + '[operator]\narm_mass_kg = 0.8\ngrasp = "rigid"\n')
    (line,) = faults(path)
    assert "operator: cannot be attached to this [response]: it has no path" in line
    path.write_text(text + "[loop.actuator]\ntime_constant_s = 0.001\n")
    assert any("loop.actuator: is part of a measured [response] already" in line for line in faults(path))


def test_half_a_path_and_a_path_given_twice_are_refused(write, spectrum):
    head, *lines = spectrum
    path = write([f"{head},{PAIR.split(',')[0]}", *(f"{line},1e-3" for line in lines)])
    (line,) = faults(path)
    assert "handle_force_to_encoder_imag_m_per_N is missing" in line
    first = [line.split(",")[0] for line in lines]
    write([f"frequency_Hz,{PAIR}", *(f"{f},1e-3,-2e-3" for f in first)], name="hand.csv")
    keys = 'file = "sweep.csv"\nhandle_file = "hand.csv"'
    (line,) = faults(write([f"{head},{PAIR}", *(f"{line},1e-3,-2e-3" for line in lines)], keys))
    assert "is in sweep.csv, too; keep one of them" in line
    write(["frequency_Hz,other", "1,2"], name="hand.csv")
    (line,) = faults(write(spectrum, keys))
    assert "has no path from the handle's force" in line
    write([f"frequency_Hz,{PAIR}", *(f"{float(f) + 0.5},1e-3,-2e-3" for f in first[:-1])], name="hand.csv")
    (line,) = faults(write(spectrum, keys))
    assert "has other frequencies than sweep.csv" in line
