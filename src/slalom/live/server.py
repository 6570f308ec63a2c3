"""The local server of `slalom view`: one page and one connection for messages, for this machine alone."""

import asyncio
import contextlib
import hmac
import json
import os
import re
import secrets
import socket
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Final, TypeVar

from starlette.applications import Starlette
from starlette.requests import HTTPConnection, Request
from starlette.responses import HTMLResponse, PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from slalom import kernels
from slalom.base.checks import whole
from slalom.base.errors import InvalidInput, reason
from slalom.live.messages import live_page, pack
from slalom.live.session import Session

T = TypeVar("T")

HOST: Final = "127.0.0.1"
OWN_HOST: Final = re.compile(r"(127\.0\.0\.1|localhost)(:\d{1,5})?")
"""Host headers that are accepted, with any port: that of a tunnel may differ. Names of other machines are refused, so
that no page can reach the server by a name that its own server resolves to this machine (DNS rebinding)."""
LAST_PORT: Final = 65535
LARGEST: Final = 1 << 20
"""[byte] Largest command that is accepted: one that restores a scene holds its file."""
SLOWEST: Final = 10.0
"""[s] A client that takes no message for this long is disconnected."""
QUIET: Final = 0.15
"""[s] After a drag the run goes on only if no other command follows for this long, so that drags are not held up."""
BACKGROUND: Final = ThreadPoolExecutor(2, "slalom-runs")
"""Threads that make further steps of runs. Openings and answers have others, so that none waits behind many runs."""
REFUSED, TOO_LARGE = 1008, 1009
COMPILING: Final = "compiling, up to a minute"
"""Text of the page while kernels compile, until the first frame is shown."""


class Mailbox:
    """Commands that wait: of drags and looks only the latest, since an older one is stale."""

    def __init__(self) -> None:
        self._waiting: list[Mapping[str, Any]] = []
        self._arrived = asyncio.Event()

    def put(self, command: Mapping[str, Any]) -> None:
        """Add a command. It replaces one at the end that it makes stale."""
        if self._waiting and _replaces(command, self._waiting[-1]):
            self._waiting.pop()
        self._waiting.append(command)
        self._arrived.set()

    def empty(self) -> bool:
        """Whether no command waits."""
        return not self._waiting

    async def wait(self, seconds: float) -> bool:
        """Wait for a command for some seconds; return whether there is one."""
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(self._arrived.wait(), seconds)
        return not self.empty()

    async def get(self) -> Mapping[str, Any]:
        """Wait for a command, and return the oldest."""
        await self._arrived.wait()
        command = self._waiting.pop(0)
        if not self._waiting:
            self._arrived.clear()
        return command


class CompilationNotice:
    """Tells connections that wait for a session when kernels begin to compile."""

    def __init__(self) -> None:
        self._waiting: set[asyncio.Event] = set()
        self._loop: asyncio.AbstractEventLoop | None = None

    def _tell(self, _: str) -> None:
        """Wake all connections that wait; called in the thread that compiles."""
        assert self._loop is not None
        with contextlib.suppress(RuntimeError):  # the loop is closed: the server has stopped
            for begun in list(self._waiting):
                self._loop.call_soon_threadsafe(begun.set)

    async def during(self, work: Callable[[], T], websocket: WebSocket) -> T:
        """Return the result of work in another thread; send the notice if kernels compile meanwhile."""
        self._loop, begun = asyncio.get_running_loop(), asyncio.Event()
        if self._tell not in kernels.when_compiling:
            kernels.when_compiling.append(self._tell)
        self._waiting.add(begun)
        making, told = asyncio.create_task(asyncio.to_thread(work)), asyncio.create_task(begun.wait())
        try:
            await asyncio.wait({making, told}, return_when=asyncio.FIRST_COMPLETED)
            if not making.done():
                await _send(websocket, [pack("note", {"text": COMPILING}, {})])
            return await making
        finally:
            self._waiting.discard(begun)
            told.cancel()


def _replaces(new: Mapping[str, Any], old: Mapping[str, Any]) -> bool:
    """Whether a command makes an older one stale: looks, and drags of one gesture."""
    if new.get("do") != old.get("do"):
        return False
    return new["do"] == "look" or (new["do"] == "drag" and new.get("gesture") == old.get("gesture"))


def application(
    begin: Callable[[], Session], title: str, token: str, beside: Callable[[], Session] | None = None
) -> Starlette:
    """Return the application that serves a scenario; each connection begins a session of its own.

    With `beside`, the page shows a second one beside it: that of connections with `run=1` in their address.
    """

    notice = CompilationNotice()

    def refusal(connection: HTTPConnection) -> str:
        """Return the sentence with which a connection is refused, "" for one that is accepted."""
        host = connection.headers.get("host", "")
        if not OWN_HOST.fullmatch(host):
            return f"This server expects the host {HOST} or localhost in its address, found {host!r}."
        given = connection.query_params.get("token", "")
        if not hmac.compare_digest(given.encode(), token.encode()):
            return "This address needs the token that `slalom view` printed."
        return ""

    async def page(request: Request) -> Response:
        refused = refusal(request)
        if refused:
            return PlainTextResponse(refused, status_code=403)
        return HTMLResponse(
            live_page(title, 1 if beside is None else 2),
            headers={"Referrer-Policy": "no-referrer", "Cache-Control": "no-store"},
        )

    async def messages(websocket: WebSocket) -> None:
        # A page of another address has another origin than the host that it connects to.
        if refusal(websocket) or websocket.headers.get("origin") != f"http://{websocket.headers.get('host')}":
            await websocket.close(REFUSED)
            return
        await websocket.accept()
        with contextlib.suppress(WebSocketDisconnect, TimeoutError):
            second = beside is not None and websocket.query_params.get("run") == "1"
            try:
                session = await notice.during(beside if second and beside is not None else begin, websocket)
                await _serve(websocket, session, notice)
            except InvalidInput as error:
                await _send(websocket, [pack("error", {"text": str(error)}, {})])

    return Starlette(routes=[Route("/", page), WebSocketRoute("/messages", messages)])


