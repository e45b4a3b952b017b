"""The page in a browser: every view, drag, click, key, drop, link and file."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import zwidth
from tests.app.page_driver import Page
from tests.app.test_app_socket import PLANT
from tests.paddle import LENGTH, PADDLE


@pytest.fixture
def page(browser, workbench):
    with Page(browser, workbench) as opened:
        yield opened


def test_the_first_view_is_the_chart_of_python(page) -> None:
    assert page.stiffness_max == pytest.approx(zwidth.load("five-bar").at().chart().stiffness_max, rel=1e-12)
    headline = page.page.locator("#headline").text_content().replace("\u00a0", " ")
    assert re.findall(r"\d[\d.]* (?:kN/m|N s/m|Hz)", headline) == ["7.849 kN/m", "10.82 N s/m", "170.5 Hz"]
    assert page.page.title() == "Five-bar – zwidth"


def test_a_slider_is_dragged_and_the_chart_follows(page) -> None:
    slider = page.page.locator("input[aria-label='sampling period']")
    box = slider.bounding_box()
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.drag(middle, (box["x"] + 0.3 * box["width"], middle[1]), steps=25)
    page.settle()
    period = page.value("zwidth.state.settings['loop.sampling_period_s']")
    assert period < 0.00125
    made = zwidth.load("five-bar", {"loop.sampling_period_s": period})
    assert page.stiffness_max == pytest.approx(made.at().chart().stiffness_max, rel=1e-12)
    assert page.value("zwidth.store.past.length") == 1, "a drag is one step"
    page.page.click("#undo")
    page.settle()
    assert page.stiffness_max == pytest.approx(7849.4414930, rel=1e-9)
    page.page.keyboard.press("Control+y")
    page.settle()
    assert page.value("zwidth.state.settings['loop.sampling_period_s']") == period


def test_a_number_is_typed_and_a_wrong_one_is_refused(page) -> None:
    field = page.page.locator("[id='n-loop.sampling_period_s']")
    field.fill("0,001")
    field.press("Enter")
    page.settle()
    assert page.value("zwidth.state.settings['loop.sampling_period_s']") == 0.001
    for text in ("abc", "-1", "1e99", "NaN"):
        field.fill(text)
        field.press("Enter")
        assert page.value("zwidth.state.settings['loop.sampling_period_s']") == 0.001, text
        assert not field.evaluate("(field) => field.validity.valid"), text


def test_a_wall_is_chosen_by_click_keys_and_fields(page) -> None:
    page.page.mouse.click(*page.at("chart", 0.5, 0.6))
    page.settle()
    clicked = page.value("zwidth.state.wall")
    assert 3000.0 < clicked["stiffness"] < 5000.0
    assert "stable" in page.page.locator("#verdict").text_content()
    page.page.focus("#chart")
    page.page.keyboard.press("ArrowRight")
    assert page.value("zwidth.state.wall.stiffness") > clicked["stiffness"]
    page.page.fill("#wall-stiffness", "8500")
    page.page.press("#wall-stiffness", "Enter")
    page.settle()
    point = zwidth.load("five-bar").at()
    damping = page.value("zwidth.state.wall.damping")
    assert point.check(8500.0, damping).names == ["unstable"]
    assert page.page.locator("#verdict").text_content().startswith("unstable")
    page.page.fill("#wall-damping", "hard")
    page.page.press("#wall-damping", "Enter")
    assert "is a number" in page.status


def test_layers_are_switched_on_and_named(page) -> None:
    for layer in ("decay", "models", "hands", "bounds", "frequency"):
        page.page.check(f"[data-layer={layer}]")
    page.wait("zwidth.chart.more?.head.bounds")
    page.settle()
    legend = page.page.locator("#legend").text_content()
    for name in ("rigid model", "thesis-arm", "|z| <", "rigid mass"):
        assert name in legend, name
    page.page.uncheck("[data-layer=models]")
    page.settle()
    assert "rigid model" not in page.page.locator("#legend").text_content()


def test_the_other_faces_of_a_wall_are_shown(page) -> None:
    page.page.mouse.click(*page.at("chart", 0.5, 0.6))
    page.settle()
    for face in ("edge", "impedance", "nyquist", "eigenvalues"):
        page.page.click(f"[data-face={face}]")
        page.settle()
        assert page.page.locator("#face").is_visible()
        assert inked(page, "face") > 500, face
    page.page.focus("[data-face=eigenvalues]")
    page.page.keyboard.press("ArrowRight")
    assert page.value("zwidth.face") == "chart"
    assert page.page.locator("#chart").is_visible()


def test_the_handle_and_the_direction_are_dragged(page) -> None:
    handle = page.value("Object.values(zwidth.deviceView.place(zwidth.deviceView.points('handle')))")
    box = page.page.locator("#scene").bounding_box()
    start = (box["x"] + handle[0], box["y"] + handle[1])
    page.drag(start, (start[0] + 30.0, start[1] + 20.0), steps=12)
    page.settle()
    position = page.value("zwidth.state.position")
    assert position[0] > 0.01
    assert position[1] < 0.25
    made = zwidth.load("five-bar").at(tuple(position)).chart()
    assert page.stiffness_max == pytest.approx(made.stiffness_max, rel=1e-9)
    tip = page.value("Object.values(zwidth.deviceView.tip())")
    page.drag((box["x"] + tip[0], box["y"] + tip[1]), (start[0] + 110.0, start[1] + 20.0), steps=12)
    page.settle()
    assert abs(page.value("zwidth.state.direction")[0]) > 0.9
    page.page.focus("#scene")
    page.page.keyboard.press("]")
    page.page.keyboard.press("ArrowUp")
    page.settle()
    assert page.value("zwidth.state.position")[1] > position[1]


def test_a_handle_dragged_out_of_reach_says_so_and_comes_back(page) -> None:
    before = page.stiffness_max
    page.page.evaluate("() => zwidth.store.set({ position: [2, 2, 0] })")
    page.wait("document.getElementById('status').classList.contains('wrong')")
    assert "reach" in page.status
    page.page.click("#undo")
    page.settle()
    assert page.stiffness_max == before
    assert page.status == ""


def test_a_map_lies_behind_the_device(page) -> None:
    page.page.select_option("#measure", "isotropy")
    page.wait("zwidth.deviceView.map")
    values = page.value("[...zwidth.deviceView.map.values].filter(Number.isFinite)")
    assert len(values) > 100
    assert page.value("zwidth.deviceView.map.name") == "isotropy"
    page.page.evaluate("() => zwidth.store.setNumbers({ 'mechanism.links.0.length_m': 0.16 })")
    assert page.value("zwidth.deviceView.map") is None, "it is of other numbers"
    page.wait("zwidth.deviceView.map")
    assert page.value("[...zwidth.deviceView.map.values].filter(Number.isFinite)") != values


def test_a_spatial_device_is_turned(page) -> None:
    page.page.select_option("#device-choice", "stamper-delta")
    page.wait("zwidth.device?.label === 'stamper-delta' && !zwidth.deviceView.scene.planar")
    page.settle()
    before = page.value("zwidth.deviceView.turned")
    page.drag(page.at("scene", 0.1, 0.9), page.at("scene", 0.4, 0.8))
    assert page.value("zwidth.deviceView.turned") != before
    assert inked(page, "scene") > 500


def test_a_map_lies_in_a_plane_through_a_spatial_device(page) -> None:
    page.page.select_option("#device-choice", "phantom-premium-1.5")
    page.wait("zwidth.shown === 'bundled phantom-premium-1.5'")
    page.settle()
    assert not page.value("zwidth.deviceView.scene.planar"), "its turntable moves the handle out of it"
    page.change(position=[0.2, 0.02, -0.15])
    page.settle()
    page.page.select_option("#measure", "isotropy")
    page.wait("zwidth.deviceView.map", seconds=60)
    found = page.value(
        "Object.fromEntries(Object.entries(zwidth.deviceView.map).map(([name, x]) => [name, x.at ? [...x] : x]))"
    )
    first, second, through = (np.array(found[name]) for name in ("first", "second", "through"))
    assert np.cross(first, second) @ (np.array([0.2, 0.02, -0.15]) - through) == pytest.approx(0.0, abs=1e-12)
    values = np.array(found["values"], dtype=float).reshape(len(found["y"]), len(found["x"]))
    row, column = np.argwhere(np.isfinite(values))[3]
    position = through + found["x"][column] * first + found["y"][row] * second
    own = zwidth.load("phantom-premium-1.5").at(position).measure("isotropy")
    assert values[row, column] == pytest.approx(float(own), rel=1e-9)
    # what is drawn there is a cell of the colour of that value, a parallelogram around the projected place
    drawn = page.value(f"zwidth.deviceView.place({position.tolist()})")
    size = page.value("[zwidth.deviceView.canvas.clientWidth, zwidth.deviceView.canvas.clientHeight]")
    assert 0 < drawn["x"] < size[0]
    assert 0 < drawn["y"] < size[1]


def test_numbers_are_sorted_and_a_goal_is_reached(page) -> None:
    page.page.click("#sort")
    page.wait("zwidth.numbers.order")
    assert "sampling period" in page.page.locator(".number label").first.text_content()
    page.page.fill("#goal", "8,5")
    page.page.click("#seek")
    page.wait("zwidth.numbers.goal.size > 0")
    assert not page.page.locator(".note", has_text="before the last change").count()
    page.page.locator(".reach", has_text="goal at").first.click()
    page.settle()
    assert page.page.locator(".note").first.text_content().startswith("before ")
    assert page.stiffness_max == pytest.approx(8500.0, rel=1e-6)
    page.page.fill("#goal", "stiff")
    page.page.click("#seek")
    assert "a goal" in page.status
    page.page.fill("#filter", "motor inertia")
    assert page.page.locator(".number").count() == 2


def test_another_estimate_brings_the_numbers_that_it_needs(page) -> None:
    page.page.select_option("#device-choice", "hapkit-course")
    page.wait("zwidth.shown === 'bundled hapkit-course'")
    choice = "[id='n-loop.velocity.method']"
    for method, brought in (
        ("savitzky-golay", {"samples": 8, "order": 2}),
        ("kalman", {"acceleration_noise_m_per_s2": 10.0, "position_noise_m": 1e-5}),
        ("central-difference", {}),
    ):
        page.page.select_option(choice, method)
        page.settle()
        page.wait(f"zwidth.numbers.valueOf(zwidth.numbers.rows.get('loop.velocity.method').number) === '{method}'")
        assert page.status == ""
        own = zwidth.load("hapkit-course", {"loop.velocity": {"method": method, **brought}})
        page.wait(f"Math.abs(zwidth.view.head.chart.stiffness_max / {own.at().chart().stiffness_max} - 1) < 1e-9")
        for key in brought:
            page.wait(f"document.getElementById('n-loop.velocity.{key}')")


def test_a_number_that_can_be_read_in_two_ways_is_none(page) -> None:
    texts = {"1.5": 1.5, "8,5": 8.5, "0,125": 0.125, "1500": 1500, "1,500": None, "12,000,000": None, "3 mm": None}
    script = "async (texts) => texts.map((await import('./typed_number.js')).typedNumber)"
    found = page.page.evaluate(script, list(texts))
    assert [None if np.isnan(number) else number for number in found] == list(texts.values())


def test_a_chart_is_pinned_for_comparison(page) -> None:
    page.page.click("#pin")
    page.page.evaluate("() => zwidth.store.setNumbers({ 'loop.delay_samples': 1 })")
    page.settle()
    assert page.page.locator("#legend").text_content().startswith("pinned 1")
    assert page.value("zwidth.chart.box.K[1]") > 7800.0, "both are in view"
    page.page.click("[aria-label='Remove pinned 1']")
    page.settle()
    assert page.page.locator("#legend").text_content() == ""


def test_files_are_dropped_and_opened(page) -> None:
    page.drop(paddle_toml=PLANT)
    page.wait("zwidth.device?.name === 'paddle'")
    page.settle()
    own = zwidth.Loop(zwidth.Plant.one_mass(mass=0.03, damping=1.0), sampling_period=0.001).chart()
    assert page.stiffness_max == pytest.approx(own.stiffness_max, rel=1e-12)
    page.drop(points_csv="stiffness_N_per_m,damping_Ns_per_m,edge\n15000,10,upper\n")
    page.wait("zwidth.chart.points.length === 1")
    page.drop(broken_toml="name = 3\n[plant]\nmass_kg = 'heavy'\n")
    page.wait("document.getElementById('status').classList.contains('wrong')")
    assert "mass_kg" in page.status
    assert page.value("zwidth.state.device") == "paddle.toml", "a faulty file changes nothing"
    page.change(device="missing.toml")
    page.wait("zwidth.view === null && zwidth.deviceView.scene === null")  # nothing of the device before
    page.page.select_option("#device-choice", "hapkit-course")
    page.wait("zwidth.device?.label === 'hapkit-course'")
    page.settle()
    assert page.status == ""


def test_of_a_device_without_masses_the_geometry_is_shown(page) -> None:
    page.page.select_option("#device-choice", "novint-falcon")
    page.wait("zwidth.shown === 'bundled novint-falcon'")
    page.settle()
    assert page.page.locator("#headline").text_content().startswith("No chart")
    assert "It needs mechanism.links.platform.mass_kg" in page.value("zwidth.view.head.chart.reason")
    assert page.value("zwidth.deviceView.scene.drives.length") == 3
    for face in ("Frequency", "|Z|", "Chart"):
        page.page.click(f"button:has-text('{face}')")
        page.settle()
    page.page.click("#pin")
    page.page.click("button:has-text('Let go')")
    page.page.click("button:has-text('Touch')")
    page.page.select_option("#device-choice", "hapkit-course")
    page.wait("zwidth.shown === 'bundled hapkit-course'")
    page.settle()
    assert page.stiffness_max == pytest.approx(zwidth.load("hapkit-course").at().chart().stiffness_max, rel=1e-12)


def test_a_link_holds_the_numbers_and_files(page) -> None:
    page.drop(paddle_toml=PLANT)
    page.wait("zwidth.device?.name === 'paddle'")
    page.change(settings={"plant.mass_kg": 0.05}, wall={"stiffness": 900, "damping": 3})
    page.settle()
    shown = page.stiffness_max
    page.page.click("#share")
    page.wait("location.hash.length > 20")
    link = page.value("location.hash")
    other = page.new_tab(link)
    assert page.value("zwidth.view.head.chart.stiffness_max", other) == pytest.approx(shown, rel=1e-12)
    assert page.value("zwidth.state.wall", other) == {"stiffness": 900, "damping": 3}
    cut = page.new_tab(link[:40])
    assert (
        "cut off" in cut.locator("#status").text_content() or page.value("zwidth.state.device", cut) == "five-bar"
    )


@pytest.mark.parametrize(
    ("choice", "part"),
    [
        ("device.toml", b"[[mechanism.links]]"),
        ("figure.svg", b"<svg"),
        ("figure.png", b"\x89PNG"),
        ("figure.pdf", b"%PDF"),
        ("data.json", b'"stiffness_max_N_per_m"'),
        ("data.csv", b"arc,stiffness_N_per_m"),
        ("python.py", b"zwidth.load"),
    ],
)
def test_files_are_kept(page, choice, part) -> None:
    with page.page.expect_download() as waiting:
        page.page.select_option("#export", choice)
    assert part in Path(waiting.value.path()).read_bytes()
    assert waiting.value.suggested_filename.startswith("five-bar")


def test_the_report_opens_in_a_tab(page) -> None:
    page.change(device="hapkit-course", settings={"loop.delay_samples": 0.5})
    page.settle()
    with page.context.expect_page() as waiting:
        page.page.select_option("#export", "report.tab")
    tab = waiting.value
    page.wait("document.getElementById('status').textContent.includes('open in another tab')", seconds=60)
    tab.wait_for_url("**/reports/*")
    assert "a delay of 0.5" in tab.locator("header").inner_text().replace("\xa0", " ")
    assert tab.locator("svg, img").count() > 0
    # its own style is applied, and it is not of the workbench's origin
    assert tab.evaluate("() => getComputedStyle(document.body).fontFamily") != "serif"
    assert tab.evaluate("() => self.origin") == "null"


def test_a_tab_that_the_browser_does_not_open_is_said(page) -> None:
    page.page.evaluate("() => { window.open = () => null; }")
    page.page.select_option("#export", "report.tab")
    page.wait("document.getElementById('status').classList.contains('wrong')")
    assert "report" in page.status


def test_a_lost_connection_comes_back_with_the_state_kept(page) -> None:
    page.page.evaluate("() => zwidth.store.setNumbers({ 'loop.delay_samples': 0.5 })")
    page.settle()
    before = page.stiffness_max
    page.page.evaluate("() => { zwidth.view = null; zwidth.connection.socket.close(); }")
    page.wait("zwidth.view")
    page.settle()
    assert page.stiffness_max == before
    assert page.value("zwidth.state.settings['loop.delay_samples']") == 0.5
    assert page.status == ""


def test_two_tabs_do_not_disturb_each_other_in_the_browser(page) -> None:
    other = page.new_tab()
    other.evaluate("() => zwidth.store.setNumbers({ 'loop.delay_samples': 1 })")
    page.wait("zwidth.view.head.chart.stiffness_max < 2000", other)
    assert page.stiffness_max == pytest.approx(7849.4414930, rel=1e-9)


@pytest.mark.parametrize(
    ("width", "height", "scheme"), [(1400, 900, "dark"), (390, 844, "light"), (820, 1180, "light")]
)
def test_the_page_fits_and_follows_the_colour_scheme(browser, workbench, width, height, scheme) -> None:
    with Page(browser, workbench, width, height, color_scheme=scheme) as page:
        page.settle()
        assert page.value("document.documentElement.dataset.theme") == scheme
        assert page.value("document.documentElement.scrollWidth") <= width, "nothing is cut off at the side"
        assert inked(page, "chart") > 500
        assert inked(page, "scene") > 300
        page.page.click("#theme")
        assert page.value("document.documentElement.dataset.theme") != scheme


def inked(page: Page, canvas: str) -> int:
    """Number of pixels that a canvas has drawn."""
    return int(
        page.page.evaluate(
            """(name) => {
              const canvas = document.getElementById(name);
              const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
              let count = 0;
              for (let i = 3; i < data.length; i += 4) count += data[i] > 0;
              return count;
            }""",
            canvas,
        )
    )


def test_a_recorded_paddle_appears_as_points(page) -> None:
    page.page.click("#paddle summary")
    page.page.evaluate(
        """async () => {
          const record = await (await fetch("paddle_record.txt")).text();
          await zwidth.paddle.stream.replay(record, Infinity);
        }"""
    )
    page.settle()
    assert page.value("zwidth.chart.points.length") == 20
    assert page.value("zwidth.chart.points.some((point) => point.measured === 'unstable')")
    with page.page.expect_download() as waiting:
        page.page.click("#paddle button:has-text('Save trials')")
    assert Path(waiting.value.path()).read_text().startswith("stiffness_N_per_m,damping_Ns_per_m")


def grab_handle(page) -> tuple[float, float]:
    """Press the mouse on the handle; where that is on the page."""
    handle = page.value("Object.values(zwidth.deviceView.place(zwidth.deviceView.points('handle')))")
    box = page.page.locator("#scene").bounding_box()
    start = (box["x"] + handle[0], box["y"] + handle[1])
    page.page.mouse.move(*start)
    page.page.mouse.down()
    return start


def test_a_handle_dragged_too_far_slides_along_the_edge_of_its_reach(page) -> None:
    x, y = grab_handle(page)
    steps = page.value("zwidth.store.past.length")
    page.page.mouse.move(x + 900.0, y, steps=5)
    page.wait("zwidth.unreached === false && zwidth.state.position?.[0] > 0.05")
    page.settle()
    below = page.value("zwidth.state.position")
    assert zwidth.load("five-bar").at(below).posture.projected == 0.0
    assert page.value("[...zwidth.deviceView.points('handle')]") == pytest.approx(below, abs=1e-9)
    page.page.mouse.move(x + 900.0, y - 300.0, steps=5)
    page.settle()
    above = page.value("zwidth.state.position")
    page.page.mouse.up()
    page.settle()
    assert above[1] > below[1] + 0.01, "the mouse is followed"
    assert page.value("zwidth.state.position") == above
    assert page.status == ""
    assert page.value("zwidth.store.past.length") == steps + 1, "one step"


def test_a_paddle_is_dragged_around_its_circle(page) -> None:
    page.drop(paddle_toml=PADDLE)
    page.wait("zwidth.device?.name === 'Teaching paddle' && zwidth.deviceView.scene?.kind === 'mechanism'")
    page.settle()
    x, y = grab_handle(page)
    page.page.mouse.move(x + 250.0, y, steps=10)
    page.wait("zwidth.state.position")
    page.settle()
    page.page.mouse.up()
    page.settle()
    handle = page.value("[...zwidth.deviceView.points('handle')]")
    assert np.hypot(*handle[:2]) == pytest.approx(LENGTH, abs=1e-9)
    assert handle[0] > 0.02
    assert page.status == ""


def test_a_handle_without_a_nearest_position_goes_back_to_where_it_was_last(page) -> None:
    page.page.select_option("#device-choice", "phantom-premium-1.5-cad")
    page.wait("zwidth.device?.label === 'phantom-premium-1.5-cad'")
    page.settle()
    before = page.value("[...zwidth.deviceView.points('handle')]")
    grab_handle(page)
    page.page.evaluate("() => zwidth.deviceView.listeners.onPosition([0.0635, -0.0546, -0.195], 'handle')")
    page.wait("zwidth.unreached")
    assert "its limits" in page.status
    page.page.mouse.up()
    page.settle()
    page.wait("!document.getElementById('status').classList.contains('wrong')")
    assert page.value("[...zwidth.deviceView.points('handle')]") == pytest.approx(before, abs=1e-9)


def test_a_response_is_dropped_and_charted_beside_the_model(page) -> None:
    frequency = np.geomspace(1.0, 490.0, 300)
    plant = zwidth.Plant.one_mass(mass=0.03, damping=1.0)
    measured = sampled_response(zwidth.Loop(plant, sampling_period=0.001), frequency)
    rows = "\n".join(f"{f},{z.real},{z.imag}" for f, z in zip(frequency, measured, strict=True))
    page.drop(paddle_toml=PLANT)
    page.wait("zwidth.device?.name === 'paddle'")
    page.settle()
    modelled = page.stiffness_max
    page.drop(sweep_csv=f"frequency_Hz,real_m_per_N,imag_m_per_N\n{rows}\n")
    page.wait("zwidth.device?.given_by === 'response'")
    page.settle()
    assert page.value("zwidth.view.head.chart.sampling_period") == 0.001
    nominal = page.value("Math.max(...zwidth.view.arrays['chart.rings'].values.filter((value, n) => n % 2 === 0))")
    assert nominal == pytest.approx(modelled, rel=0.05)
    assert page.page.locator("#legend").text_content().startswith("pinned 1")


def sampled_response(loop, frequency):
    """P(e^(jwT)) of a loop, as its circle's factors have it."""
    from zwidth.chart import terms_along
    from zwidth.loop import table_of_loops
    from zwidth.loop.loop_table import circle_factors

    A, AP, _ = terms_along(circle_factors(table_of_loops(loop)), 2.0 * np.pi * frequency * loop.period).T
    return AP / A


def test_measured_points_are_in_the_legend_and_removed_there(page) -> None:
    for _ in range(3):
        page.page.click("#pin")
    for layer in ("decay", "models"):
        page.page.check(f"[data-layer={layer}]")
    page.settle()
    page.drop(
        points_csv="stiffness_N_per_m,damping_Ns_per_m,verdict\n2000,10,stable\n9000,10,stable\n9900,10,unstable\n"
    )
    page.wait("zwidth.chart.points.length === 3")
    assert "points.csv" in page.status
    assert re.findall(r"\d+", page.status) == ["3", "2", "3"]
    page.settle()
    looks = page.value("[...document.querySelectorAll('#legend line')].map((one) => one.outerHTML)")
    assert len(looks) == 9
    assert len(set(looks)) == 9, "each line has a look of its own"
    assert "× measured" in page.page.locator("#legend").text_content()
    page.page.click("[aria-label='Remove the measured points']")
    page.settle()
    assert "measured" not in page.page.locator("#legend").text_content()
