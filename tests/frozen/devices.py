"""All device files of the record, each from a seed of its own, and the studies beside them."""

from __future__ import annotations

import copy
import tomllib
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.frozen.measured import measured_file
from tests.frozen.mechanisms import mechanism_file
from tests.frozen.plants import plant_file
from tests.frozen.toml_text import toml_text

PLANTS, MECHANISMS, MEASURED = 34, 14, 6
# words of a device file of what makes a run chaotic: after one count that differs two runs part
QUANTISERS = ("resolution_m", "noise_m", "encoder_counts_per_rev", "coulomb", "force_N ", "torque_limit", "levant")


@dataclass(frozen=True)
class RecordDevice:
    """A device of the record.

    word    what DEVICE is on a command line
    kind    "plant", "mechanism", "response", "unanswered" or "faulty"
    files   text of its file and of those beside it, by name; none for a bundled device
    """

    word: str
    kind: str
    files: dict[str, str] = field(default_factory=dict)

    @property
    def quantised(self) -> bool:
        """Does it round, stick or saturate?"""
        return any(word in text for text in self.files.values() for word in QUANTISERS)

    @property
    def drives(self) -> int:
        """How many drives its mechanism has; 0 without one."""
        return self.files.get(self.word, "").count("motor_inertia_kg_m2")

    @property
    def sampling_period(self) -> float:
        """Of its computer [s]; a thousandth where its file cannot be read."""
        try:
            return float(tomllib.loads(self.files[self.word])["loop"]["sampling_period_s"])
        except (KeyError, ValueError):
            return 1e-3


def random_devices() -> list[RecordDevice]:
    """Sixty device files: plants, mechanisms, measured responses and some that have no answer."""
    made = [_device(f"plant-{seed:02d}", "plant", plant_file(seed)) for seed in range(PLANTS)]
    made += [_device(f"mechanism-{seed:02d}", "mechanism", mechanism_file(seed)) for seed in range(MECHANISMS)]
    for seed in range(MEASURED):
        table, beside = measured_file(seed)
        made.append(_device(f"measured-{seed:02d}", "response", table, beside))
    made += [
        _device(f"unanswered-{name}", "unanswered", table) for name, table in devices_without_answer().items()
    ]
    return made


def faulty_devices() -> list[RecordDevice]:
    """Device files with bad input: of each only the exit code and the number of lines are kept."""
    return [_device(f"faulty-{name}", "faulty", table) for name, table in faulty_files().items()]


def devices_without_answer() -> dict[str, dict[str, Any]]:
    """Device files that are right and have no answer: no stable wall, or a posture that is not reached."""
    undamped = _two_mass(damping=0.0) | {"loop": {"sampling_period_s": 0.001, "delay_samples": 1.0}}
    slow = copy.deepcopy(undamped)
    slow["loop"]["velocity"] = {"method": "least-squares-slope", "samples": 9}
    toppling = {
        "name": "Toppling",
        "plant": {"mass_kg": 0.2, "stiffness_N_per_m": -40.0},
        "loop": {"sampling_period_s": 0.5},
    }
    far = mechanism_file(1)
    far["mechanism"]["reference"]["position_m"] = [0.9, 0.9]
    behind = mechanism_file(2)
    behind["mechanism"]["reference"]["position_m"] = [0.0, 0.6]
    del behind["mechanism"]["workspace"]
    stretched = mechanism_file(5)
    reach = sum(link["length_m"] for link in stretched["mechanism"]["links"])
    stretched["mechanism"]["reference"]["position_m"] = [reach, 0.0]
    stretched["mechanism"]["assemblies"]["elbow-right"]["joints_rad"] = {"upper": 0.0, "lower": 0.0}
    return {
        "undamped": undamped,
        "slow": slow,
        "toppling": toppling,
        "far": far,
        "behind": behind,
        "stretched": stretched,
    }


