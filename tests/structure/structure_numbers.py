"""All numbers of one state of the package, and what they are made of."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

from tests.structure.constants import function_literals, numeric_constants
from tests.structure.imports import circles, import_graph, single_importers
from tests.structure.modules import Module
from tests.structure.names import (
    Meanings,
    classes_of_several_modules,
    constants_of_several_modules,
    differing,
    functions_of_several_signatures,
    public_names,
    stub_names,
)
from tests.structure.sizes import (
    argument_counts,
    file_lines,
    function_lengths,
    import_lines,
    lines_of,
    percentile,
    undocumented_functions,
)

LONG = 40  # lines that a function may have
ARGUMENT_PERCENTILE = 0.9  # of all functions, whose number of arguments is told
MOST_ARGUMENTS = "arguments of a function, at most"
COMMAND_LINE = "show/cli/"
THOUSAND = 1000  # lines, the unit in which the density of numbers is told


@dataclass
class Structure:
    """What is told of one state.

    numbers  what -> number; None where it cannot be told
    lists    what -> name -> what is said of it, for numbers that count names
    """

    numbers: dict[str, float | None] = field(default_factory=dict)
    lists: dict[str, dict[str, str]] = field(default_factory=dict)

    def count(self, what: str, names: Mapping[str, str]) -> None:
        """A number that counts names, and the names."""
        self.numbers[what] = len(names)
        self.lists[what] = dict(names)


def structure(modules: list[Module], excluded: Collection[str], stub: str | None = None) -> Structure:
    """All numbers of a package's modules; those left out are left out of the imports only."""
    found = Structure()
    _sizes(found, modules)
    _functions(found, modules)
    _numbers(found, modules)
    _imports(found, modules, excluded)
    _names(found, modules, stub)
    return found


def _sizes(found: Structure, modules: list[Module]) -> None:
    parts: dict[str, int] = defaultdict(int)
    code = documented = command_line = 0
    for module in modules:
        lines, docstrings = lines_of(module)
        parts[module.part] += lines
        code, documented = code + lines, documented + docstrings
        command_line += lines if module.path.startswith(COMMAND_LINE) else 0
    found.numbers["files"] = len(modules)
    found.numbers["lines"] = file_lines(modules)
    found.numbers["lines of imports"] = import_lines(modules)
    found.numbers["lines of code"] = code
    for part in sorted(parts):
        found.numbers[f"lines of code, {part}"] = parts[part]
    found.numbers["lines of docstrings"] = documented
    commands = [module for module in modules if module.path.startswith(COMMAND_LINE)]
    found.numbers["lines of the command line, as wc -l"] = file_lines(commands)
    found.numbers["lines of code of the command line"] = command_line


def _functions(found: Structure, modules: list[Module]) -> None:
    whole, bare = function_lengths(modules), function_lengths(modules, docstrings=False)
    arguments = argument_counts(modules)
    most = max(arguments.values(), default=0)
    with_most = {name: f"{count} arguments" for name, count in sorted(arguments.items()) if count == most}
    found.numbers["functions"] = len(whole)
    found.count(f"functions over {LONG} lines", _too_long(whole))
    found.count(f"functions over {LONG} lines, docstrings not counted", _too_long(bare))
    undocumented = undocumented_functions(modules)
    found.count(
        f"functions over {LONG} lines, docstrings not counted, without a docstring",
        {name: said for name, said in _too_long(bare).items() if name in undocumented},
    )
    found.numbers[f"arguments of a function, {ARGUMENT_PERCENTILE:.0%} have at most"] = percentile(
        arguments.values(), ARGUMENT_PERCENTILE
    )
    found.numbers[MOST_ARGUMENTS] = most
    found.lists[MOST_ARGUMENTS] = with_most


def _numbers(found: Structure, modules: list[Module]) -> None:
    constants, literals = numeric_constants(modules), function_literals(modules)
    found.count("numeric constants", constants)
    found.count("numbers inside functions", literals)
    found.numbers[f"constants and numbers inside functions, in {THOUSAND} lines"] = round(
        THOUSAND * (len(constants) + len(literals)) / max(file_lines(modules), 1), 2
    )


def _imports(found: Structure, modules: list[Module], left_out: Collection[str]) -> None:
    graph = import_graph(modules, left_out)
    groups = circles(graph)
    found.numbers["import circles"] = len(groups)
    found.count(
        "modules in import circles",
        {name: f"circle {i} of {len(group)}" for i, group in enumerate(groups, 1) for name in group},
    )
    with_all = circles(import_graph(modules)) if left_out else groups
    found.count(
        "modules in import circles, those through what is left out included",
        {name: f"circle of {len(group)}" for group in with_all for name in group},
    )
    found.count(
        "modules with a single importer",
        {name: f"by {importer}" for name, importer in sorted(single_importers(graph).items())},
    )


def _names(found: Structure, modules: list[Module], stub: str | None) -> None:
    tops = [public_names(module) for module in modules if module.path == "__init__.py"]
    public = stub_names(stub) if stub is not None else tops[0] if tops else []
    found.numbers["public names at the top"] = None if public is None else len(public)
    found.lists["public names at the top"] = dict.fromkeys(public or [], "public")
    constants = constants_of_several_modules(modules)
    found.count("class names with two meanings", _meaning_texts(classes_of_several_modules(modules)))
    found.count("constants that several modules define", _meaning_texts(constants))
    found.count("constants with two meanings", _meaning_texts(differing(constants)))
    found.count("function names with two meanings", _meaning_texts(functions_of_several_signatures(modules)))


def _too_long(lengths: Mapping[str, int]) -> dict[str, str]:
    """Functions that are too long, the longest first."""
    ordered = sorted(lengths.items(), key=lambda item: (-item[1], item[0]))
    return {name: f"{length} lines" for name, length in ordered if length > LONG}


def _meaning_texts(meanings: Meanings) -> dict[str, str]:
    """The modules that give a name a meaning, in one line."""
    return {name: ", ".join(said) for name, said in meanings.items()}
