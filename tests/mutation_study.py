"""Does the suite notice a fault? Faults drawn by a fixed seed, each put in by itself, and what covers it run.

    python -m tests.mutation_study draw 40 --seed 1 > faults.json
    python -m tests.mutation_study run faults.json caught.jsonl --tree FOLDER
    python -m tests.mutation_study again caught.jsonl still.jsonl --tree FOLDER

FOLDER holds a copy of the project to break, with its own kernels; `again` runs first what caught each fault
before, on newer sources. A fault is a changed sign, bound, index or factor in one function. First come those of
the quick verdict's tests that cover it, then those of its package, then the others. What covers a function is
known where `python -m tests.verdict record` was run here, the quickest tests come first; elsewhere the test files
that `make affected` names for the fault's file are taken. What most tests execute takes the whole suite where
nothing catches the fault; `--seconds` ends that, and the fault counts as open. In a FOLDER of another time it goes
`--by-name`: the test files that name its module, then the folder of tests of its package, then those of the
commands. The first failure ends a fault's run. A fault that nothing catches is either a
hole in the suite or no fault at all (a start value of an iteration, a cell of a grid more): read those by eye.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import random
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from time import monotonic

import pytest

from tests.verdict.recording import files_of_tests, read_raw, read_recorded
from tests.verdict.selection import affected_tests, files_of, read_choice

ROOT = Path(__file__).parent.parent
FAILED = re.compile(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", re.MULTILINE)
COLLECTING = re.compile(r"^_* ERROR collecting (\S+)", re.MULTILINE)
FIRST = 50  # tests in one run of pytest: with more, what a late one would catch at once waits for all before
LIMIT = 900  # seconds for what covers one fault; a run that takes longer has caught it, as an endless loop


@dataclass(frozen=True)
class Mutation:
    """One changed place: file, function, kind, and the lines before and after."""

    path: str
    function: str
    kind: str
    before: str
    after: str


def mutations_of(path: Path) -> Iterator[Mutation]:
    """Every fault that one file can have, in its functions, messages and annotations left out."""
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines()
    for function in ast.walk(ast.parse(text)):
        if not isinstance(function, ast.FunctionDef):
            continue
        for statement in function.body:
            for node in _reachable(statement):
                for kind, new in _changes(node):
                    if node.lineno != node.end_lineno:
                        continue
                    line = lines[node.lineno - 1].encode()
                    after = line[: node.col_offset] + new.encode() + line[node.end_col_offset :]
                    name = str(path.relative_to(ROOT))
                    yield Mutation(name, function.name, kind, line.decode().strip(), after.decode().strip())


def _reachable(node: ast.AST) -> Iterator[ast.expr]:
    """Expressions of a statement; no inner function, no annotation, no text, nothing that is raised."""
    if isinstance(node, ast.FunctionDef | ast.Raise | ast.JoinedStr | ast.Assert):
        return
    if isinstance(node, ast.expr):
        yield node
    for field, value in ast.iter_fields(node):
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and field != "annotation":
                yield from _reachable(child)


def _changes(node: ast.expr) -> Iterator[tuple[str, str]]:
    """What can be wrong with one expression: kind and new text."""
    match node:
        case ast.BinOp(left, ast.Add() as op, right) | ast.BinOp(left, ast.Sub() as op, right):
            other: ast.operator = ast.Sub() if isinstance(op, ast.Add) else ast.Add()
            yield "sign", f"({ast.unparse(ast.BinOp(left, other, right))})"
        case ast.BinOp(left, ast.Mult() as op, right) | ast.BinOp(left, ast.Div() as op, right):
            other = ast.Div() if isinstance(op, ast.Mult) else ast.Mult()
            yield "factor", f"({ast.unparse(ast.BinOp(left, other, right))})"
        case ast.UnaryOp(ast.USub(), operand) if not isinstance(operand, ast.Constant):
            yield "sign", f"({ast.unparse(operand)})"
        case ast.Compare(left, [ast.Lt() | ast.LtE() | ast.Gt() | ast.GtE() as order], [right]):
            swapped = {ast.Lt: ">", ast.LtE: ">", ast.Gt: "<", ast.GtE: "<"}[type(order)]
            yield "bound", f"({ast.unparse(left)} {swapped} {ast.unparse(right)})"
        case ast.Call(ast.Name("range"), [*first, last], []):
            yield (
                "bound",
                f"range({', '.join(map(ast.unparse, [*first]))}{', ' if first else ''}{ast.unparse(last)} - 1)",
            )
        case ast.Call(ast.Name("min" | "max" as name), arguments, []) if len(arguments) > 1:
            yield "bound", f"{'max' if name == 'min' else 'min'}({', '.join(map(ast.unparse, arguments))})"
        case ast.Subscript(value, ast.Constant(int(k))):
            yield "index", f"{ast.unparse(value)}[{k + 1 if k <= 0 else k - 1}]"
        case ast.Constant(float(x)) if x not in (0.0, float("inf")):
            yield "factor", repr(2.0 * x)


def draw_mutations(count: int, seed: int) -> list[Mutation]:
    """Faults in as many functions, each function as likely as any other."""
    functions: dict[tuple[str, str], list[Mutation]] = {}
    for path in sorted((ROOT / "src").rglob("*.py")):
        for fault in mutations_of(path):
            functions.setdefault((fault.path, fault.function), []).append(fault)
    choice = random.Random(seed)
    return [choice.choice(functions[name]) for name in choice.sample(sorted(functions), count)]


def apply(fault: Mutation, tree: Path) -> bool:
    """Put a fault into a tree; False where its line is not there any more, or not once."""
    path = tree / fault.path
    if not path.exists():
        return False
    text = path.read_text(encoding="utf-8")
    places = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef) and node.name == fault.function:
            lines = text.splitlines(keepends=True)
            body = range(node.lineno - 1, node.end_lineno or 0)
            places += [i for i in body if lines[i].strip() == fault.before]
    if not places:
        return False
    lines[places[0]] = lines[places[0]].replace(fault.before, fault.after)
    path.write_text("".join(lines), encoding="utf-8")
    drop_kernels(path, tree / "src")
    return True


def drop_kernels(path: Path, source: Path) -> None:
    """Delete the compiled kernels of a file and of all that import it, directly or not: they would not notice.

    Those in a folder that NUMBA_CACHE_DIR names are kept by what they were made from, and stay.
    """
    if "NUMBA_CACHE_DIR" in os.environ:
        return
    module = ".".join(path.relative_to(source).with_suffix("").parts)
    stale, before = {module}, set[str]()
    files = {".".join(p.relative_to(source).with_suffix("").parts): p for p in source.rglob("*.py")}
    while stale != before:
        before = set(stale)
        pattern = re.compile("|".join(rf"(?:from|import) {re.escape(name)}\b" for name in sorted(stale)))
        stale |= {name for name, file in files.items() if pattern.search(file.read_text(encoding="utf-8"))}
    for name in stale:
        for kernel in (files[name].parent / "__pycache__").glob(f"{files[name].stem}.*.nb[ic]"):
            kernel.unlink()


def covering_tests(fault: Mutation, tree: Path, *, by_name: bool = False) -> dict[str, list[str]]:
    """The tests that cover a fault, by the name of their group, in the order in which they are run.

    by_name  whether to go by names although it is recorded what each test, or each file of them, executes
    """
    recorded = {} if by_name else tests_by_function()
    if recorded:
        tests = recorded.get((fault.path, fault.function), [])
        quick, folder = set(read_choice("quick")), f"tests/{Path(fault.path).parts[2]}/"
        rest = [name for name in tests if name not in quick]
        own = [name for name in rest if name.startswith(folder)]
        far = [name for name in rest if not name.startswith(folder)]
        groups = {"quick": [name for name in tests if name in quick]}
        for group, names in {"package": own, "others": far}.items():
            groups |= {f"{group} {k}": names[k : k + FIRST] for k in range(0, len(names), FIRST)}
        return groups
    module = ".".join(Path(fault.path).relative_to("src").with_suffix("").parts)
    packages = Path(fault.path).parts[2:-1]  # show/cli has its tests in tests/show and tests/cli
    files = [str(f.relative_to(tree)) for f in sorted((tree / "tests").rglob("test_*.py"))]
    named = [f for f in files if re.search(rf"{re.escape(module)}\b", (tree / f).read_text(encoding="utf-8"))]
    own = [f for f in files if Path(f).parts[1] in packages and f not in named]
    if by_name:
        commands = [f for f in files if Path(f).parts[1] in ("cli", "reproduction") and f not in named]
        return {"named": named, "package": own, "commands": commands}
    affected = affected_tests([fault.path], read_recorded(), files_of_tests())
    return {
        "quick": [test for test in read_choice("quick") if files_of([test])[0] in affected],
        "named": [f for f in named if f in affected],
        "package": [f for f in own if f in affected],
    } | {f"others {f}": [f] for f in affected if f not in named and f not in own}


@cache
def tests_by_function() -> dict[tuple[str, str], list[str]]:
    """The recorded tests that execute each function, by its file and name, the quickest first; empty where nothing
    was recorded here."""
    found: dict[tuple[str, str], list[tuple[float, str]]] = {}
    for one in read_raw().values():
        for name, test in one.tests.items():
            for path, _, qualified in (function.partition(":") for function in test.functions):
                found.setdefault((path, qualified.rpartition(".")[2]), []).append((test.seconds, name))
    return {function: [name for _, name in sorted(set(tests))] for function, tests in found.items()}


def first_failing_test(tree: Path, tests: list[str]) -> str | None:
    """The first test that fails, or None."""
    names = tree / "out" / "tests-of-fault.txt"  # too many for a command line
    names.parent.mkdir(exist_ok=True)
    names.write_text("\n".join(tests), encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", f"@{names}"]
    environment = os.environ | {"PYTHONPATH": str(tree / "src"), "PYTHONDONTWRITEBYTECODE": "1"}
    try:
        done = subprocess.run(
            command, cwd=tree, env=environment, capture_output=True, text=True, timeout=LIMIT, check=False
        )
    except subprocess.TimeoutExpired:
        return "took too long"
    if done.returncode == pytest.ExitCode.USAGE_ERROR:
        if broken := COLLECTING.search(done.stdout):  # its file cannot even be imported
            return broken[1]
        raise SystemExit(done.stderr)  # a test that is not there any more
    failed = FAILED.search(done.stdout)
    return failed[1] if failed else None if done.returncode in (0, 5) else done.stdout[-300:] + done.stderr[-300:]


def run_mutation(
    fault: Mutation, tree: Path, groups: dict[str, list[str]], seconds: float = float("inf")
) -> dict[str, object]:
    """What came of one fault in a tree that is whole before and after: the test that caught it, and its group.

    seconds  no further group is begun after them; `tried` says how many of the `tests` were run
    """
    end, tried = monotonic() + seconds, 0
    whole = (tree / fault.path).read_text(encoding="utf-8") if (tree / fault.path).exists() else ""
    if not apply(fault, tree):
        return asdict(fault) | {"caught": None, "gone": True}
    try:
        caught = where = None
        for group, tests in groups.items():
            if not tests or monotonic() > end:
                continue
            tried += len(tests)
            if caught := first_failing_test(tree, tests):
                where = group
                break
    finally:
        (tree / fault.path).write_text(whole, encoding="utf-8")
        drop_kernels(tree / fault.path, tree / "src")
    counts = {"tests": sum(map(len, groups.values())), "tried": tried}
    return asdict(fault) | {"caught": caught, "group": where} | counts


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["draw", "run", "again"])
    parser.add_argument("given", help="how many; a file of faults")
    parser.add_argument(
        "output", nargs="?", type=Path, help="one line of JSON for each fault; goes on where it ends"
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--by-name", action="store_true", help="what covers a function goes by names of files")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="after which a fault is left open")
    parser.add_argument("--tree", type=Path, help="a copy of the project")
    options = parser.parse_args()
    if options.what == "draw":
        print(json.dumps([asdict(fault) for fault in draw_mutations(int(options.given), options.seed)], indent=1))
        return
    text = Path(options.given).read_text()
    entries = json.loads(text) if options.what == "run" else [json.loads(line) for line in text.splitlines()]
    done = len(options.output.read_text().splitlines()) if options.output.exists() else 0
    tree = options.tree.resolve()
    for entry in entries[done:]:
        fault = Mutation(**{key: entry[key] for key in Mutation.__dataclass_fields__})
        groups = covering_tests(fault, tree, by_name=options.by_name)
        if options.what == "again":
            groups = {"again": [entry["caught"]], **groups} if entry["caught"] else {}
        found = run_mutation(fault, tree, groups, options.seconds)
        with options.output.open("a") as stream:
            stream.write(json.dumps(found) + "\n")
        print(fault.path, fault.function, fault.kind, "->", found["caught"], flush=True)


if __name__ == "__main__":
    main()
