"""Pages with the renderer: one file with its data, and the page of the server."""

import base64
import gzip
import html
import struct
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from slalom.errors import InvalidInput

_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<link rel="icon" href="data:,">
<title>{title}</title>
<style>body {{ margin: 0 }}</style>
</head>
<body>
<div id="slalom"{live}></div>
{data}<script type="module">{renderer}</script>
</body>
</html>
"""
_POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; connect-src {to}"


@cache
def renderer() -> str:
    """Return the bundled renderer.

    Raises:
        InvalidInput: a bundle that ends its script element.
    """
    text = Path(__file__).with_name("renderer").joinpath("view.js").read_text(encoding="utf-8")
    if "</script" in text.lower():
        raise InvalidInput("renderer: expected a script without an end tag, found one; build it again from web/")
    return text


def block(messages: Iterable[bytes]) -> bytes:
    """Return messages, each after its length, compressed by gzip; equal messages give equal bytes."""
    whole = b"".join(struct.pack("<I", len(message)) + message for message in messages)
    return gzip.compress(whole, compresslevel=9, mtime=0)


def file_page(title: str, messages: Iterable[bytes]) -> str:
    """Return a page that holds its messages and makes no request."""
    data = base64.b64encode(block(messages)).decode()
    held = f'<script type="application/octet-stream" id="slalom-data">{data}</script>\n'
    policy = _POLICY.format(to="'none'")
    return _PAGE.format(policy=policy, title=html.escape(title), live="", data=held, renderer=renderer())


def live_page(title: str) -> str:
    """Return the page of the server, which receives its messages from there."""
    policy = _POLICY.format(to="'self'")
    return _PAGE.format(policy=policy, title=html.escape(title), live=' data-live="1"', data="", renderer=renderer())
