"""The report's section on links that bend: which way it moves what, and what was assumed."""

from __future__ import annotations

from math import isfinite, isnan

from zwidth.show.report.facts import Facts
from zwidth.show.report.sentences import hertz, join_words
from zwidth.show.units import SPACE, percent, quantity
from zwidth.study.bending import DAMPING, Bending, BendingNumbers

Row = tuple[str, ...]

SAME = 5e-4  # relative change below which a number is said to stay


def sentences(facts: Facts) -> list[str]:
    """What is said of bending; [] for a device without links that could bend."""
    found = facts.bending
    if found is None:
        return []
    return [
        sentence for sentence in (beginning(found), stiffness(found), felt(found), first_mode(found)) if sentence
    ]


def beginning(found: Bending) -> str:
    """Which links bend, and whether the file says so or how they were chosen."""
    if found.given:
        verb = "bends" if len(found.links) == 1 else "bend"
        return f"{join_words(found.links)} {verb} as the file says; beside it stands the same device with rigid links."
    damped = ""
    if any(tube.damping_time for tube in found.tubes):
        damped = (
            f" The file damps no bending, so that each tube has {percent(DAMPING)} in its own first vibration, clamped "
            "at its base."
        )
    links = "the link" if len(found.links) == 1 else "the links"
    return (
        f"The file takes its links as rigid. To see what bending could do, {links} {join_words(found.links)} are taken "
        "as round tubes of aluminium 6061, as long as the link, with a wall of a tenth of the diameter, that weigh "
        "half of it, or less where its inertia leaves no room for that, or they would be thicker than a quarter of "
        f"their length; the rest of the link's mass is carried.{damped} A real link may be softer or stiffer."
    )


def stiffness(found: Bending) -> str:
    """Which way the largest stiffness goes."""
    bent, rigid = found.bent.stiffness_max, found.rigid.stiffness_max
    if isnan(bent) and isnan(rigid):
        return "No wall is found to be stable, whether the links bend or not."
    if isnan(rigid):
        return f"Bending lets it render walls: of up to {quantity(bent, 'N/m')}, where with rigid links it renders none."
    if isnan(bent):
        return (
            f"With bending links no wall is found to be stable; with rigid ones, up to {quantity(rigid, 'N/m')}."
        )
    what = f"the largest stiffness: {quantity(rigid, 'N/m')} with rigid links, {quantity(bent, 'N/m')} with bending ones"
    if abs(bent / rigid - 1.0) < SAME:
        return f"Bending hardly changes {what}."
    verb = "raises" if bent > rigid else "lowers"
    return f"Bending {verb} {what}, {percent(abs(bent / rigid - 1.0))} {'more' if bent > rigid else 'less'}."


def felt(found: Bending) -> str:
    """What an infinitely stiff wall is felt as, at rest."""
    bent, rigid = found.bent.static_stiffness, found.rigid.static_stiffness
    limit = f"no wall is felt stiffer than {quantity(bent, 'N/m')}"
    if not isfinite(bent):
        return "At rest nothing between wall and handle gives, whether the links bend or not."
    if not isfinite(rigid):
        return f"At rest {limit}; with rigid links nothing would give."
    if rigid / bent - 1.0 < SAME:
        return f"At rest {limit}, and hardly any stiffer with rigid links: the drives give."
    share = percent(1.0 - bent / rigid)
    return f"At rest {limit}, {share} less than the {quantity(rigid, 'N/m')} with rigid links."


def first_mode(found: Bending) -> str:
    """Where the first mode that a wall moves goes."""
    bent, rigid = found.bent.first_mode, found.rigid.first_mode
    if isnan(bent):
        return "A wall moves no mode in which anything gives."
    if isnan(rigid):
        return f"The first mode that a wall moves is at {hertz(bent)}; with rigid links there is none."
    if abs(bent / rigid - 1.0) < SAME:
        return f"The first mode that a wall moves stays at {hertz(bent)}."
    verb = "falls" if bent < rigid else "rises"
    return f"The first mode that a wall moves {verb} from {hertz(rigid)} to {hertz(bent)}."


def tubes(facts: Facts) -> list[Row]:
    """Link, diameter, wall and share of its mass of each tube that is assumed; [] where the file gives the beams."""
    found = facts.bending
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
    """What is compared, with rigid and with bending links."""
    found = facts.bending
    if found is None:
        return []
    return [_row("rigid links", found.rigid), _row("bending links", found.bent)]


def _row(label: str, numbers_: BendingNumbers) -> Row:
    return (
        label,
        "none" if isnan(numbers_.stiffness_max) else quantity(numbers_.stiffness_max, "N/m"),
        f"no{SPACE}limit"
        if not isfinite(numbers_.static_stiffness)
        else quantity(numbers_.static_stiffness, "N/m"),
        "none" if isnan(numbers_.first_mode) else hertz(numbers_.first_mode),
    )
