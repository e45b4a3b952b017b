"""The shape of the code: which package may import which, and what no file may do."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.structure.imports import circles, import_graph
from tests.structure.modules import modules_of
from zwidth.device.new_device import KINDS

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "src" / "zwidth"
MODULES = sorted(PACKAGE.rglob("*.py"))
DEVICES = sorted(path.stem for path in (PACKAGE / "device" / "zoo").glob("*.toml"))

# Numbers flow from left to right: a package imports itself and what stands before it.
FLOW = ("model", "loop", "chart", "conditions", "guarantees", "contact", "measures", "study", "show")
# Device files become models and loops; what computes knows nothing of files.
EVERYWHERE = {
    "compiled",
    "compile_events",
    "cuda_kernels",
    "processors",
    "progress",
    "machine_code",
    "memory_limit",
    "result",
    "threads",
    "tuple_references",
    "_version",
}
MAY_IMPORT = {package: {*FLOW[: place + 1], *EVERYWHERE} for place, package in enumerate(FLOW)}
MAY_IMPORT |= {module: set() for module in EVERYWHERE}
MAY_IMPORT["compiled"] = {"compile_events", "machine_code", "tuple_references"}
MAY_IMPORT["cuda_kernels"] = {"tuple_references"}
MAY_IMPORT["device"] = {"device", "model", "loop", *EVERYWHERE}
MAY_IMPORT["study"].add("device")
MAY_IMPORT["show"].add("device")
MAY_IMPORT["_old_names"] = {*FLOW, "device"}  # above all, and imported by nothing but the package itself

VERBS = "_verbs"
FOR_PEOPLE = {"matplotlib", "click", "rich", "jinja2"}
HEAVY = {"numba", "scipy", "matplotlib"}
LONGEST_MODULE = 600


def imports(source: str, module: str, *, is_package: bool = False) -> Iterator[str]:
    """Full dotted names of all that `source` imports while it runs, inside functions too; `module` resolves the
    dots."""
    tree = ast.parse(source)
    for_types = {id(node) for guard in ast.walk(tree) if type_only(guard) for node in ast.walk(guard)}
    for node in ast.walk(tree):
        if id(node) in for_types:
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            up = node.level - is_package
            base = module.split(".")[: -up or None] if node.level else []
            origin = ".".join([*base, *filter(None, [node.module])])
            yield from (f"{origin}.{alias.name}" for alias in node.names)


def type_only(node: ast.AST) -> bool:
    """Is it a block that only type checkers read?"""
    return isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING" and not node.orelse


def imports_of(path: Path) -> set[str]:
    module = ".".join(("zwidth", *path.relative_to(PACKAGE).with_suffix("").parts)).removesuffix(".__init__")
    return set(imports(path.read_text(encoding="utf-8"), module, is_package=path.name == "__init__.py"))


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
    from ..study.sweep import run
if TYPE_CHECKING:
    from zwidth.show import output
"""
    assert set(imports(source, "zwidth.model.posture")) == {
        "zwidth.chart.edge_by_eigenvalues",
        "numpy",
        "zwidth.show",
        "zwidth.loop.hold",
        "zwidth.model.closure",
        "zwidth.study.sweep.run",
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
    tree = ast.parse(path.read_text())
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    with_text = [node for node in ast.walk(tree) if isinstance(node, documented) and ast.get_docstring(node)]
    prose = {id(node.body[0].value) for node in with_text}
    texts = [node for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    messages = [node.value for node in texts if id(node) not in prose]
    assert not [text for text in messages if re.search(r"(?<![-\w])--[a-z]|\bzwidth (chart|simulate|check)", text)]


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


def test_no_device_is_known_outside_the_zoo():
    assert DEVICES, "the zoo is empty"
    known = re.compile("|".join(name.replace("-", "[-_]") for name in DEVICES), re.IGNORECASE)
    sources = [path for path in PACKAGE.rglob("*") if path.is_file() and "__pycache__" not in path.parts]
    outside = [path for path in sources if PACKAGE / "device" / "zoo" not in path.parents]
    named = {relative_path(path): set(known.findall(path.read_text(encoding="utf-8"))) for path in outside}
    # a linkage of five bars is a kind of device before it is a bundled one: these files declare and want the kinds
    for path in ("src/zwidth/device/new_device.py", "src/zwidth/show/cli/compile_group.py"):
        named[path] -= set(KINDS)
    assert {path: names for path, names in named.items() if names} == {}
