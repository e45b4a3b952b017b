"""Random devices with measured boundaries: the exact edge with scatter, or a virtual experiment."""

from __future__ import annotations

import json

import numpy as np

import zwidth
from zwidth.chart import EdgeChords
from zwidth.errors import ChartError
from zwidth.identify import record_of
from zwidth.identify.boundary.identify import COLUMNS


def random_document(rng):
    """Two masses: 0.2-20 kHz sampling, a mode from 1 Hz to 0.4 of the sampling rate, 1-30 % damping."""
    rate = 10.0 ** rng.uniform(np.log10(200.0), np.log10(20000.0))
    m1, m2 = 10.0 ** rng.uniform(-2.0, 0.0, 2)
    f = 10.0 ** rng.uniform(0.0, np.log10(0.4 * rate))
    w, reduced = 2.0 * np.pi * f, m1 * m2 / (m1 + m2)
    k, b = w**2 * reduced, 2.0 * 10.0 ** rng.uniform(-2.0, -0.5) * w * reduced
    link = np.array([[1.0, -1.0], [-1.0, 1.0]])
    return {
        "name": "random",
        "plant": {
            "mass_kg": [[float(m1), 0.0], [0.0, float(m2)]],
            "damping_Ns_per_m": (b * link).tolist(),
            "stiffness_N_per_m": (k * link).tolist(),
            "actuator": [0.0, 1.0],
            "sensor": [0.0, 1.0],
            "handle": [1.0, 0.0],
        },
        "loop": {"sampling_period_s": float(1.0 / rate), "delay_samples": float(rng.uniform(0.1, 2.0))},
    }


def random_device(rng, folder):
    """Such a device, loaded from a file, whose chart has a tip at K > 0."""
    while True:
        document = random_document(rng)
        path = folder / "random.toml"
        path.write_text(toml(document), encoding="utf-8")
        try:
            device = zwidth.load(path)
            chart = device.at().chart(decay=False)
        except ChartError:
            continue
        if chart.stiffness_max > 0.0:
            return device, EdgeChords.of(chart)


def toml(document):
    """The document as TOML."""
    lines = [f'name = "{document["name"]}"']
    for name in ("plant", "loop"):
        lines.append(f"[{name}]")
        lines += [f"{key} = {json.dumps(value)}" for key, value in document[name].items()]
    return "\n".join(lines) + "\n"


def measured(rng, chords, scatter=0.01, count=10, tips=4, frequency=0.0):
    """Columns of points on the exact edge, with scatter as a share of the largest damping and stiffness.

    frequency  scatter of the frequencies as a share; 0: they are not measured
    """
    K1, B1 = chords.box[1], chords.box[3]
    tip = chords.first[np.argmax(chords.first[:, 0])]
    K, near = np.linspace(0.1, 0.9, count) * K1, np.full(count, tip[1])
    lower, upper = (chords.crossings(K, near, edge) for edge in ("lower", "upper"))
    B = np.linspace(0.6, 1.3, tips) * tip[1]
    ends = chords.crossings(B, np.full(tips, tip[0]), "tip")
    rows = [
        *zip(K, lower[0] + scatter * B1 * rng.normal(size=count), lower[1], ["lower"] * count, strict=True),
        *zip(K, upper[0] + scatter * B1 * rng.normal(size=count), upper[1], ["upper"] * count, strict=True),
        *zip(ends[0] + scatter * K1 * rng.normal(size=tips), B, ends[1], ["tip"] * tips, strict=True),
    ]
    rows = [row for row in rows if np.isfinite(row[:2]).all()]
    columns = dict(
        zip(
            ("stiffness_N_per_m", "damping_Ns_per_m", "frequency_Hz", "edge"), zip(*rows, strict=True), strict=True
        )
    )
    if frequency:
        f = np.array(columns["frequency_Hz"])
        columns["frequency_Hz"] = f + frequency * np.max(f) * rng.normal(size=len(f))
    else:
        del columns["frequency_Hz"]
    return columns


def record(columns, label="points"):
    return record_of(columns, COLUMNS, label)
