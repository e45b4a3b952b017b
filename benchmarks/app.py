"""The workbench in headless Chromium: how fast chart and device follow a drag, touch, first view, memory.

Run `python benchmarks/app.py`, or with MINUTES=10 in the environment to drag at random for so long and
watch the memory. Nothing
passes or fails: 16 ms from input to picture is a display's frame, 33 ms two of them. Times are the page's own,
from the input event to the end of drawing; what the socket and the computing process take is asked for apart.
"""

from __future__ import annotations

import os
import re
import shutil
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks._cases import Cases, TimedCase, run
from benchmarks._timing import machine, print_table
from zwidth.show import State, pack_frame
from zwidth.show.app.layers import page_view
from zwidth.show.app.opened import OpenedDevices
from zwidth.show.app.request import Wall

PATH = "drives.motor-right.stiffness_Nm_per_rad"
INPUTS, PAUSE_MS = 300, 16.0
AIMS = (16.0, 33.0)
OPENED = 7  # pages opened for the first view
# Drag one number, an input each frame, and note when each state has been drawn.
DRAG = """async ([path, count, pause]) => {
  const app = window.zwidth;
  const sent = new Map();
  const [found, drawn, asked] = [[], [], []];
  const ask = app.connection.ask.bind(app.connection);
  app.connection.ask = (kind, ...rest) => {
    const began = performance.now();
    const answer = ask(kind, ...rest);
    if (kind === "view") answer.then(() => asked.push(performance.now() - began), () => {});
    return answer;
  };
  const draw = app.draw.bind(app);
  app.draw = () => {
    const began = performance.now();
    draw();
    const now = performance.now();
    drawn.push(now - began);
    const value = app.drawnValue;
    if (sent.has(value)) { found.push(now - sent.get(value)); sent.delete(value); }
  };
  const setFrame = app.chart.setFrame.bind(app.chart);
  app.chart.setFrame = (frame) => { app.drawnValue = app.state.settings[path]; setFrame(frame); };
  for (let n = 0; n < count; n++) {
    const value = 0.4 + 0.0005 * n;
    sent.set(value, performance.now());
    app.store.setNumbers({ [path]: value }, path);
    await new Promise((resolve) => setTimeout(resolve, pause));
  }
  app.store.release();
  Object.assign(app, { draw, });
  app.connection.ask = ask;
  app.chart.setFrame = setFrame;
  return { found, drawn, asked };
}"""
TOUCH = """async (periods) => {
  const { TouchMachine } = await import("./touch_machine.js");
  const machine = new TouchMachine(await zwidth.contact.touch.module);
  machine.load(zwidth.contact.touch.blocks);
  const wall = { law: 1, stiffness: 2000, damping: 5, position: 0 };
  const began = performance.now();
  for (let done = 0; done < periods; done += 100) machine.run(100, wall, 1.0);
  return performance.now() - began;
}"""


@contextmanager
def page(browser: Any, address: str) -> Iterator[Any]:
    """A page that has drawn its first view."""
    context = browser.new_context(viewport={"width": 1400, "height": 900})
    opened = context.new_page()
    opened.goto(address)
    while not opened.evaluate("() => Boolean(window.zwidth?.view && zwidth.device && !zwidth.waits)"):
        time.sleep(0.002)
    yield opened
    context.close()


@contextmanager
def workbench() -> Iterator[tuple[Any, str, int]]:
    """A browser, the page's address, and the number of the server's process."""
    from playwright.sync_api import sync_playwright

    command = [sys.executable, "-m", "zwidth", "app", "--no-browser", "--port", "0"]
    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as server, sync_playwright() as playwright:
        assert server.stderr is not None
        found = re.search(r"http://\S+", server.stderr.readline())
        assert found
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        time.sleep(3.0)  # its first process has loaded
        yield browser, found[0], server.pid
        browser.close()
        server.terminate()


