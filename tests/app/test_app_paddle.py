"""A class's own paddle: its sketch against the chart, its lines as the page reads them, and the record of them."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import zwidth
from tests.app.paddle_simulation import MASS, SKETCH, compile_sketch, cpp_compiler, run_sketch
from tests.lazy_module import LazyModule
from zwidth.study import read_points

PAGE = SKETCH.parent
make_paddle_record = LazyModule("docs.make_paddle_record")


@pytest.fixture(scope="module")
def program(tmp_path_factory) -> Path:
    compiler = cpp_compiler()
    if compiler is None:
        pytest.skip("no C++ compiler here")
    return compile_sketch(compiler, tmp_path_factory.mktemp("paddle"))


def in_node(script: str, *arguments: object) -> object:
    """What a module script prints as JSON; the page's paddle.js is `paddle`, the arguments are `given`."""
    if shutil.which("node") is None:
        pytest.skip("node is not installed")
    begin = f"import * as paddle from {json.dumps((PAGE / 'paddle.js').as_uri())};\n"
    begin += f"const given = {json.dumps(arguments)};\n"
    done = subprocess.run(
        ["node", "--input-type=module"], input=begin + script, capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stderr) == (0, "")
    return json.loads(done.stdout)


def parsed(*lines: str) -> list[dict]:
    return in_node("console.log(JSON.stringify(given.map(paddle.parseLine)));", *lines)


def samples(printed: str) -> np.ndarray:
    """Time [s], position [m] and force [N] of each whole sample that was printed, (3, n)."""
    rows = re.findall(r"^sample (\S+) (\S+) (\S+)$", printed, re.MULTILINE)
    return np.array(rows).astype(float).T


def trials(printed: str) -> list[tuple[float, float, str, float]]:
    """Stiffness [N/m], damping [N s/m], verdict and frequency [Hz] of each trial that was printed."""
    rows = [line.split()[1:] for line in printed.splitlines() if line.startswith("trial ")]
    return [(float(row[0]), float(row[1]), row[2], float(row[3])) for row in rows]


def exact_stiffness(chart, damping: float) -> float:
    """Largest stable stiffness at a damping [N/m], by bisection of the spectral radius."""
    low, high = 1.0, 1e5
    while high - low > 0.01:
        middle = (low + high) / 2
        low, high = (middle, high) if float(chart.check(middle, damping).spectral_radius) < 1.0 else (low, middle)
    return low


def paddle_chart(mass: float, friction: float, tmp_path: Path):
    file = tmp_path / "mass.toml"
    file.write_text(
        f"name = 'paddle'\n[plant]\nmass_kg = {mass}\ndamping_Ns_per_m = {friction}\n"
        "[loop]\nsampling_period_s = 0.001\n"
    )
    return zwidth.load(file).at().chart()


@pytest.mark.parametrize("damping", [0.5, 1.0, 2.0, 3.0])
@pytest.mark.parametrize(("mass", "friction"), [(0.03, 0.1), (0.015, 0.05), (0.06, 0.3), (0.1, 1.0)])
def test_a_sweep_finds_the_stiffness_of_the_chart_within_its_step(
    program, tmp_path, mass, friction, damping
) -> None:
    chart = paddle_chart(mass, friction, tmp_path)
    exact = exact_stiffness(chart, damping)
    step = 0.05 * exact
    first = 0.673 * exact  # no trial at the edge itself
    printed = run_sketch(
        program, 20.0, (0.1, f"sweep {damping} {first} {1.5 * exact} {step}"), mass=mass, friction=friction
    )
    found = trials(printed)
    assert [verdict for *_, verdict, _ in found] == ["stable"] * (len(found) - 1) + ["unstable"]
    assert len(found) > 5
    assert found[-2][0] < exact < found[-1][0] <= exact + step
    assert found[-1][3] == pytest.approx(float(chart.check(exact, damping).frequency), rel=0.04)
    assert "late: 0" in printed


@pytest.mark.parametrize("factor", [0.5, 1.2, 1.5, 4.0])
@pytest.mark.parametrize(("mass", "damping"), [(0.01, 10.0), (0.015, 10.0), (0.03, 1.0), (0.1, 3.0)])
def test_a_wall_far_from_the_boundary_is_judged_although_the_motor_is_too_weak(
    program, tmp_path, mass, damping, factor
) -> None:
    """Where the motor's force is limited an unstable vibration stays at one size, from the first window on."""
    stiffness = factor * exact_stiffness(paddle_chart(mass, 0.02, tmp_path), damping)
    command = f"sweep {damping} {stiffness} {stiffness} 1"
    ((*_, verdict, _),) = trials(run_sketch(program, 1.5, (0.1, command), mass=mass, friction=0.02))
    assert verdict == ("stable" if factor < 1.0 else "unstable")


