"""The exported C header: what it answers is what the table answers, and compilers have nothing to say."""

from __future__ import annotations

import shutil
import struct
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from zwidth.device.load import load
from zwidth.errors import OutputError
from zwidth.loop import BackwardDifference, Butterworth, FirstOrder, ForceSensor, WindowedDifference
from zwidth.show import HEADER_NAME, header_text
from zwidth.show.safe_walls_header import sketch_obstacle, sketch_text, write_sketch
from zwidth.study import safe_walls

STRICT = ("-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wshadow", "-Wundef", "-O1")
SANITIZED = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")
CASES = {"plane": ("five-bar", 2), "alone": ("published-two-mass", 1)}

# Reads rows of position, direction and stiffness; writes what the three functions say of each.
PROGRAM = """
#include <stdio.h>
#include "safe_walls.h"
int main(void)
{
  double in[7];
  while (fread(in, sizeof(double), 7, stdin) == 7) {
    double out[9];
    double stiffness = in[6];
    double damping = 1.5;
    out[0] = (double)zwidth_safe_wall(in, &out[1], &out[2], &out[3]);
    out[4] = (double)zwidth_safe_damping(in, in + 3, in[6], &out[5], &out[6]);
    (void)zwidth_clamp_wall(in, &stiffness, &damping);
    out[7] = stiffness;
    out[8] = damping;
    if (fwrite(out, sizeof(double), 9, stdout) != 9) {
      return 1;
    }
  }
  return 0;
}
"""
BOARD = """
#ifndef ARDUINO_STUB
#define ARDUINO_STUB
#include <math.h>
enum { LOW, HIGH, OUTPUT, A0 };
inline int analogRead(int pin) { return 512 + pin; }
inline void analogWrite(int, int) {}
inline void digitalWrite(int, int) {}
inline void pinMode(int, int) {}
inline unsigned long micros() { static unsigned long now = 0; return now += 100; }
#endif
"""
# What 8-bit boards read tables by, counting here that nothing else reads them.
FLASH = """
static int reads_of_flash = 0;
#define PROGMEM __attribute__((section(".rodata.flash")))
static inline float pgm_read_float(const float *address) { ++reads_of_flash; return *address; }
static inline unsigned char pgm_read_byte(const unsigned char *address) { ++reads_of_flash; return *address; }
"""


@pytest.fixture(scope="module")
def compiler():
    found = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if found is None:
        pytest.skip("no C compiler here")
    return found


@pytest.fixture(scope="module")
def cpp_compiler():
    found = shutil.which("c++") or shutil.which("g++") or shutil.which("clang++")
    if found is None:
        pytest.skip("no C++ compiler here")
    return found


@pytest.fixture(scope="module", params=CASES)
def table(request):
    name, directions = CASES[request.param]
    # cells of which some are out of reach
    cells = {"x": (-0.1, 0.1), "y": (0.15, 0.4), "cells": (3, 2)} if name == "five-bar" else {}
    return safe_walls(load(name), levels=3, directions=directions, workers=1, **cells)