def quantiles(name: str, times: list[float]) -> tuple[str, ...]:
    """A row: median and 90th percentile [ms], and the median over both aims."""
    ordered = sorted(times)
    middle, late = statistics.median(ordered), ordered[int(0.9 * len(ordered))]
    return (name, f"{len(ordered)}", f"{middle:.1f}", f"{late:.1f}", *(f"{middle / aim:.2f}" for aim in AIMS))


def memory(server: int, opened: Any) -> tuple[float, float]:
    """Resident memory of the server with its processes, and of the page's own objects [MB]."""
    import psutil

    processes = [psutil.Process(server), *psutil.Process(server).children(recursive=True)]
    resident = sum(process.memory_info().rss for process in processes)
    session = opened.context.new_cdp_session(opened)
    session.send("HeapProfiler.collectGarbage")
    used = session.send("Runtime.getHeapUsage")["usedSize"]
    return resident / 1e6, used / 1e6


def drag_at_random(opened: Any, server: int, minutes: float) -> list[tuple[str, ...]]:
    """Memory each minute, while numbers are dragged at random."""
    rows = [("0", *(f"{x:.1f}" for x in memory(server, opened)))]
    for minute in range(1, int(minutes) + 1):
        opened.evaluate(
            """async ([path, until]) => {
              const end = performance.now() + until;
              while (performance.now() < end) {
                zwidth.store.setNumbers({ [path]: 0.2 + Math.random() }, Math.random() < 0.9 ? path : undefined);
                await new Promise((resolve) => setTimeout(resolve, 16));
              }
            }""",
            [PATH, 60_000.0],
        )
        rows.append((str(minute), *(f"{x:.1f}" for x in memory(server, opened))))
    return rows


def cases() -> Cases:
    """What the computing process does for one view of a drag."""
    from tempfile import mkdtemp

    opened = OpenedDevices(Path(mkdtemp()))
    state = State(device="five-bar", wall=Wall(stiffness=4000.0, damping=10.0))
    values = iter(range(10**9))

    def one() -> State:
        return state.model_copy(update={"settings": {PATH: 0.4 + 1e-6 * next(values)}})

    def answer(asked: State) -> float:
        return float(len(pack_frame(*page_view(opened, asked, ("chart", "scene")))))

    return {"a view of a drag": TimedCase(answer, one)}


def main() -> None:
    print(machine("numpy", "numba"))
    minutes = float(os.environ.get("MINUTES", "0"))
    with workbench() as (browser, address, server):
        firsts = []
        for _ in range(OPENED):
            began = time.perf_counter()
            with page(browser, address):
                firsts.append(1e3 * (time.perf_counter() - began))
            time.sleep(2.0)  # another process is made ready
        with page(browser, address) as opened:
            found = opened.evaluate(DRAG, [PATH, INPUTS, PAUSE_MS])
            opened.evaluate("() => zwidth.store.set({ wall: { stiffness: 2000, damping: 5 } })")
            opened.evaluate("() => zwidth.store.setNumbers({ 'loop.sampling_period_s': 0.00025 })")
            opened.click("button:has-text('Touch')")
            while not opened.evaluate("() => Boolean(zwidth.contact.touch.running)"):
                time.sleep(0.01)
            touched = opened.evaluate(TOUCH, 4000)
            opened.click("button:has-text('Touch')")
            rows = [
                quantiles("input to picture", found["found"]),
                quantiles("  of it, asked to answered", found["asked"]),
                quantiles("  of it, drawing", found["drawn"]),
                quantiles("page request to first view", firsts),
            ]
            print_table(("during a drag", "times", "median ms", "90 % ms", "over 16 ms", "over 33 ms"), rows)
            times = f"{touched:.1f} ms for a second, {1000.0 / touched:.0f} times real time"
            print(f"touch, 20 substeps at 4 kHz: {times}")
            if minutes:
                table = drag_at_random(opened, server, minutes)
                print_table(("minute", "server and processes MB", "objects of the page MB"), table)


if __name__ == "__main__":
    sys.exit(run(main, cases))
