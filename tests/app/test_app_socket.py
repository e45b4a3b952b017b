"""The socket of the workbench: its answers are those of Python, and what is wrong is answered in a sentence."""

from __future__ import annotations

import asyncio
import json
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

import zwidth
from tests.app.socket_client import FIVE_BAR, SocketClient
from zwidth.model import Operator, undamped_modes
from zwidth.show import State, pack_frame, unpack_frame
from zwidth.show.app.request import FileRequest, ViewRequest
from zwidth.show.app.worker import ANSWER, ComputeLost, ComputeProcess, SparePool

PLANT = """name = "paddle"
[plant]
mass_kg = 0.03
damping_Ns_per_m = 1.0
[loop]
sampling_period_s = 0.001
"""


@pytest.fixture(scope="module")
def client(workbench):
    with SocketClient(workbench) as opened:
        yield opened


def test_a_frame_gives_back_its_head_and_arrays() -> None:
    arrays = {"a": np.arange(6.0).reshape(2, 3), "n": np.array([1, 2, 3]), "u": np.array([7], dtype=np.uint8)}
    head, back = unpack_frame(pack_frame({"id": 1, "bad": float("nan"), "text": "µ"}, arrays))
    assert (head["id"], head["bad"], head["text"]) == (1, None, "µ")
    for name, values in arrays.items():
        assert np.array_equal(back[name], values), name
        assert head["arrays"][name][2] % 8 == 0


def test_a_view_is_the_chart_of_python(client) -> None:
    settings = {"drives.motor-right.stiffness_Nm_per_rad": 0.9, "loop.delay_samples": 0.5}
    state = {**FIVE_BAR, "settings": settings, "position": [0.02, 0.24, 0.0], "direction": [1.0, 1.0, 0.0]}
    head, arrays = client.ask("view", state=state, layers=["chart", "scene", "touch"])
    point = zwidth.load("five-bar", settings).at((0.02, 0.24), (1.0, 1.0))
    chart = point.chart()
    assert head["chart"]["stiffness_max"] == pytest.approx(chart.stiffness_max, rel=1e-12)
    assert head["chart"]["frequencies"] == pytest.approx(list(chart.frequencies_at_stiffness_max), rel=1e-12)
    assert np.array_equal(arrays["chart.rings"], np.vstack(chart.regions))
    assert arrays["chart.rings_ends"][-1] == len(arrays["chart.rings"])
    assert arrays["scene.handle"] == pytest.approx(point.posture.position, abs=1e-12)
    assert head["touch"]["period"] == 0.00125


def test_a_view_beyond_the_reach_is_refused_or_that_of_the_nearest_position(client) -> None:
    state = {**FIVE_BAR, "position": [0.4, 0.4, 0.0]}
    head, _ = client.ask("view", state=state, layers=["chart", "scene"])
    assert not head["ok"]
    head, arrays = client.ask("view", state=state, layers=["chart", "scene"], nearest=True)
    assert np.array(head["position"]) == pytest.approx(arrays["scene.handle"], abs=1e-9)
    point = zwidth.load("five-bar").at(head["position"])
    assert head["chart"]["stiffness_max"] == pytest.approx(point.chart().stiffness_max, rel=1e-12)
    head, _ = client.ask("view", state={**FIVE_BAR, "position": head["position"]}, nearest=True)
    assert head["ok"]
    assert "position" not in head, "it is reached"
    gone = {"device": "phantom-premium-1.5-cad", "position": [0.0635, -0.0546, -0.195]}
    head, _ = client.ask("view", state=gone, nearest=True)
    assert "its limits" in head["sentences"][0]


HAND = {
    "arm_mass": 0.05,
    "arm_stiffness": 300.0,
    "arm_damping": 4.0,
    "grasp_stiffness": 800.0,
    "grasp_damping": 1.0,
}


