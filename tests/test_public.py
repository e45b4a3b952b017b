"""The public names: there, light to import, and the same in the stubs."""

from __future__ import annotations

import ast
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import zwidth

SOURCE = Path(zwidth.__file__).read_text(encoding="utf-8")


@pytest.mark.parametrize("name", zwidth.__all__)
def test_a_public_name_is_there(name):
    assert getattr(zwidth, name) is not None
    assert name in dir(zwidth)


def test_the_names_that_type_checkers_see_are_the_names_that_run():
    (guarded,) = [node for node in ast.parse(SOURCE).body if isinstance(node, ast.If)]
    seen = {}
    for line in guarded.body:
        assert isinstance(line, ast.ImportFrom)
        (alias,) = line.names
        assert alias.name == alias.asname
        seen[alias.name] = line.module
    assert {*seen, "__version__"} == set(zwidth.__all__)
    assert all(getattr(import_module(module), name) is getattr(zwidth, name) for name, module in seen.items())


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'stabilty_chart'"):
        zwidth.stabilty_chart  # noqa: B018


def test_importing_costs_nothing_until_a_name_is_used():
    program = "import sys, zwidth; before = set(sys.modules); zwidth.load; print(*before); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    before, after = (set(line.split()) for line in done.stdout.splitlines())
    assert not before & {"numpy", "numba", "pydantic"}
    assert "pydantic" in after
    assert "numba" not in after
