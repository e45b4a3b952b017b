"""The report's section on links that bend: which way it moves what, and what was assumed."""

from __future__ import annotations

from math import inf, isfinite, isnan

from zwidth.show.report.facts import Facts
from zwidth.show.report.sentences import hertz, join_words
from zwidth.show.units import NONE, SPACE, as_written, percent, quantity, speaking_of_moments
from zwidth.study.link_bending import DAMPING, Bending, BendingNumbers

Row = tuple[str, ...]

SAME = 5e-4  # relative change below which a number is said to stay


def sentences(facts: Facts) -> list[str]:
    """What bending changes; [] for a device without links that could bend."""
    found = facts.bending
    if found is None:
        return []
    said = [
        stiffness(found),
        felt(found, loaded=facts.point.load is not None),
        first_mode(found, held=facts.operator is not None),
    ]
    return [sentence for sentence in said if sentence]


def beginning(found: Bending) -> str:
    """Sentences on which links bend, and whether the file says so or how they were chosen."""
    one = len(found.links) == 1
    links = f"the link {found.links[0]}" if one else f"the links {join_words(found.links)}"
    if found.given:
        verb, rigid = ("bends", "this link is rigid") if one else ("bend", "these links are rigid")
        return (
            f"{links[0].upper()}{links[1:]} {verb}, by what the file gives. This compares the device with the "
            f"same where {rigid}, of the same mass and inertia."
        )
    as_tubes = (
        "is taken as a round tube of aluminium 6061, as long as the link"
        if one
        else "are taken as round tubes of aluminium 6061, each as long as its link"
    )
    return (
        f"The file takes its links as rigid. To see what bending could change, {links} {as_tubes}, with a wall of "
        "a tenth of the diameter. A tube has half of its link's mass, or less where the link's inertia leaves no "
        "room for that or the tube would be thicker than a quarter of its length; it carries the rest of that "
        f"mass. {damping(found)}{kept(found)}A real link may be softer or stiffer."
    )


def damping(found: Bending) -> str:
    """Sentence on what damps the tubes, a blank at its end; "" where the file's damping covers bending too."""
    if not any(tube.damping_time for tube in found.tubes):
        return ""
    return (
        "The file gives bending no damping: here each tube has a damping ratio of "
        f"{as_written(100.0 * DAMPING)}{SPACE}% in its own first vibration, clamped at its base. "
    )


def kept(found: Bending) -> str:
    """Sentences on which links stay rigid, and why, a blank at their end; "" where none with a length does."""
    if not found.kept:
        return ""
    links, verb, their = ("link", "stays", "its") if len(found.kept) == 1 else ("links", "stay", "their")
    why = f"{their} joint, mass or inertia is not that of such a tube"
    return f"The {links} {join_words(found.kept)} {verb} rigid: {why}. "


def stiffness(found: Bending) -> str:
    """Sentence on which way bending moves the largest stiffness, and by how much."""
    bent, rigid = found.bent.stiffness_max, found.rigid.stiffness_max
    if isnan(bent) and isnan(rigid):
        if found.bent.reason == found.rigid.reason:
            return f"With bending links and with rigid ones there is no largest stiffness: {found.bent.reason}."
        return (
            f"With bending links there is no largest stiffness: {found.bent.reason}; nor with rigid ones: "
            f"{found.rigid.reason}."
        )
    if isnan(rigid):
        return (
            f"With bending links it renders walls of up to {quantity(bent, 'N/m')}; with rigid ones there is no "
            f"largest stiffness: {found.rigid.reason}."
        )
    if isnan(bent):
        return (
            f"With bending links there is no largest stiffness: {found.bent.reason}; with rigid ones it is "
            f"{quantity(rigid, 'N/m')}."
        )
    change = bent / rigid - 1.0
    if abs(change) < SAME:
        return f"Bending hardly changes the largest stiffness, {quantity(bent, 'N/m')}."
    verb, more = ("raises", "more") if change > 0.0 else ("lowers", "less")
    return (
        f"Bending {verb} the largest stiffness from {quantity(rigid, 'N/m')} with rigid links to "
        f"{quantity(bent, 'N/m')}, {percent(abs(change))} {more}."
    )


def felt(found: Bending, *, loaded: bool = False) -> str:
    """Sentence on what an infinitely stiff wall is felt as, at rest; "" where that is not known.

    loaded  whether the device bears a load, which this leaves out
    """
    bent, rigid = found.bent.static_stiffness, found.rigid.static_stiffness
    rest = "At rest, the load left out," if loaded else "At rest"
    if isnan(bent) or isnan(rigid):
        return ""
    if not isfinite(bent):
        return f"{rest} nothing between wall and handle gives, whether the links bend or not."
    limit = f"{rest} no wall is felt stiffer than {quantity(bent, 'N/m')}"
    if not isfinite(rigid):
        return f"{limit}; with rigid links nothing would give."
    change = bent / rigid - 1.0
    if abs(change) < SAME:
        return f"{limit}; with rigid links that is hardly any different."
    more = "more" if change > 0.0 else "less"
    return f"{limit}, {percent(abs(change))} {more} than the {quantity(rigid, 'N/m')} with rigid links."


def first_mode(found: Bending, *, held: bool = False) -> str:
    """Sentence on which way bending moves the frequency of the first mode that a wall moves.

    "" where there is none, and with bending links no chart

    held  whether somebody holds the handle, who is left out here
    """
    bent, rigid = found.bent.first_mode, found.rigid.first_mode
    mode = "mode of the ungripped device" if held else "mode"
    if isnan(bent) and isnan(rigid):
        return "" if not found.bent.chart else f"A wall moves no {mode} in which anything gives."
    if isnan(rigid):
        return f"The first {mode} that a wall moves is at {hertz(bent)}; with rigid links there is none."
    if isnan(bent):
        return f"With bending links a wall moves no {mode}; with rigid ones the first is at {hertz(rigid)}."
    change = bent / rigid - 1.0
    if abs(change) < SAME:
        return f"The first {mode} that a wall moves stays at {hertz(bent)}."
    verb, less = ("falls", "lower") if change < 0.0 else ("rises", "higher")
    return (
        f"The first {mode} that a wall moves {verb} from {hertz(rigid)} with rigid links to {hertz(bent)}, "
        f"{percent(abs(change))} {less}."
    )


def tubes(facts: Facts) -> list[Row]:
    """Link, length, diameter, wall and share of the link's mass of each tube that is assumed, as texts.

    [] where the file gives the beams, and where no link could bend
    """
    found = facts.bending
    with speaking_of_moments(False):  # these are lengths, whatever is rendered
        return [
            (
                tube.link,
                quantity(tube.length, "m"),
                quantity(tube.outer_diameter, "m"),
                quantity(tube.wall, "m"),
                percent(tube.share),
            )
            for tube in (() if found is None else found.tubes)
        ]


def numbers(facts: Facts) -> list[Row]:
    """Two rows of what is compared, as `_row`: with rigid and with bending links; [] where none could bend."""
    found = facts.bending
    if found is None:
        return []
    return [_row("rigid links", found.rigid), _row("bending links", found.bent)]


def _row(label: str, found: BendingNumbers) -> Row:
    """Label, largest stiffness, largest static stiffness that is felt, and first mode's frequency, as texts."""
    static = quantity(found.static_stiffness, "N/m")
    return (
        label,
        NONE if isnan(found.stiffness_max) else quantity(found.stiffness_max, "N/m"),
        f"no{SPACE}limit" if found.static_stiffness == inf else static,
        NONE if isnan(found.first_mode) else hertz(found.first_mode),
    )