@pytest.mark.parametrize("device", ["five-bar", "stamper-delta"])
@pytest.mark.parametrize("hand", [None, HAND], ids=["free", "held"])
def test_modes_move_the_drawn_handle_as_they_move_the_plant(client, device, hand) -> None:
    state = {"device": device, **({} if hand is None else {"hand": hand})}
    _, arrays = client.ask("view", state=state, layers=["chart", "scene", "touch"])
    moved = arrays["scene.handle_rates"][0] @ arrays["touch.coordinates"]
    assert len(arrays["scene.strokes_rates"]) == len(arrays["scene.strokes"])
    assert len(arrays["scene.joints_rates"]) == len(arrays["scene.joints"])
    operator = None if hand is None else Operator(*HAND.values())
    point = zwidth.load(device).at(operator=operator)
    modes = undamped_modes(point.plant.mass, point.plant.stiffness)[1]
    assert arrays["touch.coordinates"] == pytest.approx(modes, rel=1e-9, abs=1e-9 * np.abs(modes).max())
    expected = point.plant.handle @ modes
    assert arrays["scene.direction"] @ moved == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("hand", [None, HAND], ids=["free", "held"])
def test_the_mouse_holds_no_wrist_and_its_chart_is_the_one_held_by_nobody(client, hand) -> None:
    state = {"device": "openwrist", **({} if hand is None else {"hand": hand})}
    head, arrays = client.ask("view", state=state, layers=["chart", "scene", "touch"])
    assert head["moments"]
    assert "an axis" in head["touch"]["reason"]
    assert "touch.numbers" not in arrays
    assert not arrays["scene.handle_rates"].any(), "the handle of a wrist stays where it is"
    free = zwidth.load("openwrist").at(operator="none").chart()
    assert head["chart"]["stiffness_max"] == pytest.approx(free.stiffness_max, rel=1e-12)


def test_vibration_is_sent_where_there_is_one_to_draw(client) -> None:
    _, arrays = client.ask("view", state=FIVE_BAR, layers=["chart", "scene"])
    assert "scene.strokes_rates" not in arrays, "a drag does without"
    head, arrays = client.ask("view", state={**FIVE_BAR, "model": "rigid"}, layers=["chart", "scene", "touch"])
    assert "'rigid'" in head["scene"]["still"]
    assert "scene.strokes_rates" not in arrays
    head, arrays = client.ask("view", state={"device": "published-two-mass"}, layers=["chart", "scene", "touch"])
    assert head["scene"] == {"kind": "chain"}


def test_layers_are_those_of_python(client) -> None:
    layers = ["chart", "models", "hands", "bounds", "decay", "eigenvalues", "nyquist", "impedance"]
    head, arrays = client.ask("more", state=FIVE_BAR, layers=layers)
    device = zwidth.load("five-bar")
    rigid = device.at(model="rigid").chart()
    assert head["models"]["charts"]["rigid"]["stiffness_max"] == pytest.approx(rigid.stiffness_max, rel=1e-12)
    held = device.at(operator="thesis-arm").chart()
    assert head["hands"]["charts"]["thesis-arm"]["stiffness_max"] == pytest.approx(held.stiffness_max, rel=1e-12)
    names = [one["name"] for one in head["bounds"]["conditions"]]
    assert names == [one.name for one in device.at().bounds().bounds if not one.lacking]
    z = arrays["eigenvalues.z"] @ np.array([1.0, 1j])
    assert abs(z).max() == pytest.approx(head["chart"]["wall"]["spectral_radius"], rel=1e-9)
    felt = device.at().felt(4000.0, 10.0)
    assert arrays["impedance.felt"] == pytest.approx(abs(felt.felt_impedance), rel=1e-12)
    # the wall's L passes -1 as its chart says: on the edge it goes through it
    edge = device.at().chart().boundary[0]
    at = len(edge.stiffness) // 2
    wall = {"stiffness": edge.stiffness[at], "damping": edge.damping[at]}
    _, arrays = client.ask("more", state={**FIVE_BAR, "wall": wall}, layers=["nyquist"])
    real, imaginary, _ = arrays["nyquist.open_loop"].T
    assert np.hypot(real + 1.0, imaginary).min() < 0.02