def test_the_frequency_of_a_stable_trial_is_that_of_its_decay(program, tmp_path) -> None:
    """What creeps back after the oscillation has died out does not count."""
    mass, friction, damping = 0.03, 0.1, 2.0
    for stiffness in (2500.0, 2800.0, 3090.0, 3380.0):
        (trial,) = trials(run_sketch(program, 1.5, (0.1, f"sweep {damping} {stiffness} {stiffness} 1")))
        chart = paddle_chart(mass, friction, tmp_path)
        assert trial[3] == pytest.approx(float(chart.check(stiffness, damping).frequency), rel=0.04)


def test_a_wall_pushes_a_paddle_back_and_does_not_pull(program) -> None:
    commands = ((0.1, "sweep 0.2 1300 1300 1"), (1.5, "wall 100 3"))  # the paddle still moves, and into the wall
    time, position, force = samples(run_sketch(program, 3.0, *commands, friction=0.01))
    touched = time > 1.51
    assert force[touched].min() < -0.3
    assert force[touched].max() == 0.0
    assert position[-1] < position[time < 1.51][-1] < position[touched].max()


def test_a_line_ends_a_sweep_and_what_is_no_command_is_said(program) -> None:
    commands = ((0.1, "sweep 1 500 3000 50"), (2.0, "stop"), (4.0, "walk 3"), (4.5, "sweep 1 9 5 1"))
    printed = run_sketch(program, 6.0, *commands)
    assert 0 < len(trials(printed)) < 3
    assert printed.count("# sweep ended") == 1
    assert printed.count("# not understood") == 2
    time, _, force = samples(printed)
    assert np.allclose(np.diff(time), 0.01)
    assert np.all(force[time > 2.1] == 0.0), "the motor is off"


def test_a_turn_of_the_sensor_is_counted(program) -> None:
    """The sensor begins again 380 counts, 4.5 mm, from the start, and the motion goes on."""
    printed = run_sketch(program, 19.5, (0.1, "sweep 0 5 900 5"))
    position = samples(printed)[1]
    assert np.abs(position).max() > 0.006
    assert np.abs(np.diff(position)).max() < 0.005


def test_good_lines_are_read() -> None:
    lines = {
        "#zwidth 1 period_s=0.001": {"kind": "header", "version": 1, "period": 0.001},
        "trial 900 1 stable 26.4\r": {
            "kind": "trial",
            "stiffness": 900,
            "damping": 1,
            "verdict": "stable",
            "frequency": 26.4,
        },
        "  trial\t1e3  .5 unstable 0": {
            "kind": "trial",
            "stiffness": 1000,
            "damping": 0.5,
            "verdict": "unstable",
            "frequency": 0,
        },
        "sample 0.25 -4e-4 +3.": {"kind": "sample", "time": 0.25, "position": -4e-4, "force": 3},
        "sample 1e7 -10 -1e4": {"kind": "sample", "time": 1e7, "position": -10, "force": -1e4},
        "# sweep ended": {"kind": "comment", "text": "sweep ended"},
        "#zwidthless": {"kind": "comment", "text": "zwidthless"},
        "": {"kind": "comment", "text": ""},
    }
    assert parsed(*lines) == list(lines.values())


FAULTS = {
    "#zwidth": "must read #zwidth 1 period_s=0.001",
    "#zwidth 2 period_s=0.001": "is of version 2, but this page reads version 1",
    "#zwidth 1 period_s=0": "as period_s, but it must be from 0.00001 to 0.1 s",
    "#zwidth 1 period_s=1e-3s": "which is no number",
    "trial 900 1 stable": "has 3 values after trial, not K B verdict frequency_Hz",
    "trial 900 1 stable 26.4 7": "has 5 values after trial",
    "trial 900 1 Stable 26.4": "must be stable or unstable",
    "trial 9oo 1 stable 26.4": 'has "9oo" as stiffness, which is no number',
    "trial 0x10 1 stable 26.4": "as stiffness, which is no number",
    "trial nan 1 stable 26.4": "as stiffness, which is no number",
    "trial 1e400 1 stable 26.4": "must be from -10000000 to 10000000 N/m",
    "trial 900 -1e6 stable 26.4": "must be from -100000 to 100000 N s/m",
    "trial 900 1 unstable -3": "as frequency, but it must be from 0 to 50000 Hz",
    "trial 900,5 1 unstable 3": "as stiffness, which is no number",
    "sample 1 2": "has 2 values after sample, not t x f",
    "sample -1 0 0": "as time, but it must be from 0",
    "sample 1 10.001 0": "as position, but it must be from -10 to 10 m",
    "sample 1 0 Infinity": "as force, which is no number",
    "Trial 900 1 stable 26.4": "must begin with trial, sample or #",
    "\x00\ufffd\x7f": '"???" must begin',
    "y" * 201: "is longer than 200 characters",
}


