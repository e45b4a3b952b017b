"""A process that computes for one page, and the server's hold on it.

A computation cannot be stopped from within the process that runs it, compiled code least of all. So each page has
processes of its own: what is no longer wanted is ended with its process, and a spare one, which has loaded
everything already, takes over. A process that has answered all becomes a spare one when its page is closed; of the
page nothing is left in it.
"""

from __future__ import annotations

import asyncio
import json
import os
import pickle
import shutil
import sys
import tempfile
from collections.abc import AsyncIterator
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO, Final

START: Final = (
    "import sys, json; sys.path[:] = json.loads(sys.argv[1]); "
    "from zwidth.show.app.worker import compute_answers; compute_answers()"
)
LENGTH: Final = 8  # bytes of the number that a message's length is
MOST_SPARES: Final = 2  # as many as one page has; each more would hold 150 MB for pages that may never open
# Kinds of messages from a process.
READY, PROGRESS, ANSWER = b"r", b"p", b"a"


class ComputeLost(Exception):
    """The process has ended before it answered."""


class ComputeProcess:
    """One process, from its start to its end. Messages go through pipes; it has a folder of its own."""

    def __init__(self) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="zwidth-app-"))
        self.process: asyncio.subprocess.Process | None = None
        self._ready: asyncio.Task[None] | None = None  # waits for the message that it has started, or forgotten
        self._answering = False

    async def start(self) -> None:
        """Start it; it then loads what every answer needs, which takes a second."""
        from zwidth.study.jobs.workers import THREADS

        environment = {**os.environ, **dict.fromkeys(THREADS, "1")}
        self.process = await asyncio.create_subprocess_exec(
            sys.executable,
            "-c",
            START,
            json.dumps(sys.path),
            str(self.folder),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            env=environment,
            start_new_session=True,  # ctrl-C is for the server, which ends its processes
        )
        self._ready = asyncio.ensure_future(self._until_ready())

    async def _until_ready(self) -> None:
        """Wait for the message that it has started. Raises ComputeLost."""
        kind, _ = await self._read()
        if kind != READY:
            raise ComputeLost("a process could not be started")

    async def ready(self) -> None:
        """Wait until it has started. Raises ComputeLost, also where it was ended meanwhile."""
        assert self._ready is not None
        await asyncio.wait([self._ready])  # awaiting it would cancel whoever waits when it is cancelled
        if self._ready.cancelled():
            raise ComputeLost("the computing process was ended before it had started")
        self._ready.result()

    @property
    def idle(self) -> bool:
        """Whether it has started, and has answered all that it was asked."""
        started = self._ready is not None and self._ready.done() and not self._ready.cancelled()
        return started and self._ready.exception() is None and not self._answering  # type: ignore[union-attr]

    def renew(self) -> None:
        """Have an idle process forget what it was asked, and the files that it was sent; `ready` waits for it.

        Raises ComputeLost where it has ended
        """
        self._send(b"")
        self._ready = asyncio.ensure_future(self._until_ready())

    async def ask(self, request: Any) -> AsyncIterator[tuple[bytes, bytes]]:
        """Send a request; yields (PROGRESS, frame) any number of times, then (ANSWER, frame) once.

        Raises ComputeLost
        """
        assert self.process is not None
        assert self.process.stdin is not None
        await self.ready()
        self._answering = True
        self._send(pickle.dumps(request))
        try:
            await self.process.stdin.drain()
        except (ConnectionError, RuntimeError) as error:
            raise ComputeLost(str(error)) from None
        while True:
            kind, content = await self._read()
            if kind == ANSWER:
                self._answering = False
            yield kind, content
            if kind == ANSWER:
                return

    def _send(self, data: bytes) -> None:
        """Write one message to the process: its length, then its bytes. Raises ComputeLost."""
        assert self.process is not None
        assert self.process.stdin is not None
        try:
            self.process.stdin.write(len(data).to_bytes(LENGTH, "little") + data)
        except (ConnectionError, RuntimeError) as error:
            raise ComputeLost(str(error)) from None

    async def _read(self) -> tuple[bytes, bytes]:
        """Read one message of the process: READY, PROGRESS or ANSWER, and its content. Raises ComputeLost."""
        assert self.process is not None
        assert self.process.stdout is not None
        try:
            length = int.from_bytes(await self.process.stdout.readexactly(LENGTH), "little")
            content = await self.process.stdout.readexactly(length)
        except (asyncio.IncompleteReadError, ConnectionError):
            code = await self.process.wait()
            raise ComputeLost(f"the computing process ended with code {code}") from None
        return content[:1], content[1:]

    async def end(self) -> None:
        """End it, whatever it does, and remove its folder."""
        if self._ready is not None:
            self._ready.cancel()
            with suppress(asyncio.CancelledError, ComputeLost):
                await self._ready
        if self.process is not None:
            with suppress(ProcessLookupError):
                self.process.kill()
            await self.process.wait()
            # asyncio closes the pipes' transports when both ends are done
            if self.process.stdin is not None:
                self.process.stdin.close()
        shutil.rmtree(self.folder, ignore_errors=True)


