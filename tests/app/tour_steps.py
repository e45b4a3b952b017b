"""The steps of the guided tour, and what the walls of them do."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

import zwidth
from zwidth.show import page_files

STEPS = json.loads(page_files()["tour.json"])["steps"]


@cache
def answer(number: int, solved: bool) -> Any:
    """The verdict on the wall of a step, as it begins or solved; of a step about rest whether it rests."""
    step = STEPS[number]
    state, solution = step["state"], step["solution"] if solved else {}
    settings = {**state["settings"], **solution.get("settings", {})}
    device = zwidth.load(state["device"], settings, operator=solution.get("operator"))
    point, wall = device.at(), state["wall"]
    if step["until"] == "rests":
        return point.simulate(stiffness=wall["stiffness"], damping=wall["damping"]).stable
    return point.check(wall["stiffness"], wall["damping"])
