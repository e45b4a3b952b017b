"""The front's designs as device files, ready to use."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from zwidth.device.address import UNSET
from zwidth.device.edit_file import edited_text
from zwidth.device.read import LARGEST_FILE
from zwidth.device.text_file import UnreadableFileError, read_text
from zwidth.study.designs.sampling import CIRCUMSTANCES, WANTED
from zwidth.study.designs.study import Study
from zwidth.study.optimise.optimisation import Optimisation

# Circumstance -> where a device file has it.
PLACES: Final = {
    "at": "mechanism.reference.position_m",
    "direction": "mechanism.reference.direction",
    "assembly": "mechanism.reference.assembly",
}
NO_PLACE: Final = ("model", *WANTED)  # circumstances that no device file has


def device_files(found: Optimisation) -> Iterator[tuple[str, str]]:
    """Name and text of a file for each design of the front, in its order: the study's device file with its
    comments, the changes of `set`, and the design's numbers, whose sources say where they come from.

    Position, direction, assembly and operator, of the study or of the design, go into the file too. What has no
    place there, such as a model, is said in a comment at its beginning.
    """
    study = found.problem.study
    stem = _stem(study)
    width = len(str(len(found.front)))
    for place in range(len(found.front)):
        settings = found.settings(place)
        numbers = {key: value for key, value in settings.items() if key not in CIRCUMSTANCES}
        source = f"{_origin(study)}, seed {found.problem.seed}, design {place + 1}"
        given = {key: study.document[key] for key in CIRCUMSTANCES if key in study.document} | settings
        changes: list[str | tuple[str, Any]] = [*study.document.get("set", ())]
        changes += [(path, _plain(given[key])) for key, path in PLACES.items() if key in given]
        changes += _operator(found, settings)
        text = edited_text(study.device.label, [*changes, *numbers.items()], dict.fromkeys(numbers, source))
        missing = [f"{key} = {given[key]}" for key in NO_PLACE if key in given]
        head = (
            f"# The design was judged with {', '.join(missing)}, which no device file holds.\n" if missing else ""
        )
        head += "" if numbers else f"# {source}\n"
        yield f"{stem}-{place + 1:0{width}d}.toml", head + text


def files_there(folder: Path, study: Study) -> tuple[list[Path], list[Path]]:
    """Files in a folder that are called as the designs of a study are: those that it has written earlier, whose
    place its next designs take, and others. None where there is no folder.

    Raises  OSError  where it cannot be read
    """
    if not folder.is_dir():
        return [], []
    name = re.compile(rf"{re.escape(_stem(study))}-\d+\.toml")
    named = [path for path in sorted(folder.iterdir()) if name.fullmatch(path.name)]
    own = [path for path in named if _is_of(path, study)]
    return own, [path for path in named if path not in own]


def _is_of(path: Path, study: Study) -> bool:
    try:
        return f"{_origin(study)}, seed " in read_text(path, LARGEST_FILE)
    except UnreadableFileError:
        return False


def _stem(study: Study) -> str:
    """What the names of the files begin with: the name of the device's."""
    return Path(study.device.label).name.removesuffix(".toml")


def _origin(study: Study) -> str:
    return f"optimised, study {Path(study.label).name}"


def _operator(found: Optimisation, settings: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """The changes that give a device file the operator of a design or of the study; none of those of a task."""
    study = found.problem.study
    if "operator" in settings:
        table = study.operators[settings["operator"]]
    elif "operator" in study.document:
        table = study.device.document.get("operator")
    else:
        return
    yield "operator", UNSET
    for key, value in (table or {}).items():
        yield f"operator.{key}", value


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value
