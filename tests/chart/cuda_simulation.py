"""Numbers of charts in numba's simulator of a GPU, where kernels run as Python, and by the processor.

    NUMBA_ENABLE_CUDASIM=1 python tests/chart/cuda_simulation.py

prints one JSON object: the name of each number -> its values there, and here; those of a map's cells, too.
"""

from __future__ import annotations

import json

import numpy as np

from tests.systems import mass, published, random_loop
from zwidth.chart.chart_batch import DECAY, STIFFEST, WHOLE_EDGE, chart_numbers
from zwidth.chart.chart_cuda import numbers_on_gpu
from zwidth.device.load import load
from zwidth.loop import Controller, Loop, table_of_loops
from zwidth.study import plane_of, workspace_map

RANDOM = 3  # loops besides the two known ones


def main() -> None:
    """Compute and print."""
    rng = np.random.default_rng(5)
    known = published(), Loop(mass(0.3, 0.5), Controller(0.001, delay=0.5))
    loops = table_of_loops(*known, *(random_loop(rng) for _ in range(RANDOM)))
    found: dict[str, list[object]] = {}
    for what in (STIFFEST, STIFFEST | WHOLE_EDGE | DECAY):
        there, here = (numbers(loops, what)._asdict() for numbers in (numbers_on_gpu, chart_numbers))
        found |= {f"{name} {what}": [there[name].tolist(), here[name].tolist()] for name in there}
    device = load("five-bar")
    plane = plane_of(device, cells=(3, 2))
    there, here = (
        workspace_map(device, "stiffness_max", plane, processor=one)["stiffness_max"] for one in ("cuda", "cpu")
    )
    found["map"] = [there.values.tolist(), here.values.tolist()]
    print(json.dumps(found))


if __name__ == "__main__":
    main()
