"""A process that computes for one page, and the server's hold on it.

A computation cannot be stopped from within the process that runs it, compiled code least of all. So each page has
processes of its own: what is no longer wanted is ended with its process, and a spare one, which has loaded
everything already, takes over.
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
from typing import Any, Final

START: Final = (
    "import sys, json; sys.path[:] = json.loads(sys.argv[1]); from zwidth.show.app.worker import work; work()"
)
LENGTH: Final = 8  # bytes of the number that a message's length is
# Kinds of messages from a process.
READY, PROGRESS, ANSWER = b"r", b"p", b"a"


class ComputeLost(Exception):
    """The process has ended before it answered."""


class ComputeProcess:
    """One process, from its start to its end. Messages go through pipes; it has a folder of its own."""

    def __init__(self) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="zwidth-app-"))
        self.process: asyncio.subprocess.Process | None = None
        self._ready: asyncio.Task[None] | None = None

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

    async def ask(self, request: Any) -> AsyncIterator[tuple[bytes, bytes]]:
        """Send a request; yields (PROGRESS, frame) any number of times, then (ANSWER, frame) once.

        Raises ComputeLost
        """
        assert self.process is not None
        assert self.process.stdin is not None
        await self.ready()
        data = pickle.dumps(request)
        try:
            self.process.stdin.write(len(data).to_bytes(LENGTH, "little") + data)
            await self.process.stdin.drain()
        except (ConnectionError, RuntimeError) as error:
            raise ComputeLost(str(error)) from None
        while True:
            kind, content = await self._read()
            yield kind, content
            if kind == ANSWER:
                return

    async def _read(self) -> tuple[bytes, bytes]:
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
    """Keeps one process ready that has loaded everything."""

    def __init__(self) -> None:
        self._spare: ComputeProcess | None = None
        self._lock = asyncio.Lock()
        self._next: asyncio.Task[None] | None = None

    async def prepare(self) -> None:
        """Start a spare process if there is none."""
        async with self._lock:
            if self._spare is None:
                spare = ComputeProcess()
                await spare.start()
                self._spare = spare

    async def take(self) -> ComputeProcess:
        """The spare process, which is the caller's to end; another is started."""
        await self.prepare()
        taken, self._spare = self._spare, None
        assert taken is not None
        self._next = asyncio.ensure_future(self.prepare())
        return taken

    async def end(self) -> None:
        """End the spare process."""
        if self._next is not None:
            await self._next
        if self._spare is not None:
            await self._spare.end()
            self._spare = None


def work() -> None:
    """Main function of a process: read requests from its input, write progress and answers to its output."""
    import warnings

    received, sent = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints must not mix with the answers
    warnings.filterwarnings("ignore")  # implausible numbers are part of an answer, see `answers`

    def send(kind: bytes, content: bytes = b"") -> None:
        sent.write((len(content) + 1).to_bytes(LENGTH, "little") + kind + content)
        sent.flush()

    from zwidth.study.jobs.workers import ended_with_its_starter

    try:
        with ended_with_its_starter():
            from zwidth.show.app.answers import Answers

            os.chdir(sys.argv[2])  # a device file's label is its bare name, see `opened`
            answers = Answers(Path(sys.argv[2]), lambda frame: send(PROGRESS, frame))
            answers.warm_up()
        send(READY)
        while True:
            head = received.read(LENGTH)
            if len(head) < LENGTH:
                break
            request = pickle.loads(received.read(int.from_bytes(head, "little")))
            with ended_with_its_starter():
                frame = answers.answer(request)
            send(ANSWER, frame)
    except (EOFError, BrokenPipeError):
        pass
    os._exit(0)  # the server has ended, or needs no more; nothing to clean up
