"""Write src/zwidth/show/app/page/paddle_record.txt: lines of a paddle that the workbench replays without one.

`make docs` runs this. The lines are those of the paddle's own sketch, compiled here around a simulated mass
(`tests/app/paddle_simulation.py`); where there is no C++ compiler the record stays as it is.
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.app.paddle_simulation import FRICTION, MASS, SKETCH, compile_sketch, cpp_compiler, run_sketch

RECORD: Final = SKETCH.with_name("paddle_record.txt")
DURATION: Final = 19.5  # s
# Each begins at about two thirds of the largest stable stiffness, and has ended when the next is sent.
SWEEPS: Final = (
    (0.3, "sweep 0.5 750 1500 120"),
    (5.1, "sweep 1 1450 2500 180"),
    (9.9, "sweep 2 2800 4500 290"),
    (14.7, "sweep 3 4100 6500 400"),
)


def record(compiler: str) -> str:
    """The record: a comment that says what it is, then what the sketch prints; the same on every computer."""
    with TemporaryDirectory() as folder:
        printed = run_sketch(compile_sketch(compiler, Path(folder)), DURATION, *SWEEPS)
    header, _, lines = printed[: printed.rindex("\n") + 1].partition("\n")  # without a line that time has cut
    return f"{header}\n# simulated paddle: mass {MASS} kg, viscous friction {FRICTION} N s/m, no hand\n{lines}"


def main() -> None:
    compiler = cpp_compiler()
    if compiler is None:
        print(f"no C++ compiler here: {RECORD} stays as it is")
        return
    RECORD.write_text(record(compiler), encoding="utf-8", newline="\n")
    print(RECORD)


if __name__ == "__main__":
    main()
