"""The page's modules under TypeScript's checker, and the page under axe; both come by npm."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from tests.app.page_driver import Page

NODE = Path(__file__).parent / "node"
PAGE = Path(__file__).parents[2] / "src/zwidth/show/app/page"
installed = pytest.mark.skipif(
    shutil.which("node") is None or not (NODE / "node_modules").is_dir(),
    reason="TypeScript and axe are not here; `npm ci` in tests/app/node installs them",
)


@installed
def test_the_modules_have_the_types_that_they_say(tmp_path) -> None:
    compiler = NODE / "node_modules/typescript/bin/tsc"
    modules = sorted(str(path) for path in PAGE.glob("*.js"))
    ended = subprocess.run(
        ["node", compiler, "--project", str(NODE / "tsconfig.json")], capture_output=True, text=True, timeout=120
    )
    assert ended.returncode == 0, ended.stdout
    assert len(modules) > 10


@installed
@pytest.mark.parametrize(("width", "scheme"), [(1400, "light"), (1400, "dark"), (390, "light")])
def test_axe_finds_nothing_serious(browser, workbench, width, scheme) -> None:
    source = (NODE / "node_modules/axe-core/axe.min.js").read_text(encoding="utf-8")
    with Page(browser, workbench, width, 900, color_scheme=scheme) as page:
        page.change(wall={"stiffness": 4000.0, "damping": 10.0})
        page.page.check("[data-layer=models]")
        page.page.click("#pin")
        page.page.click("#tour")
        page.wait("zwidth.tour.at === 0")
        page.settle()
        page.page.evaluate(source)
        found = page.page.evaluate("async () => (await axe.run()).violations")
        serious = [
            (one["id"], one["nodes"][0]["html"][:120], one["nodes"][0].get("failureSummary", "")[:200])
            for one in found
            if one["impact"] in ("serious", "critical")
        ]
        assert serious == []
