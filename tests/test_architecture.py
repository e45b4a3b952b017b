"""The shape of the code: which package may import which, and what no file may do."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Collection, Iterator
from pathlib import Path

import pytest

from tests.structure.imports import circles, import_graph
from tests.structure.modules import modules_of
from zwidth.device.read import KINDS

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "src" / "zwidth"
MODULES = sorted(PACKAGE.rglob("*.py"))
DEVICES = sorted(path.stem for path in (PACKAGE / "device" / "zoo").glob("*.toml"))

# Numbers flow from left to right: a package imports itself and what stands before it.
FLOW = ("model", "loop", "chart", "conditions", "guarantees", "contact", "measures", "identify", "study", "show")
# Device files become models and loops; what computes knows nothing of files.
EVERYWHERE = {
    "argument",
    "arrays",
    "compiled",
    "compile_events",
    "errors",
    "progress",
    "questions",
    "machine_code",
    "result",
    "resources",
    "tuple_references",
    "unit_text",
    "_version",
}
MAY_IMPORT = {package: {*FLOW[: place + 1], *EVERYWHERE} for place, package in enumerate(FLOW)}
MAY_IMPORT |= {module: set() for module in EVERYWHERE}
MAY_IMPORT["argument"] = MAY_IMPORT["resources"] = {"errors"}
MAY_IMPORT["questions"] = {"argument"}
MAY_IMPORT["compiled"] = {"compile_events", "machine_code", "tuple_references"}
MAY_IMPORT["device"] = {"device", "model", "loop", *EVERYWHERE}
MAY_IMPORT["identify"].add("device")
MAY_IMPORT["study"].add("device")
MAY_IMPORT["show"].add("device")
MAY_IMPORT["__main__"] = {"show"}

VERBS = "_verbs"
FOR_PEOPLE = {"matplotlib", "click", "rich", "jinja2"}
HEAVY = {"numba", "scipy", "matplotlib"}
LONGEST_MODULE = 600
OPTIONS_OF_COMMANDS = r"(?<![-\w])--[a-z]|\bzwidth (chart|simulate|check)"


def imports(source: str, module: str, *, is_package: bool = False) -> Iterator[str]:
    """Full dotted names of all that `source` imports while it runs, inside functions too; `module` resolves the
    dots."""
    for node in runtime_statements(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            up = node.level - is_package
            base = module.split(".")[: -up or None] if node.level else []
            origin = ".".join([*base, *filter(None, [node.module])])
            yield from (f"{origin}.{alias.name}" for alias in node.names)


def runtime_statements(tree: ast.AST) -> Iterator[ast.AST]:
    """All statements but those that only type checkers read; no expressions, which hold no statement and are nine
    tenths of a tree."""
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        yield node
        if not type_only(node):
            waiting += [child for child in ast.iter_child_nodes(node) if not isinstance(child, ast.expr)]


def type_only(node: ast.AST) -> bool:
    """Is it a block that only type checkers read?"""
    return isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING" and not node.orelse


def imports_of(path: Path) -> set[str]:
    module = ".".join(("zwidth", *path.relative_to(PACKAGE).with_suffix("").parts)).removesuffix(".__init__")
    return set(imports(path.read_text(encoding="utf-8"), module, is_package=path.name == "__init__.py"))


def joined_texts(source: str) -> str:
    """Python source with texts that follow each other joined: to see fast that it holds no such words at all."""
    return re.sub(r"""["']\s*\w?["']""", "", source)


def top_package(path: Path) -> str:
    """The package (or single module) directly under zwidth that holds the file."""
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def relative_path(path: Path) -> str:
    return str(path.relative_to(ROOT))


def test_every_way_of_importing_is_seen():
    source = """
import zwidth.chart.edge_by_eigenvalues as r, numpy
from zwidth import show
from ..loop import hold
from . import closure
def lazily():
    from ..study.designs.sweep import run
if TYPE_CHECKING:
    from zwidth.show import output
"""
    assert set(imports(source, "zwidth.model.posture")) == {
        "zwidth.chart.edge_by_eigenvalues",
        "numpy",
        "zwidth.show",
        "zwidth.loop.hold",
        "zwidth.model.closure",
        "zwidth.study.designs.sweep.run",
    }
    source = "from .forward_kinematics import f\nfrom .. import chart"
    assert set(imports(source, "zwidth.model", is_package=True)) == {
        "zwidth.model.forward_kinematics.f",
        "zwidth.chart",
    }


@pytest.mark.parametrize(
    "path", [path for path in MODULES if top_package(path) not in ("__init__", VERBS)], ids=relative_path
)
def test_imports_follow_the_flow_of_numbers(path):
    assert top_package(path) in MAY_IMPORT, f"say in FLOW where {top_package(path)} stands"
    inner = {name.split(".")[1] for name in imports_of(path) if name.startswith("zwidth.")}
    # `from zwidth import __version__` and the like name attributes, not packages.
    packages = {name for name in inner if (PACKAGE / name).is_dir() or (PACKAGE / f"{name}.py").is_file()}
    assert packages - {VERBS} <= MAY_IMPORT[top_package(path)]


def test_verbs_forward_and_do_nothing_else():
    """Each function of the one module that may import upwards imports what it calls, and returns its result."""
    tree = ast.parse((PACKAGE / f"{VERBS}.py").read_text(encoding="utf-8"))
    forwards = [node for node in tree.body if isinstance(node, ast.FunctionDef)]
    assert forwards
    for function in forwards:
        imported, returned = function.body
        assert isinstance(imported, ast.ImportFrom), function.name
        assert isinstance(returned, ast.Return), function.name
        assert isinstance(returned.value, ast.Call), function.name
        assert [alias.asname or alias.name for alias in imported.names] == [ast.unparse(returned.value.func)]
    rest = [node for node in tree.body if not isinstance(node, ast.FunctionDef | ast.ImportFrom | ast.Expr)]
    assert all(type_only(node) for node in rest)


def test_no_modules_import_each_other_in_a_circle():
    texts = {str(path.relative_to(PACKAGE)): path.read_text(encoding="utf-8") for path in MODULES}
    assert circles(import_graph(modules_of("zwidth", texts), [f"zwidth.{VERBS}"])) == []


@pytest.mark.parametrize("path", [path for path in MODULES if top_package(path) != "show"], ids=relative_path)
def test_only_show_draws_and_talks(path):
    assert not {name.split(".")[0] for name in imports_of(path)} & FOR_PEOPLE


@pytest.mark.parametrize("path", [path for path in MODULES if top_package(path) != "show"], ids=relative_path)
def test_only_the_command_line_speaks_of_options(path):
    source, options = path.read_text(encoding="utf-8"), re.compile(OPTIONS_OF_COMMANDS)
    if not options.search(joined_texts(source)):
        return
    tree = ast.parse(source)
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    with_text = [node for node in ast.walk(tree) if isinstance(node, documented) and ast.get_docstring(node)]
    prose = {id(node.body[0].value) for node in with_text}
    texts = [node for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    messages = [node.value for node in texts if id(node) not in prose]
    assert not [text for text in messages if options.search(text)]


@pytest.mark.parametrize("module", ["zwidth", "zwidth.show.cli.main"])
def test_importing_stays_light(module):
    program = f"import sys, {module}; print(*sys.modules)"
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    assert module in found.split()
    assert not HEAVY & set(found.split())


def test_modules_stay_short():
    folders = [ROOT / name for name in ("src", "tests", "benchmarks", "gallery", "docs")]
    lengths = {path: len(path.read_bytes().splitlines()) for folder in folders for path in folder.rglob("*.py")}
    assert {relative_path(path): n for path, n in lengths.items() if n > LONGEST_MODULE} == {}


# Kinds of `zwidth new`, one of which a bundled device is called by too: what declares and wants them.
SAYS_KINDS = {
    "src/zwidth/device/read.py": ("KINDS", "new_device"),
    "src/zwidth/show/cli/compile_group.py": ("DEVICES",),
}


def without_kinds(source: str, owners: Collection[str]) -> str:
    """Python source without the quoted kinds of `zwidth new` inside the named constants, and in the docstrings of
    the named functions."""
    lines = source.splitlines()
    for node in ast.parse(source).body:
        if isinstance(node, ast.FunctionDef) and node.name in owners and ast.get_docstring(node):
            node = node.body[0]
        elif not (isinstance(node, ast.AnnAssign) and getattr(node.target, "id", None) in owners):
            continue
        for number in range(node.lineno - 1, node.end_lineno or node.lineno):
            for kind in KINDS:
                lines[number] = lines[number].replace(f'"{kind}"', '""')
    return "\n".join(lines)


def devices_named(source: str, names: Collection[str], *, python: bool) -> set[str]:
    """Those names that stand whole between quotes; in Python also as a word of a text that code may use, such as a
    command, or with _ for - as an identifier."""
    whole = "|".join(map(re.escape, sorted(names, key=len, reverse=True)))
    found = set(re.findall(rf"""(?<=["'`])(?:{whole})(?:\.toml)?(?=["'`])""", source, re.IGNORECASE))
    loose = re.sub("[-.]", "[-._]", whole.replace("\\", ""))
    if python and re.search(loose, joined_texts(source), re.IGNORECASE):
        nodes = list(ast.walk(ast.parse(source)))
        prose = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
        word = re.compile(rf"(?<![\w-])(?:{whole})(?!\w|-\w)", re.IGNORECASE)
        identifiers = {re.sub(r"[-.]", "_", name): name for name in names}
        for node in nodes:
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in prose:
                found |= set(word.findall(node.value))
            elif isinstance(node, ast.Name | ast.FunctionDef | ast.ClassDef | ast.Attribute | ast.arg):
                written = next(getattr(node, key) for key in ("id", "name", "attr", "arg") if hasattr(node, key))
                found |= {identifiers.get(written.lower(), "")} - {""}
    return {name.lower().removesuffix(".toml") for name in found}


def test_no_device_is_known_outside_the_zoo():
    assert len(DEVICES) > 10, "the zoo has lost its devices"
    sources = [path for path in PACKAGE.rglob("*") if path.is_file() and "__pycache__" not in path.parts]
    outside = [path for path in sources if PACKAGE / "device" / "zoo" not in path.parents]
    assert MODULES[0] in outside
    named = {}
    for path in outside:
        # a compiled file holds bytes that are no text
        text, name = path.read_text(encoding="utf-8", errors="replace"), relative_path(path)
        text = without_kinds(text, SAYS_KINDS[name]) if name in SAYS_KINDS else text
        named[name] = devices_named(text, DEVICES, python=path.suffix in (".py", ".pyi"))
    assert {path: names for path, names in named.items() if names} == {}


@pytest.mark.parametrize("name", DEVICES)
def test_a_device_that_code_names_is_found(name):
    """Whatever the quotes, in code and in other files; and each by its own name, not by one that begins alike."""
    for source in (
        f'if device.name == "{name}":\n    pass\n',
        f"load('{name}')",
        f'f"chart {name} --at {{x}}"',
        f'read("{name}.toml")',
        f'def f():\n    """As in\n\n    >>> load("{name}")\n    """\n',
        f'COUNT = {{"{name.upper()}": 1}}',
    ):
        assert devices_named(source, DEVICES, python=True) == {name}, source
    assert devices_named(f'extends = "{name}"', DEVICES, python=False) == {name}
    if "-" in name:
        identifier = re.sub(r"[-.]", "_", name)
        assert devices_named(f"def {identifier}(): pass", DEVICES, python=True) == {name}
    for source in (f'"{name}s"', f'"my-{name}"', f'"{name}-of-mine"', f"# a {name} or another\n", "five_bars = 1"):
        assert devices_named(source, [name], python=True) == set(), source


def test_the_kinds_of_new_devices_are_overlooked_where_they_are_declared_only():
    for path, owners in SAYS_KINDS.items():
        source = (ROOT / path).read_text(encoding="utf-8")
        assert devices_named(source, DEVICES, python=True) == {"five-bar"}, path
        assert devices_named(without_kinds(source, owners), DEVICES, python=True) == set()
        for more in ('\nload("five-bar")\n', '\nDEFAULT: str = "five-bar"\n'):
            assert devices_named(without_kinds(source + more, owners), DEVICES, python=True) == {"five-bar"}
