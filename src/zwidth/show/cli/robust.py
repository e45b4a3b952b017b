"""`zwidth robust`: the walls stable for every member of a family of devices."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.device.read import LARGEST_FILE
from zwidth.device.text_file import Unreadable, read_text
from zwidth.show.cli.answer import Answer, deliver, sheet, table
from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.failures import NoAnswer, computing
from zwidth.show.cli.heading import heading
from zwidth.show.cli.measured import without_model
from zwidth.show.cli.options import Question, about_a_device, as_json, example, named, output_option
from zwidth.show.cli.progress import progress_told
from zwidth.show.motions import counted
from zwidth.show.output import DATA, FIGURES, destination, replacing, shown, write_data
from zwidth.show.units import amount, percent, radius, typed, uncertain

if TYPE_CHECKING:
    from zwidth.chart.robust.chart import RobustChart
    from zwidth.device.device import Device
    from zwidth.study.robust import Progress, RobustStudy
    from zwidth.study.robust_family import Range

KEYS: Final = (
    "regions",
    "boundary",
    "stiffness_max_N_per_m",
    "damping_at_stiffness_max_Ns_per_m",
    "frequency_at_stiffness_max_Hz",
    "frequencies_at_stiffness_max_Hz",
    "members_at_stiffness_max",
    "damping_max_Ns_per_m",
    "stable_area_N2s_per_m2",
    "fastest_decay",
    "fastest_decay_in_first_quadrant",
    "unobserved_modes",
    "members",
    "failed",
    "binding",
    "best_by_area",
    "best_by_stiffness",
    "lost_share",
    "lost_stiffness_share",
    "corner_blur",
    "search",
    "violation",
    "excluding",
)
MOST: Final = 100_000  # members, or unseen ones
TOLD: Final = 12  # binding members in what people read


@click.command(
    short_help="Find the walls that DEVICE renders stably whoever holds it.",
    epilog=example(
        "zwidth robust my-device.toml --range operator.arm_mass_kg=0.3,2 --range loop.delay_samples=0,1",
        "zwidth robust my-device.toml --operators none,thesis-arm,my-hand.toml --output robust.svg",
    ),
)
@about_a_device
@click.option(
    "--range",
    "ranges",
    metavar="PATH=LOW,HIGH[,log]",
    multiple=True,
    help="A number of the device file that is known within two values; repeatable. log: samples are spread evenly "
    "over its logarithm.",
)
@click.option("--operators", metavar="A,B,C", callback=named, help="Who may hold the handle: names, files, none.")
@click.option("--operator-list", metavar="FILE", callback=named, help="The same, one a line; # begins a comment.")
@click.option("--members", type=click.IntRange(2, MOST), default=256, metavar="N", help="Charts (default 256).")
@click.option(
    "--unseen",
    type=click.IntRange(1, MOST),
    default=10_000,
    metavar="N",
    help="Random members that the answer is tried on afterwards (default 10000).",
)
@click.option("--seed", type=click.IntRange(min=0), default=1, metavar="N", help="Of what is random (default 1).")
@output_option("Write a figure (.png .svg .pdf) or the data (.csv: the edge, .json).")
@as_json
def robust(
    question: Question,
    ranges: tuple[str, ...],
    operators: str | None,
    operator_list: str | None,
    members: int,
    unseen: int,
    seed: int,
    output: str | None,
    as_json: bool,
) -> int:
    """Find the walls that DEVICE renders stably for every operator of a list, and every value of numbers known in
    ranges."""
    from zwidth.study.robust import RobustError

    path = None if output is None else destination(output, FIGURES + DATA)
    held_by = _operators(question, operators, operator_list)
    varied = _ranges(ranges)
    device = question.device()
    if device.response is not None:
        return without_model(question, device, dict.fromkeys(KEYS) | {"decided": True}, as_json)
    if not varied and not held_by:
        raise BadInput(f"{question.name}: nothing varies; give --range PATH=LOW,HIGH or --operators A,B,C")
    try:
        with computing(question), progress_told() as progress:
            found = _computed(question, device, varied, held_by, (members, unseen, seed), progress)
    except (NoAnswer, RobustError) as none:
        unanswered = question.facts(device) | dict.fromkeys(KEYS) | {"decided": getattr(none, "decided", True)}
        return deliver(Answer(unanswered, reason=str(none)), as_json)
    reason = None if found.chart.members_at_stiffness_max else _reason(found)
    document = question.facts(device) | found.document() | {"decided": True}
    if path is not None:
        document["file"] = str(path)
        _write(path, found, document, reason)
    return deliver(Answer(document, lambda: list(_pages(question, device, found, path)), reason), as_json)


def _ranges(texts: tuple[str, ...]) -> tuple[Range, ...]:
    from zwidth.study.robust_family import Range

    found, lines = [], []
    for text in texts:
        path, equals, values = (part.strip() for part in text.partition("="))
        parts = [part.strip() for part in values.split(",")]
        logarithmic = len(parts) == 3 and parts[2] == "log"
        try:
            low, high = map(float, parts[:2] if logarithmic else parts)
        except ValueError:
            equals = ""
        if not equals or not path:
            lines.append(f"--range: must be PATH=LOW,HIGH or PATH=LOW,HIGH,log with two numbers, got {text!r}")
            continue
        found.append(Range(path, low, high, logarithmic))
    if lines:
        raise BadInput(*lines)
    return tuple(found)


def _operators(question: Question, names: str | None, file: str | None) -> tuple[str, ...]:
    if names is None and file is None:
        return ()
    if names is not None and file is not None:
        raise BadInput("--operators and --operator-list say the same; give one of them")
    if question.operator is not None:
        raise BadInput("--operator is one of those in the list; leave it out")
    if file is not None:
        try:
            lines = read_text(file, LARGEST_FILE).splitlines()
        except Unreadable as error:
            raise BadInput(f"--operator-list: {file}: {error}; give a text file, one name a line") from None
        listed = [line.split("#")[0].strip() for line in lines]
        found = tuple(dict.fromkeys(name for name in listed if name))
    else:
        found = tuple(dict.fromkeys(name.strip() for name in str(names).split(",")))
    if not found or "" in found:
        raise BadInput(f"--operators: must be names with commas between them, got {names or file!r}")
    return found


def _computed(
    question: Question,
    device: Device,
    ranges: tuple[Range, ...],
    operators: tuple[str, ...],
    counts: tuple[int, int, int],
    progress: Progress,
) -> RobustStudy:
    from zwidth.study.robust import robust_study
    from zwidth.study.robust_family import Family

    family = Family(device, ranges, operators, question.point(device))
    members, unseen, seed = counts
    return robust_study(family, members, unseen, seed, progress=progress)


def _reason(found: RobustStudy) -> str:
    """Why there is no wall for all."""
    names = [name_of(found, index) for index in found.chart.excluding]
    if len(names) == 1:
        return f"no wall with K > 0 and B >= 0 is stable for member {names[0]}"
    group = "these two members exclude each other" if len(names) == 2 else "these members have none in common"
    return f"no wall with K > 0 and B >= 0 is stable for every member; {group}: {'; '.join(names)}"


def name_of(found: RobustStudy, index: int) -> str:
    """A member in words: its number and its values."""
    values = ", ".join(f"{path} = {_cell(value)}" for path, value in found.members[index].items())
    return f"{index} ({values})"


def _pages(question: Question, device: Device, found: RobustStudy, path: Path | None) -> Iterator[Any]:
    yield heading(question, device)
    chart = found.chart
    if chart.members_at_stiffness_max:
        yield sheet(list(_rows(found)))
        binding = [index for index in chart.binding if index in _lengths(chart)]
        binding.sort(key=lambda index: -_lengths(chart)[index])
        paths = list(found.members[0])
        rows = [
            [str(index), *(_cell(found.members[index][p]) for p in paths), typed(percent(_lengths(chart)[index]))]
            for index in binding[:TOLD]
        ]
        yield table(["binds", *paths, "of the edge"], rows)
        if len(binding) > TOLD:
            yield f"... and {len(binding) - TOLD} more; --json lists all"
    if path is not None:
        yield f"written: {path}"


def _cell(value: Any) -> str:
    from zwidth.study.robust_family import in_words

    return shown(in_words(value))


def _lengths(chart: RobustChart) -> dict[int, float]:
    """Member -> share of the edge's length, on the chart as drawn."""
    import numpy as np

    size = np.ptp(np.vstack(chart.regions), axis=0)
    found: dict[int, float] = {}
    for arc in chart.boundary:
        length = float(np.hypot(np.diff(arc.stiffness) / size[0], np.diff(arc.damping) / size[1]).sum())
        found[arc.member] = found.get(arc.member, 0.0) + length
    total = sum(found.values())
    return {member: length / total for member, length in found.items()}


