"""From a request of the page to a frame: what the computing process does."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

from zwidth.device.read import first_bundled
from zwidth.errors import NoAnswerError
from zwidth.show.app.frames import pack_frame
from zwidth.show.app.opened import OpenedDevices
from zwidth.show.app.request import (
    Computed,
    ContactRequest,
    ExportRequest,
    FileRequest,
    MapRequest,
    MoreRequest,
    OpenRequest,
    PointsRequest,
    SensitivityRequest,
    State,
    ViewRequest,
    Wall,
)
from zwidth.show.cli.errors import BadInput, explain, translate_errors
from zwidth.show.cli.options import Question
from zwidth.show.cli.progress import BAD_INPUT, NO_ANSWER

Contents = tuple[dict[str, Any], Mapping[str, Any]]  # a head, and its arrays
STATUS: Final = {NO_ANSWER: "no answer", BAD_INPUT: "bad input"}


class PageAnswers:
    """Answers of one process. Each request is answered by one frame, a failure by its sentences.

    folder   where files that the page sends are kept
    report   takes frames that tell how far a long computation is
    """

    def __init__(self, folder: Path, report: Callable[[bytes], None]) -> None:
        self.opened = OpenedDevices(folder)
        self.report = report
        self._asked: Any = None

    def warm_up(self) -> None:
        """Load what every answer needs, by answering what a page asks first."""
        state = State(device=first_bundled(), wall=Wall(stiffness=1000.0, damping=1.0))
        self._contents(OpenRequest(id=0, kind="open", state=state))
        self._contents(ViewRequest(id=0, kind="view", state=state, layers=("chart", "scene")))

    def answer(self, request: Computed | FileRequest) -> bytes:
        """The frame that answers a request; never raises for what a page can ask."""
        self._asked = request
        head: dict[str, Any] = {"id": request.id, "kind": request.kind, "ok": True}
        arrays: Mapping[str, Any] = {}
        try:
            with self._errors_translated(request):
                contents, arrays = self._contents(request)
            head |= contents
        except NoAnswerError as error:
            head |= {"ok": False, "status": STATUS[NO_ANSWER], "sentences": [str(error)]}
        except (Exception, RecursionError) as error:
            sentences, code = explain(error)
            head |= {"ok": False, "status": STATUS.get(code, "error in zwidth"), "sentences": sentences}
        return pack_frame(head, arrays)

    def progress(self, stage: str, done: int, of: int) -> None:
        """Tell the page how far the computation is: `done` of `of` steps of this stage."""
        asked = self._asked
        self.report(pack_frame({"id": asked.id, "kind": "progress", "stage": stage, "done": done, "of": of}, {}))

    def _errors_translated(self, request: Computed | FileRequest) -> Any:
        """Context in which errors are explained in words about the request's device and model."""
        state: State | None = getattr(request, "state", None)
        name, model = (state.device, state.model) if state else ("", None)
        return translate_errors(Question(name, model=model))

    def _contents(self, request: Computed | FileRequest) -> Contents:
        """Head and arrays that answer a request, by its class. Raises BadInput for one that has no answer."""
        from zwidth.show.app import layers, studies

        opened = self.opened
        match request:
            case FileRequest():
                opened.add(request.name, request.text)
                return {"name": request.name}, {}
            case OpenRequest():
                return layers.opened_device(opened, request.state)
            case ViewRequest():
                return layers.page_view(opened, request.state, request.layers, request.nearest)
            case MoreRequest():
                return layers.page_view(opened, request.state, request.layers)
            case MapRequest():
                return studies.workspace(opened, request, self.progress)
            case SensitivityRequest():
                return studies.what_to_change(opened, request, self.progress)
            case ContactRequest():
                return studies.contact(opened, request, self.progress)
            case PointsRequest():
                return studies.measured_points(opened, request)
            case ExportRequest():
                return studies.export(opened, request)
        raise BadInput(f"there is no answer to {request.kind}")