def test_disks_hold_minus_one_where_no_passive_hand_is_safe(client) -> None:
    guaranteed = zwidth.load("hapkit-course").at().guarantees()["passive"].region.stiffness_max
    for share, safe in ((0.9, True), (1.2, False)):
        state = {"device": "hapkit-course", "wall": {"stiffness": share * guaranteed, "damping": 0.0}}
        _, arrays = client.ask("more", state=state, layers=["nyquist"])
        real, imaginary, radius, _ = arrays["nyquist.disks"].T
        assert bool(np.all(np.hypot(real + 1.0, imaginary) > radius)) is safe, share


def test_a_device_file_of_the_page_is_answered(client) -> None:
    assert client.ask("file", name="my.toml", text=PLANT)[0]["ok"]
    state = {"device": "my.toml", "from_file": True, "settings": {"plant.mass_kg": 0.05}}
    head, _ = client.ask("view", state=state)
    assert head["chart"]["stiffness_max"] == pytest.approx(
        zwidth.Loop(zwidth.Plant.one_mass(mass=0.05, damping=1.0), sampling_period=0.001).chart().stiffness_max,
        rel=1e-12,
    )
    saved, arrays = client.ask("export", state=state, what="device", format="toml")
    assert saved["name"] == "my.toml"
    assert "mass_kg = 0.05" in bytes(arrays["content"]).decode()


def test_exported_lines_of_python_give_the_same_number(client, capsys) -> None:
    settings = {"loop.delay_samples": 1.0, "loop.velocity": None}
    state = {**FIVE_BAR, "settings": settings, "position": [0.0, 0.26, 0.0], "operator": "thesis-arm"}
    head, _ = client.ask("view", state=state)
    _, arrays = client.ask("export", state=state, what="python", format="py")
    lines: dict[str, object] = {}
    exec(bytes(arrays["content"]).decode(), lines)
    assert lines["chart"].stiffness_max == pytest.approx(head["chart"]["stiffness_max"], rel=1e-12)


def test_sensitivities_goal_map_and_contact_are_answered(client) -> None:
    head, _ = client.ask("sensitivity", state=FIVE_BAR, goal=8500.0)
    reached = [one for one in head["goal"]["goal"] if one["status"] == "reached"]
    device = zwidth.load("five-bar").with_({reached[0]["path"]: reached[0]["value"]})
    assert device.at().chart().stiffness_max == pytest.approx(8500.0, rel=1e-6)
    head, arrays = client.ask("map", state=FIVE_BAR, measure="isotropy", count=9)
    assert arrays["values"].shape == (9, 9)
    assert np.isfinite(arrays["values"]).any()
    head, arrays = client.ask("contact", state=FIVE_BAR)
    made = zwidth.load("five-bar").at().simulate(stiffness=4000.0, damping=10.0)
    assert np.array_equal(arrays["reading"], made.position)
    assert head["stable"] is made.stable


def test_measured_points_come_with_a_verdict(client) -> None:
    rows = "stiffness_N_per_m,damping_Ns_per_m,edge\n5000,10,upper\n9000,10,tip\n"
    client.ask("file", name="points.csv", text=rows)
    head, arrays = client.ask("points", state=FIVE_BAR, file="points.csv")
    assert head["verdicts"] == ["stable", "unstable"]
    assert arrays["walls"].tolist() == [[5000.0, 10.0], [9000.0, 10.0]]