def test_the_lines_of_the_page_about_the_format_are_read() -> None:
    text = (SKETCH.parents[5] / "docs" / "paddle.md").read_text(encoding="utf-8")
    lines = re.findall(r"^    (#.*|trial .*|sample .*)$", text, re.MULTILINE)
    assert [one["kind"] for one in parsed(*lines)] == ["header", "comment", "sample", "trial"]


def test_malformed_lines_are_faults_in_words() -> None:
    for (line, words), found in zip(FAULTS.items(), parsed(*FAULTS), strict=True):
        assert found["kind"] == "fault", line
        assert words in found["sentence"], line
        assert re.fullmatch(r'The line "[ -~]*" .*\.', found["sentence"]), line
        assert len(found["sentence"]) < 200


def test_no_line_makes_the_reader_throw_or_leave_its_ranges() -> None:
    rng = np.random.default_rng(7)
    good = ["#zwidth 1 period_s=0.001", "trial 900 1 stable 26.4", "sample 0.25 0.0004 -0.36", "# words"]
    lines = []
    for _ in range(3000):
        letters = list(good[rng.integers(4)])
        for _ in range(rng.integers(1, 4)):
            letters[rng.integers(len(letters))] = chr(
                rng.choice([32, 45, 46, 48, 57, 69, 101, 9, 0, 255, 0x1F600])
            )
        lines.append("".join(letters))
    found = parsed(*lines)
    assert {one["kind"] for one in found} == {"header", "trial", "sample", "comment", "fault"}
    for one in found:
        numbers = [value for value in one.values() if not isinstance(value, str)]
        assert all(isinstance(value, int | float) and abs(value) <= 1e7 for value in numbers), one


# What a stream hands out, as a list of [name, value].
COLLECT = """
const heard = [];
const listen = (name) => (value) => heard.push(value === undefined ? [name] : [name, value]);
const stream = new paddle.PaddleStream({
  onTrial: listen("trial"), onSample: listen("sample"), onFault: listen("fault"), onEnd: listen("end"),
});
"""
# A port that gives chunks of characters, then waits until its reader is cancelled or, at null, is unplugged.
PORT = """
const port = {
  closed: 0, written: "",
  async open({ baudRate }) {
    this.baudRate = baudRate;
    const chunks = given[0].values();
    this.readable = new ReadableStream({ pull(control) {
      const { value, done } = chunks.next();
      if (done) return new Promise(() => {});
      if (value !== null) return control.enqueue(new TextEncoder().encode(value));
      port.readable = null;
      control.error(new DOMException("lost.", "NetworkError"));
    } });
    this.writable = new WritableStream({ write: (bytes) => { port.written += new TextDecoder().decode(bytes); } });
  },
  async close() { this.closed += 1; },
};
Object.defineProperty(globalThis, "navigator", { value: { serial: { requestPort: async () => port } } });
"""


def test_lines_from_a_port_may_be_cut_anywhere() -> None:
    chunks = [
        "e 0.1 0\n#zwidth 1 per",
        "iod_s=0.001\r",
        "\ntrial 900 1 st",
        "able 26\nsample 0.2",
        " 0.001 -3\nsample 1\n",
    ]
    script = """
    const done = stream.connectSerial();
    await new Promise((resolve) => setTimeout(resolve, 50));
    await Promise.all([stream.send("wall 1 2"), stream.send("stop")]);
    stream.stop();
    await done;
    stream.stop();
    await stream.send("stop");
    console.log(JSON.stringify([heard, port.closed, port.baudRate, port.written]));"""
    heard, closed, baud, written = in_node(COLLECT + PORT + script, chunks)
    assert [name for name, *_ in heard] == ["trial", "sample", "fault", "end", "fault"]
    assert heard[0][1] == {"stiffness": 900, "damping": 1, "verdict": "stable", "frequency": 26}
    assert heard[1][1] == {"time": 0.2, "position": 0.001, "force": -3}
    assert '"sample 1"' in heard[2][1]
    assert (closed, baud, written) == (1, 115200, "wall 1 2\nstop\n")


