"""The server of the workbench: the page's files, one socket, and who may use them.

It listens on this computer alone unless told otherwise, and then wants a token. Requests that name another host,
as those of a page that had its own name resolved to this computer, and sockets opened by other pages are refused.
No path of a request ever reaches the file system: what can be fetched is a fixed list.
"""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from importlib.resources import files
from typing import Any, Final
from urllib.parse import urlsplit

from fastapi import FastAPI, Request, Response, WebSocket, WebSocketDisconnect
from fastapi.requests import HTTPConnection
from fastapi.responses import JSONResponse, PlainTextResponse

from zwidth.show.app.connection import LARGEST_FILE, LARGEST_REQUEST, Connection
from zwidth.show.app.worker import SparePool

LOOPBACK: Final = ("127.0.0.1", "localhost", "[::1]", "::1")
MOST_PAGES: Final = 12  # open at once, each with processes of its own
LARGEST_MESSAGE: Final = 4 * (LARGEST_FILE + LARGEST_REQUEST)  # bytes; a character may take four
TYPES: Final = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".wasm": "application/wasm",
    ".svg": "image/svg+xml",
    ".ino": "text/plain; charset=utf-8",
    ".json": "application/json",
    ".csv": "text/csv; charset=utf-8",
    ".txt": "text/plain; charset=utf-8",
}
POLICY: Final = (
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self' {socket}; worker-src 'self'; media-src 'self' blob:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors {ancestors}"
)
# A report is a page that was made from a device's file: nothing in it may run, or reach the workbench.
REPORT_POLICY: Final = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; sandbox"
LARGEST_REPORT: Final = 20_000_000  # bytes
MOST_REPORTS: Final = 4  # kept to be opened; the oldest goes


@dataclass(frozen=True)
class Settings:
    """What the server was told.

    host, port  it listens on
    token       that a page must bring; "" on this computer alone
    start       what a page opens first: `state` and `files`, as `start_of` returns them
    framed      whether notebooks on this computer may show the page in a frame
    """

    host: str = "127.0.0.1"
    port: int = 0
    token: str = ""
    start: dict[str, Any] = field(default_factory=dict)
    framed: bool = False

    @property
    def local(self) -> bool:
        """Whether nobody but this computer can connect."""
        return self.host in LOOPBACK

    def knows_host(self, host: str) -> bool:
        """Whether a request's Host header names this server. Any name will do where a token is wanted."""
        if self.token and not self.local:
            return True
        name = urlsplit(f"//{host}").hostname or ""
        return name in LOOPBACK

    def admits(self, token: str | None) -> bool:
        """Whether a request brings the token; true of any where none is wanted."""
        return not self.token or secrets.compare_digest((token or "").encode(), self.token.encode())


def page_files() -> dict[str, bytes]:
    """Everything that a page can fetch: its name, and its contents. The tour goes through bundled devices, and its
    words lie with them."""
    folder, tour = files("zwidth.show.app") / "page", files("zwidth.device") / "zoo" / "tour.json"
    return {
        entry.name: entry.read_bytes()
        for entry in (*folder.iterdir(), tour)
        if entry.is_file() and entry.name.endswith(tuple(TYPES))
    }


def make_app(settings: Settings) -> FastAPI:
    """The server's application; its processes live as long as it runs."""
    pool = SparePool()
    contents = page_files()
    open_pages: set[Connection] = set()
    received: dict[str, Any] = {}

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        """Make processes ready when the server starts; end them and the pages when it ends."""
        app.state.received = received
        preparing = asyncio.ensure_future(pool.prepare())
        yield
        await preparing  # it takes a moment; a start that is cancelled half-way may never end
        await asyncio.gather(*(page.end() for page in open_pages), pool.end())

    app = FastAPI(lifespan=lifespan, docs_url=None, redoc_url=None, openapi_url=None)

    _add_checks(app, settings)
    _add_page(app, settings, contents)
    _add_reports(app, settings)
    _add_files(app, contents)
    _add_socket(app, settings, pool, open_pages, received)
    return app


