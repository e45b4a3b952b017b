"""Drive the page as a user does, and look at what it holds."""

from __future__ import annotations

import time
from typing import Any


class Page:
    """One page of the workbench in a browser, whose console must stay silent."""

    def __init__(self, browser: Any, port: int, width: int = 1400, height: int = 900, **options: Any) -> None:
        self.context = browser.new_context(
            viewport={"width": width, "height": height}, accept_downloads=True, **options
        )
        self.address = f"http://127.0.0.1:{port}/"
        self.complaints: list[str] = []
        self.page = self.new_tab()

    def new_tab(self, link: str = "") -> Any:
        """Open the page, and wait for its first view."""
        tab = self.context.new_page()
        tab.on("console", lambda message: self._listen(message.type, message.text))
        tab.on("pageerror", lambda error: self.complaints.append(str(error)))
        tab.goto(self.address + link)
        self.wait("window.zwidth?.view && zwidth.device", tab)
        return tab

    def _listen(self, kind: str, text: str) -> None:
        # reading pixels back is what these tests do, not the page
        if kind in ("error", "warning") and "getImageData" not in text:
            self.complaints.append(text)

    def __enter__(self) -> Page:
        return self

    def __exit__(self, kind: object, *error: object) -> None:
        self.context.close()
        if kind is None:
            assert not self.complaints, self.complaints

    def value(self, expression: str, tab: Any = None) -> Any:
        """What an expression is in the page."""
        return (tab or self.page).evaluate(f"() => ({expression})")

    def wait(self, expression: str, tab: Any = None, seconds: float = 120.0) -> None:
        """Wait until an expression is true, also on a busy machine; the page's policy forbids Playwright's way."""
        end = time.monotonic() + seconds
        while not self.value(f"Boolean({expression})", tab):
            assert time.monotonic() < end, f"{expression} did not become true: {self.complaints}"
            time.sleep(0.02)

    @property
    def status(self) -> str:
        """The page's sentence."""
        return str(self.page.locator("#status").text_content())

    @property
    def stiffness_max(self) -> float:
        """Largest stiffness of the view that is shown [N/m]."""
        return float(self.value("zwidth.view.head.chart.stiffness_max"))

    def change(self, **state: Any) -> None:
        """Change the state, as what the user does ends in."""
        self.page.evaluate("(change) => zwidth.store.set(change)", state)

    def settle(self) -> None:
        """Wait until the view is that of the state."""
        self.wait("zwidth.connection.waiting.size === 0 && !zwidth.waits")

    def at(self, name: str, x: float, y: float) -> tuple[float, float]:
        """Pixels of a place in an element, as shares of its box."""
        box = self.page.locator(f"#{name}").bounding_box()
        assert box is not None
        return box["x"] + x * box["width"], box["y"] + y * box["height"]

    def drag(self, start: tuple[float, float], end: tuple[float, float], steps: int = 10) -> None:
        """Drag the mouse."""
        self.page.mouse.move(*start)
        self.page.mouse.down()
        self.page.mouse.move(*end, steps=steps)
        self.page.mouse.up()

    def drop(self, **files: str) -> None:
        """Drop files onto the page: name with _ for the dot -> text."""
        contents = [[name.replace("_", "."), text] for name, text in files.items()]
        self.page.evaluate(
            """(files) => {
              const data = new DataTransfer();
              for (const [name, text] of files) data.items.add(new File([text], name));
              document.body.dispatchEvent(new DragEvent("drop", { dataTransfer: data, bubbles: true }));
            }""",
            contents,
        )
