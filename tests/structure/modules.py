"""Modules of a package as read from their sources; nothing of the package is imported or run."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class Module:
    """One file.

    name      dotted, with the package in front; a folder's "__init__.py" has the folder's name
    path      from the package's folder
    text      the file's
    package   is it a folder's "__init__.py"?
    """

    name: str
    path: str
    text: str

    @property
    def is_package(self) -> bool:
        return self.path.endswith("__init__.py")

    @property
    def part(self) -> str:
        """The folder directly below the package that holds the file; "(top)" for a file beside those folders."""
        first, slash, _ = self.path.partition("/")
        return first if slash else "(top)"

    @cached_property
    def tree(self) -> ast.Module:
        return ast.parse(self.text)


def modules_of(package: str, texts: Mapping[str, str]) -> list[Module]:
    """Modules of a package from the texts of its files by their paths, such as "chart/region.py"."""
    found = []
    for path, text in sorted(texts.items()):
        words = path.removesuffix(".py").split("/")
        if words[-1] == "__init__":
            words.pop()
        found.append(Module(".".join((package, *words)), path, text))
    return found


def functions(module: Module) -> Iterator[tuple[str, Function, bool]]:
    """All functions of a module, inner ones and methods too: dotted name, definition, is it a method?"""
    yield from _functions(module.tree.body, module.name, False)


def _functions(body: Iterable[ast.AST], prefix: str, in_class: bool) -> Iterator[tuple[str, Function, bool]]:
    for node in body:
        if isinstance(node, Function):
            name = f"{prefix}.{node.name}"
            yield name, node, in_class
            yield from _functions(node.body, name, False)
        elif isinstance(node, ast.ClassDef):
            yield from _functions(node.body, f"{prefix}.{node.name}", True)
        else:  # a definition below `if`, `try` or `with`
            yield from _functions(ast.iter_child_nodes(node), prefix, in_class)
