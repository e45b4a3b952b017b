"""The drawn device vibrates as the touched one does."""

from __future__ import annotations

import re

import numpy as np
import pytest

import zwidth
from tests.app.page_driver import Page

WALL = {"stiffness": 8050.0, "damping": 10.0}  # not stable in the page's hand: it grows by 0.4 % in each period
# Handle's output in every period, and amplitudes after it; run as the page runs it, with a push that grows.
RUN = """async ([periods, push]) => {
  const { TouchMachine } = await import("./touch_machine.js");
  const machine = new TouchMachine(await zwidth.contact.touch.module);
  machine.load(zwidth.contact.touch.blocks);
  const wall = { law: 1, stiffness: 8050, damping: 10, position: 0 };
  const outputs = [...machine.run(periods, wall, push)];
  return { outputs, trail: machine.trail };
}"""
# Of a made-up history: modes that swing about a slow drift.
CLIP = """async ([shapes, history, step, frequency]) => {
  const { Vibration } = await import("./vibration.js");
  const vibration = new Vibration();
  vibration.modes = history[0].length;
  vibration.shapes = { handle: Float64Array.from(shapes.flat()) };
  vibration.frequency = frequency;
  vibration.add(Float64Array.from(history.flat()), step);
  const { rows, ...clip } = vibration.newClip(0);
  return { rows: [...rows], ...clip };
}"""


@pytest.fixture
def page(browser, workbench):
    with Page(browser, workbench) as opened:
        yield opened


def touch(page: Page, **state: object) -> None:
    """Take the device into the hand at a wall, and lean on it."""
    page.page.evaluate("(state) => zwidth.store.set(state)", {"wall": WALL, **state})
    page.settle()
    page.page.click("button:has-text('Touch')")
    page.wait("zwidth.contact.touch.running && zwidth.contact.touch.machine")
    page.settle()
    page.page.mouse.move(*page.at("motion", 0.6, 0.1))


def shape_of_handle(page: Page) -> np.ndarray:
    """Motion of the drawn handle per amplitude of each mode, (3, n)."""
    return np.array(page.value("[...zwidth.deviceView.vibration.shapes.handle]")).reshape(3, -1)


def test_amplitudes_of_the_page_move_the_drawn_handle_as_the_kernel_moves_it(page) -> None:
    touch(page)
    direction = np.array(page.value("[...zwidth.deviceView.points('direction')]"))
    along = direction @ shape_of_handle(page)
    found = page.page.evaluate(RUN, [300, 3.0])
    outputs, trail = np.array(found["outputs"]).reshape(-1, 7), np.array(found["trail"]).reshape(-1, len(along))
    handle = outputs[1:, 4]  # before the period after
    assert trail[:-1] @ along == pytest.approx(handle, abs=1e-9 * np.abs(handle).max())


# Of the clip that is played: where the handle is, row by row, and where it is drawn now, both from its place.
PLAYED = """(() => {
  const view = zwidth.deviceView;
  const { clip, modes, step } = view.vibration;
  const points = view.points("handle");
  const row = (k) => [...view.vibration.displacements("handle", clip.rows.subarray(modes * k, modes * (k + 1)))];
  const rows = Array.from({ length: clip.count }, (_, k) => row(k));
  const now = [...view.drawnPoints("handle")].map((value, k) => value - points[k]);
  const { gain } = view.moment;
  return { now, rows, largest: clip.largest, gain, step, scale: view.scale, caption: view.caption() };
})()"""


def vibrate(page: Page) -> None:
    """Touch until nothing is left but what grows, and wait for a clip of that."""
    touch(page)
    page.wait("zwidth.contact.view.filled > 1200")
    page.page.evaluate("() => { window.since = performance.now(); }")
    page.wait("zwidth.deviceView.vibration.clip.began > since && zwidth.deviceView.vibration.clip.size > 2e-6")


