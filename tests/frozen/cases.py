"""Command lines that are asked of both commits."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from tests.frozen.devices import RecordDevice

# processor seconds that a run may take
LIMIT, LONG_LIMIT = 60.0, 180.0
SAMPLES = 400  # of a run in time


@dataclass(frozen=True)
class RecordWall:
    """Stiffness [N/m] and damping [N s/m] of a wall about a third into the stable set, two digits each."""

    stiffness: float = 1000.0
    damping: float = 1.0

    @classmethod
    def of_chart(cls, document: Mapping[str, object]) -> RecordWall:
        """From the chart that the first of the two commits gives; the default where it gives none."""
        stiffness, damping = document.get("stiffness_max_N_per_m"), document.get("damping_max_Ns_per_m")
        if not isinstance(stiffness, float) or not isinstance(damping, float) or not damping:
            return cls()
        return cls(float(f"{0.4 * stiffness:.2g}"), float(f"{0.3 * damping:.2g}"))

    def table(self) -> str:
        """Walls in and out of the stable set, for --points."""
        shares = [(a, b) for a in (-0.5, 0.2, 1.0, 2.2, 3.0) for b in (-0.5, 0.3, 1.0, 4.0)]
        rows = (f"{a * self.stiffness:.6g},{b * self.damping:.6g}" for a, b in shares)
        return "stiffness_N_per_m,damping_Ns_per_m\n" + "\n".join(rows) + "\n"


@dataclass(frozen=True)
class CommandLine:
    """One command line.

    name     command, device and, where there are several, what tells them apart: "map five-bar worst"
    words    the command line
    digest   of all that it reads: another generator makes another case
    quick    is it among those of --quick?
    """

    name: str
    words: tuple[str, ...]
    digest: str
    quantised: bool = False
    quick: bool = False
    limit: float = LIMIT

    @property
    def command(self) -> str:
        return self.words[0]

    @property
    def device(self) -> str:
        return self.name.split(" ", 1)[1]


def chart_case(device: RecordDevice, quick: bool = False) -> CommandLine:
    return _case(device, ("chart", device.word), quick=quick)


def cases(
    devices: list[RecordDevice], walls: Mapping[str, RecordWall], study_files: Mapping[str, str]
) -> list[CommandLine]:
    """Every command line, those that all devices have first: an interrupted comparison has looked at most."""
    made = [_case_without_device("devices"), _case_without_device("schema")]
    for index, device in enumerate(devices):
        quick = device.kind == "bundled" or index % 10 == 0
        made += _device_cases(device, index, walls.get(device.word, RecordWall()), quick)
    for name, text in study_files.items():
        command = "tolerance" if name.startswith("tolerances") else "sweep"
        made.append(
            _case_without_device(command, name, "--workers", "1", reads=text, quick=name == "study-plant.toml")
        )
    made += [_case_without_device(*words) for words in USAGE]
    return sorted(made, key=lambda case: _SHARE.get(case.command, 1))


def commands_with_arguments() -> set[str]:
    """Names of the commands that there are arguments for."""
    return {"devices", "schema", "sweep", "tolerance"} | set(_SHARE)


# commands without a number to compare: `new` and `import` write a device file, which tests of their own load and
# chart; `compile` answers how many kernels it had to compile; `identify` reads records, whose tests know the
# truth; limits of `export` end where a search has narrowed them to, and rounding may choose between its samples,
# as between the designs of `optimise`; `app` serves a page
COMMANDS_WITHOUT_NUMBERS = {"new", "compile", "import", "identify", "export", "optimise", "app"}
# what is asked of every n-th device only, because it takes long
_SHARE = {
    "show": 1,
    "chart": 1,
    "check": 1,
    "bounds": 1,
    "felt": 1,
    "simulate": 1,
    "polar": 1,
    "map": 1,
    "load": 4,
    "move": 1,
    "sensitivity": 3,
    "robust": 3,
    "report": 6,
    "guarantees": 8,
    "limit-cycles": 4,
    "experiment": 20,
}

ENVIRONMENTS = (
    "slot",
    "nonlinear_wall",
    "hunt_crossley",
    "coupled_wall",
    "friction_patch",
    "texture",
    "grating",
    "virtual_mass",
)
MEASURES = (
    "link_side_mass",
    "motor_side_mass",
    "stiffness",
    "manipulability",
    "isotropy_frobenius",
    "dynamic_manipulability",
    "dynamic_isotropy",
    "handle_mass_isotropy",
    "damping_max",
    "stable_area",
    "fastest_decay",
    "optimal_spectral_radius",
    "optimal_motor_side_mass",
    "spectral_radius",
    "decay_time",
    "structural_distortion",
    "felt_stiffness",
    "free_motion_force",
)
# bad input for a device whose file is silent on its motors, or on its encoders
FORCES, READINGS = ("peak_force", "acceleration_max"), ("position_resolution", "friction_force")
CLOSED_FORMS = ("stiffness_max_closed_form", "damping_max_closed_form", "stable_area_closed_form")
# bad input, and a question without an answer
USAGE = (
    ("chart", "no-such-device"),
    ("chart", "five-bar", "--at", "here"),
    ("chart", "five-bar", "--at", "0.5,0.5"),
    ("chart", "five-bar", "--set", "loop.delay=1"),
    ("check", "five-bar", "--stiffness", "1000"),
    ("show", "five-bar", "--direction", "0,0"),
    ("simulate", "hapkit-course", "--stiffness", "nan", "--damping", "1"),
    ("map", "five-bar", "--measure", "beauty"),
    ("robust", "hapkit-course"),
    ("move", "hapkit-course", "--push", "1"),
)


def _device_cases(device: RecordDevice, index: int, wall: RecordWall, quick: bool) -> Iterator[CommandLine]:
    yield chart_case(device, quick)
    for command, every in _SHARE.items():
        # offset, so that it is not always the same devices that have all the long ones
        asked = index % every == len(command) % every or device.kind == "bundled"
        if not asked or (device.kind == "faulty" and command not in ("show", "simulate")):
            continue
        for variant, words in _lines(command, device, wall, index):
            yield _case(device, (command, device.word, *words), variant, wall.table(), quick and every < 8)


def _lines(
    command: str, device: RecordDevice, wall: RecordWall, index: int
) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Variants of one command for a device, by name."""
    K, B, T = wall.stiffness, wall.damping, device.sampling_period
    at_wall = ("--stiffness", f"{K:g}", "--damping", f"{B:g}")
    beyond = ("--stiffness", f"{3 * K:g}", "--damping", f"{B:g}")
    duration = ("--duration", f"{SAMPLES * T:.6g}")
    in_space = device.kind == "mechanism" or device.word == "five-bar"
    match command:
        case "show":
            yield "", ()
            yield "two-mass", ("--model", "two-mass")
        case "chart":
            for model in ("two-mass", "motor-mass", "rigid"):
                yield model, ("--model", model)
            yield "held", ("--operator", "thesis-arm")
            yield "late", ("--set", "loop.delay_samples=1")
            if in_space:
                yield "corner", ("--with-direction", "1,0.3")
        case "sensitivity":
            yield "", ()
        case "check":
            yield "", ("--points", _points(device))
            yield "held", ("--points", _points(device), "--operator", "course-hand")
        case "bounds":
            yield "", ()
            yield "damping", ("--damping", f"{B:g}")
        case "felt":
            yield "", at_wall
            yield "held", (*at_wall, "--operator", "thesis-arm")
        case "simulate":
            yield "stable", (*at_wall, *duration)
            yield "beyond", (*beyond, *duration)
            yield "one-sided", (*at_wall, *duration, "--wall", "one-sided", "--start-position", "-1e-5")
            reach = ("--reach", "0.001,0,0.05", "--operator", "thesis-arm")
            yield "held", (*at_wall, *duration, "--wall", "one-sided", "--start-position", "-1e-5", *reach)
            yield "passivity", (*at_wall, *duration, "--passivity", f"{B:g}")
            environment = ENVIRONMENTS[index % len(ENVIRONMENTS)]
            yield environment, ("--environment", environment, "--start-position", "1e-4", *duration)
        case "polar" if in_space:
            yield "", ("--count", "8")
            yield "line", ("--count", "5", "--plane", "xz")
        case "load" if in_space:
            yield "", ("--count", "3")
            yield "weight", ("--count", "3", "--push", "0.5", "--gravity", "0,-9.81")
        case "map" if in_space:
            yield "stiffness", ("--measure", "stiffness_max", "--measure", "isotropy", "--cells", "5,4")
            yield "worst", ("--measure", "rigid_mass", "--direction", "worst", "--cells", "4,4")
            yield "require", ("--require", "rigid_mass>=0.2", "--require", "isotropy<=1.6", "--cells", "5,4")
            for name, measures, about in (
                ("measures", MEASURES, (*at_wall, "--frequency", "5")),
                ("forces", FORCES, ()),
                ("readings", READINGS, ()),
                ("closed forms", CLOSED_FORMS, ("--model", "motor-mass")),
            ):
                named = tuple(word for measure in measures for word in ("--measure", measure))
                yield name, (*named, *about, "--cells", "3,3")
        case "move" if in_space:
            yield "free", ("--push", "0.5", "--gravity", "0,-9.81,0", *duration)
            yield "ball", ("--sphere", "0,0,0.02", "--push", "0.2", *at_wall, *duration)
            yield "box", ("--box", "0,0.25,0.04,0.02", "--hollow", "--push", "1", *at_wall, *duration)
        case "robust":
            yield "range", ("--range", "loop.delay_samples=0,1", "--members", "4", "--unseen", "20")
            yield "operators", ("--operators", "none,thesis-arm")
        case "report":
            yield "", ("--output", "report.html")
        case "guarantees":
            yield "", ()
            if device.word == "hapkit-course":
                yield "coupling", ("--coupling", "--stiffness", "5000")
        case "limit-cycles":
            limited = ("--set", f"loop.saturation.force_N={K * 1e-4:g}")
            yield "predicted", (*beyond, *limited, "--no-simulation")
            if device.kind == "plant":
                yield "simulated", beyond
        case "experiment" if device.kind in ("plant", "bundled"):
            yield "", ("--stiffnesses", "2", "--tips", "1")


def _points(device: RecordDevice) -> str:
    return f"walls-{device.word.removesuffix('.toml')}.csv"


def points_files(devices: list[RecordDevice], walls: Mapping[str, RecordWall]) -> dict[str, str]:
    """Files for --points, by name."""
    return {_points(device): walls.get(device.word, RecordWall()).table() for device in devices}


def _case(
    device: RecordDevice, words: tuple[str, ...], variant: str = "", reads: str = "", quick: bool = False
) -> CommandLine:
    name = " ".join(filter(None, (words[0], device.word.removesuffix(".toml"), variant)))
    words = (*words, "--json")
    digest = _digest(*words, reads, *device.files.values())
    return CommandLine(
        name, words, digest, device.quantised, quick, LONG_LIMIT if words[0] == "experiment" else LIMIT
    )


def _case_without_device(*words: str, reads: str = "", quick: bool = True) -> CommandLine:
    line = (*words, "--json")
    return CommandLine(
        " ".join((*words[:1], " ".join(words[1:]) or "-")), line, _digest(*line, reads), quick=quick
    )


def _digest(*parts: str) -> str:
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:16]