def _rows(found: RobustStudy) -> Iterator[tuple[str, str]]:
    chart = found.chart
    frequencies = " and ".join(amount(frequency, "Hz") for frequency in chart.frequencies_at_stiffness_max)
    members = " and ".join(map(str, chart.members_at_stiffness_max))
    yield (
        "largest stiffness",
        f"{amount(chart.stiffness_max, 'N/m')} at {amount(chart.damping_at_stiffness_max, 'Ns/m')} of damping; "
        f"there member {members} vibrates at {frequencies}",
    )
    yield (
        "lost against the best",
        (
            f"{typed(percent(chart.lost_stiffness_share))} of its stiffness (member {chart.best_by_stiffness}), "
            f"{typed(percent(chart.lost_share))} of its area (member {chart.best_by_area})"
        ),
    )
    yield "largest damping", amount(chart.damping_max, "Ns/m")
    yield "stable area", amount(chart.stable_area, "N²s/m²")
    yield "members", _members(found)
    if chart.failed:
        first = next(iter(chart.failed))
        yield (
            "not charted",
            (
                f"{len(chart.failed)} members, of which nothing is claimed; the first, {name_of(found, first)}: "
                f"{shown(chart.failed[first])}"
            ),
        )
    if found.violation is not None:
        yield "unseen members", _violation(found)
    if chart.unobserved_modes:
        yield "moved by no wall", ", ".join(counted(chart.unobserved_modes))