def faulty_files() -> dict[str, dict[str, Any]]:
    """Device files with a slip: a key misspelt, a sign, a text, a matrix that is not symmetric, and several."""
    good = _two_mass(damping=2.0) | {"loop": {"sampling_period_s": 0.001}}

    def slip(**changes: Any) -> dict[str, Any]:
        table = copy.deepcopy(good)
        for path, value in changes.items():
            part, key = path.split("__")
            table[part][key] = value
        return table

    return {
        "misspelt": slip(plant__mas_kg=0.1),
        "negative": slip(loop__sampling_period_s=-0.001),
        "text": slip(plant__damping_Ns_per_m="2 Ns/m"),
        "asymmetric": slip(plant__stiffness_N_per_m=[[1000.0, -900.0], [-1000.0, 1000.0]]),
        "several": slip(loop__sampling_period_s=1000.0, plant__sensor=[1.0], loop__delay=3),
    }


def studies() -> dict[str, str]:
    """Study files by name."""
    return {
        "study-plant.toml": _study(
            "plant-01.toml",
            ["stiffness_max", "damping_max", "stable_area"],
            [
                {"key": "loop.delay_samples", "values": [0.0, 0.5, 1.0, 2.5]},
                {"key": "loop.sampling_period_s", "range": [2e-4, 2e-3], "count": 4, "scale": "log"},
            ],
        ),
        "study-five-bar.toml": _study(
            "five-bar",
            ["stiffness_max", "isotropy", "rigid_mass"],
            [
                {
                    "key": "links.upper-right.length_m",
                    "range": [0.03, 0.18],
                    "count": 4,
                    "tie": ["links.upper-left.length_m"],
                },
                {"key": "assembly", "values": ["elbows-out", "elbows-in"]},
            ],
        ),
        "study-workspace.toml": _study(
            "five-bar",
            ["worst(isotropy)", "average(rigid_mass)", "share(stiffness)"],
            [{"key": "drives.motor-left.stiffness_Nm_per_rad", "values": [0.4, 0.8]}],
            workspace={"x_m": [-0.05, 0.05], "y_m": [0.2, 0.28], "count": 5},
        ),
        "study-hypercube.toml": _study(
            "mechanism-01.toml",
            ["stiffness_max", "link_side_mass", "motor_side_mass"],
            [
                {"key": "links.lower.mass_kg", "range": [0.02, 0.3], "scale": "log"},
                {"key": "drives.elbow.transmission_ratio", "range": [4.0, 24.0]},
            ],
            sampling="latin-hypercube",
            count=12,
            seed=7,
        ),
        "tolerances-five-bar.toml": toml_text(
            {
                "device": "five-bar",
                "stiffness_N_per_m": 7000.0,
                "damping_Ns_per_m": 9.5,
                "draw": {"samples": 72, "index_samples": 32},
                "tolerance": [
                    {
                        "key": "damping.mode_ratio",
                        "distribution": "normal",
                        "standard_deviation_percent": 20.0,
                    },
                    {"key": "loop.sampling_period_s", "distribution": "uniform", "plus_minus_percent": 5.0},
                ],
            }
        ),
        "study-faulty.toml": _study("hapkit-course", ["no_such_measure"], [{"key": "plant.mass_kg"}]),
    }


def _study(device: str, measures: list[str], axes: list[dict[str, Any]], **more: Any) -> str:
    return toml_text({"device": device, "measures": measures, "axis": axes, **more})


def _device(name: str, kind: str, table: dict[str, Any], beside: dict[str, str] | None = None) -> RecordDevice:
    return RecordDevice(f"{name}.toml", kind, {f"{name}.toml": toml_text(table), **(beside or {})})


def _two_mass(damping: float) -> dict[str, Any]:
    pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
    plant = {
        "mass_kg": [[0.2, 0.0], [0.0, 0.03]],
        "damping_Ns_per_m": (damping * pair).tolist(),
        "stiffness_N_per_m": (2e4 * pair).tolist(),
        "actuator": [0.0, 1.0],
        "sensor": [0.0, 1.0],
        "handle": [1.0, 0.0],
    }
    return {"name": "Two masses", "plant": plant}
