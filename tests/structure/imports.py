"""Which module of a package imports which, and what follows from it."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Collection, Iterator, Mapping

from tests.structure.modules import Module

Graph = Mapping[str, Collection[str]]


def import_graph(modules: list[Module], left_out: Collection[str] = ()) -> dict[str, set[str]]:
    """The modules of the package that each module imports.

    Imports inside functions count, those below `if TYPE_CHECKING` do not. `from a import b` is an import of the
    module a.b where there is one, else of a; that importing a.b also runs a's `__init__` does not count. Modules
    that are left out neither import nor are imported.
    """
    names = {module.name for module in modules}
    wanted = names.difference(left_out)
    return {
        module.name: {name for name in _imported(module, names) if name in wanted and name != module.name}
        for module in modules
        if module.name not in left_out
    }


def circles(graph: Graph) -> list[list[str]]:
    """Groups of modules that import each other, directly or through others, the largest first."""
    reached = {name: _imported_modules(graph, name) for name in graph}
    groups = {tuple(sorted(other for other in reached[name] if name in reached[other])) for name in graph}
    return sorted((list(group) for group in groups if group), key=lambda group: (-len(group), group))


def single_importers(graph: Graph) -> dict[str, str]:
    """Modules that exactly one other module imports, and that one; a folder's `__init__` is a module, too."""
    count = Counter(name for imported in graph.values() for name in imported)
    return {
        name: module for module, imported in sorted(graph.items()) for name in sorted(imported) if count[name] == 1
    }


def _imported_modules(graph: Graph, start: str) -> set[str]:
    """All that a module imports, directly or through others; itself only where it is on a circle."""
    reached: set[str] = set()
    queue = list(graph[start])
    while queue:
        name = queue.pop()
        if name not in reached:
            reached.add(name)
            queue += graph[name]
    return reached


def _imported(module: Module, names: Collection[str]) -> Iterator[str | None]:
    """What a module imports, as the longest name of a module in it; None for what is no module of the package."""
    for node in _runtime_nodes(module.tree):
        if isinstance(node, ast.Import):
            yield from (_module_in(alias.name, names) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = module.name.split(".")[: -(node.level - module.is_package) or None] if node.level else []
            origin = ".".join([*base, *filter(None, [node.module])])
            yield from (_module_in(f"{origin}.{alias.name}", names) for alias in node.names)


def _module_in(name: str, names: Collection[str]) -> str | None:
    """The module that an imported name or one of its attributes belongs to: itself, or what it is taken from."""
    return next((one for one in (name, name.rpartition(".")[0]) if one in names), None)


def _runtime_nodes(tree: ast.AST) -> Iterator[ast.AST]:
    """All statements but those that only a type checker sees; expressions hold none."""
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        yield node
        typed = isinstance(node, ast.If) and ast.unparse(node.test).split(".")[-1] == "TYPE_CHECKING"
        children = node.orelse if typed and isinstance(node, ast.If) else ast.iter_child_nodes(node)
        waiting += [child for child in children if not isinstance(child, ast.expr)]
