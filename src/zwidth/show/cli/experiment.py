"""`zwidth experiment`: a stability boundary measured on the virtual device."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.show.cli.answer import table, two_columns
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.errors import BadInput, NoAnswer
from zwidth.show.cli.experiment_page import explanation, point_rows, sentences, warning
from zwidth.show.cli.options import Numbers, refuse_empty
from zwidth.show.cli.process import say
from zwidth.study.boundary.points_file import read_points

if TYPE_CHECKING:
    from zwidth.study.boundary.experiment_plan import Plan
    from zwidth.study.boundary.measured_boundary import Experiment

MOST: Final = 1000
# options that are numbers of the plan, under its own names
PLAN_OPTIONS: Final = (
    "stiffnesses",
    "tips",
    "disturbance",
    "visible",
    "push",
    "speed",
    "reflex",
    "subjects",
    "trials",
    "spread",
    "seed",
)


def _check_range(ctx: click.Context, param: click.Parameter, span: tuple[float, float] | None) -> Any:
    if span and not span[0] < span[1]:
        raise click.BadParameter(f"needs LOW < HIGH, such as 0,8000; got {span[0]:g},{span[1]:g}")
    return span


class ExperimentCommand(Command):
    """Measure a stability boundary on a simulated DEVICE: disturb it, judge the motion, bisect the damping at each
    stiffness, and the stiffness near the tip."""

    name = "experiment"
    summary = "Measure a stability boundary on a simulated DEVICE."
    examples = (
        "zwidth experiment my-device.toml --output boundary.svg",
        "zwidth experiment my-device.toml --operator thesis-arm --wall one-sided --subjects 2 --trials 4",
        "zwidth experiment my-device.toml --measured bench.csv --output compared.png",
    )
    options = (
        click.option(
            "--wall",
            type=click.Choice(("two-sided", "one-sided")),
            default="two-sided",
            help="Default: two-sided.",
        ),
        click.option(
            "--stiffnesses",
            type=click.IntRange(1, MOST),
            default=16,
            metavar="N",
            help="Number of stiffnesses at which the damping is bisected (default 16).",
        ),
        click.option(
            "--tips",
            type=click.IntRange(0, MOST),
            default=8,
            metavar="N",
            help="Number of dampings, near the tip, at which the stiffness is bisected (default 8).",
        ),
        click.option(
            "--stiffness",
            type=Numbers("KMIN,KMAX", (2,), "0,8000"),
            callback=_check_range,
            help="Range of stiffness to search [N/m].",
        ),
        click.option(
            "--damping",
            type=Numbers("BMIN,BMAX", (2,), "0,30"),
            callback=_check_range,
            help="Range of damping to search [Ns/m].",
        ),
        click.option(
            "--disturbance",
            type=float,
            metavar="M",
            help="Displacement at the start, for a two-sided wall [m] (default 0.001; at most 1).",
        ),
        click.option(
            "--visible",
            type=float,
            metavar="M",
            help="Largest amplitude of a lasting vibration that counts as none [m] (default: three encoder steps "
            "and ten standard deviations of the noise).",
        ),
        click.option(
            "--push",
            type=float,
            metavar="N",
            help="Constant force of the hand [N] (default: 2 against a one-sided wall, else 0).",
        ),
        click.option(
            "--speed",
            type=float,
            metavar="V",
            help="Velocity at the start [m/s] (default: 0.02 towards a one-sided wall, else 0; at most 100).",
        ),
        click.option(
            "--reflex",
            is_flag=True,
            help="The hand stiffens threefold, 50 ms after the wall has half of the push.",
        ),
        click.option(
            "--subjects",
            type=click.IntRange(1, MOST),
            default=1,
            metavar="N",
            help="Number of operators (default 1).",
        ),
        click.option(
            "--trials",
            type=click.IntRange(1, MOST),
            default=1,
            metavar="N",
            help="Number of trials with each operator (default 1).",
        ),
        click.option(
            "--spread",
            type=click.FloatRange(0.0, 2.0),
            default=0.2,
            metavar="S",
            help="Spread of operators and trials: standard deviation of the logarithm (default 0.2).",
        ),
        click.option(
            "--seed",
            type=click.IntRange(min=0),
            default=1,
            metavar="N",
            help="Seed of the random numbers (default 1).",
        ),
        click.option(
            "--measured",
            metavar="FILE.csv",
            callback=refuse_empty,
            help="Your own points, with columns stiffness_N_per_m, damping_Ns_per_m, and edge (lower, upper, tip) "
            "or verdict (stable, unstable); optional: damping_low_Ns_per_m, "
            "damping_high_Ns_per_m, stiffness_low_N_per_m, stiffness_high_N_per_m, trials.",
        ),
        click.option(
            "--resume",
            metavar="FILE",
            callback=refuse_empty,
            help="Save finished work here; the same command continues from it.",
        ),
    )
    output_help = "Write a figure (.png .svg .pdf) or the points (.csv .json)."
    keys = (
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
    linear = False

    def parse(self, case: CommandLine) -> dict[str, Any]:
        measured = case["measured"]
        return {"measured": () if measured is None else read_points(measured), "plan": _plan(case)}

    def circumstances(self, case: CommandLine) -> dict[str, Any]:
        return {"left_out": []} | super().circumstances(case)

    def compute(self, case: CommandLine) -> Experiment:
        from zwidth.contact.boundary_experiment import NoStableWallError
        from zwidth.contact.stability_trial import TrialError
        from zwidth.study.boundary.experiment import measure_boundary
        from zwidth.study.jobs.journal import JournalError

        file = _journal(case)
        try:
            with _report_kept_work(file):
                return measure_boundary(
                    case.point, case["plan"], case["measured"], file=file, progress=case.progress
                )
        except TrialError as error:
            raise BadInput(f"--{error.argument}: {error.reason}") from None
        except JournalError as error:
            raise BadInput(str(error)) from None
        except NoStableWallError as none:
            raise NoAnswer(str(none)) from None
        except OSError as error:  # of the journal
            raise BadInput(f"{file}: cannot be written: {error.strerror}; name another file") from None

    def document(self, case: CommandLine, result: Experiment) -> dict[str, Any]:
        return result.document() | {"warning": warning(result), "explanation": explanation(result)}

    def write(
        self, case: CommandLine, result: Experiment, document: dict[str, Any], reason: str | None
    ) -> str | None:
        reason = super().write(case, result, document, reason)
        file = _journal(case)
        if case["resume"] is None and file is not None:
            file.unlink(missing_ok=True)  # now that what it kept is written
        return reason

    def pages(self, case: CommandLine, result: Experiment, document: Mapping[str, Any]) -> Iterator[Any]:
        if document["warning"]:
            yield f"warning: {document['warning']}"
        headings, rows = point_rows(result)
        yield table(headings, rows)
        yield two_columns(list(sentences(result)))


def _plan(case: CommandLine) -> Plan:
    """What is to be measured. Raises BadInput."""
    from zwidth.contact.boundary_experiment import SearchWindow
    from zwidth.contact.stability_trial import TrialError
    from zwidth.study.boundary.experiment_plan import Plan

    stiffness, damping = case["stiffness"], case["damping"]
    if (stiffness is None) != (damping is None):
        raise BadInput("--stiffness and --damping give the search range together; give both or neither")
    one_sided = case["wall"] == "one-sided"
    if one_sided and case["disturbance"] is not None:
        raise BadInput(
            "--disturbance: applies to a two-sided wall; against a one-sided wall use --push and --speed"
        )
    given = {name: case[name] for name in PLAN_OPTIONS if case[name] is not None}
    box = None if stiffness is None else SearchWindow(stiffness, damping)
    try:
        return Plan.touching(box=box, **given) if one_sided else Plan(box=box, **given)
    except TrialError as error:
        raise BadInput(f"--{error.argument}: {error.reason}") from None


def _journal(case: CommandLine) -> Path | None:
    """The file that keeps what is done: --resume, or one beside --output; None: nothing is kept."""
    if case["resume"] is not None:
        return Path(case["resume"])
    return None if case.path is None else case.path.with_name(case.path.name + ".progress")


@contextmanager
def _report_kept_work(file: Path | None) -> Iterator[None]:
    """Says where the work is when it is interrupted."""
    try:
        yield
    except KeyboardInterrupt:
        if file is not None and file.exists():
            say(f"zwidth: {file} keeps the finished work; the same command continues from it")
        raise
