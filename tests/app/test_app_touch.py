"""What is touched and heard in the page agrees with the simulation in Python."""

from __future__ import annotations

import numpy as np
import pytest

import zwidth
from tests.app.page_driver import Page
from zwidth.contact import simulate
from zwidth.contact import wall as wall_law
from zwidth.model import Operator

MOUSE = Operator(0.05, 300.0, 4.0)
# Let go 1 mm inside a wall, the periods of one call at a time, by the page's own machine.
RUN = """async ([stiffness, damping, periods, push]) => {
  const { TouchMachine, OUTPUTS } = await import("./touch_machine.js");
  const machine = new TouchMachine(await zwidth.contact.touch.module);
  machine.load(zwidth.contact.touch.blocks);
  const wall = { law: 1, stiffness, damping, position: 0 };
  machine.push = push;
  const found = [];
  for (let done = 0; done < periods; done += 100) found.push(...machine.run(100, wall, push));
  return found;
}"""
HEAR = """async ([stiffness, damping, seconds, push]) => {
  const { Touch } = await import("./touch.js");
  const touch = new Touch(() => {});
  touch.load(zwidth.contact.touch.blocks);
  touch.wall = { law: 1, stiffness, damping, position: 0 };
  const context = new OfflineAudioContext(1, 48000 * seconds, 48000);
  touch.setPitch(zwidth.contact.touch.factor);
  touch.target = 0;
  await context.audioWorklet.addModule("touch_worklet.js");
  const node = new AudioWorkletNode(context, "touch", {
    numberOfInputs: 0,
    outputChannelCount: [1],
    processorOptions: { module: await touch.module, blocks: touch.blocks, wall: touch.wall, push,
      factor: touch.factor },
  });
  node.connect(context.destination);
  const buffer = await context.startRendering();
  return [...buffer.getChannelData(0)];
}"""


@pytest.fixture
def page(browser, workbench):
    with Page(browser, workbench) as opened:
        yield opened


def touch(page: Page, stiffness: float, damping: float) -> None:
    """Choose a wall and take the device into the hand."""
    page.change(wall={"stiffness": stiffness, "damping": damping})
    page.settle()
    page.page.click("button:has-text('Touch')")
    page.wait("zwidth.contact.touch.running && zwidth.contact.touch.machine")
    page.settle()


def test_the_chart_is_the_one_held_by_the_hand_that_touches(page) -> None:
    free = page.stiffness_max
    touch(page, 4000.0, 10.0)
    held = zwidth.load("five-bar").at(operator=MOUSE).chart()
    assert page.stiffness_max == pytest.approx(held.stiffness_max, rel=1e-12)
    assert "no force" in page.page.locator("#contact-text").text_content()
    page.page.click("button:has-text('Touch')")
    page.settle()
    assert page.stiffness_max == pytest.approx(free, rel=1e-12)


@pytest.mark.parametrize(("stiffness", "damping", "stable"), [(4000.0, 10.0, True), (9000.0, 10.0, False)])
def test_what_is_touched_is_what_python_simulates(page, stiffness, damping, stable) -> None:
    touch(page, stiffness, damping)
    periods, push = 400, 3.0
    found = np.array(page.page.evaluate(RUN, [stiffness, damping, periods, push])).reshape(-1, 7)
    loop = zwidth.load("five-bar").at(operator=MOUSE).loop
    made = simulate(
        loop, wall_law, wall_law.values(stiffness=stiffness, damping=damping), duration=0.5, hand=hand(push)
    )
    count = min(len(found), len(made.reading))
    assert count == 401 - 1
    assert np.array_equal(found[:count, 0], made.reading[:count]), "to the bit"
    assert np.array_equal(found[:count, 3], made.force[:count]), "to the bit"
    verdict = page.value("zwidth.view.head.chart.wall.verdict")
    assert verdict == ("stable" if stable else "unstable")
    late = np.abs(np.diff(found[200:, 0])).max()
    assert bool(late < np.abs(np.diff(found[:200, 0])).max()) is stable


