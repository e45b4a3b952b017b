"""The front's designs as device files, ready to use."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from zwidth.device.edit_file import edited_text
from zwidth.study.designs.sampling import CIRCUMSTANCES
from zwidth.study.optimise.optimisation import Optimisation


def device_files(found: Optimisation) -> Iterator[tuple[str, str]]:
    """Name and text of a file for each design of the front, in its order: the study's device file with its
    comments, the changes of `set`, and the design's numbers, whose sources say where they come from.

    Circumstances that are varied, such as an assembly or a direction, have no place in a device file.
    """
    study = found.problem.study
    stem = Path(study.device.label).name.removesuffix(".toml")
    width = len(str(len(found.front)))
    for place in range(len(found.front)):
        numbers = {key: value for key, value in found.settings(place).items() if key not in CIRCUMSTANCES}
        text = f"optimised, study {Path(study.label).name}, seed {found.problem.seed}, design {place + 1}"
        changes = [*study.document.get("set", ()), *numbers.items()]
        sources = dict.fromkeys(numbers, text)
        yield f"{stem}-{place + 1:0{width}d}.toml", edited_text(study.device.label, changes, sources)
