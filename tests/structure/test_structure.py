"""What is counted of a package's structure, on small packages where every count is known."""

from __future__ import annotations

import json
import subprocess

import pytest

from tests import revisions
from tests.structure.__main__ import main, merged_keys
from tests.structure.constants import function_literals, numeric_constants
from tests.structure.crossings import traced
from tests.structure.imports import circles, import_graph, single_importers
from tests.structure.modules import functions, modules_of
from tests.structure.names import (
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
from tests.structure.structure_numbers import LONG, structure


def module(text, path="a.py"):
    return modules_of("house", {path: text})[0]


def modules(folders=None, **files):
    """Modules from texts by their paths without the ending."""
    return modules_of("house", {f"{path}.py": text for path, text in ((folders or {}) | files).items()})


# --- sizes ------------------------------------------------------------------------------------------

SAMPLE_SOURCE = '''"""A file.

Two paragraphs.
"""

# why
x = 1  # a comment beside code

text = """one

two"""


class Wall:
    """One line."""

    def push(self):
        """Two
        lines."""
        # why
        return (
            1
        )
'''


def test_lines_of_code_are_told_from_docstrings_comments_and_blanks():
    # code: x, text of two lines that are not blank, class, def, return and its two lines
    assert lines_of(module(SAMPLE_SOURCE)) == (8, 3 + 1 + 2)


def test_a_text_that_is_no_docstring_is_code():
    assert lines_of(module('x = 1\n"""no docstring"""\n')) == (2, 0)


def test_the_lines_of_a_file_are_those_of_wc():
    assert file_lines([module(SAMPLE_SOURCE), module("\n# one\n")]) == SAMPLE_SOURCE.count("\n") + 2


def test_functions_are_found_wherever_they_stand():
    text = """
if True:
    def one():
        def inner(): ...
class Outer:
    class Inner:
        async def two(self): ...
"""
    found = [(name, is_method) for name, _, is_method in functions(module(text))]
    assert found == [
        ("house.a.one", False),
        ("house.a.one.inner", False),
        ("house.a.Outer.Inner.two", True),
    ]


def test_a_function_is_as_long_as_from_def_to_its_end():
    text = (
        '@first\n@second\ndef f(\n    x,\n):\n    """A.\n\n    B."""\n\n    # why\n    return x\n\ndef g(): ...\n'
    )
    assert function_lengths([module(text)]) == {"house.a.f": 9, "house.a.g": 1}
    assert function_lengths([module(text)], docstrings=False) == {"house.a.f": 6, "house.a.g": 1}


@pytest.mark.parametrize(
    ("signature", "count"), [("", 0), ("a, /, b, c=1, *more, d, **rest", 6), ("*, a", 1), ("self", 1)]
)
def test_all_kinds_of_arguments_count(signature, count):
    assert argument_counts([module(f"def f({signature}): ...")]) == {"house.a.f": count}


def test_what_a_method_is_bound_to_is_no_argument():
    text = """
class Wall:
    def push(self, force): ...
    @classmethod
    def of(cls, a, b): ...
    @staticmethod
    def plain(a): ...
    def outer(self):
        def inner(a): ...
"""
    counts = argument_counts([module(text)])
    names = {name.removeprefix("house.a.Wall."): count for name, count in counts.items()}
    assert names == {"push": 1, "of": 2, "plain": 1, "outer": 0, "outer.inner": 1}


def test_a_percentile_is_one_of_the_values():
    assert [percentile(range(1, 11), share) for share in (0.1, 0.85, 0.9, 0.91, 1.0)] == [1, 9, 9, 10, 10]
    assert percentile([5], 0.0) == 5
    assert percentile([], 0.9) == 0


def test_a_constant_is_a_name_in_capitals_with_a_number():
    text = (
        "FEW: Final = 3\nNEAR = -1e-9\nHALF = 1 / 2\nTWO = (1, 2)\nNAME = 'a'\nx = 5\nYES = True\n"
        "if x:\n    LATE = 7"
    )
    assert numeric_constants([module(text)]) == {
        "house.a.FEW": "3",
        "house.a.NEAR": "-1e-09",
        "house.a.HALF": "1 / 2",
        "house.a.LATE": "7",
    }


def test_numbers_inside_functions_are_those_that_decide():
    text = (
        "x = 5\ndef f(a=7):\n    '9'\n    def g():\n        return 1e-3\n    return 0, 4.0, 0.5, True, a[2:6], -8"
    )
    found = function_literals([module(text)])
    assert sorted(found.values()) == ["0.001", "6", "7", "8"]
    assert "house.a:2:8" in found


def test_lines_of_imports_are_those_they_take():
    text = "import a\nfrom b import (\n    c,\n    d,\n)\ndef f():\n    import e\n    return 'import g'\n"
    assert import_lines([module(text)]) == 6


def test_a_function_without_a_docstring_is_found_in_a_class_too():
    text = "class A:\n    def f(self): ...\n    def g(self):\n        'Say.'\n"
    assert undocumented_functions([module(text)]) == {"house.a.A.f"}


def test_what_a_question_crosses_is_followed_through_other_code(tmp_path, monkeypatch):
    house = tmp_path / "crossed_house"
    texts = {
        "top.py": "from crossed_house.loop.a import f\ndef ask():\n    return sorted([2, 1], key=f)\n",
        "loop/a.py": "from crossed_house.chart.b import g\ndef f(x):\n    return g(x) + g(x) + h()\n"
        "def h():\n    return 0\n",
        "chart/b.py": "def g(x):\n    return x\n",
    }
    for path, text in texts.items():
        (house / path).parent.mkdir(parents=True, exist_ok=True)
        (house / path).write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    from crossed_house.top import ask

    # Each of two numbers: from the top into loop, and from there twice into chart.
    assert traced(ask, house) == {"files": 3, "package changes": 6}


# --- imports ----------------------------------------------------------------------------------------


def test_every_way_of_importing_is_an_edge():
    found = modules(
        {
            "chart/__init__": "from . import region\nfrom .region import trace",
            "chart/region": "import numpy\nimport house.loop as l\nfrom house import chart",
        },
        __init__="",
        loop="import house",
    )
    assert import_graph(found) == {
        "house": set(),
        "house.chart": {"house.chart.region"},
        "house.chart.region": {"house.loop", "house.chart"},
        "house.loop": {"house"},
    }


def test_dots_lead_up_from_a_file_and_from_a_folder():
    found = modules(
        {
            "model/tree": "from ..loop import hold\nfrom . import body",
            "model/body": "",
            "loop/__init__": "from .hold import push\nfrom .. import top",
            "loop/hold": "",
        },
        top="",
    )
    graph = import_graph(found)
    assert graph["house.model.tree"] == {"house.loop.hold", "house.model.body"}
    assert graph["house.loop"] == {"house.loop.hold", "house.top"}


def test_an_import_inside_a_function_closes_a_circle_and_one_for_types_does_not():
    late = "def f():\n    if True:\n        from house.b import g"
    typed = (
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from house.d import D\nelse:\n    import house.e"
    )
    found = modules(a=late, b="from house import a", c=typed, d="import house.c", e="")
    graph = import_graph(found)
    assert circles(graph) == [["house.a", "house.b"]]
    assert graph["house.c"] == {"house.e"}


def test_types_may_be_asked_for_by_the_module_of_types():
    text = "import typing\nif typing.TYPE_CHECKING:\n    import house.b\nif typing.OTHER:\n    import house.c"
    assert import_graph(modules(a=text, b="", c=""))["house.a"] == {"house.c"}


def test_circles_of_more_modules_are_one_group_each():
    ring = {
        "a": "import house.b",
        "b": "import house.c",
        "c": "import house.a",
        "d": "import house.a\nimport house.e",
    }
    found = modules(**ring, e="import house.f", f="import house.e", g="import house.g")
    assert circles(import_graph(found)) == [["house.a", "house.b", "house.c"], ["house.e", "house.f"]]


def test_a_module_that_is_left_out_closes_no_circle():
    found = modules(_verbs="import house.chart", chart="import house._verbs", map="import house.chart")
    assert circles(import_graph(found)) == [["house._verbs", "house.chart"]]
    graph = import_graph(found, ["house._verbs"])
    assert graph == {"house.chart": set(), "house.map": {"house.chart"}}
    assert single_importers(graph) == {"house.chart": "house.map"}


def test_a_single_importer_is_one_module_however_often_it_imports():
    found = modules(
        a="import house.one\nfrom house.one import x\nimport house.two",
        b="import house.two",
        one="",
        two="",
        none="",
    )
    assert single_importers(import_graph(found)) == {"house.one": "house.a"}


# --- names ------------------------------------------------------------------------------------------


def test_a_class_of_one_name_in_two_modules_has_two_meanings():
    found = modules(
        a="class Motion: ...\nclass _Own: ...\nclass Here: ...",
        b="class Motion(tuple): ...\nclass _Own: ...\nfrom house.a import Here",
        c="def f():\n    class Here: ...",
    )
    assert classes_of_several_modules(found) == {"Motion": {"house.a": "class()", "house.b": "class(tuple)"}}


def test_a_constant_that_several_modules_define():
    found = modules(
        a="MODELS = (1, 2)\nNEAR: float = 1e-9\nT = 1\n_OWN = 1\nONCE = 1\nTYPED: int",
        b="if True:\n    MODELS = (1, 2, 3)\nNEAR = 1e-9\nT = 2\n_OWN = 2\nfrom house.a import ONCE\nTYPED = 1",
    )
    several = constants_of_several_modules(found)
    assert several == {
        "MODELS": {"house.a": "(1, 2)", "house.b": "(1, 2, 3)"},
        "NEAR": {"house.a": "1e-09", "house.b": "1e-09"},
    }
    assert set(differing(several)) == {"MODELS"}


def test_a_function_of_two_signatures_has_two_meanings():
    found = modules(
        a="def limit(x): ...\ndef same(x: int = 1) -> int: ...\ndef typed(x: int): ...\ndef _own(x): ...",
        b="def limit(y): ...\ndef same(x: int=1) -> int: return x\ndef typed(x: str): ...\ndef _own(y): ...",
        c="class C:\n    def limit(self): ...",
    )
    assert functions_of_several_signatures(found) == {
        "limit": {"house.a": "(x)", "house.b": "(y)"},
        "typed": {"house.a": "(x: int)", "house.b": "(x: str)"},
    }


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ('__all__ = ["b", "a"]', ["a", "b"]),
        (
            '_HOME = {"m": ("a", "b")}\n_OF = {n: m for m, ns in _HOME.items() for n in ns}\n__all__ = [*_OF]',
            ["a", "b"],
        ),
        ('X: tuple = ("a",)\n__all__ = sorted(X)\n__all__ += ["b"]', ["a", "b"]),
        ("from house.names import NAMES\n__all__ = [*NAMES]", None),
        ("from house.b import c as d\nimport house.e\ndef f(): ...\ng = _h = 1", ["d", "f", "g", "house"]),
        ('if True:\n    __all__ = ["a"]\nelse:\n    pass', ["a"]),
    ],
)
def test_public_names_are_read_without_importing(text, names):
    assert public_names(module(text, "__init__.py")) == names