def hand(push: float):
    """A hand whose push is constant."""
    from zwidth.contact import Hand

    return Hand(push=push)


def test_an_unstable_wall_is_heard_at_the_predicted_frequency(page) -> None:
    touch(page, 8600.0, 10.0)
    predicted = page.value("zwidth.view.head.chart.wall.frequency")
    samples = np.array(page.page.evaluate(HEAR, [8600.0, 10.0, 1.0, 2.0]))
    assert np.abs(samples).max() > 0.01, "silent"
    spectrum = np.abs(np.fft.rfft(samples * np.hanning(len(samples))))
    heard = float(np.argmax(spectrum[20:]) + 20)  # Hz, one second
    assert heard == pytest.approx(predicted, rel=0.02)


def test_a_vibration_too_low_to_be_heard_is_shifted_by_the_stated_factor(page) -> None:
    touch(page, 4000.0, 1.5)
    predicted = page.value("zwidth.view.head.chart.wall.frequency")
    factor = page.value("zwidth.contact.touch.factor")
    assert predicted < 60.0
    assert factor in (2.0, 4.0, 8.0, 16.0)
    assert f"{factor:.1f} times higher" in page.page.locator("#contact-text").text_content()
    samples = np.array(page.page.evaluate(HEAR, [4000.0, 1.5, 1.0, 2.0]))
    spectrum = np.abs(np.fft.rfft(samples * np.hanning(len(samples))))
    heard = float(np.argmax(spectrum[40:]) + 40)
    assert heard == pytest.approx(factor * predicted, rel=0.1)


def test_the_mouse_moves_the_device_and_sound_takes_it_over(page) -> None:
    touch(page, 2000.0, 8.0)
    for share in np.linspace(0.5, 0.8, 12):
        page.page.mouse.move(*page.at("motion", float(share), 0.1))
        page.page.wait_for_timeout(20)
    page.wait("zwidth.contact.view.now > 0.0001")
    target = page.value("zwidth.contact.view.target")
    assert target > 0.003
    page.page.click("button:has-text('Sound')")
    page.wait("zwidth.contact.touch.sound")
    before = page.value("zwidth.contact.view.filled")
    page.wait(f"zwidth.contact.view.filled > {before} + 50")
    page.page.click("button:has-text('Sound')")
    page.wait("!zwidth.contact.touch.sound")
    before = page.value("zwidth.contact.view.filled")
    page.wait(f"zwidth.contact.view.filled > {before} + 50")
    page.page.focus("#motion")
    page.page.keyboard.press("ArrowLeft")
    assert page.value("zwidth.contact.view.target") < target


def test_a_contact_is_let_go_and_shown(page) -> None:
    page.change(wall={"stiffness": 9000, "damping": 10})
    page.settle()
    page.page.click("button:has-text('Let go')")
    page.wait("zwidth.contact.view.motion")
    made = zwidth.load("five-bar").at().simulate(stiffness=9000.0, damping=10.0)
    assert page.value("zwidth.contact.view.motion.reading.length") == len(made.position)
    text = page.page.locator("#contact-text").text_content()
    assert text.startswith("not stable")


def test_a_contact_goes_with_its_device(page) -> None:
    page.change(wall={"stiffness": 900, "damping": 3})
    page.settle()
    page.page.click("button:has-text('Let go')")
    page.wait("zwidth.contact.view.motion")
    said = page.page.evaluate(
        """() => {
          zwidth.choose("hapkit-course");
          return document.getElementById("status").textContent;
        }"""
    )
    assert said.endswith(" hapkit-course…")
    assert not page.value("zwidth.contact.view.motion")
    assert page.page.locator("#contact-text").text_content() == ""
    page.wait("zwidth.shown === 'bundled hapkit-course'")
    assert page.status == ""


