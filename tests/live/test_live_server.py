"""The server of the view: what it refuses, what it survives, and how it stops."""

import asyncio
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator

import pytest
from live_views import crossing, first_messages, kinds, serving, socket_address

from slalom import kernels, method
from slalom.live.messages import unpack
from slalom.live.session import Session

pytest.importorskip("starlette", reason="slalom[view] is not installed: the server is not tested")
from slalom.live import server  # after the check of its packages


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """The address of a server."""
    with serving("roundabout_crossing", "--seed", "3") as found:
        yield found


@pytest.mark.slow
def test_the_server_refuses_what_it_must(address: str) -> None:
    import websockets

    url, origin = socket_address(address)
    assert kinds(asyncio.run(first_messages(url, origin)))[:2] == ["scene", "frames"]
    for wrong in (address.partition("?")[0], address[:-4] + "AAAA"):
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(wrong)
    # A page of another name that resolves to this machine is refused by its Host, with a message of its own.
    for host in ("example.org", "localhost.example.org", "127.0.0.1.example.org:80", "localhost:80@example.org"):
        with pytest.raises(urllib.error.HTTPError, match="403") as refused:
            urllib.request.urlopen(urllib.request.Request(address, headers={"Host": host}))
        with refused.value as answer:
            said = answer.read().decode()
        assert said == f"This server expects the host 127.0.0.1 or localhost in its address, found {host!r}."
    elsewhere = ("http://example.org", "null", origin.replace("http", "https"), origin[:-1])
    for wrong_url, wrong_origin in ((url[:-4] + "AAAA", origin), *((url, each) for each in elsewhere)):
        with pytest.raises(websockets.exceptions.InvalidStatus):
            asyncio.run(first_messages(wrong_url, wrong_origin))
    for sent in ("x" * 20000, "x" * 200000, b"{}", b"x" * 200000, "not json", "[1]", '{"do": 3}', "[" * 9000):
        with pytest.raises(websockets.exceptions.ConnectionClosed):
            asyncio.run(first_messages(url, origin, sent, count=1000))


@pytest.mark.slow
def test_a_tunnel_from_another_port_is_accepted(address: str) -> None:
    """The port in the address of the browser then is that of the tunnel, in the host and in the origin."""
    import websockets

    tunnel = "localhost:1"
    with urllib.request.urlopen(urllib.request.Request(address, headers={"Host": tunnel})) as page:
        assert page.status == 200
    url, origin = socket_address(address)
    port, through = int(origin.rpartition(":")[2]), f"ws://{tunnel}/messages?{url.partition('?')[2]}"

    def kind_of_first(of_page: str) -> str:
        (message,) = asyncio.run(first_messages(through, of_page, count=1, host="127.0.0.1", port=port))
        return kinds([message])[0]

    assert kind_of_first(f"http://{tunnel}") == "scene"
    for elsewhere in (origin, "http://localhost:2", "http://127.0.0.1:1"):
        with pytest.raises(websockets.exceptions.InvalidStatus):
            kind_of_first(elsewhere)


@pytest.mark.slow
def test_without_a_display_the_view_states_the_command_of_a_tunnel(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
    command = [sys.executable, "-m", "slalom", "view", "empty", "--port", str(port)]
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    for _ in range(2):  # the port is free again at once
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            assert process.stderr is not None
            address = process.stdout.readline().strip()
            assert f":{port}/" in address
            url, origin = socket_address(address)
            assert kinds(asyncio.run(first_messages(url, origin, count=1))) == ["scene"]
            process.send_signal(signal.SIGINT)
            assert process.wait(20) == 0
            assert f"`ssh -L {port}:localhost:{port} HOST`" in process.stderr.read()


@pytest.mark.slow
def test_a_malformed_command_is_answered_by_a_sentence(address: str) -> None:
    """One that is an object with a name, but not a known or complete command; the connection stays."""
    url, origin = socket_address(address)
    sent = (
        '{"do": "fly"}',
        '{"do": "look", "step": "x"}',
        '{"do": "drag", "what": "robot", "index": 0, "to": [1e999, 0]}',
    )
    found = asyncio.run(first_messages(url, origin, *sent, '{"do": "select", "robot": 0}', count=12))
    errors = [message for message in map(unpack, found) if message[0]["kind"] == "error"]
    assert len(errors) == 3


@pytest.mark.slow
def test_the_server_survives_100_connects_and_disconnects(address: str) -> None:
    import websockets

    url, origin = socket_address(address)

    async def come_and_go() -> None:
        for _ in range(100):
            async with websockets.connect(url, origin=origin):  # type: ignore[arg-type]
                pass

    asyncio.run(come_and_go())
    assert kinds(asyncio.run(first_messages(url, origin)))[0] == "scene"


@pytest.mark.slow
def test_a_client_that_stops_reading_holds_up_no_other(address: str) -> None:
    """It asks for some 30 MB and reads nothing of them."""
    import websockets

    url, origin = socket_address(address)

    async def beside() -> list[bytes]:
        async with websockets.connect(url, origin=origin, max_queue=1, close_timeout=0.2) as deaf:  # type: ignore[arg-type]
            for _ in range(3000):
                await deaf.send('{"do": "yaml"}')
            return await first_messages(url, origin, '{"do": "look", "step": 0, "id": 7}', count=8)

    assert any(unpack(message)[0].get("answers") == 7 for message in asyncio.run(beside()))


def test_a_client_that_takes_no_message_is_disconnected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "SLOWEST", 0.05)

    class Deaf:
        """A connection that accepts no bytes and sends none."""

        async def receive(self) -> None:
            await asyncio.Event().wait()

        async def send_bytes(self, message: bytes) -> None:
            await asyncio.Event().wait()

    session = Session(crossing(), method("nao"))
    with pytest.raises(TimeoutError):
        asyncio.run(asyncio.wait_for(server._serve(Deaf(), session, server.CompilationNotice()), 10.0))  # type: ignore[arg-type]
    assert not session._played.steps[10:]  # nothing is simulated for it