def test_a_stub_names_what_it_gives_away():
    stub = """from .a import b as b
from .a import c
import d
__version__: str
def f(x: int) -> int: ...
class G: ...
_hidden: int
"""
    assert stub_names(stub) == ["G", "__version__", "b", "f"]
    assert structure(modules(__init__="__all__ = made()"), [], stub).numbers["public names at the top"] == 4


def test_nothing_runs_while_names_are_read(tmp_path):
    file = tmp_path / "written"
    text = f"x = open({str(file)!r}, 'w')\ny = __import__('os').mkdir({str(file)!r})\n__all__ = ['a']"
    assert public_names(module(text, "__init__.py")) == ["a"]
    assert not file.exists()


# --- altogether -------------------------------------------------------------------------------------

LONG_FUNCTION = "def f(a, b):\n" + "    a += b\n" * LONG


def test_all_numbers_of_a_small_package():
    found = structure(
        modules(
            {
                "chart/region": LONG_FUNCTION + "NEAR = 1\nimport house._verbs",
                "show/cli/main": "NEAR = 2\n\n\ndef f():\n    import house.chart.region",
            },
            __init__='"""Top."""\n__all__ = ["f"]',
            _verbs="import house.show.cli.main",
        ),
        ["house._verbs"],
    )
    assert found.numbers == {
        "files": 4,
        "lines": 47,
        "lines of imports": 3,
        "lines of code": 1 + 1 + LONG + 3 + 3,
        "lines of code, (top)": 2,
        "lines of code, chart": LONG + 3,
        "lines of code, show": 3,
        "lines of docstrings": 1,
        "lines of the command line, as wc -l": 4,
        "lines of code of the command line": 3,
        "functions": 2,
        "functions over 40 lines": 1,
        "functions over 40 lines, docstrings not counted": 1,
        "functions over 40 lines, docstrings not counted, without a docstring": 1,
        "arguments of a function, 90% have at most": 2,
        "arguments of a function, at most": 2,
        "numeric constants": 2,
        "numbers inside functions": 0,
        "constants and numbers inside functions, in 1000 lines": 42.55,
        "import circles": 0,
        "modules in import circles": 0,
        "modules in import circles, those through what is left out included": 3,
        "modules with a single importer": 1,
        "public names at the top": 1,
        "class names with two meanings": 0,
        "constants that several modules define": 1,
        "constants with two meanings": 1,
        "function names with two meanings": 1,
    }
    assert found.lists["functions over 40 lines"] == {"house.chart.region.f": "41 lines"}
    assert found.lists["modules with a single importer"] == {"house.chart.region": "by house.show.cli.main"}