def test_the_drawn_handle_vibrates_along_the_rendered_direction(page) -> None:
    vibrate(page)
    direction = np.array(page.value("[...zwidth.deviceView.points('direction')]"))
    predicted = page.value("zwidth.view.head.chart.wall.frequency")
    found = page.value(PLAYED)
    rows = np.array(found["rows"])
    along = rows @ direction
    across = np.linalg.norm(rows - np.outer(along, direction), axis=1)
    assert np.abs(along).max() > across.max(), "mostly along it; the two drives are unlike"
    crossings = np.flatnonzero(np.diff(np.sign(along)))
    drawn = (len(crossings) - 1) / (2.0 * found["step"] * (crossings[-1] - crossings[0]))
    assert drawn == pytest.approx(predicted, rel=0.1)
    assert found["caption"].endswith(f"enlarged {found['gain']} times")
    seen = []
    for _ in range(15):
        seen.append(page.value(PLAYED)["now"] @ direction * found["scale"])
        page.page.wait_for_timeout(23)
    assert min(seen) < -1.0, "css px"
    assert max(seen) > 1.0
    page.page.click("button:has-text('Touch')")
    page.settle()
    assert page.value("zwidth.deviceView.caption()") == ""
    assert page.value("zwidth.deviceView.drawnPoints('handle')") == page.value(
        "zwidth.deviceView.points('handle')"
    )


def test_who_wants_no_motion_sees_the_largest_displacement(browser, workbench) -> None:
    with Page(browser, workbench, reduced_motion="reduce") as page:
        vibrate(page)
        found = page.value(PLAYED)
        assert found["caption"].startswith("largest displacement")
        largest = found["gain"] * np.array(found["rows"])[found["largest"]]
        assert found["now"] == pytest.approx(largest, abs=1e-9)
        assert 5.0 < found["scale"] * np.linalg.norm(largest) <= 30.0, "css px"


