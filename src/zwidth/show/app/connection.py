"""One open page: its requests, the newest first, and how many answers it has not yet drawn.

Views and everything else are computed by two processes, so that a drag does not wait for a map. In each the newest
request of a kind replaces one that waits, and one that has been computed for longer than PATIENCE is ended with
its process. A page confirms each view that it has drawn; no more than IN_FLIGHT are on their way to it, so that a
slow page shows the newest state and not a queue of old ones.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Any, Final

from pydantic import ValidationError

from zwidth.show.app.frames import pack_frame
from zwidth.show.app.request import BESIDE, REQUEST, Computed, FileRequest
from zwidth.show.app.worker import ANSWER, ComputeLost, ComputeProcess, SparePool

PATIENCE: Final = 1.0  # s after which a computation that a newer request replaces is ended
IN_FLIGHT: Final = 2  # views on their way that the page has not confirmed
LARGEST_FILE: Final = 5_000_000  # characters
MOST_FILES: Final = 20
LARGEST_REQUEST: Final = 1_000_000  # characters of any other message
MOST_CHARACTERS: Final = 2 * LARGEST_FILE + LARGEST_REQUEST  # characters: JSON writes the end of a line as two

Send = Callable[[bytes], Awaitable[None]]


class Lane:
    """One computing process and the requests that wait for it.

    pool      gives processes that are ready to compute
    send      sends a frame to the page
    files     name -> file that the page has sent, which a process must have before it answers
    confirms  whether the page confirms the views that it has drawn
    """

    def __init__(self, pool: SparePool, send: Send, files: dict[str, FileRequest], confirms: bool) -> None:
        self.pool, self.send, self.files = pool, send, files
        self.process: ComputeProcess | None = None
        self._waiting: dict[str, Computed] = {}  # kind of request -> the newest one
        self._sent_files: set[str] = set()  # "NAME:ID" of those that the process has
        self._news = asyncio.Event()  # set where a request may wait
        self._room = asyncio.Semaphore(IN_FLIGHT) if confirms else None  # for views on their way
        self._computing: str | None = None  # kind of request, since the loop's time `_since` [s]
        self._since = 0.0
        self._ended_for: str | None = None  # "replaced" or "stopped": why this lane ended its process
        self._watch: asyncio.Task[None] | None = None  # waits until patience is lost
        self.task = asyncio.ensure_future(self._run())

    def ask(self, request: Computed) -> None:
        """Have a request computed; one of its kind that waits is dropped."""
        self._waiting[request.kind] = request
        self._news.set()
        if self._computing == request.kind and self._watch is None:
            self._watch = asyncio.ensure_future(self._lose_patience(request.kind))

    def confirm(self) -> None:
        """Make room for another view on its way: the page has drawn one."""
        if self._room is not None and self._room._value < IN_FLIGHT:
            self._room.release()

    async def stop(self) -> None:
        """End what is being computed, and drop what waits; the next request finds a fresh process."""
        self._waiting.clear()
        if self._computing is not None:
            self._ended_for = "stopped"
            await self._drop_process()

    async def end(self) -> None:
        """End the lane; its process serves another page, unless it computes."""
        self.task.cancel()
        for task in (self.task, self._watch):
            if task is not None:
                task.cancel()
                with suppress(asyncio.CancelledError):
                    await task
        process, self.process = self.process, None
        if process is not None:
            await self.pool.give_back(process)

    async def _lose_patience(self, kind: str) -> None:
        """End the process once it has computed for PATIENCE, if a newer request of this kind waits then."""
        loop = asyncio.get_running_loop()
        while (left := self._since + PATIENCE - loop.time()) > 0.0:
            await asyncio.sleep(left)  # meanwhile the next computation may have begun, and has its own time
        self._watch = None
        if self._computing == kind and kind in self._waiting:
            self._ended_for = "replaced"
            await self._drop_process()

    async def _drop_process(self) -> None:
        """End the process; the next request takes another."""
        process, self.process = self.process, None
        if process is not None:
            await process.end()

    async def _run(self) -> None:
        """Compute what waits, one request after another; a view once fewer than IN_FLIGHT are on their way."""
        while True:
            await self._news.wait()
            if not self._waiting:
                self._news.clear()
                continue
            kind = next(iter(self._waiting))
            if kind == "view" and self._room is not None:
                await self._room.acquire()
            request = self._waiting.pop(kind, None)
            if request is None:  # dropped meanwhile
                if kind == "view" and self._room is not None:
                    self._room.release()
                continue
            answered = await self._compute(request)
            # of a view that was sent the page makes room, by `confirm`
            if kind == "view" and self._room is not None and not answered:
                self._room.release()

    async def _compute(self, request: Computed) -> bool:
        """Have a request computed and send its answer. Returns whether that was sent; a failure does not count."""
        try:
            if self.process is None:
                self.process, self._sent_files = await self.pool.take(), set()
            await self.process.ready()  # one that still starts is not ended for a newer request
            await self._send_files()
            self._computing, self._since = request.kind, asyncio.get_running_loop().time()
            async for kind, frame in self.process.ask(request):
                await self.send(frame)
                if kind == ANSWER:
                    return True
        except ComputeLost as error:
            await self._drop_process()
            reason, self._ended_for = self._ended_for, None
            if reason == "replaced":
                return False
            sentence = "stopped" if reason else f"{error}; perhaps it ran out of memory. Change the request"
            await self.send(failure(request.id, request.kind, [sentence], "stopped" if reason else "lost"))
        finally:
            self._computing = None
        return False

    async def _send_files(self) -> None:
        """Give the process those of the page's files that it does not have."""
        assert self.process is not None
        for name, file in self.files.items():
            mark = f"{name}:{file.id}"
            if mark not in self._sent_files:
                async for _ in self.process.ask(file):
                    pass
                self._sent_files.add(mark)


