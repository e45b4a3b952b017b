"""The structure of two commits beside each other, in numbers: `python -m tests.structure BASE [NEW]`.

Everything is read from the sources of `src/zwidth`; nothing is imported, so that any commit can be asked. With
--traced, two questions are run as well. What is counted:

    files               the package's *.py
    lines               of those files as `wc -l` counts them, and of them those of import statements
    lines of code       lines that hold more than a comment or a docstring; by folder directly below the package,
                        "(top)" being the files beside those. Docstrings are counted apart, without blank lines
    functions           methods and inner functions, too. Length: from `def` to the end, with the docstring and
                        without; decorators not. Arguments: all parameters but `self` and `cls`; the share is by
                        nearest rank
    numbers             constants: names in capitals at the top level of modules that are given a number; inside
                        functions: numbers other than 0 to 4 and 1/2, defaults of arguments included
    command line        the files below `show/cli`
    import circles      groups of modules that import each other, directly or through others. Imports inside
                        functions count, those below `if TYPE_CHECKING` do not; a module named by --except is
                        left out of this and of the next. `from a import b` imports the module a.b, or else a.
                        The circle that the modules left out close is counted beside it
    single importer     modules that one other module imports, and no more
    public names        those of the package's own stub; without one its `__all__`, worked out from literals
                        without importing
    two meanings        a class defined in several modules; a constant in capitals (two letters or more) to which
                        several modules give values, and of those where the values as written differ; a public
                        function that stands in several modules with different signatures as written, annotations
                        and defaults included. Top level of modules only; names that begin with an underscore not
    traced              files whose functions run in a chart of the five-bar under a load, and calls from a folder
                        below the package into another: there and in a sweep of 2 x 2; imports, compiling not
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from dataclasses import asdict

from tests.revisions import WORKING_TREE, texts_below, tree_of
from tests.structure.crossings import crossings
from tests.structure.modules import modules_of
from tests.structure.structure_numbers import MOST_ARGUMENTS, Structure, structure

UNKNOWN = "-"


def options(words: list[str] | None = None) -> argparse.Namespace:
    """What was asked for."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.structure", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("base", help="the commit before")
    parser.add_argument("new", nargs="?", default=WORKING_TREE, help="that after; left out: the working tree")
    parser.add_argument("--folder", default="src/zwidth", help="the package's folder in both")
    parser.add_argument(
        "--except", dest="left_out", action="append", metavar="MODULE", help="left out; zwidth._verbs if not given"
    )
    parser.add_argument("--traced", action="store_true", help="run a chart and a sweep, and count what they cross")
    parser.add_argument("--list", action="store_true", help="the names behind the numbers, too")
    parser.add_argument("--json", action="store_true", help="numbers and names as one object")
    return parser.parse_args(words)


def structure_of(label: str, folder: str, left_out: list[str], traced: bool = False) -> Structure:
    """The numbers of one commit; with those of questions that are run where they are asked for."""
    texts = texts_below(tree_of(label), folder, ".py", ".pyi")
    sources = {path: text for path, text in texts.items() if path.endswith(".py")}
    found = structure(modules_of(folder.rpartition("/")[2], sources), left_out, texts.get("__init__.pyi"))
    for question, counts in (crossings(tree_of(label), folder) if traced else {}).items():
        found.numbers.update({f"{what} of a {question}": number for what, number in counts.items()})
    return found


def number_rows(before: Structure, after: Structure) -> Iterator[tuple[str, str, str]]:
    """Rows of the table of numbers: what, before, after."""
    for what in merged_keys(before.numbers, after.numbers):
        yield what, text_of(before, what), text_of(after, what)


def name_lines(before: Structure, after: Structure) -> Iterator[str]:
    """Names under the heading of their number, with what is said of each: "-" before only, "+" after only."""
    for what in merged_keys(before.lists, after.lists):
        old, new = before.lists.get(what, {}), after.lists.get(what, {})
        yield from ("", what)
        for name in merged_keys(old, new):
            if old.get(name) == new.get(name):
                yield f"  {name}: {new[name]}"
            else:
                yield from (
                    f"{mark} {name}: {side[name]}" for mark, side in (("-", old), ("+", new)) if name in side
                )


def merged_keys(old: dict[str, object], new: dict[str, object]) -> list[str]:
    """Keys of both: the new ones in their order, each old one that is gone after the one that it stood behind."""
    keys = list(new)
    for i, key in enumerate(old):
        if key not in new:
            keys.insert(keys.index(list(old)[i - 1]) + 1 if i else 0, key)
    return keys


def text_of(side: Structure, what: str) -> str:
    """A number, or a mark where there is none; for the most arguments also the function that has them."""
    number = side.numbers.get(what)
    if number is None:
        return UNKNOWN
    name = next(iter(side.lists[MOST_ARGUMENTS]), "") if what == MOST_ARGUMENTS else ""
    return f"{number} {name.rpartition('.')[2]}".rstrip()


def table(rows: list[tuple[str, str, str]]) -> list[str]:
    """Lines of three columns."""
    widths = [max(len(row[i]) for row in rows) for i in range(3)]
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]


def main(words: list[str] | None = None) -> None:
    """Count, and print."""
    asked = options(words)
    left_out = asked.left_out or [f"{asked.folder.rpartition('/')[2]}._verbs"]
    before, after = (
        structure_of(label, asked.folder, left_out, asked.traced) for label in (asked.base, asked.new)
    )
    if asked.json:
        print(json.dumps({"before": asdict(before), "after": asdict(after)}, indent=1))
        return
    rows = [("what", asked.base, "here" if asked.new == WORKING_TREE else asked.new), *number_rows(before, after)]
    print("\n".join(table(rows)))
    if asked.list:
        print("\n".join(name_lines(before, after)))


if __name__ == "__main__":
    main()