def _add_checks(app: FastAPI, settings: Settings) -> None:
    """Add to every request the check of the host and of the page that it comes from, and to every answer the
    headers that restrict what a page may do."""

    @app.middleware("http")
    async def guard(request: Request, following: Any) -> Response:
        """Refuse a request for another host, or from another page; restrict the page in the headers of the
        answer."""
        host = request.headers.get("host", "")
        if not settings.knows_host(host):
            return PlainTextResponse("this workbench answers to 127.0.0.1 and localhost only\n", 403)
        site = request.headers.get("sec-fetch-site", "none")
        if site not in ("none", "same-origin") and request.url.path != "/":
            return PlainTextResponse("other pages may not use this workbench\n", 403)
        answer: Response = await following(request)
        socket = f"ws://{host} wss://{host}"
        ancestors = "'self' http://127.0.0.1:* http://localhost:*" if settings.framed else "'none'"
        answer.headers.setdefault("Content-Security-Policy", POLICY.format(socket=socket, ancestors=ancestors))
        answer.headers.update(
            {
                "X-Content-Type-Options": "nosniff",
                "Referrer-Policy": "no-referrer",
                "Cross-Origin-Resource-Policy": "same-origin",
                "Cache-Control": "no-cache",
            }
        )
        return answer


def _add_page(app: FastAPI, settings: Settings, contents: dict[str, bytes]) -> None:
    """Add the address of the page, and that of what it opens first; both want the token.

    contents  name -> contents of each file that a page can fetch
    """

    @app.get("/")
    async def page(token: str | None = None) -> Response:
        if not settings.admits(token):
            return PlainTextResponse("this address needs the token that `zwidth app` printed: /?token=...\n", 403)
        return Response(contents["index.html"], media_type=TYPES[".html"])

    @app.get("/start")
    async def start(token: str | None = None) -> Response:
        if not settings.admits(token):
            return PlainTextResponse("the token is missing or wrong\n", 403)
        return JSONResponse({**settings.start, "local": settings.local})


def _add_reports(app: FastAPI, settings: Settings) -> None:
    """Add the addresses at which a page leaves a report, and at which the report is opened."""
    reports: dict[str, bytes] = {}

    @app.post("/reports")
    async def keep_report(request: Request, token: str | None = None) -> Response:
        """Keep a report that the page sends, and answer with the name that it is opened by."""
        if not _from_own_page(request, settings, token):
            return PlainTextResponse("only the workbench's own page may send a report\n", 403)
        content = bytearray()
        async for part in request.stream():
            content += part
            if len(content) > LARGEST_REPORT:
                return PlainTextResponse(f"a report has {LARGEST_REPORT} bytes at most\n", 413)
        name = secrets.token_urlsafe(16)
        reports[name] = bytes(content)
        while len(reports) > MOST_REPORTS:
            del reports[next(iter(reports))]
        return PlainTextResponse(name)

    @app.get("/reports/{name}")
    async def report(name: str) -> Response:
        if name not in reports:
            return PlainTextResponse("this report is no longer kept; open it once more from the workbench\n", 404)
        headers = {"Content-Security-Policy": REPORT_POLICY}
        return Response(reports[name], media_type=TYPES[".html"], headers=headers)


def _add_files(app: FastAPI, contents: dict[str, bytes]) -> None:
    """Add the addresses of the files that a page can fetch: name -> contents."""

    @app.get("/{name}")
    async def file(name: str) -> Response:
        if name not in contents:
            return PlainTextResponse("there is no such file\n", 404)
        ending = name[name.rindex(".") :]
        return Response(contents[name], media_type=TYPES[ending])


def _add_socket(
    app: FastAPI, settings: Settings, pool: SparePool, open_pages: set[Connection], received: dict[str, Any]
) -> None:
    """Add the socket of a page.

    pool        gives the page its processes
    open_pages  the connections that are open; each is in it from its start to its end
    received    takes the state that the page shows, as `state`
    """

    @app.websocket("/socket")
    async def socket(websocket: WebSocket, token: str | None = None) -> None:
        """Serve one page, from its first message until it is gone."""
        if not _from_own_page(websocket, settings, token) or len(open_pages) >= MOST_PAGES:
            await websocket.close(code=1008)  # refused by the server's rules
            return
        await websocket.accept()
        opened = Connection(pool, websocket.send_bytes, received)
        open_pages.add(opened)
        try:
            while True:
                message = await websocket.receive()
                if message["type"] == "websocket.disconnect":
                    break
                await opened.receive(message.get("text") or "")
        except (WebSocketDisconnect, RuntimeError):
            pass  # the page is gone
        finally:
            open_pages.discard(opened)
            await opened.end()


def _from_own_page(asked: HTTPConnection, settings: Settings, token: str | None) -> bool:
    """Whether a socket is opened, or something sent, by this server's own page."""
    host = asked.headers.get("host", "")
    origin = urlsplit(asked.headers.get("origin", ""))
    return settings.knows_host(host) and settings.admits(token) and origin.netloc == host
