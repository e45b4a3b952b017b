"""`zwidth robust`: the walls stable for every member of a family of devices."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import isnan
from typing import TYPE_CHECKING, Any, Final

from zwidth.device.read import LARGEST_FILE, read_text
from zwidth.errors import FileError, NoAnswerError
from zwidth.loop.motion_names import listed_names
from zwidth.questions import ROBUST
from zwidth.show.circumstances import member_text, operator_text, value_text
from zwidth.show.cli.answer import answer_table, two_columns
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.options import options_of
from zwidth.show.output import printable
from zwidth.show.units import amount, percent, radius, typed, uncertain

if TYPE_CHECKING:
    from zwidth.study.robust.family import Range
    from zwidth.study.robust.robust_study import RobustStudy, Violation

BINDING_ROWS: Final = 12  # binding members in what people read
LEAST_SHARE: Final = 1e-4  # of the edge, that is given as a number
ARGUMENT_NAMES: Final = {"Device.with_": "--set", "logarithmic": "log"}  # arguments of a range, as typed


class RobustCommand(Command):
    """Find the walls that DEVICE renders stably for every operator of a list, and every value of numbers known in
    ranges."""

    name = "robust"
    takes_responses = True
    summary = "Find the walls that are stable for every operator and number in a range."
    examples = (
        "zwidth robust my-device.toml --range operator.arm_mass_kg=0.3,2 --range loop.delay_samples=0,1",
        "zwidth robust my-device.toml --operators none,thesis-arm,my-hand.toml --output robust.svg",
    )
    options = options_of(ROBUST)
    output_help = "Write a figure (.png .svg .pdf) or the data (.csv: the edge, .json)."
    keys = (
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
        "unknown_members",
        "numbers_hold_for",
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
    may_be_undecided = True

    def parse(self, case: CommandLine) -> dict[str, Any]:
        operators = _operators(case.question.operator, case["operators"], case["operator_list"])
        return {"operators": operators, "ranges": _ranges(case["ranges"])}

    def compute(self, case: CommandLine) -> RobustStudy:
        """The study of the family. Raises BadInput where nothing varies, or for wrong ranges."""
        from zwidth.errors import RangeError
        from zwidth.study.robust.family import Family
        from zwidth.study.robust.robust_study import robust_study

        response = case.point.response
        if not case["ranges"] and not case["operators"] and (response is None or response.sweeps is None):
            repeat = "" if response is None else ", or repeat the sweep to see the device itself vary"
            raise BadInput(
                f"{case.question.name}: nothing varies; give --range PATH=LOW,HIGH or --operators A,B,C{repeat}"
            )
        family = Family(case.device, case["ranges"], case["operators"], case.point)
        try:
            return robust_study(family, case["members"], case["unseen"], case["seed"], progress=case.progress)
        except RangeError as error:
            faults = (fault.spelled(lambda name, _: ARGUMENT_NAMES[name]) for fault in error.faults)
            raise BadInput(*(f"--range: {fault}" for fault in faults)) from None
        except NoAnswerError as error:
            raise NoAnswerError(str(error), decided=False) from None

    def caption_facts(self, case: CommandLine, document: Mapping[str, Any]) -> dict[str, Any]:
        from zwidth.show.figures.caption import facts_of_members

        return super().caption_facts(case, document) | facts_of_members(document["members"])

    def reason(self, case: CommandLine, result: RobustStudy) -> str | None:
        """Which members have no stable wall in common; None where all have one."""
        if result.chart.members_at_stiffness_max:
            return None
        names = [member_text(index, result.members[index]) for index in result.chart.excluding]
        if len(names) == 1:
            return f"no wall with K > 0 and B >= 0 is stable for member {names[0]}"
        group = "these two members exclude each other" if len(names) == 2 else "these members have none in common"
        return f"no wall with K > 0 and B >= 0 is stable for every member; {group}: {'; '.join(names)}"

    def pages(self, case: CommandLine, result: RobustStudy, document: Mapping[str, Any]) -> Iterator[Any]:
        """Numbers of the robust set, and a row for each member that limits it, BINDING_ROWS at most.

        Of a set without stable wall nothing but the doubt is said.
        """
        if result.doubt:
            yield f"warning: this is undecided: {printable(result.doubt)}"
        if not result.chart.members_at_stiffness_max:
            return
        yield two_columns(list(_rows(result)))
        shares = result.edge_shares
        paths = list(result.members[0])
        rows = [
            [
                str(index),
                *(printable(value_text(result.members[index][path])) for path in paths),
                _share_text(share),
            ]
            for index, share in list(shares.items())[:BINDING_ROWS]
        ]
        yield answer_table(["limiting member", *paths, "share of the edge"], rows)
        if len(shares) > BINDING_ROWS:
            yield f"... and {len(shares) - BINDING_ROWS} more; --json lists all"


def _ranges(texts: tuple[str, ...]) -> tuple[Range, ...]:
    """The ranges of --range PATH=LOW,HIGH[,log]. Raises BadInput with every text that is none."""
    from zwidth.study.robust.family import Range

    ranges, lines = [], []
    for text in texts:
        path, equals, values = (part.strip() for part in text.partition("="))
        parts = [part.strip() for part in values.split(",")]
        logarithmic = len(parts) == 3 and parts[2] == "log"
        try:
            low, high = map(float, parts[:2] if logarithmic else parts)
        except ValueError:  # no numbers, or not two of them
            equals = ""  # a fault
        if not equals or not path:
            lines.append(f"--range: must be PATH=LOW,HIGH or PATH=LOW,HIGH,log with two numbers, got {text!r}")
            continue
        ranges.append(Range(path, low, high, logarithmic))
    if lines:
        raise BadInput(*lines)
    return tuple(ranges)


def _operators(single: str | None, names: str | None, file: str | None) -> tuple[str, ...]:
    """Who may hold the handle, of --operators or --operator-list; () where neither is given.

    single  --operator, which excludes both
    """
    if names is None and file is None:
        return ()
    if names is not None and file is not None:
        raise BadInput("--operators and --operator-list exclude each other; give one of them")
    if single is not None:
        raise BadInput("--operator and a list of operators exclude each other; leave out --operator")
    if file is not None:
        try:
            lines = read_text(file, LARGEST_FILE).splitlines()
        except FileError as error:
            raise BadInput(f"--operator-list: {file}: {error}; give a text file, one name a line") from None
        listed = [line.split("#")[0].strip() for line in lines]
        operators = tuple(dict.fromkeys(name for name in listed if name))
    else:
        operators = tuple(dict.fromkeys(name.strip() for name in str(names).split(",")))
    if not operators or "" in operators:
        raise BadInput(f"--operators: must be names with commas between them, got {names or file!r}")
    return operators


def _rows(study: RobustStudy) -> Iterator[tuple[str, str]]:
    """Rows (label, value) on a family: walls stable for all, the loss against the best member, the members."""
    chart = study.chart
    frequencies = " and ".join(amount(frequency, "Hz") for frequency in chart.frequencies_at_stiffness_max)
    members = " and ".join(_member_name(study, member) for member in chart.members_at_stiffness_max)
    of_whom = " (charted members)" if not study.holds_for_all else " (in doubt)" if study.doubt else ""
    yield (
        f"largest stiffness{of_whom}",
        f"{amount(chart.stiffness_max, 'N/m')} at {amount(chart.damping_at_stiffness_max, 'N s/m')} of damping; "
        f"at this limit {members} oscillates at {frequencies}",
    )
    stiffest, widest = _member_name(study, chart.best_by_stiffness), _member_name(study, chart.best_by_area)
    yield (
        "loss against the best",
        (
            f"{typed(percent(chart.lost_stiffness_share))} of its stiffness ({stiffest}), "
            f"{typed(percent(chart.lost_share))} of its area ({widest})"
        ),
    )
    yield f"largest damping{of_whom}", amount(chart.damping_max, "N s/m")
    yield f"stable area{of_whom}", amount(chart.stable_area, "N^2 s/m^2")
    yield "members", _members_text(study)
    if chart.failed:
        first = next(iter(chart.failed))
        yield (
            "not charted",
            (
                f"{len(chart.failed)} members, of which nothing is known; the first, "
                f"{member_text(first, study.members[first])}: {printable(chart.failed[first])}"
            ),
        )
    if study.violation is not None:
        yield "unseen members", _violation_text(study.violation)
    if chart.unobserved_modes:
        yield "not affected by a wall", ", ".join(listed_names(chart.unobserved_modes))


def _member_name(study: RobustStudy, member: int) -> str:
    """A member by its operator or its sweep, where members differ in nothing else; otherwise by its number."""
    from zwidth.device.load import NOBODY
    from zwidth.study.robust.family import MEAN

    values = study.members[member]
    if list(values) == ["sweep"]:
        return "the mean of all sweeps" if values["sweep"] == MEAN else f"the device of sweep {values['sweep']}"
    if list(values) != ["operator"]:
        return f"member {member}"
    operator = values["operator"]
    return "the ungripped device" if operator == NOBODY else f"the device held by {operator_text(str(operator))}"


def _share_text(share: float) -> str:
    """A share of the edge in per cent; very small ones are only bounded."""
    return "under 0.01 %" if 0.0 < share < LEAST_SHARE else typed(percent(share))


def _members_text(study: RobustStudy) -> str:
    """How many members were charted, and of ranges what a search for worse ones found."""
    count, edge_change = len(study.members), f"{typed(uncertain(100 * study.area_change))} %"
    if study.violation is None:
        return (
            f"{count}, the whole list"
            if not study.chart.failed
            else f"{count}, {len(study.chart.charted)} charted"
        )
    found = count - study.sampled
    worse = (
        f"{found} of them found by searching the ranges for worse ones" if found else "a search found none worse"
    )
    if not study.settled:
        worse += (
            f"; --members {count} ended the search, whose last round moved the edge by {edge_change} of the area"
        )
    elif study.area_change:
        worse += f"; its last round moved the edge by {edge_change} of the area"
    return f"{count} charted, {worse}"


def _violation_text(violation: Violation) -> str:
    """How many random members, not charted, make a wall unstable, and how much softer walls must be for them."""
    if not violation.violating:
        return f"none of {violation.unseen} random ones makes one of these walls unstable"
    less = typed(uncertain(100 * violation.worst_stiffness_share))
    softer = f"with {less} % less of the largest stiffness all are stable"
    if violation.worst_stiffness_share == 0.0:
        softer = "all of these have K <= 0 or B < 0"
    largest = violation.worst_spectral_radius  # not known of a measured response
    up_to = "" if isnan(largest) else f", with spectral radii up to {radius(largest)}"
    return f"{violation.violating} of {violation.unseen} random ones make a wall unstable{up_to}; {softer}"