def test_an_unplugged_paddle_and_a_port_of_something_else_end_the_stream() -> None:
    script = "await stream.connectSerial(); console.log(JSON.stringify([heard, port.closed]));"
    heard, closed = in_node(COLLECT + PORT + script, ["# here\nsample 0 0 0\n", None])
    assert closed == 1
    assert "unplugged" in heard[-2][1]
    assert heard[-1] == ["end"]
    heard, closed = in_node(COLLECT + PORT + script, ["\x02g\x7f\n" * 15 + "x" * 500, "\n" + "?\n" * 30])
    assert closed == 1
    assert "20 lines" in heard[-2][1] or "20 lines" in heard[-1][1]
    assert [name for name, *_ in heard].count("end") == 1
    assert len(heard) == 22


def test_a_browser_without_serial_ports_is_told_in_one_sentence() -> None:
    script = """
    Object.defineProperty(globalThis, "navigator", { value: {} });
    await stream.connectSerial();
    heard.push(paddle.serialMissing({ isSecureContext: false, navigator: {} }));
    heard.push(paddle.serialMissing({ isSecureContext: true, navigator: { serial: {} } }));
    console.log(JSON.stringify(heard));"""
    first, end, insecure, fine = in_node(COLLECT + script)
    assert first[0] == "fault"
    assert "Chrome" in first[1]
    assert end == ["end"]
    assert "secure address" in insecure
    assert fine == ""


def test_a_replay_keeps_its_pace_and_can_be_stopped() -> None:
    lines = "sample 0 0 0\ntrial 9 1 stable 4\nsample 3 0 0\nsample 0.5 0 0\nsample 60000 1 1"
    script = """
    const waits = [];
    globalThis.setTimeout = ((real) => (act, ms) => { waits.push(ms); return real(act, 0); })(setTimeout);
    globalThis.performance = { now: () => 0 };
    await stream.replay(given[0], 10);
    await stream.replay(given[0], 0);
    const third = stream.replay(given[0], 10);
    stream.stop();
    await third;
    console.log(JSON.stringify([heard, waits]));"""
    heard, waits = in_node(COLLECT + script, lines)
    names = [name for name, *_ in heard]
    assert names == [
        "sample",
        "trial",
        "sample",
        "sample",
        "sample",
        "end",
        "fault",
        "end",
        "sample",
        "trial",
        "end",
    ]
    assert waits[:3] == pytest.approx([300.0, 300.0, 5300.0])
    assert heard[6][1].endswith("got 0.")


def test_a_frequency_beyond_the_header_s_nyquist_frequency_is_a_fault() -> None:
    lines = "#zwidth 1 period_s=0.001\ntrial 9 1 unstable 500\ntrial 9 1 unstable 501"
    script = "await stream.replay(given[0], Infinity); console.log(JSON.stringify(heard));"
    heard = in_node(COLLECT + script, lines)
    assert [name for name, *_ in heard] == ["trial", "fault", "end"]
    assert "at most 500 Hz" in heard[1][1]


def test_the_record_is_what_the_sketch_prints(program) -> None:
    recorded = make_paddle_record.RECORD.read_text(encoding="utf-8")
    assert make_paddle_record.record(cpp_compiler()) == recorded
    assert len(recorded) < 100_000


def test_the_record_is_read_without_a_fault_and_its_trials_are_points_for_python(tmp_path) -> None:
    script = """
    await stream.replay(given[0], Infinity);
    const trials = heard.filter(([name]) => name === "trial").map(([, trial]) => trial);
    console.log(JSON.stringify([heard.map(([name]) => name), paddle.toCsv(trials)]));"""
    recorded = make_paddle_record.RECORD.read_text(encoding="utf-8")
    names, table = in_node(COLLECT + script, recorded)
    assert set(names) == {"trial", "sample", "end"}
    file = tmp_path / "trials.csv"
    file.write_text(table)
    points = read_points(file)
    assert [(point.stiffness, point.damping, point.verdict) for point in points] == [
        one[:3] for one in trials(recorded)
    ]
    chart = paddle_chart(MASS, make_paddle_record.FRICTION, tmp_path)
    for point in points:
        radius = float(chart.check(point.stiffness, point.damping).spectral_radius)
        assert (radius < 1.0) is (point.verdict == "stable"), point
