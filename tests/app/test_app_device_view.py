"""The drawn device: its texts, base, wall and links, in the order in which one covers another."""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np
import pytest

from tests.app.page_driver import Page

BAND = 11  # css px, width of a drawn link
# Every path that a drawing strokes or fills, with its points and the width of its line.
PATHS = """(() => {
  const drawing = CanvasRenderingContext2D.prototype;
  const [paths, kept] = [[], {}];
  let points = [];
  const seen = {
    beginPath: () => (points = []),
    moveTo: (x, y) => points.push([x, y]),
    lineTo: (x, y) => points.push([x, y]),
    stroke: (context) => paths.push({ how: "stroke", width: context.lineWidth, points: [...points] }),
    fill: () => paths.push({ how: "fill", width: 0, points: [...points] }),
  };
  for (const name of Object.keys(seen)) {
    kept[name] = drawing[name];
    drawing[name] = function (...numbers) {
      seen[name](...(numbers.length ? numbers : [this]));
      return kept[name].apply(this, numbers);
    };
  }
  zwidth.deviceView.draw();
  Object.assign(drawing, kept);
  return paths;
})()"""
TEXTS = "zwidth.deviceView.labels.written"
SIZE = "[zwidth.deviceView.canvas.clientWidth, zwidth.deviceView.canvas.clientHeight]"


# Texts for one place in a corner of a canvas, each given as layouts.
CORNER = """async (texts) => {
  const { Labels } = await import("./labels.js");
  const labels = new Labels();
  labels.begin(document.createElement("canvas").getContext("2d"), 300, 150);
  for (const layouts of texts) labels.writeBeside(layouts.join(), layouts, { x: 290, y: 6 }, 5, {}, []);
  return labels.written;
}"""


@pytest.fixture(scope="module")
def page(browser, workbench):
    """A planar device."""
    with Page(browser, workbench) as opened:
        yield opened


@pytest.fixture(scope="module")
def spatial(browser, workbench):
    with Page(browser, workbench) as opened:
        opened.page.select_option("#device-choice", "stamper-delta")
        opened.wait("zwidth.device?.label === 'stamper-delta' && !zwidth.deviceView.scene.planar")
        opened.settle()
        yield opened


def assert_clear(texts: list[dict], size: list[float]) -> list[str]:
    """No text is drawn over another one or cut by the canvas; the texts."""
    width, height = size
    for one, other in combinations(texts, 2):
        across = min(one["right"], other["right"]) - max(one["left"], other["left"])
        up = min(one["bottom"], other["bottom"]) - max(one["top"], other["top"])
        assert across <= 0.0 or up <= 0.0, (one["text"], other["text"])
    for one in texts:
        assert 0.0 <= one["left"] <= one["right"] <= width, one["text"]
        assert 0.0 <= one["top"] <= one["bottom"] <= height, one["text"]
    return [one["text"] for one in texts]


def points(page: Page, name: str) -> np.ndarray:
    return np.array(page.value(f"[...zwidth.deviceView.points('{name}')]")).reshape(-1, 3)


def places(page: Page, points: np.ndarray) -> np.ndarray:
    """Pixels of points, (k, 2)."""
    placed = page.page.evaluate("(rows) => rows.map((p) => zwidth.deviceView.place(p))", points.tolist())
    return np.array([[each["x"], each["y"]] for each in placed])


def test_drives_in_one_place_have_one_label(page) -> None:
    texts = assert_clear(page.value(TEXTS), page.value(SIZE))
    assert "motor-right, motor-left" in texts
    assert "rendered direction" in texts


def test_texts_keep_clear_on_a_phone_with_a_map(browser, workbench) -> None:
    with Page(browser, workbench, 390, 844) as phone:
        phone.page.select_option("#measure", "stiffness_max")
        phone.wait("zwidth.deviceView.map && !zwidth.waits")
        texts = assert_clear(phone.value(TEXTS), phone.value(SIZE))
        assert {"stiffness max", "rendered direction", "x → [mm]"} < set(texts)
        corners = phone.value(
            "[0, -1].map((n) => [zwidth.deviceView.map.x.at(n), zwidth.deviceView.map.y.at(n), 0])"
        )
        assert (places(phone, np.array(corners)) > 0.0).all(), "all of the map is seen"


def test_texts_for_one_place_in_a_corner_keep_clear(page) -> None:
    wide = "a text that would be cut, as it is wider than the picture"
    for texts in ([[["first text"]], [["second text"]]], [[[wide], ["the", "same"]]]):
        written = assert_clear(page.page.evaluate(CORNER, texts), [300.0, 150.0])
        assert written == [line for layouts in texts for line in layouts[-1]]