def test_slow_motions_are_taken_away_and_vibrations_stay(page) -> None:
    """Of a swing about a drift the clip has the swing, at frequencies from slow to near the sampling's half."""
    step = 0.001
    time = step * np.arange(1600)
    for frequency, slower in ((6.0, 20), (50.0, 20), (200.0, 20), (400.0, 50)):
        swing = 1e-5 * np.sin(2.0 * np.pi * frequency * time)
        history = np.column_stack([0.01 * time + swing, 0.02 - 0.03 * time])
        shapes = np.array([[0.0, 1.0], [2.0, 0.0], [0.0, 0.0]])
        found = page.page.evaluate(CLIP, [shapes.tolist(), history.tolist(), step, frequency])
        rows = np.array(found["rows"]).reshape(-1, 2)
        assert found["slower"] == slower
        assert len(rows) == found["count"] == max(round(4000.0 / frequency), 1000 // slower)
        assert np.abs(rows[:, 1]).max() < 1e-14, "a drift alone"
        assert np.ptp(rows[:, 0]) == pytest.approx(np.ptp(swing), rel=0.05), frequency
        # 2 m per unit of the swing, and of a long clip some rows are looked at
        assert found["size"] == pytest.approx(2.0 * np.abs(rows[:, 0]).max(), rel=2e-3)


def test_the_picture_is_enlarged_by_round_numbers(page) -> None:
    sizes = [1e-9, 0.0031, 0.08, 1.6, 14.0, 29.0, 31.0, 290.0, 31000.0]  # css px as they are
    gains, captions = page.page.evaluate(
        """async (sizes) => {
          const { captionOf, gainFor } = await import("./vibration.js");
          return [sizes.map(gainFor), [captionOf(0.05, 20), captionOf(1, 0)]];
        }""",
        sizes,
    )
    assert gains == [10000, 5000, 200, 10, 2, 1, 0.5, 0.1, 0.0005]
    assert [re.findall("1:20|20 times|largest", text) for text in captions] == [["1:20", "20 times"], ["largest"]]


def test_a_model_without_a_picture_says_so(page) -> None:
    touch(page, model="rigid")
    page.wait("zwidth.deviceView.scene.still")
    assert page.value("zwidth.deviceView.caption()").startswith("its vibration")
    assert not page.value("Boolean(zwidth.deviceView.moment)")


def test_vibrations_are_drawn_while_sound_is_on(page) -> None:
    touch(page)
    page.page.click("button:has-text('Sound')")
    page.wait("zwidth.contact.touch.sound")
    page.page.evaluate("() => { window.since = performance.now(); zwidth.deviceView.vibration.clear(); }")
    page.wait("zwidth.deviceView.vibration.clip?.began > since && zwidth.deviceView.vibration.clip.size > 1e-9")


def test_a_device_that_was_put_back_has_a_new_history(page) -> None:
    touch(page)
    page.wait("zwidth.deviceView.vibration.history.length > 100")
    found = page.page.evaluate(
        """async () => {
          const { TouchMachine } = await import("./touch_machine.js");
          const { Vibration } = await import("./vibration.js");
          const machine = new TouchMachine(await zwidth.contact.touch.module);
          machine.load(zwidth.contact.touch.blocks);
          const vibration = new Vibration();
          vibration.modes = zwidth.deviceView.vibration.modes;
          const rows = () => vibration.history.length / vibration.modes;
          const wall = { law: 1, stiffness: 1e5, damping: 0, position: 0 };
          const found = [];
          for (const periods of [20, 2000, 30]) {
            machine.run(periods, wall, 1);
            vibration.add(Float64Array.from(machine.trail), 0.00125);
            found.push(rows());
          }
          return [...found, vibration.history.every(Number.isFinite)];
        }"""
    )
    assert found == [20, 0, 30, True]


def let_go(page: Page, **state: object) -> None:
    """Let the device go at a wall and wait for the picture of its vibration."""
    page.page.evaluate("(state) => zwidth.store.set(state)", state)
    page.settle()
    page.page.click("button:has-text('Let go')")
    page.wait("zwidth.deviceView.replayed && zwidth.deviceView.moment")


def assert_swings(page: Page, drawn: np.ndarray, moved: np.ndarray) -> None:
    """Of a motion from its start on, what is left without the slow mean is drawn."""
    half = page.value("zwidth.deviceView.vibration.lengths.half")
    moved = moved[: len(drawn) + 2 * half + 1]
    sums = np.append(0.0, np.cumsum((moved[1:] + moved[:-1]) / 2.0))
    mean = (sums[2 * half :] - sums[: -2 * half]) / (2 * half)
    swing = (moved[half : len(moved) - half] - mean)[
        1:
    ]  # an amplitude stands after its period: at the next sample
    assert drawn == pytest.approx(swing, abs=0.02 * np.abs(swing).max())


def test_a_device_that_is_let_go_vibrates_in_slow_motion_as_it_is_simulated(page) -> None:
    let_go(page, wall=WALL)
    made = zwidth.load("five-bar").at().simulate(stiffness=WALL["stiffness"], damping=WALL["damping"])
    direction = np.array(page.value("[...zwidth.deviceView.points('direction')]"))
    along = np.array(page.value(PLAYED)["rows"]) @ direction
    assert_swings(page, along, made.handle)
    began = page.value("zwidth.deviceView.vibration.clip.began")
    page.wait(f"zwidth.deviceView.vibration.clip.began > {began}")  # again and again
    page.change(wall={"stiffness": 3000, "damping": 10})
    page.settle()
    assert not page.value("zwidth.deviceView.moment"), "until another view comes"


def test_masses_in_a_row_vibrate(page) -> None:
    let_go(page, device="published-two-mass", settings={}, wall={"stiffness": 8000, "damping": 10})
    found = page.value("Object.keys(zwidth.deviceView.vibration.shapes)")
    assert found == ["masses"]
    clip = page.page.evaluate(
        """() => {
          const { vibration } = zwidth.deviceView;
          const { clip, modes } = vibration;
          const row = (k) => clip.rows.subarray(modes * k, modes * (k + 1));
          return Array.from({ length: clip.count }, (_, k) => [...vibration.displacements("masses", row(k))]);
        }"""
    )
    rows = np.array(clip).reshape(len(clip), -1, 3)
    assert np.all(rows[:, :, 1:] == 0.0)
    made = zwidth.load("published-two-mass").at().simulate(stiffness=8000.0, damping=10.0)
    assert_swings(page, rows[:, 0, 0], made.handle)
    assert_swings(page, rows[:, 1, 0], made.position)
    assert page.value("zwidth.deviceView.caption()").startswith("slow motion 1:20")


def test_a_contact_whose_vibration_is_not_drawn_says_so(page) -> None:
    page.page.evaluate("(state) => zwidth.store.set(state)", {"wall": WALL, "model": "rigid"})
    page.settle()
    page.page.click("button:has-text('Let go')")
    page.wait("zwidth.contact.view.motion")
    assert "; its vibration" in page.page.locator("#contact-text").text_content()