class Connection:
    """What one page has asked and been told; `receive` takes its messages one after another."""

    def __init__(self, pool: SparePool, send: Send, received: dict[str, Any]) -> None:
        """Start both lanes.

        received  is given the state that the page shows, under the key `state`
        """
        self.send, self._lock, self.received = send, asyncio.Lock(), received
        self.files: dict[str, FileRequest] = {}
        self.view = Lane(pool, self._send, self.files, confirms=True)
        self.beside = Lane(pool, self._send, self.files, confirms=False)

    async def receive(self, message: str) -> None:
        """Take one message; what is wrong with it is answered in a sentence."""
        try:
            if len(message) > MOST_CHARACTERS:
                raise ValueError(f"a message may have {LARGEST_FILE:,} characters at most")
            content = json.loads(message, parse_constant=_check_constant)
            if not isinstance(content, dict):
                raise ValueError("a message is a JSON object")
            if content.get("kind") == "shown":
                self.view.confirm()
                return
            if content.get("kind") == "stop":
                await self.view.stop()
                await self.beside.stop()
                return
            request = REQUEST.validate_python(content)
            if not isinstance(request, FileRequest) and len(message) > LARGEST_REQUEST:
                raise ValueError(f"a request may have {LARGEST_REQUEST:,} characters at most")
        except ValidationError as error:
            await self._refuse(message, [_fault_sentence(one) for one in error.errors()[:5]])
            return
        except RecursionError:
            await self._refuse(message, ["the message is nested too deeply"])
            return
        except ValueError as error:
            await self._refuse(message, [str(error)])
            return
        if isinstance(request, FileRequest):
            await self._take_file(request)
        else:
            if request.kind == "view":
                self.received["state"] = request.state
            (self.beside if request.kind in BESIDE else self.view).ask(request)

    async def end(self) -> None:
        """End the page's processes."""
        await asyncio.gather(self.view.end(), self.beside.end())

    async def _take_file(self, request: FileRequest) -> None:
        """Keep a file that the page has sent, and confirm it; refuse one too many, too long or of another kind."""
        sentence = ""
        if len(request.text) > LARGEST_FILE:
            sentence = f"{request.name} has {len(request.text):,} characters; at most {LARGEST_FILE:,} are read"
        elif len(self.files) >= MOST_FILES and request.name not in self.files:
            sentence = f"{MOST_FILES} files are open already; reload the page to close them"
        elif not request.name.lower().endswith((".toml", ".csv", ".txt")) or request.name in (".", ".."):
            sentence = f"{request.name} is neither a device file (.toml) nor measurements (.csv)"
        if sentence:
            await self._send(failure(request.id, "file", [sentence], "bad input"))
            return
        self.files[request.name] = request
        await self._send(pack_frame({"id": request.id, "kind": "file", "ok": True, "name": request.name}, {}))

    async def _refuse(self, message: str, sentences: list[str]) -> None:
        """Answer a message that is not computed with its faults, under its id and kind where they can be read."""
        number, kind = 0, "request"
        with suppress(ValueError, RecursionError, AttributeError):
            content = json.loads(message[:LARGEST_REQUEST])
            number, kind = int(content.get("id", 0)), str(content.get("kind", kind))[:20]
        await self._send(failure(number, kind, sentences, "bad input"))

    async def _send(self, frame: bytes) -> None:
        """Send a frame; both lanes do, one after the other."""
        async with self._lock:
            await self.send(frame)


def failure(number: int, kind: str, sentences: list[str], status: str) -> bytes:
    """The frame of a request that was not computed.

    number     the id of the request;   kind  its kind
    sentences  why;   status  "bad input", "stopped" or "lost"
    """
    return pack_frame({"id": number, "kind": kind, "ok": False, "status": status, "sentences": sentences}, {})


def _check_constant(name: str) -> Any:
    """Raise ValueError for NaN or an infinity, which the JSON parser passes on."""
    raise ValueError(f"numbers must be finite, got {name}")


def _fault_sentence(fault: Any) -> str:
    """A fault of a request that pydantic found, as one sentence with the path of the key."""
    place = ".".join(str(step) for step in fault["loc"][1:] if not str(step).startswith("function"))
    return f"{place or 'the request'}: {fault['msg'][:1].lower()}{fault['msg'][1:]}"
