"""Names that mean more than one thing, and the names at the top of a package."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from typing import Any

from tests.structure.modules import Function, Module

CONSTANT = re.compile(r"[A-Z][A-Z0-9_]+")
# What a list of names is put together with; nothing else can be called while `__all__` is worked out.
ALLOWED_FUNCTIONS: dict[str, Any] = {
    "__builtins__": {},
    **{f.__name__: f for f in (dict, frozenset, list, map, set, sorted, str, sum, tuple, zip)},
}
Meanings = dict[str, dict[str, str]]


def classes_of_several_modules(modules: list[Module]) -> Meanings:
    """Classes that more than one module defines at its top level: name -> module -> what it is derived from."""
    found: Meanings = defaultdict(dict)
    for module in modules:
        for node in top_level(module.tree):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found[node.name][module.name] = f"class({', '.join(map(ast.unparse, node.bases))})"
    return _in_several(found)


def constants_of_several_modules(modules: list[Module]) -> Meanings:
    """Names in capitals that more than one module gives a value at its top level: name -> module -> value.

    At least two letters, the first no underscore. An import of a constant is no definition.
    """
    found: Meanings = defaultdict(dict)
    for module in modules:
        for node in top_level(module.tree):
            for name, value in assigned_names(node):
                if CONSTANT.fullmatch(name):
                    found[name][module.name] = ast.unparse(value)
    return _in_several(found)


def functions_of_several_signatures(modules: list[Module]) -> Meanings:
    """Public functions that stand at the top level of several modules with different signatures.

    Returns name -> module -> signature as written: parameters with their order, kinds, defaults and annotations,
    and what is returned. A name with one and the same signature everywhere is no entry.
    """
    found: Meanings = defaultdict(dict)
    for module in modules:
        for node in top_level(module.tree):
            if isinstance(node, Function) and not node.name.startswith("_"):
                returned = f" -> {ast.unparse(node.returns)}" if node.returns else ""
                found[node.name][module.name] = f"({ast.unparse(node.args)}){returned}"
    return differing(_in_several(found))


def differing(meanings: Meanings) -> Meanings:
    """The names whose modules do not all say the same of them."""
    return {name: said for name, said in meanings.items() if len(set(said.values())) > 1}


def stub_names(stub: str) -> list[str]:
    """Names that a stub gives away, sorted: what it imports under its own name, and what it defines."""
    found: set[str] = set()
    for node in ast.parse(stub).body:
        if isinstance(node, ast.ImportFrom):
            found.update(alias.asname for alias in node.names if alias.asname is not None)
        elif isinstance(node, Function | ast.ClassDef):
            found.add(node.name)
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            found.add(node.target.id)
    return sorted(name for name in found if not name.startswith("_") or name.startswith("__"))


def public_names(top: Module) -> list[str] | None:
    """The package's `__all__`, sorted; without one its names at the top level that begin with no underscore.

    The assignments of the file are worked out one after the other as far as they are made of literals, of each
    other and of ALLOWED_FUNCTIONS; nothing is imported. Returns None where `__all__` is made of anything else.
    """
    known: dict[str, Any] = dict(ALLOWED_FUNCTIONS)
    bound: set[str] = set()
    for node in top_level(top.tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            bound.update(alias.asname or alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, Function | ast.ClassDef):
            bound.add(node.name)
        for name, value in assigned_names(node):
            bound.add(name)
            try:
                known[name] = eval(compile(ast.Expression(value), top.path, "eval"), known)
            except Exception:  # made of what is not worked out here
                known.pop(name, None)
    if "__all__" in bound:
        return sorted(known["__all__"]) if "__all__" in known else None
    return sorted(name for name in bound if not name.startswith("_"))


def _in_several(found: Meanings) -> Meanings:
    return {name: said for name, said in sorted(found.items()) if len(said) > 1}


def top_level(node: ast.AST) -> Iterator[ast.stmt]:
    """Statements of a module outside functions and classes, those below `if`, `try` and `with` included."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.stmt):
            yield child
        if isinstance(child, ast.If | ast.Try | ast.ExceptHandler | ast.With):
            yield from top_level(child)


def assigned_names(node: ast.stmt) -> Iterator[tuple[str, ast.expr]]:
    """Names and values of an assignment; a name that is only annotated has none."""
    match node:
        case ast.Assign(targets=targets, value=value):
            yield from ((target.id, value) for target in targets if isinstance(target, ast.Name))
        case ast.AnnAssign(target=ast.Name(id=name), value=ast.expr() as value):
            yield name, value
        case ast.AugAssign(target=ast.Name(id=name) as target, op=op, value=value):
            before = ast.copy_location(ast.Name(name, ast.Load()), target)
            yield name, ast.copy_location(ast.BinOp(before, op, value), node)
