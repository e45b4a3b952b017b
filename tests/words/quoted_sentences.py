"""The sentences that a test file quotes: texts of three words and more that its asserts compare with."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from typing import Final

# A word has only letters, and blanks or marks around it: keys, options, numbers and formulas are none.
WORD: Final = re.compile(r"(?<![^\s(\[\"'`“])[^\W\d_]+(?:['’-][^\W\d_]+)*(?=[,.;:)\]\"'`”?!]*(?:\s|$))")
UNITS: Final = {"Hz", "kHz", "Nm", "Ns", "kN", "kg", "mm", "ms", "mN", "rad", "cm", "mHz", "kB", "GB"}
FEWEST_WORDS: Final = 3

# Names of states and parts that documents hold, which are compared as data
NAMES: Final = {
    "out of reach",
    "out of time",
    "out of motion",
    "out of range",
    "at a joint limit",
    "the force limit",
    "end of the curve",
}
# Pages of the project and the texts of the page `zwidth app`: tests compare their numbers with what is computed
PAGES: Final = {"PAGE", "TEXT", "OPERATORS", "PARTS", "STEPS", "SHEET", "SECTION"}

SEARCHES: Final = {"startswith", "endswith", "index", "count", "search", "match", "fullmatch", "findall"}
PARTS_OF_A_TEXT: Final = {
    "partition",
    "rpartition",
    "split",
    "join",
    "format",
    "replace",
    "escape",
    "removeprefix",
}


def sentences_of(source: str) -> list[tuple[int, str]]:
    """Line and text of every sentence that asserts, `match=` or the parameters that they compare with quote."""
    tree = ast.parse(source)
    quoted = [*_texts_of_asserts(tree), *_texts_of_parameters(tree)]
    found = {(node.lineno, text) for node in quoted for text in (_value(node),) if is_sentence(text)}
    return sorted(found)


def is_sentence(text: str) -> bool:
    """Are there three words, units, single letters, names of states and escapes of patterns not counted?"""
    text = re.sub(r"\\[a-zA-Z][+*]?|\\", "", text)
    words = [word for word in WORD.findall(text) if len(word) > 1 and word not in UNITS]
    return len(words) >= FEWEST_WORDS and text not in NAMES


def _value(node: ast.expr) -> str:
    """The text of a constant; of a formatted one the constant parts."""
    if isinstance(node, ast.JoinedStr):
        return "\0".join(str(part.value) for part in node.values if isinstance(part, ast.Constant))
    return str(node.value) if isinstance(node, ast.Constant) else ""


def _texts(node: ast.expr) -> Iterator[ast.expr]:
    """Texts that are compared where `node` is an operand: itself, or those in it."""
    inner: list[ast.expr] = []
    if isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str)):
        yield node
    elif isinstance(node, (ast.List, ast.Tuple, ast.Set)):
        inner = node.elts
    elif isinstance(node, ast.Dict):
        inner = node.values
    elif isinstance(node, ast.BinOp):
        inner = [node.left, node.right]
    elif isinstance(node, ast.IfExp):
        inner = [node.body, node.orelse]
    elif isinstance(node, (ast.GeneratorExp, ast.ListComp, ast.SetComp)):
        inner = [node.elt]
    elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
        inner = [node.func.value, *node.args] if node.func.attr in SEARCHES | PARTS_OF_A_TEXT else []
    for each in inner:
        yield from _texts(each)


def _operands(test: ast.expr) -> Iterator[ast.expr]:
    """What an assert compares, or searches for, pages apart."""
    for node in ast.walk(test):
        sides: list[ast.expr] = []
        if isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in SEARCHES:
            sides = [node.func.value, *node.args]
        names = {each.id for side in sides for each in ast.walk(side) if isinstance(each, ast.Name)}
        if not names & PAGES:
            yield from sides


def _texts_of_asserts(tree: ast.AST) -> Iterator[ast.expr]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Assert):
            for side in _operands(node.test):
                yield from _texts(side)
        elif isinstance(node, ast.keyword) and node.arg == "match":
            yield from _texts(node.value)


def _compared_names(function: ast.FunctionDef) -> set[str]:
    """Names that the function's asserts compare, or that `match=` is made of."""
    sides = [side for node in ast.walk(function) if isinstance(node, ast.Assert) for side in _operands(node.test)]
    sides += [node.value for node in ast.walk(function) if isinstance(node, ast.keyword) and node.arg == "match"]
    formatted = [part.value for side in sides if isinstance(side, ast.JoinedStr)
                 for part in side.values if isinstance(part, ast.FormattedValue)]  # fmt: skip
    return {each.id for each in (*sides, *formatted) if isinstance(each, ast.Name)}


def _texts_of_parameters(tree: ast.Module) -> Iterator[ast.expr]:
    """Texts of `parametrize` at the places of those parameters that an assert compares."""
    tables = {
        target.id: node.value
        for node in tree.body
        if isinstance(node, ast.Assign)
        for target in node.targets
        if isinstance(target, ast.Name)
    }
    for function in (node for node in tree.body if isinstance(node, ast.FunctionDef)):
        compared = _compared_names(function)
        for mark in function.decorator_list:
            if not (isinstance(mark, ast.Call) and ast.unparse(mark.func).endswith("parametrize")):
                continue
            names, rows = ast.literal_eval(mark.args[0]), mark.args[1]
            names = [each.strip() for each in names.split(",")] if isinstance(names, str) else names
            rows = tables.get(rows.id, rows) if isinstance(rows, ast.Name) else rows
            for row in rows.elts if isinstance(rows, (ast.List, ast.Tuple)) else []:
                cells = (
                    [row]
                    if len(names) == 1
                    else row.args
                    if isinstance(row, ast.Call)
                    else getattr(row, "elts", [])
                )
                for name, cell in zip(names, cells, strict=False):
                    if name in compared:
                        yield from _texts(cell)