def test_a_new_connection_waits_for_no_run_of_others() -> None:
    """Forty connections, each with a run whose next steps take long."""

    class Client:
        """A connection that accepts all and sends nothing."""

        async def receive(self) -> None:
            await asyncio.Event().wait()

        async def send_bytes(self, message: bytes) -> None:
            pass

    class Slow(Session):
        def more(self, count: int = 5) -> list[bytes]:
            time.sleep(0.0 if count == 1 else 0.3)
            return []

    async def among_many() -> float:
        notice, sessions = server.CompilationNotice(), [Slow(crossing(), method("nao")) for _ in range(40)]
        serving = [asyncio.create_task(server._serve(Client(), one, notice)) for one in sessions]  # type: ignore[arg-type]
        await asyncio.sleep(0.5)
        before = time.monotonic()
        await notice.during(lambda: None, Client())  # type: ignore[arg-type]
        passed = time.monotonic() - before
        for task in serving:
            task.cancel()
        await asyncio.gather(*serving, return_exceptions=True)
        return passed

    assert asyncio.run(among_many()) < 1.0


def test_the_page_tells_that_kernels_compile(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only if they do, and before the session is there; a later compilation is announced again."""
    monkeypatch.setattr(kernels, "when_compiling", [])
    sent: list[bytes] = []

    class Client:
        """A connection that keeps what is sent."""

        async def send_bytes(self, message: bytes) -> None:
            sent.append(message)

    def compiling() -> str:
        while kernels.when_compiling:  # as numba's listener does in this thread
            kernels.when_compiling.pop(0)("compiling")
        deadline = time.monotonic() + 10.0
        while len(sent) == before and time.monotonic() < deadline:
            time.sleep(0.01)
        return "compiled"

    notice = server.CompilationNotice()
    for k in range(2):
        assert asyncio.run(notice.during(lambda: "cached", Client())) == "cached"  # type: ignore[arg-type]
        assert len(sent) == k
        before = len(sent)
        assert asyncio.run(notice.during(compiling, Client())) == "compiled"  # type: ignore[arg-type]
        assert unpack(sent[k])[0] == {"kind": "note", "text": "compiling, up to a minute"}
    notice._tell("compiling")  # after the server has stopped


def test_stale_commands_are_dropped_and_others_kept() -> None:
    async def taken() -> list[dict[str, object]]:
        mailbox = server.Mailbox()
        for command in (
            *({"do": "look", "step": k} for k in range(5)),
            *({"do": "drag", "gesture": 1, "to": [k, 0]} for k in range(5)),
            *({"do": "drag", "gesture": 2, "to": [k, 0]} for k in range(5)),
            {"do": "undo"},
            {"do": "undo"},
        ):
            mailbox.put(command)
        found = []
        while not mailbox.empty():
            found.append(dict(await mailbox.get()))
        return found

    assert asyncio.run(taken()) == [
        {"do": "look", "step": 4},
        {"do": "drag", "gesture": 1, "to": [4, 0]},
        {"do": "drag", "gesture": 2, "to": [4, 0]},
        {"do": "undo"},
        {"do": "undo"},
    ]


@pytest.mark.slow
def test_ctrl_c_stops_the_server_within_seconds_while_clients_are_connected() -> None:
    import websockets

    async def connected(address: str) -> None:
        url, origin = socket_address(address)
        async with websockets.connect(url, origin=origin, close_timeout=0.2) as client:  # type: ignore[arg-type]
            await client.recv()
            async with websockets.connect(url, origin=origin, max_queue=1, close_timeout=0.2) as deaf:  # type: ignore[arg-type]
                for _ in range(300):
                    await deaf.send('{"do": "yaml"}')
                process.send_signal(signal.SIGINT)
                before = time.monotonic()
                assert await asyncio.to_thread(process.wait, 20) == 0
                assert time.monotonic() - before < 10.0

    command = [sys.executable, "-m", "slalom", "view", "empty", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        asyncio.run(connected(process.stdout.readline().strip()))
        assert "Traceback" not in process.stderr.read()