@pytest.mark.parametrize("delay", [0.0, 1.0, 0.35])
def test_the_loop_encloses_the_energy_that_the_wall_makes(page, delay) -> None:
    """What the ledger of the simulation says; with part of a sample as delay as well as a cubic can."""
    at = zwidth.load("five-bar", {"loop.delay_samples": delay}).at()
    chart = at.chart()
    damping = chart.damping_at_stiffness_max
    for share in (1.03, 0.4):
        stiffness = share * chart.stiffness_max
        page.change(settings={"loop.delay_samples": delay}, wall={"stiffness": stiffness, "damping": damping})
        page.settle()
        page.page.evaluate("() => { zwidth.contact.view.motion = null; }")
        page.page.click("button:has-text('Let go')")
        page.wait("zwidth.contact.view.motion")
        found = page.page.evaluate(
            """async () => {
              const { loopOf, madeOf } = await import("./contact_view.js");
              const { motion, spring } = zwidth.contact.view;
              const { place, force } = loopOf(motion);
              const own = [...madeOf(motion, spring)];
              return { made: [...motion.made], own, place: [...place], force: [...force] };
            }"""
        )
        ledger = at.simulate(stiffness=stiffness, damping=damping).table()
        parts = ("wall", "hold", "velocity_estimate", "quantiser", "passivity_controller", "actuator")
        x = ledger["position_m"]
        energy = sum(ledger[f"{part}_J"] for part in parts) + 0.5 * stiffness * (x**2 - x[0] ** 2)
        size = np.abs(energy).max()
        assert found["made"] == pytest.approx(energy, abs=1e-9 * size)
        assert share < 1.0 or energy[-1] > 0.0, "an unstable wall makes energy"
        assert share > 1.0 or delay > 0.0 or energy[-1] < 0.0, "damped, this one takes some out"
        place, force = np.array(found["place"]), np.array(found["force"])
        assert np.all(force[::2] == force[1::2]), "held"
        late = int(np.ceil(delay))  # before that the page knows of no force
        own, rest = np.array(found["own"]), (energy - energy[late])[late:]
        assert own[late:] == pytest.approx(rest, abs=(0.05 if delay % 1 else 1e-9) * size)
        area = np.sum(force * np.append(np.diff(place), 0.0)) + 0.5 * stiffness * (x[-1] ** 2 - x[late] ** 2)
        assert area == pytest.approx(own[-1], rel=1e-9)


def test_the_energy_of_a_touched_wall_follows_the_choice_of_its_sides(page) -> None:
    page.change(wall={"stiffness": 900, "damping": 3})
    page.settle()
    for sided in (True, False):
        page.page.set_checked("label:has-text('one-sided') input", sided)
        assert page.value("zwidth.contact.view.spring") == {"stiffness": 900, "oneSided": sided}
        assert page.value("zwidth.contact.touch.wall.law") == (2 if sided else 1)


def test_what_the_kernel_does_not_cover_is_said(page) -> None:
    foaw = {"method": "foaw", "samples": 8, "noise_m": 1e-6}
    page.change(settings={"loop.velocity": foaw}, wall={"stiffness": 900, "damping": 3})
    page.page.click("button:has-text('Touch')")
    page.wait("document.getElementById('status').classList.contains('wrong')")
    assert not page.value("zwidth.contact.touch.running")


def test_the_hand_that_touches_is_not_taken_for_one_of_the_file(page) -> None:
    page.change(wall={"stiffness": 4000, "damping": 10})
    page.settle()
    page.page.click("button:has-text('Touch')")
    page.wait("zwidth.hand")
    page.page.select_option("#device-choice", "hapkit-course")
    page.wait("zwidth.device.label === 'hapkit-course'")
    assert page.page.locator("#operator option").first.text_content() == "nobody"
    page.page.select_option("#operator", "course-hand")
    page.wait("zwidth.device.operator")
    assert page.page.locator("#operator option").first.text_content().endswith(" the file")
    page.page.select_option("#device-choice", "novint-falcon")
    page.wait("!zwidth.contact.touching")


def test_who_asks_without_a_connection_is_told(page) -> None:
    page.page.evaluate("() => { zwidth.connection.open = () => {}; zwidth.connection.socket.close(); }")
    page.wait("!zwidth.connection.connected")
    page.page.click("#sort")
    page.wait("document.getElementById('status').textContent.includes('connection to zwidth is lost')")