def test_a_package_without_functions_or_a_file_of_its_own_has_numbers_too():
    numbers = structure(modules(a="x = 1"), []).numbers
    assert numbers["arguments of a function, at most"] == 0
    assert numbers["public names at the top"] == 0


def test_rows_of_both_stand_in_the_new_order():
    assert merged_keys({"a": 1, "gone": 1, "b": 1}, {"a": 1, "new": 1, "b": 1}) == ["a", "gone", "new", "b"]
    assert merged_keys({"gone": 1, "b": 1}, {"b": 1}) == ["gone", "b"]
    assert merged_keys({"a": 1, "one": 1, "two": 1}, {"a": 1}) == ["a", "one", "two"]


@pytest.fixture
def repository(tmp_path, monkeypatch):
    """A commit in which two modules import each other and a folder that is gone in the working tree."""
    source = tmp_path / "src" / "house"
    (source / "old").mkdir(parents=True)
    (source / "__init__.py").write_text("__all__ = ['f', 'g']\n")
    (source / "old" / "a.py").write_text("from house.old import b\n")
    (source / "old" / "b.py").write_text("import house.old.a\n")
    who = ["-c", "user.name=a", "-c", "user.email=a@example.org"]
    for words in (["init", "--quiet"], ["add", "--all"], [*who, "commit", "--quiet", "-m", "one"]):
        subprocess.run(["git", *words], cwd=tmp_path, check=True)
    (source / "old" / "a.py").unlink()
    (source / "old" / "b.py").rename(source / "c.py")
    (source / "c.py").write_text("def f(x, y): ...\n")
    monkeypatch.setattr(revisions, "ROOT", tmp_path)
    return tmp_path


