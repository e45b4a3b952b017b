"""One number, one rounding: what commands, reports and figures print of a device's numbers is rounded alike."""

from __future__ import annotations

import html
import re
from collections.abc import Iterator
from typing import Any

import pytest
from matplotlib.text import Text

from tests.cli.command_runner import TWO_MASS, document_of, run_command
from zwidth.show.figures import style

WALL = ("--stiffness", "4000", "--damping", "10")
COMMANDS = {
    "chart": (),
    "show": (),
    "check": WALL,
    "bounds": (),
    "felt": WALL,
    "sensitivity": (),
    "simulate": ("--stiffness", "3000", "--damping", "12"),
}
UNITS = {
    "_N_per_m": "N/m",
    "_Ns_per_m": "N s/m",
    "_N2s_per_m2": "N² s/m²",
    "_Hz": "Hz",
    "_kg": "kg",
    "_s": "s",
    "_m": "m",
    "_J": "J",
}
LONGEST = 30
PREFIXES = {"n": 1e-9, "µ": 1e-6, "m": 1e-3, "": 1.0, "k": 1e3, "M": 1e6}
NUMBER = re.compile(
    r"(?<![\w.])(?P<digits>\d+\.?\d*)(?: ?× ?10(?P<power>[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+))?"
    r"(?: (?P<prefix>[nµmkM]?)(?P<unit>N/m|N s/m|N² s/m²|Hz|kg|s|m|J|%|×)(?![\w²/]))?"
)
SUPERSCRIPTS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
BLANKS = str.maketrans("\u00a0\u2009\u2212", "  -")


def numbers(text: str) -> Iterator[tuple[str, str, float, float]]:
    """Every number of three digits, with a unit two: its text, its unit, its size, and one of its last digit."""
    for match in NUMBER.finditer(text.translate(BLANKS)):
        digits, unit = match["digits"], match["unit"] or ""
        scale = PREFIXES[match["prefix"] or ""] * 10.0 ** int((match["power"] or "0").translate(SUPERSCRIPTS))
        if len(digits.replace(".", "").lstrip("0")) >= (2 if unit else 3):
            yield (
                match[0],
                unit.replace("×", ""),
                scale * float(digits),
                scale * 10.0 ** -len(digits.partition(".")[2]),
            )


def exact(document: Any, unit: str = "") -> Iterator[tuple[str, float]]:
    """Unit and size of every number in a command's document; what is asked or given stands in it as well."""
    if isinstance(document, dict):
        for key, value in document.items():
            known = next((own for ending, own in UNITS.items() if key.endswith(ending)), "")
            if key != "spectral_radius":
                yield from exact(value, known or unit)
    elif isinstance(document, list) and len(document) <= LONGEST:  # the samples of a curve are not printed
        for value in document:
            yield from exact(value, unit)
    elif isinstance(document, float) and document != 0.0:
        yield unit, abs(document)


def derived(documents: dict[str, Any]) -> Iterator[tuple[str, float]]:
    """Shares, ratios and gains that are printed and in no document."""
    top = documents["chart"]["stiffness_max_N_per_m"]
    for bound in documents["bounds"]["bounds"]:
        for key in ("stiffness_max_N_per_m", "stiffness_at_damping_N_per_m"):
            if bound.get(key):
                yield "", bound[key] / top
    for number in documents["sensitivity"]["sensitivities"]:
        slope = number["d_ln_stiffness_max_d_ln_value"]
        if slope:
            yield "", abs(slope)
            yield "%", abs(slope)
            yield "N/m", 0.01 * abs(slope) * top
    felt = documents["felt"]
    yield "%", 100.0 * felt["static_stiffness_N_per_m"] / 4000.0
    yield "%", 100.0 * felt["static_stiffness_at_stiffness_max_N_per_m"] / top
    yield from (("%", 100.0 * ratio) for ratio in documents["show"]["damping_ratios"] if ratio)


@pytest.fixture
def figure_texts(monkeypatch):
    """The words in every figure that is saved, those at its axes' ticks left out, and its caption, whose numbers
    are those that were chosen."""
    words: list[str] = []
    save = style.save

    def kept(figure, path):
        found = figure.findobj(Text)
        ticks = {
            text
            for ax in figure.axes
            for axis in (ax.xaxis, ax.yaxis)
            for text in [*axis.get_ticklabels(which="both"), axis.get_offset_text()]
        }
        caption = figure.get_supxlabel()
        words.extend(text.get_text() for text in found if text not in ticks and text.get_text() != caption)
        save(figure, path)

    monkeypatch.setattr(style, "save", kept)
    return words


def test_no_number_is_printed_in_two_roundings(figure_texts, tmp_path):
    documents = {command: document_of(command, TWO_MASS, *options) for command, options in COMMANDS.items()}
    known = {*derived(documents), *(pair for document in documents.values() for pair in exact(document))}
    texts = {}
    for command, options in COMMANDS.items():
        figure = () if command in ("show", "check", "simulate") else ("--output", tmp_path / f"{command}.svg")
        texts[command] = run_command(command, TWO_MASS, *options, *figure).out
    texts["figures"] = "\n".join(figure_texts)
    page = tmp_path / "report.html"
    texts["report"] = run_command("report", TWO_MASS, "--output", page).out
    bare = re.sub(r"(?s)<(svg|style|script).*?</\1>|<[^>]*>", " ", page.read_text())
    texts["page"] = html.unescape(bare)
    wrong = {
        f"{where}: {text} is {size:.9g} {unit}"
        for where, written in texts.items()
        for text, own, value, last in numbers(written)
        for unit, size in known
        if own == unit and abs(value - size) <= last and not _is_rounded(value, size)
    }
    assert not wrong, sorted(wrong)
    seen = {text for written in texts.values() for text, *_ in numbers(written)}
    assert {"7.134 kN/m", "9.975 N s/m", "174.5 Hz"} <= seen  # the numbers are found at all


def _is_rounded(value: float, size: float) -> bool:
    """Is it the number in four digits, to nearest, or the number itself?"""
    return any(abs(value - right) <= 1e-9 * size for right in (size, float(f"{size:.3e}")))