def _members(found: RobustStudy) -> str:
    count, moved = len(found.members), f"{typed(uncertain(100 * found.moved))} %"
    if found.violation is None:
        return f"{count}, all of the list"
    if found.settled:
        end = f"the search settled, its last round moved the edge by {moved} of the area"
    else:
        end = f"the search used up --members {count} and had still moved the edge by {moved}"
    return f"{count}, of which {count - found.sampled} found by searching the ranges for worse ones; {end}"


def _violation(found: RobustStudy) -> str:
    violation = found.violation
    assert violation is not None
    if not violation.violating:
        return f"of {violation.unseen} at random none finds one of these walls unstable"
    less = typed(uncertain(100 * violation.worst_stiffness_share))
    softer = f"{less} % less of the largest stiffness would do for all"
    if violation.worst_stiffness_share == 0.0:
        softer = "all of these have K <= 0 or B < 0"
    return (
        f"of {violation.unseen} at random {violation.violating} find a wall unstable, with spectral radii up to "
        f"{radius(violation.worst_spectral_radius)}; {softer}"
    )


def _write(path: Path, found: RobustStudy, document: dict[str, Any], reason: str | None) -> None:
    if path.suffix.lower() in DATA:
        write_data(path, document | ({} if reason is None else {"reason": reason}), found.chart.table())
        return
    from zwidth.show.figures.robust import draw_robust
    from zwidth.show.figures.style import figure, save

    drawing, ax = figure(5.6, 4.6)
    draw_robust(ax, found.chart, found.members)
    with replacing(path) as draft:
        save(drawing, draft)