def test_each_drive_is_named_beside_its_joint(spatial) -> None:
    for turned in (0.6, 1.6, 2.6):
        spatial.page.evaluate(
            "(turned) => { zwidth.deviceView.turned = turned; zwidth.deviceView.draw(); }", turned
        )
        assert_clear(spatial.value(TEXTS), spatial.value(SIZE))
        boxes = {one["text"]: one for one in spatial.value(TEXTS)}
        driven = places(spatial, points(spatial, "driven"))
        for name, (x, y) in zip(spatial.value("zwidth.deviceView.scene.drives"), driven, strict=True):
            box = boxes[name]
            away = [max(box["left"] - x, x - box["right"], 0.0), max(box["top"] - y, y - box["bottom"], 0.0)]
            assert np.hypot(*away) < 40.0, (name, turned)


def test_links_have_the_names_of_the_figure(page, spatial) -> None:
    assert page.page.locator("#links li").all_inner_texts() == [
        "upper-right",
        "distal-right",
        "upper-left",
        "distal-left",
    ]
    assert spatial.page.locator("#links li").all_inner_texts() == [
        "platform",
        *(f"{name} (3)" for name in ("arm", "near-bar", "rod-left", "rod-right", "far-bar")),
    ]


def test_the_ground_is_drawn_below_the_base(page, spatial) -> None:
    for each, count in ((page, 1), (spatial, 3)):
        base = np.unique(places(each, points(each, "base")).round(6), axis=0)
        assert len(base) == count
        lines = [
            path["points"] for path in each.value(PATHS) if path["how"] == "stroke" and len(path["points"]) == 5
        ]
        ends = np.array([points[:2] for points in lines])
        for x, y in base:
            assert (np.abs(ends - [[x - 13.0, y + 13.0], [x + 13.0, y + 13.0]]).max(axis=(1, 2)) < 1e-5).any()


def test_keys_turn_a_spatial_device_and_no_planar_one(page, spatial) -> None:
    view = "[zwidth.deviceView.turned, zwidth.deviceView.tilted]"
    for each, step in ((page, 0.0), (spatial, np.radians(5.0))):
        each.page.focus("#scene")
        before = np.array(each.value(view))
        for key, change in ((",", [step, 0.0]), (".", [-step, 0.0]), ("<", [0.0, -step]), (">", [0.0, step])):
            each.page.keyboard.press(key)
            after = np.array(each.value(view))
            assert after - before == pytest.approx(change), key
            before = after


def test_farther_links_are_drawn_first_and_the_wall_between(spatial) -> None:
    strokes, ends = points(spatial, "strokes"), spatial.value("[...zwidth.deviceView.points('strokes_ends')]")
    handle, direction = points(spatial, "handle")[0], points(spatial, "direction")[0]
    pairs = [(i, i + 1) for start, end in pairwise([0, *ends]) for i in range(start, end - 1, 2)]
    for turned, tilted in ((0.6, 0.4), (2.0, -0.7)):
        spatial.page.evaluate(
            "([turned, tilted]) => Object.assign(zwidth.deviceView, { turned, tilted })", [turned, tilted]
        )
        right = np.array([np.cos(turned), np.sin(turned), 0.0])
        up = np.array([-np.sin(turned) * np.sin(tilted), np.cos(turned) * np.sin(tilted), np.cos(tilted)])
        eye = np.cross(right, up)
        assert eye[2] == pytest.approx(np.sin(tilted)), "from above where it is tilted up"
        middle = np.array([(strokes[a] + strokes[b]) / 2.0 for a, b in pairs])
        near = (middle - handle) @ direction * np.sign(direction @ eye) >= -1e-6
        order = sorted(range(len(pairs)), key=lambda n: (near[n], middle[n] @ eye))
        paths = spatial.value(PATHS)
        bands = [
            (n, path["points"])
            for n, path in enumerate(paths)
            if path["how"] == "stroke" and path["width"] == BAND
        ]
        drawn = np.array([points for _, points in bands[::2]])  # each is covered, and tinted
        at = places(spatial, strokes)
        assert drawn == pytest.approx(np.array([[at[a], at[b]] for a, b in (pairs[n] for n in order)]), abs=1e-6)
        wall = next(n for n, path in enumerate(paths) if path["how"] == "fill" and len(path["points"]) == 4)
        behind = sum(n < wall for n, _ in bands) // 2
        assert behind == np.count_nonzero(~near)
        assert (behind > 0) == (tilted > 0.0), "the arms hang below the platform"
        assert behind < len(pairs)


def test_a_wall_across_the_line_of_sight_is_seen_as_a_square(spatial) -> None:
    spatial.page.evaluate("() => Object.assign(zwidth.deviceView, { tilted: Math.PI / 2 })")
    square = next(
        path["points"] for path in spatial.value(PATHS) if path["how"] == "fill" and len(path["points"]) == 4
    )
    sides = np.diff([*square, square[0]], axis=0)
    assert np.linalg.norm(sides, axis=1) == pytest.approx(100.0)
    assert sides[0] @ sides[1] == pytest.approx(0.0, abs=1e-6)