class SparePool:
    """Keeps a process ready that has loaded everything, and a few that closed pages have left."""

    def __init__(self) -> None:
        self._spares: list[ComputeProcess] = []
        self._lock = asyncio.Lock()
        self._next: asyncio.Task[None] | None = None  # starts the next spare process
        self._ended = False

    async def prepare(self) -> None:
        """Start a spare process if there is none."""
        async with self._lock:
            if not self._spares:
                spare = ComputeProcess()
                await spare.start()
                self._spares.append(spare)

    async def take(self) -> ComputeProcess:
        """A spare process, the caller's to give back or to end; where it was the last another is started."""
        await self.prepare()
        taken = self._spares.pop(0)
        self._next = asyncio.ensure_future(self.prepare())
        return taken

    async def give_back(self, process: ComputeProcess) -> None:
        """Keep a process for another page where it is idle and there are not MOST_SPARES; else end it."""
        if process.idle and len(self._spares) < MOST_SPARES and not self._ended:
            with suppress(ComputeLost):
                process.renew()
                self._spares.append(process)
                return
        await process.end()

    async def end(self) -> None:
        """End the spare processes, and those that are given back from now on."""
        self._ended = True
        if self._next is not None:
            await self._next
        spares, self._spares = self._spares, []
        for spare in spares:
            await spare.end()


def compute_answers() -> None:
    """Main function of a process: read requests from its input, write progress and answers to its output."""
    import warnings

    received, sent = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints must not mix with the answers
    warnings.filterwarnings("ignore")  # implausible numbers are part of an answer, see `answers`

    def send(kind: bytes, content: bytes = b"") -> None:
        """Write one message to the server: its length, its kind, its content."""
        sent.write((len(content) + 1).to_bytes(LENGTH, "little") + kind + content)
        sent.flush()

    from zwidth.study.jobs.workers import ended_with_its_starter

    try:
        with ended_with_its_starter():
            from zwidth.show.app.answers import PageAnswers

            os.chdir(sys.argv[2])  # a device file's label is its bare name, see `opened`
            folder = Path(sys.argv[2])

            def new_answers() -> PageAnswers:
                return PageAnswers(folder, lambda frame: send(PROGRESS, frame))

            answers = new_answers()
            answers.warm_up()
        send(READY)
        while (length := _request_length(received)) is not None:
            if not length:  # for another page
                _empty_folder(folder)
                answers = new_answers()
                send(READY)
                continue
            request = pickle.loads(received.read(length))
            with ended_with_its_starter():
                frame = answers.answer(request)
            send(ANSWER, frame)
    except (EOFError, BrokenPipeError):
        pass
    os._exit(0)  # the server has ended, or needs no more; nothing to clean up


def _request_length(received: BinaryIO) -> int | None:
    """Read the length [bytes] of the next request and return it; None where no more comes."""
    head = received.read(LENGTH)
    if len(head) < LENGTH:
        return None
    return int.from_bytes(head, "little")


def _empty_folder(folder: Path) -> None:
    """Remove all files of a folder."""
    for file in folder.iterdir():
        file.unlink()
