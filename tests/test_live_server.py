"""The server of the view: what it refuses, what it survives, and how it stops."""

import asyncio
import urllib.error
import urllib.request
from collections.abc import Iterator

import pytest
from live_views import first_messages, kinds, serving, socket_address


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
    with pytest.raises(urllib.error.HTTPError, match="403"):
        urllib.request.urlopen(address[:-4] + "AAAA")
    for wrong_url, wrong_origin in ((url[:-4] + "AAAA", origin), (url, "http://example.org")):
        with pytest.raises(websockets.exceptions.InvalidStatus):
            asyncio.run(first_messages(wrong_url, wrong_origin))
    for sent in ("x" * 20000, "x" * 200000, "not json", "[1]", '{"do": 3}', "[" * 9000):
        with pytest.raises(websockets.exceptions.ConnectionClosed):
            asyncio.run(first_messages(url, origin, sent, count=1000))


@pytest.mark.slow
def test_the_server_survives_clients_that_come_and_go(address: str) -> None:
    import websockets

    url, origin = socket_address(address)

    async def come_and_go() -> None:
        for _ in range(100):
            async with websockets.connect(url, origin=origin):  # type: ignore[arg-type]
                pass
        # One that stops reading does not hold up another.
        async with websockets.connect(url, origin=origin, max_queue=1):  # type: ignore[arg-type]
            await first_messages(url, origin)

    asyncio.run(come_and_go())
    assert kinds(asyncio.run(first_messages(url, origin)))[0] == "scene"
