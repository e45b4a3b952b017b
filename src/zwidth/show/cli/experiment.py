"""`zwidth experiment`: a stability boundary measured on the virtual device."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.show.cli.answer import Answer, deliver, sheet, table
from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.failures import NoAnswer, computing
from zwidth.show.cli.heading import heading
from zwidth.show.cli.measured import without_model
from zwidth.show.cli.options import Numbers, Question, about_a_device, as_json, example, named, output_option
from zwidth.show.cli.points import PointFromBench, read_measured
from zwidth.show.cli.process import say
from zwidth.show.cli.progress import progress_told
from zwidth.show.experiment import numbers, point_rows, point_table, sentences
from zwidth.show.output import DATA, FIGURES, OutputError, destination, replacing, write_data

if TYPE_CHECKING:
    from zwidth.device.device import Device
    from zwidth.study.experiment import Experiment, Plan
    from zwidth.study.journal import Journal

KEYS: Final = (
    "points",
    "lost",
    "warning",
    "stiffness_max_N_per_m",
    "damping_at_stiffness_max_Ns_per_m",
    "exact_stiffness_max_N_per_m",
    "visible_m",
    "subjects",
    "explanation",
    "measured",
    "measured_counts",
)
MOST: Final = 1000
PUSH: Final = 2.0  # N, against a one-sided wall
SPEED: Final = 0.02  # m/s
DISTURBANCE: Final = 1e-3  # m, at a two-sided wall


def _range(ctx: click.Context, param: click.Parameter, span: tuple[float, float] | None) -> Any:
    if span and not span[0] < span[1]:
        raise click.BadParameter(f"needs LOW < HIGH, such as 0,8000; got {span[0]:g},{span[1]:g}")
    return span


@click.command(
    short_help="Measure a stability boundary on the virtual DEVICE.",
    epilog=example(
        "zwidth experiment my-device.toml --output boundary.svg",
        "zwidth experiment my-device.toml --operator thesis-arm --wall one-sided --subjects 2 --trials 4",
        "zwidth experiment my-device.toml --measured bench.csv --output compared.png",
    ),
)
@about_a_device
@click.option(
    "--wall", type=click.Choice(("two-sided", "one-sided")), default="two-sided", help="Default: two-sided."
)
@click.option(
    "--stiffnesses",
    type=click.IntRange(1, MOST),
    default=16,
    metavar="N",
    help="At how many stiffnesses the damping is bisected (default 16).",
)
@click.option(
    "--tips",
    type=click.IntRange(0, MOST),
    default=8,
    metavar="N",
    help="At how many dampings the stiffness is, near the tip (default 8).",
)
@click.option(
    "--stiffness", type=Numbers("KMIN,KMAX", (2,), "0,8000"), callback=_range, help="Where to look [N/m]."
)
@click.option("--damping", type=Numbers("BMIN,BMAX", (2,), "0,30"), callback=_range, help="Where to look [Ns/m].")
@click.option(
    "--disturbance",
    type=float,
    metavar="M",
    help="Displaced by this [m], from a two-sided wall (default 0.001; at most 1).",
)
@click.option(
    "--visible",
    type=float,
    metavar="M",
    help="A lasting vibration up to this amplitude [m] counts as none (default: three encoder steps and ten "
    "standard deviations of the noise).",
)
@click.option(
    "--push", type=float, metavar="N", help="Of the hand [N] (default: 2 against a one-sided wall, else 0)."
)
@click.option(
    "--speed", type=float, metavar="V", help="At the start [m/s] (default: 0.02 to a one-sided wall; at most 100)."
)
@click.option(
    "--reflex", is_flag=True, help="The hand stiffens threefold, 50 ms after the wall has half of the push."
)
@click.option("--subjects", type=click.IntRange(1, MOST), default=1, metavar="N", help="Operators (default 1).")
@click.option(
    "--trials", type=click.IntRange(1, MOST), default=1, metavar="N", help="Of each subject (default 1)."
)
@click.option(
    "--spread",
    type=click.FloatRange(0.0, 2.0),
    default=0.2,
    metavar="S",
    help="Of operators and trials: standard deviation of the logarithm (default 0.2).",
)
@click.option("--seed", type=click.IntRange(min=0), default=1, metavar="N", help="Of what is random (default 1).")
@click.option(
    "--measured",
    metavar="FILE.csv",
    callback=named,
    help="Your own points: stiffness_N_per_m, damping_Ns_per_m, and edge (lower, upper, tip) or verdict (stable, "
    "unstable) of each; if you like damping_low_Ns_per_m, damping_high_Ns_per_m, stiffness_low_N_per_m, "
    "stiffness_high_N_per_m, trials.",
)
@click.option("--resume", metavar="FILE", callback=named, help="Keep what is done here, and go on from it.")
@output_option("Write a figure (.png .svg .pdf) or the points (.csv .json).")
@as_json
def experiment(
    question: Question, output: str | None, as_json: bool, resume: str | None, measured: str | None, **asked: Any
) -> int:
    """Measure a stability boundary on the virtual DEVICE: disturb it, watch it, bisect the damping for each
    stiffness, and the stiffness near the tip."""
    path = None if output is None else destination(output, FIGURES + DATA)
    own = [] if measured is None else read_measured(measured)
    device = question.device()
    if device.response is not None:
        return without_model(question, device, dict.fromkeys(KEYS), as_json)
    from zwidth.contact.experiment import NothingStable

    try:
        found = _measured(question, device, asked, path, resume)
    except (NoAnswer, NothingStable) as none:
        return deliver(Answer(_facts(question, device) | dict.fromkeys(KEYS), reason=str(none)), as_json)
    document = _facts(question, device) | numbers(found, own)
    if path is not None:
        document["file"] = str(path)
        _write(path, found, document, own)
    return deliver(Answer(document, lambda: list(_pages(question, device, found, document))), as_json)


def _facts(question: Question, device: Device) -> dict[str, Any]:
    """The device, of which nothing is left out."""
    return question.circumstances(device) | {"left_out": []}


def _measured(
    question: Question, device: Device, asked: dict[str, Any], path: Path | None, resume: str | None
) -> Experiment:
    from zwidth.contact.bench import BenchError
    from zwidth.study.experiment import measure
    from zwidth.study.experiment import question as known_by

    with computing(question):
        loop = question.point(device).without_operator.loop
    operator = device.operator if loop.plant.handle is not None and question.operator_of(device) else None
    try:
        plan = _plan(asked)
        journal = _journal(known_by(loop, operator, plan), path, resume)
        with computing(question), progress_told() as progress, _kept(journal):
            found = measure(loop, operator, plan, journal, progress, causes=bool(loop.nonlinear))
    except BenchError as error:
        raise BadInput(_of_option(str(error))) from None
    except OSError as error:  # of the journal
        raise BadInput(f"{error.filename}: cannot be written: {error.strerror}; name another file") from None
    if resume is None and journal.path is not None:
        journal.path.unlink(missing_ok=True)
    return found


def _of_option(fault: str) -> str:
    """The fault under the name of its option, where it begins with one."""
    name, _, rest = fault.partition(" ")
    if name in ("disturbance", "visible", "push", "speed", "stiffness", "damping", "subjects", "spread"):
        return f"--{name}: {rest}"
    return f"--reflex: {fault}" if name == "a" else fault


def _plan(asked: dict[str, Any]) -> Plan:
    from zwidth.contact.experiment import Box
    from zwidth.study.experiment import Plan

    one_sided = asked.pop("wall") == "one-sided"
    stiffness, damping = asked.pop("stiffness"), asked.pop("damping")
    if (stiffness is None) != (damping is None):
        raise BadInput("--stiffness and --damping say where to look together; give both, or none")
    disturbance = asked.pop("disturbance")
    if one_sided and disturbance is not None:
        raise BadInput(
            "--disturbance: is of a two-sided wall; the device meets a one-sided one with --push and --speed"
        )
    push, speed = asked.pop("push"), asked.pop("speed")
    return Plan(
        one_sided=one_sided,
        disturbance=DISTURBANCE if disturbance is None else disturbance,
        push=(PUSH if one_sided else 0.0) if push is None else push,
        speed=(SPEED if one_sided else 0.0) if speed is None else speed,
        box=None if stiffness is None else Box(stiffness, damping),
        **asked,
    )


def _journal(question: str, path: Path | None, resume: str | None) -> Journal:
    from zwidth.study.journal import Journal, JournalError

    beside = None if path is None else path.with_name(path.name + ".progress")
    try:
        return Journal(beside if resume is None else Path(resume), question)
    except JournalError as error:
        raise BadInput(str(error)) from None
    except OSError as error:
        raise OutputError(f"{resume or beside}: cannot be written: {error.strerror}; name another file") from None


@contextmanager
def _kept(journal: Journal) -> Iterator[None]:
    """Says where the work is when it is interrupted."""
    try:
        yield
    except KeyboardInterrupt:
        if journal.path is not None:
            say(f"zwidth: {journal.path} keeps what is done; the same command goes on from there")
        raise


def _pages(question: Question, device: Device, found: Experiment, document: dict[str, Any]) -> Iterator[Any]:
    yield heading(question, device, linear=False)
    if document["warning"]:
        yield f"warning: {document['warning']}"
    headings, rows = point_rows(found)
    yield table(headings, rows)
    yield sheet(list(sentences(found, document["measured"])))
    if "file" in document:
        yield f"written: {document['file']}"


def _write(path: Path, found: Experiment, document: dict[str, Any], own: list[PointFromBench]) -> None:
    if path.suffix.lower() in DATA:
        write_data(path, document, point_table(document))
        return
    from zwidth.show.figures.experiment import Barred, draw_experiment
    from zwidth.show.figures.style import figure, save

    points = [Barred(p.stiffness, p.damping, p.edge, p.low, p.high, p.unsure) for p in found.points]
    others = [
        Barred(p.stiffness, p.damping, p.edge or p.verdict or "lower", p.stiffness_low, p.stiffness_high)
        if p.edge == "tip"
        else Barred(p.stiffness, p.damping, p.edge or p.verdict or "lower", p.damping_low, p.damping_high)
        for p in own
    ]
    drawing, ax = figure()
    draw_experiment(ax, points, found.chart, others)
    with replacing(path) as draft:
        save(drawing, draft)