def compiled(folder, program, compiler, *options, name="program.c"):
    (folder / name).write_text(program)
    binary = folder / "program"
    done = subprocess.run(
        [compiler, *options, *STRICT, "-o", str(binary), str(folder / name)], capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")
    return binary


def asked(binary, rows):
    done = subprocess.run([binary], input=rows.astype(np.float64).tobytes(), capture_output=True, check=True)
    assert done.stderr == b""
    return np.frombuffer(done.stdout).reshape(len(rows), 9)


def rows_to_ask(table):
    """Random places, borders between cells and at the edge, levels of stiffness, and what is no number."""
    rng = np.random.default_rng(7)
    grid, n = table.grid, 4000
    rows = np.zeros((n, 7))
    d = max(grid.dimensions, 1)
    if grid.dimensions:
        low, high = grid.low - 0.02, grid.high + 0.02
        rows[:, :d] = low + (high - low) * rng.random((n, d))
        lines = np.stack([rng.choice(grid.lines(k), n) for k in range(d)], axis=1)
        rows[:, :d] = np.where(rng.random((n, d)) < 0.2, lines, rows[:, :d])
        beside = np.nextafter(lines, rng.choice([-np.inf, np.inf], (n, d)))
        rows[:, :d] = np.where(rng.random((n, d)) < 0.1, beside, rows[:, :d])
    rows[:, 3 : 3 + d] = rng.standard_normal((n, d)) * 10.0 ** rng.uniform(-5, 5, (n, 1))
    rows[: n // 4, 3 : 3 + d] = np.round(rows[: n // 4, 3 : 3 + d])
    rows[:, 6] = rng.uniform(-100.0, 1.2 * table.top.max(), n)
    levels = table.top.ravel()[rng.integers(table.top.size, size=n)] * rng.integers(0, table.levels + 1, n)
    rows[::3, 6] = levels[::3] / table.levels
    strange = [np.nan, np.inf, -np.inf, 1e300, -1e300, 0.0, -0.0, 5e-324]
    for value in strange:
        for column in range(7):
            rows[rng.integers(n, size=4), column] = value
    return rows


def expected(table, row):
    d = max(table.grid.dimensions, 1)
    code, box = table.at(row[:d])
    of_direction = table.damping_at(row[:d], row[6], row[3 : 3 + d] if table.grid.dimensions else None)
    stiffness = min(row[6], box.stiffness) if row[6] >= 0.0 else 0.0
    return [code, box.stiffness, box.low, box.high, *of_direction, stiffness, min(max(1.5, box.low), box.high)]


def test_c_answers_as_the_table_does_bit_for_bit_and_sanitizers_are_silent(tmp_path, compiler, table):
    (tmp_path / HEADER_NAME).write_text(header_text(table))
    rows = rows_to_ask(table)
    answers = asked(compiled(tmp_path, PROGRAM, compiler, "-std=c99", *SANITIZED), rows)
    wanted = np.array([expected(table, row) for row in rows])
    np.testing.assert_array_equal(answers, wanted)
    codes = set(answers[:, 0])
    assert codes == ({0.0, 1.0} if table.grid.dimensions else {0.0})
    assert {0.0, 2.0} <= set(answers[:, 4])


@pytest.mark.parametrize("standard", ["c++98", "c++17"])
def test_it_is_cpp_as_well(tmp_path, cpp_compiler, table, standard):
    (tmp_path / HEADER_NAME).write_text(header_text(table))
    binary = compiled(tmp_path, PROGRAM, cpp_compiler, f"-std={standard}", *SANITIZED, name="program.cpp")
    rows = rows_to_ask(table)[:200]
    np.testing.assert_array_equal(asked(binary, rows), [expected(table, row) for row in rows])


def test_8_bit_boards_read_the_tables_from_their_program_memory(tmp_path, compiler, table):
    (tmp_path / HEADER_NAME).write_text(header_text(table))
    (tmp_path / "avr").mkdir()
    (tmp_path / "avr" / "pgmspace.h").write_text(FLASH)
    counted = PROGRAM.replace("  return 0;\n}", "  return (reads_of_flash > 0) ? 0 : 2;\n}")
    assert counted != PROGRAM
    binary = compiled(tmp_path, counted, compiler, "-std=c99", "-D__AVR__", f"-I{tmp_path}")
    rows = rows_to_ask(table)[:100]
    np.testing.assert_array_equal(asked(binary, rows), [expected(table, row) for row in rows])


def test_with_doubles_of_32_bits_nothing_that_was_unsafe_becomes_safe(tmp_path, compiler, table):
    """As on 8-bit boards: positions and stiffness are rounded, and may fall into the neighbour, whose cells and
    bands overlap; what is said is nowhere more than the larger of both."""
    (tmp_path / HEADER_NAME).write_text(header_text(table).replace("double", "float"))
    program = PROGRAM.replace("double", "float").replace("sizeof(float)", "4")
    options = ("-std=c99", "-Wno-conversion", "-Wno-float-conversion")
    (tmp_path / "program.c").write_text(program)
    binary = tmp_path / "program"
    done = subprocess.run(
        [compiler, *options, "-o", str(binary), str(tmp_path / "program.c")], capture_output=True
    )
    assert (done.returncode, done.stderr) == (0, b"")
    if not table.grid.dimensions:
        return
    rng = np.random.default_rng(3)
    grid, n = table.grid, 1000
    rows = np.zeros((n, 7), dtype=np.float32)
    rows[:, :2] = grid.low + (grid.high - grid.low) * rng.random((n, 2))
    rows[:, 3:5], rows[:, 6] = rng.standard_normal((n, 2)), 0.9 * table.top.max() * rng.random(n)
    answers = np.frombuffer(
        subprocess.run([binary], input=rows.tobytes(), capture_output=True, check=True).stdout, dtype=np.float32
    )
    wanted = np.array([expected(table, row) for row in rows.astype(np.float64)])
    same = np.isclose(answers.reshape(n, 9), wanted, rtol=1e-6).all(axis=1)
    assert same.mean() > 0.98


def test_the_sketch_compiles_and_clamps_its_gains(tmp_path, cpp_compiler, table):
    folder = tmp_path / "my-wall"
    write_sketch(folder, table)
    assert sorted(path.name for path in folder.iterdir()) == ["my-wall.ino", HEADER_NAME]
    program = (
        f"{BOARD}\n{(folder / 'my-wall.ino').read_text()}\nint main() {{ setup(); loop(); loop(); return 0; }}\n"
    )
    (tmp_path / HEADER_NAME).write_text(header_text(table))
    binary = compiled(tmp_path, program, cpp_compiler, "-std=c++11", *SANITIZED, name="program.cpp")
    assert subprocess.run([binary]).returncode == 0
    assert f"PERIOD_US = {round(1e6 * table.device.controller.sampling_period)}UL" in sketch_text(table)


OTHER_LOOPS = {
    "filter of the velocity": {"velocity_filter": FirstOrder(0.002)},
    "filter of the force": {"force_filter": Butterworth(2, 100.0)},
    "estimator": {"velocity": WindowedDifference(4)},
    "force sensor": {"force_sensor": ForceSensor(0.5)},
}


@pytest.fixture(scope="module")
def small():
    return safe_walls(load("published-two-mass"), levels=3, workers=1)


@pytest.mark.parametrize("parts", OTHER_LOOPS.values(), ids=OTHER_LOOPS)
def test_no_sketch_is_written_for_a_loop_that_it_does_not_compute(tmp_path, small, parts):
    other = replace(small, device=replace(small.device, controller=replace(small.device.controller, **parts)))
    with pytest.raises(OutputError, match="another loop"):
        write_sketch(tmp_path / "my-wall", other)
    assert not (tmp_path / "my-wall").exists()
    assert header_text(other) != header_text(small), "which names what the table is about"


def test_a_lag_behind_the_computer_is_no_part_of_the_sketch(small):
    controller = replace(small.device.controller, actuator_time_constant=0.001, delay=0.5)
    assert sketch_obstacle(controller) == ""
    assert sketch_obstacle(replace(controller, velocity=BackwardDifference())) == ""


@pytest.mark.parametrize(("size", "compiles"), [(63_000, True), (66_000, False)])
def test_tables_beyond_16_bit_addresses_together_refuse_to_compile(tmp_path, compiler, small, size, compiles):
    """Each array of them is small enough for itself."""
    text = header_text(small)
    own = f"#define ZWIDTH_BYTES {small.size}UL"
    assert own in text
    (tmp_path / HEADER_NAME).write_text(text.replace(own, f"#define ZWIDTH_BYTES {size}UL"))
    (tmp_path / "avr").mkdir()
    (tmp_path / "avr" / "pgmspace.h").write_text(FLASH)
    (tmp_path / "program.c").write_text(PROGRAM)
    for avr, expected_to in ((True, compiles), (False, True)):
        options = ["-D__AVR__"] if avr else []
        done = subprocess.run(
            [compiler, "-std=c99", *options, f"-I{tmp_path}", "-fsyntax-only", str(tmp_path / "program.c")],
            capture_output=True,
            text=True,
        )
        assert (done.returncode == 0) is expected_to, done.stderr


def test_the_size_of_the_tables_is_that_of_their_arrays(tmp_path, compiler, table):
    (tmp_path / HEADER_NAME).write_text(header_text(table))
    arrays = " + ".join(f"sizeof(zwidth_{name})" for name in ("level", "top", "low", "high"))
    program = f'#include "safe_walls.h"\nint main(void) {{ return ({arrays}) == ZWIDTH_BYTES ? 0 : 1; }}\n'
    (tmp_path / "size.c").write_text(program)
    subprocess.run([compiler, "-std=c99", "-o", str(tmp_path / "size"), str(tmp_path / "size.c")], check=True)
    assert subprocess.run([tmp_path / "size"]).returncode == 0


def test_two_files_may_include_it(tmp_path, compiler, table):
    (tmp_path / HEADER_NAME).write_text(header_text(table))
    (tmp_path / "other.c").write_text('#include "safe_walls.h"\nint other(void);\nint other(void) { return 1; }\n')
    (tmp_path / "main.c").write_text(
        2 * '#include "safe_walls.h"\n' + "int other(void);\nint main(void) { return other() - 1; }\n"
    )
    files = [str(tmp_path / name) for name in ("main.c", "other.c")]
    done = subprocess.run(
        [compiler, "-std=c99", *STRICT, "-o", str(tmp_path / "two"), *files], capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_names_cannot_end_a_comment(table):
    named = replace(table, device=replace(table.device, name="Evil */ int x; /* ä\n??/"), hands=("*/",))
    text = header_text(named)
    assert "Evil * / int x; / * \\xe4\\n? ?/" in text
    assert text.isascii()
    assert text.count("/*") == text.count("*/")


def test_numbers_are_written_exactly(table):
    text = header_text(table)
    listed = text.partition("zwidth_top[")[2].partition("{")[2].partition("}")[0]
    values = [struct.unpack("f", struct.pack("f", float(one.strip().rstrip("f"))))[0] for one in listed.split(",")]
    np.testing.assert_array_equal(values, table.top.ravel())
    assert f"take {table.size} bytes" in text
