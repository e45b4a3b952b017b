"""How long files and functions are, and how many arguments functions have."""

from __future__ import annotations

import ast
import io
import tokenize
from collections.abc import Iterable
from math import ceil

from tests.structure.modules import Function, Module, functions

NO_CODE = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENCODING,
    tokenize.ENDMARKER,
}


def lines_of(module: Module) -> tuple[int, int]:
    """Lines of code, and lines of docstrings.

    A line of code holds something that is neither a comment nor a docstring; a blank line is none, within a text
    neither. A docstring is the text that a module, class or function begins with; its blank lines do not count.
    """
    blank = {i for i, line in enumerate(module.text.split("\n"), 1) if not line.strip()}
    documented: set[int] = set()
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Module | ast.ClassDef | Function):
            documented |= _docstring(node)
    code: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(module.text).readline):
        if token.type not in NO_CODE:
            code.update(range(token.start[0], token.end[0] + 1))
    return len(code - documented - blank), len(documented - blank)


def import_lines(modules: Iterable[Module]) -> int:
    """Lines that import statements take, those inside functions and below `if TYPE_CHECKING` included."""
    return sum(
        len(_span(node))
        for module in modules
        for node in ast.walk(module.tree)
        if isinstance(node, ast.Import | ast.ImportFrom)
    )


def file_lines(modules: Iterable[Module]) -> int:
    """Lines of files as `wc -l` counts them, blank ones and comments included."""
    return sum(module.text.count("\n") for module in modules)


def function_lengths(modules: Iterable[Module], docstrings: bool = True) -> dict[str, int]:
    """Lines of every function from `def` to its end, comments, blank lines and inner functions included.

    Decorators are not. Where a name is defined twice in one place, as overloads are, the last one counts.
    docstrings  False: without the lines of the function's own docstring
    """
    return {
        name: len(_span(function)) - (0 if docstrings else len(_docstring(function)))
        for module in modules
        for name, function, _ in functions(module)
    }


def undocumented_functions(modules: Iterable[Module]) -> set[str]:
    """Functions without a docstring."""
    return {
        name
        for module in modules
        for name, function, _ in functions(module)
        if ast.get_docstring(function, clean=False) is None
    }


def argument_counts(modules: Iterable[Module]) -> dict[str, int]:
    """How many parameters every function has: `*args` and `**kwargs` are one each, `self` and `cls` none."""
    return {
        name: _argument_count(function, is_method)
        for module in modules
        for name, function, is_method in functions(module)
    }


def percentile(values: Iterable[int], share: float) -> int:
    """The smallest value that at least that share of all values does not exceed; 0 for no values."""
    ordered = sorted(values)
    return ordered[max(ceil(share * len(ordered)) - 1, 0)] if ordered else 0


def _argument_count(function: Function, is_method: bool) -> int:
    arguments = function.args
    count = len(arguments.posonlyargs) + len(arguments.args) + len(arguments.kwonlyargs)
    count += (arguments.vararg is not None) + (arguments.kwarg is not None)
    static = any(isinstance(node, ast.Name) and node.id == "staticmethod" for node in function.decorator_list)
    return count - (is_method and not static)


def _docstring(node: ast.Module | ast.ClassDef | Function) -> set[int]:
    """Numbers of a docstring's lines, blank ones included; empty where there is none."""
    return _span(node.body[0]) if ast.get_docstring(node, clean=False) is not None else set()


def _span(node: ast.stmt) -> set[int]:
    """Numbers of a statement's lines."""
    assert node.end_lineno is not None
    return set(range(node.lineno, node.end_lineno + 1))
