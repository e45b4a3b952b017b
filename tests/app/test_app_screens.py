"""The page against how it looked: thumbnails, for gross changes only.

Letters and lines may differ from one machine to the next; a view that is missing, a colour scheme that is not
followed or a layout that falls apart may not. `ZWIDTH_WRITE_SCREENS=1` writes the thumbnails anew: look at them
then.
"""

from __future__ import annotations

import io
import os
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.app.page_driver import Page

SCREENS = Path(__file__).parent / "screens"
WIDTH = 70  # pixels of a thumbnail
DIFFERS = 14.0  # mean difference of the pixels' grey, of 255, that is a gross change
VIEWS = [("laptop", 1400, 900, "light"), ("laptop-dark", 1400, 900, "dark"), ("phone", 390, 844, "light")]


def thumbnail(page: Page) -> np.ndarray:
    """What the page shows, small and grey."""
    with Image.open(io.BytesIO(page.page.screenshot())) as picture:
        size = (WIDTH, round(WIDTH * picture.height / picture.width))
        return np.asarray(picture.convert("L").resize(size, Image.Resampling.BOX), dtype=float)


@pytest.mark.parametrize(("name", "width", "height", "scheme"), VIEWS)
def test_the_page_looks_as_it_did(browser, workbench, name, width, height, scheme) -> None:
    with Page(browser, workbench, width, height, color_scheme=scheme) as page:
        page.change(wall={"stiffness": 4000.0, "damping": 10.0})
        page.settle()
        page.page.check("[data-layer=models]")
        page.settle()
        seen = thumbnail(page)
    kept = SCREENS / f"{name}.png"
    if os.environ.get("ZWIDTH_WRITE_SCREENS"):
        SCREENS.mkdir(exist_ok=True)
        Image.fromarray(seen.astype(np.uint8)).save(kept)
    with Image.open(kept) as picture:
        before = np.asarray(picture, dtype=float)
    assert seen.shape == before.shape
    assert np.abs(seen - before).mean() < DIFFERS


def test_a_dark_page_is_a_gross_change_of_a_light_one() -> None:
    with Image.open(SCREENS / "laptop.png") as light, Image.open(SCREENS / "laptop-dark.png") as dark:
        assert np.abs(np.asarray(light, dtype=float) - np.asarray(dark, dtype=float)).mean() > 5.0 * DIFFERS