@pytest.mark.parametrize(
    ("state", "part"),
    [
        ({"device": "five-bar", "settings": {"loop.sampling_period_s": -1}}, "least 1e-07"),
        ({"device": "five-bar", "settings": {"loop.sampling_perod_s": 1}}, "you mean"),
        ({"device": "five-bar", "settings": {"loop.sampling_period_s": 1e300}}, "sampling_period_s"),
        ({"device": "five-bar", "settings": {"mechanism.links.upper-left.mass_kg": 1e15}}, ""),
        ({"device": "five-bar", "position": [5.0, 5.0, 0.0]}, "reach"),
        ({"device": "five-bar", "direction": [0.0, 0.0, 0.0]}, "direction"),
        ({"device": "no-such"}, "bundled device"),
        ({"device": "other.toml", "from_file": True}, "not been"),
        ({"device": "five-bar", "operator": "/etc/passwd"}, "bundled operator"),
        ({"device": "five-bar", "settings": {"name": [[[[[[["x"]]]]]]]}}, ""),
    ],
)
def test_a_bad_state_is_answered_in_a_sentence_and_the_next_one_is_answered(client, state, part) -> None:
    head, _ = client.ask("view", state=state)
    if not head["ok"]:
        assert part in " ".join(head["sentences"])
        assert all("Traceback" not in line and len(line) < 600 for line in head["sentences"])
    assert client.ask("view", state=FIVE_BAR)[0]["ok"]


@pytest.mark.parametrize(
    ("message", "part"),
    [
        ("", "Expecting value"),
        ("[1]", "JSON object"),
        ("{", "Expecting"),
        ('{"kind": "view", "id": 1}', "state"),
        ('{"kind": "view", "id": -1, "state": {"device": "five-bar"}}', "id"),
        ('{"kind": "no-such", "id": 1}', "kind"),
        ('{"id": 1, "kind": "view", "state": {"device": "../five-bar"}}', "device"),
        ('{"id": 1, "kind": "view", "state": {"device": "five-bar", "settings": {"a": NaN}}}', "finite"),
        (
            '{"id": 1, "kind": "view", "state": {"device": "m", "wall": {"stiffness": 1e99, "damping": 0}}}',
            "wall",
        ),
        ('{"id": 1, "kind": "view", "state": {"device": "five-bar", "secret": 1}}', "secret"),
        ("[" * 100_000, "nested"),
        ('{"id": 1, "kind": "file", "name": "../../x.toml", "text": ""}', "name"),
        ('{"id": 1, "kind": "file", "name": "x.py", "text": ""}', "neither a"),
    ],
)
def test_a_malformed_message_is_answered_in_a_sentence(client, message, part) -> None:
    assert part in " ".join(client.refused(message))
    assert client.ask("view", state=FIVE_BAR)[0]["ok"]


def test_a_file_that_is_too_large_is_refused(client) -> None:
    head, _ = client.ask("file", name="large.csv", text="x" * 5_000_001)
    assert "at most 5,000,000" in head["sentences"][0]


def test_a_file_of_many_short_lines_is_read(client) -> None:
    assert client.ask("file", name="lines.csv", text="1\n" * 2_400_000)[0]["ok"]


def test_a_response_reads_no_file_that_the_page_has_not_sent(client) -> None:
    text = 'name = "m"\n[response]\nfile = "/etc/passwd"\n[loop]\nsampling_period_s = 0.001\n'
    client.ask("file", name="spy.toml", text=text)
    head, _ = client.ask("view", state={"device": "spy.toml", "from_file": True})
    assert not head["ok"]
    assert "response.file: " in head["sentences"][0]
    assert "root:" not in json.dumps(head)


def test_a_computation_that_takes_long_is_ended_by_the_next_drag(workbench) -> None:
    with SocketClient(workbench) as own:
        own.ask("view", state=FIVE_BAR)
        slow = {**FIVE_BAR, "settings": {"loop.delay_samples": 60.0, "loop.velocity": SLOW}}
        own.send("view", state=slow, layers=["chart", "decay", "guarantees", "bounds", "models", "hands"])
        time.sleep(0.2)
        began = time.monotonic()
        head, _ = own.ask("view", state=FIVE_BAR)
        assert head["ok"]
        assert head["chart"]["stiffness_max"] == pytest.approx(7849.4414930, rel=1e-9)
        assert time.monotonic() - began < 20.0


