"""Numbers that decide: constants at the top of modules, and literals inside functions."""

from __future__ import annotations

import ast
from collections.abc import Iterable

from tests.structure.modules import Function, Module
from tests.structure.names import assigned_names, top_level

# Numbers that count, halve or double, and say nothing about what they decide.
PLAIN_NUMBERS = frozenset({0, 1, 2, 3, 4, 0.5})
ARITHMETIC = ast.Constant | ast.UnaryOp | ast.BinOp | ast.operator | ast.unaryop


def numeric_constants(modules: Iterable[Module]) -> dict[str, str]:
    """Names in capitals to which a module gives a number at its top level: dotted name -> value as written.

    A number is written with literals and arithmetic alone, "1e-9" or "2.0**-52"; 0 is one. Tuples are not.
    """
    return {
        f"{module.name}.{name}": ast.unparse(value)
        for module in modules
        for node in top_level(module.tree)
        for name, value in assigned_names(node)
        if name.isupper() and _is_number(value)
    }


def function_literals(modules: Iterable[Module]) -> dict[str, str]:
    """Numbers written inside functions, defaults of arguments included: "module:line:column" -> as written.

    Left out are 0 to 4 and 1/2, whole or not, and what a list of choices for a type checker holds.
    """
    found: dict[str, str] = {}
    for module in modules:
        for node in ast.walk(module.tree):
            if isinstance(node, Function):
                for one in ast.walk(node):
                    if isinstance(one, ast.Constant) and _decides(one.value):
                        found[f"{module.name}:{one.lineno}:{one.col_offset}"] = repr(one.value)
    return found


def _is_number(node: ast.expr) -> bool:
    """Is an expression made of numbers alone?"""
    parts = list(ast.walk(node))
    return all(isinstance(part, ARITHMETIC) for part in parts) and all(
        isinstance(part.value, int | float | complex) and not isinstance(part.value, bool)
        for part in parts
        if isinstance(part, ast.Constant)
    )


def _decides(value: object) -> bool:
    return isinstance(value, int | float | complex) and not isinstance(value, bool) and value not in PLAIN_NUMBERS
