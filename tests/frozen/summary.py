"""What a comparison came to, for people."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from tests.frozen.accepted import AcceptedDifference
from tests.frozen.compare import Difference, Tally

SHOWN = 60  # lines of differences; the file has all


def summary(
    tally: Tally, unaccepted: list[Difference], accepted: dict[AcceptedDifference, int], complete: Path
) -> Iterable[str]:
    """Lines of the summary; all differences go into a file besides."""
    complete.write_text("".join(f"{one.command}\t{one.device}\t{one.key}\t{one.reason}\n" for one in unaccepted))
    total = tally.same_numbers + sum(tally.numbers.values())
    took = " and ".join(f"{seconds:.0f} s" for seconds in tally.seconds)
    yield f"{tally.runs} command lines, {total} numbers compared; processor time {took}"
    yield f"  {tally.same} documents with {tally.same_numbers} numbers are equal to the last digit; the others:"
    for kind, count in tally.numbers.most_common():
        size, where = tally.largest.get(kind, (0.0, ""))
        yield f"  {kind.value:9} {count:9}  largest difference {size:.1e}{f' ({where})' if where else ''}"
    yield from _counted("keys added, which is no difference", tally.added)
    yield from _counted("sentences worded anew, which is no difference", tally.reworded)
    if tally.diverged_runs:
        yield f"quantised runs that parted, compared by amplitude: {len(tally.diverged_runs)}"
        yield from (f"  {line}" for line in tally.diverged_runs[:SHOWN])
    for entry, count in accepted.items():
        used = f"accepted {count} times" if count else "accepted, but does not occur: remove the entry"
        yield f"{used}: {entry.command} {entry.device} {entry.key}: {entry.reason}"
    if not unaccepted:
        yield "nothing differs"
        return
    yield from _counted("differences by command and key", Counter((one.command, one.key) for one in unaccepted))
    yield f"{len(unaccepted)} differences, all in {complete}"
    yield from (f"  {one.command} {one.device} {one.key}: {one.reason}" for one in unaccepted[:SHOWN])
    if len(unaccepted) > SHOWN:
        yield f"  and {len(unaccepted) - SHOWN} more"


def _counted(title: str, counts: Counter[tuple[str, str]]) -> Iterable[str]:
    if counts:
        yield f"{title}: {counts.total()}"
        yield from (f"  {command} {key}: {count}" for (command, key), count in counts.most_common(SHOWN))