async def _serve(websocket: WebSocket, session: Session, notice: CompilationNotice) -> None:
    """Read and answer commands until the client leaves."""
    mailbox = Mailbox()
    reading = asyncio.create_task(_read(websocket, mailbox))
    answering = asyncio.create_task(_answer(websocket, session, mailbox, notice))
    done, pending = await asyncio.wait({reading, answering}, return_when=asyncio.FIRST_COMPLETED)
    for task in pending:
        task.cancel()
    await asyncio.gather(*pending, return_exceptions=True)
    for task in done:
        task.result()


async def _read(websocket: WebSocket, mailbox: Mailbox) -> None:
    while True:
        received = await websocket.receive()
        if received["type"] == "websocket.disconnect":
            return
        text = received.get("text")
        if text is None or len(text) > LARGEST:
            await websocket.close(TOO_LARGE if text else REFUSED)
            return
        try:
            command = json.loads(text)
        except (ValueError, RecursionError):
            command = None
        if not isinstance(command, dict) or not isinstance(command.get("do"), str):
            await websocket.close(REFUSED)
            return
        mailbox.put(command)


async def _answer(websocket: WebSocket, session: Session, mailbox: Mailbox, notice: CompilationNotice) -> None:
    """Send the opening, then the answers, and between them further steps of the run."""
    await _send(websocket, await notice.during(session.opening, websocket))
    quiet, owed = 0.0, False
    while True:
        # A large fleet goes on between two control spaces, each of which takes as long as some steps.
        if not session.complete and (owed or not await mailbox.wait(quiet)):
            quiet, owed = 0.0, False
            await _send(websocket, await asyncio.get_running_loop().run_in_executor(BACKGROUND, session.more))
            continue
        command = await mailbox.get()
        quiet, owed = QUIET if command["do"] == "drag" else 0.0, command["do"] == "look"
        try:
            answer = await asyncio.to_thread(session.answer, command)
        except InvalidInput as error:
            answer = [pack("error", {"text": str(error)}, {})]
        await _send(websocket, answer)


async def _send(websocket: WebSocket, messages: list[bytes]) -> None:
    for message in messages:
        await asyncio.wait_for(websocket.send_bytes(message), SLOWEST)


class Server:
    """A server on a port of this machine.

    Args:
        port: 0 for any free one. beside: begins the session of a second scenario, which is shown beside the first one.

    Attributes:
        address: with the token, for the browser. token, port: of it.

    Raises:
        InvalidInput: not a port, or one that is not free.
    """

    def __init__(
        self, begin: Callable[[], Session], title: str, port: int = 0, beside: Callable[[], Session] | None = None
    ) -> None:
        if whole(port, "--port") > LAST_PORT:
            raise InvalidInput(f"--port: expected 0 to {LAST_PORT}, found {port}")
        self.token = secrets.token_urlsafe(24)
        # asyncio sends without delay (TCP_NODELAY) only on sockets that name their protocol; a drag waits 40 ms else.
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP)
        if os.name == "posix":
            # Without this option a port is refused for a minute after its last server has stopped.
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            self._socket.bind((HOST, port))
            self._socket.listen()
        except OSError as error:
            self._socket.close()
            raise InvalidInput(
                f"--port: expected a free port, or 0 for any; found {port}: {reason(error).lower()}"
            ) from None
        self.port = int(self._socket.getsockname()[1])
        self.address = f"http://{HOST}:{self.port}/?token={self.token}"
        self._application = application(begin, title, self.token, beside)
        self._serving: Any = None
        self._stopped = False

    def stop(self) -> None:
        """Stop serving, from another thread; a server that does not serve yet stops at once."""
        self._stopped = True
        if self._serving is not None:
            self._serving.should_exit = True

    def run(self, started: Callable[[], None] | None = None) -> None:
        """Serve until Ctrl-C (or SIGTERM); call `started` once connections are accepted."""
        import uvicorn

        config = uvicorn.Config(
            self._application,
            log_level="warning",
            ws="websockets-sansio",
            ws_max_size=2 * LARGEST,
            ws_max_queue=8,
            ws_per_message_deflate=False,
            timeout_graceful_shutdown=1,
            lifespan="off",
        )
        server = self._serving = uvicorn.Server(config)
        server.should_exit = self._stopped

        async def serve() -> None:
            serving = asyncio.create_task(server.serve(sockets=[self._socket]))
            while not server.started and not serving.done():
                await asyncio.sleep(0.01)
            if started and server.started:
                started()
            await serving

        with contextlib.suppress(KeyboardInterrupt):
            asyncio.run(serve())
        self._socket.close()
