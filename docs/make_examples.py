"""Write docs/examples.md: the first examples of the gallery as they stand, with what they print and draw.

`make docs` runs this. Nothing of an example is typed in here: its text is the docstring of its file, and what it
prints and draws is that of a run.
"""

from __future__ import annotations

import sys
from contextlib import chdir, redirect_stdout
from dataclasses import dataclass
from functools import cache
from io import StringIO
from pathlib import Path
from runpy import run_path
from tempfile import TemporaryDirectory
from typing import Any

import matplotlib as mpl
from matplotlib import pyplot
from matplotlib.figure import Figure

sys.path.insert(0, str(Path(__file__).parents[1]))

from zwidth.show import save

HERE = Path(__file__).parent
PAGE = HERE / "examples.md"
IMAGES = HERE / "images"
FILES = tuple(sorted((HERE.parent / "gallery").glob("first_*.py")))

INTRODUCTION = """# First examples

Ten scripts of about twenty lines, each about one thing. They lie in the [gallery](../gallery) and run as they
stand, `python gallery/first_01_my_first_device.py`, in a few seconds each; the very first run after the
installation compiles, and takes longer. A script prints what stands below it here, and writes its figure into the
folder that it is run in. `make docs` writes this page from the scripts; tests compare it with what they print, and
their numbers with what other ways of computing them give.
"""


@dataclass(frozen=True)
class Example:
    """A script of the gallery, run.

    path     of the script
    printed  what it printed
    written  names of the files that it wrote
    names    what stands in its module variables
    """

    path: Path
    printed: str
    written: tuple[str, ...]
    names: dict[str, Any]

    @property
    def number(self) -> int:
        """Its place among the others, from 1 on."""
        return int(self.path.stem.split("_")[1])

    @property
    def title(self) -> str:
        """The first words of its docstring, up to the colon."""
        return str(self.names["__doc__"]).partition(":")[0]

    @property
    def image(self) -> str | None:
        """Name of its picture; None where it draws none."""
        return f"{self.path.stem.replace('_', '-')}.svg" if "figure" in self.names else None


@cache
def run(path: Path) -> Example:
    """Run a script as `python` does, in a folder of its own."""
    printed = StringIO()
    with TemporaryDirectory() as folder, chdir(folder), redirect_stdout(printed), mpl.rc_context():
        names = run_path(str(path), run_name="__main__")
        written = tuple(sorted(file.name for file in Path().iterdir()))
    pyplot.close("all")
    lines = [line.rstrip() for line in printed.getvalue().splitlines()]
    return Example(path, "\n".join(lines), written, names)


def page() -> str:
    """The page, from a run of every script."""
    examples = [run(path) for path in FILES]
    contents = [f"{one.number}. [{one.title}](#{_anchor(one)})" for one in examples]
    return "\n".join([INTRODUCTION, *contents, "", *map(section, examples)])


def section(example: Example) -> str:
    """An example as the page shows it: its docstring as text, its code, what it prints, its picture."""
    first, _, rest = str(example.names["__doc__"]).strip().partition("\n\n")
    about = first.partition(":")[2].strip()
    code = example.path.read_text(encoding="utf-8").split('"""\n', 1)[1]
    parts = [
        f"## {example.number}. {example.title}",
        f"{about[0].upper()}{about[1:]}\n{rest}",
        f"```python\n{code.strip()}\n```",
        f"prints\n\n```\n{example.printed}\n```",
    ]
    if example.image is not None:
        said = str(example.names["figure"].__doc__)
        parts.append(f"![{said.rstrip('.')}](images/{example.image})\n\n*{said}*")
    return "\n\n".join(parts) + "\n"


def picture(example: Example) -> Figure:
    """The figure of an example that draws one, as a script by itself draws it: into no axes of another's."""
    pyplot.close("all")
    figure: Figure = example.names["figure"]().figure
    return figure


def _anchor(example: Example) -> str:
    return f"{example.number}-{example.title.lower().replace(' ', '-')}"


def main() -> None:
    PAGE.write_text(page(), encoding="utf-8")
    print(PAGE)
    for example in map(run, FILES):
        if example.image is not None:
            print(save(picture(example), IMAGES / example.image))
    pyplot.close("all")


if __name__ == "__main__":
    main()