def test_a_commit_stands_beside_the_working_tree(repository, capsys):
    main(["HEAD", "--folder", "src/house", "--list"])
    lines = capsys.readouterr().out.splitlines()
    rows = [line.split() for line in lines]
    assert rows[0] == ["what", "HEAD", "here"]
    assert ["files", "3", "2"] in rows
    assert ["lines", "of", "code,", "old", "2", "-"] in rows
    assert ["import", "circles", "1", "0"] in rows
    assert ["arguments", "of", "a", "function,", "at", "most", "0", "2", "f"] in rows
    listed = lines[lines.index("modules in import circles", len(rows) // 2) :]
    assert listed[1:3] == ["- house.old.a: circle 1 of 2", "- house.old.b: circle 1 of 2"]
    assert "  f: public" in lines


def test_the_same_as_an_object(repository, capsys):
    main(["HEAD", ".", "--folder", "src/house", "--json"])
    document = json.loads(capsys.readouterr().out)
    assert document["before"]["numbers"]["import circles"] == 1
    assert document["after"]["numbers"]["import circles"] == 0
    assert document["before"]["lists"]["public names at the top"] == {"f": "public", "g": "public"}


def test_a_folder_that_a_commit_lacks_ends_it(repository):
    with pytest.raises(SystemExit, match="src/zwidth"):
        main(["HEAD"])