def test_a_process_that_is_ended_while_it_starts_is_lost() -> None:
    async def lose() -> None:
        process = ComputeProcess()
        process._ready = asyncio.ensure_future(asyncio.sleep(60.0))
        waiting = asyncio.ensure_future(process.ready())
        await asyncio.sleep(0)
        process._ready.cancel()
        with pytest.raises(ComputeLost, match="had started"):
            await waiting

    with ThreadPoolExecutor(1) as thread:  # the browser's tests run an event loop in this one
        thread.submit(asyncio.run, lose()).result()


def test_a_closed_page_leaves_its_idle_process_to_the_next_which_finds_nothing_of_it() -> None:
    async def hand_over() -> None:
        pool = SparePool()
        first = await pool.take()
        file = FileRequest(id=1, kind="file", name="my.toml", text=PLANT)
        view = ViewRequest(id=2, kind="view", state=State(device="my.toml", from_file=True), layers=("chart",))
        assert await answer_of(first, file)
        assert await answer_of(first, view)
        await pool.give_back(first)
        taken = [await pool.take(), await pool.take()]
        assert first in taken
        assert not await answer_of(first, view)
        for process in taken:
            await process.ready()
            await pool.give_back(process)
        await pool.end()
        assert first.process is not None
        assert first.process.returncode is not None

    with ThreadPoolExecutor(1) as thread:
        thread.submit(asyncio.run, hand_over()).result()


def test_a_process_that_still_computes_serves_no_other_page() -> None:
    async def hand_over() -> None:
        pool = SparePool()
        process = await pool.take()
        state = State(device="five-bar", settings={"loop.delay_samples": 60.0, "loop.velocity": SLOW})
        asked = process.ask(ViewRequest(id=1, kind="view", state=state, layers=("chart", "guarantees")))

        async def to_the_end() -> None:
            async for _ in asked:  # frames of progress, which may come before the page is closed
                pass

        waiting = asyncio.ensure_future(to_the_end())
        await process.ready()
        await asyncio.sleep(0)
        assert not process.idle
        await pool.give_back(process)
        with pytest.raises(ComputeLost):
            await waiting
        taken = await pool.take()
        assert process is not taken
        await pool.end()
        await pool.give_back(taken)

    with ThreadPoolExecutor(1) as thread:
        thread.submit(asyncio.run, hand_over()).result()


async def answer_of(process: ComputeProcess, request: Any) -> bool:
    """Whether a request has an answer."""
    async for kind, frame in process.ask(request):
        if kind == ANSWER:
            head, _ = unpack_frame(frame)
    return bool(head["ok"])


# Guarantees of a loop of this size take longer than anybody waits.
SLOW = {"method": "windowed-difference", "samples": 40}


def test_two_pages_do_not_disturb_each_other(workbench) -> None:
    with SocketClient(workbench) as one, SocketClient(workbench) as other:
        one.ask("file", name="my.toml", text=PLANT)
        assert one.ask("view", state={"device": "my.toml", "from_file": True})[0]["ok"]
        assert not other.ask("view", state={"device": "my.toml", "from_file": True})[0]["ok"]
        head, _ = other.ask("view", state=FIVE_BAR)
        assert head["chart"]["stiffness_max"] == pytest.approx(7849.4414930, rel=1e-9)


def test_only_two_views_are_on_their_way_to_a_page_that_confirms_none(workbench) -> None:
    with SocketClient(workbench) as own:
        own.ask("view", state=FIVE_BAR)  # the process is there
        for n in range(1, 9):
            own.number += 1
            state = {**FIVE_BAR, "settings": {"loop.delay_samples": 0.1 * n}}
            last = own.number
            own.socket.send(json.dumps({"id": own.number, "kind": "view", "state": state}))
            time.sleep(0.1)
        received = []
        while True:
            try:
                received.append(unpack_frame(own.socket.recv(timeout=1.0))[0]["id"])
            except TimeoutError:
                break
        assert len(received) == 2
        own.socket.send('{"kind": "shown"}')
        newest = unpack_frame(own.socket.recv(timeout=20))[0]["id"]
        assert newest == last, "the newest state, not one that waited"
