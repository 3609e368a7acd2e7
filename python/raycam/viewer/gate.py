"""Access control of the server, based only on a request's path and headers.

The control protects the images and this machine's disk and CPU from other pages in the same browser and from other
users of the machine. A page of another origin does not have the token, and its Origin header differs. A name that a
foreign DNS server binds to 127.0.0.1 (DNS rebinding) is not allowed in the Host header.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Collection, Sequence
from typing import NamedTuple, Protocol

from .bundle import bundle, style_sheet
from .web.document import filled, source_hash

__all__ = [
    "PROTOCOL",
    "SOCKET",
    "Answer",
    "Headers",
    "answer_to",
    "prepare_page",
    "response_headers",
    "token_of",
]

PROTOCOL = "raycam.view.1"
"""The subprotocol of the WebSocket; its number increases when the messages change."""
SOCKET = "/socket"
LOOPBACK = ("127.0.0.1", "localhost", "[::1]")
HOST = re.compile(r"(\[[0-9a-f:]+\]|[a-z0-9.-]+)(?::\d{1,5})?", re.I)

CLIENT = "client.js"
"""The page's script, which the inline start script runs after it has connected."""


class Headers(Protocol):
    """The headers of a request, with the interface of `websockets`."""

    def get_all(self, name: str) -> Sequence[str]:
        """All values of a header."""


class Answer(NamedTuple):
    """An HTTP response."""

    status: int
    media: str
    text: str


def answer_to(
    path: str,
    headers: Headers,
    accepts: Callable[[str], bool],
    allowed: Collection[str] = (),
    method: str = "GET",
    *,
    forwarded: bool = False,
) -> Answer | None:
    """The response to a request, or None if the WebSocket may open.

    `accepts` checks a token; `allowed` are host names in addition to those of this machine. `forwarded` is True for a
    request from a trusted proxy, whose X-Forwarded-Host then replaces Host.
    """
    hosts = (headers.get_all("X-Forwarded-Host") if forwarded else []) or headers.get_all("Host")
    match = HOST.fullmatch(hosts[0]) if len(hosts) == 1 else None
    if match is None:
        return _refused(403, "Expected exactly one host name in the Host header.")
    if match[1].lower() not in {*LOOPBACK, *(name.lower() for name in allowed)}:
        return _refused(
            403, f"Host {match[1]} is not allowed: start raycam view with --allow-host {match[1]}."
        )
    if method != "GET":
        return _refused(405, "This server only supports GET.")
    if headers.get_all("Upgrade"):
        return _refusal_of_socket(path, headers, hosts[0], accepts)
    pages: dict[str, tuple[str, Callable[[], str]]] = {
        "/": ("text/html", _page),
        f"/{CLIENT}": ("text/javascript", bundle),
    }
    if path not in pages:
        return _refused(404, "Not found.")
    media, text = pages[path]
    return Answer(200, f"{media}; charset=utf-8", text())


def _refusal_of_socket(
    path: str, headers: Headers, host: str, accepts: Callable[[str], bool]
) -> Answer | None:
    """Returns the response that rejects an upgrade to a WebSocket; None if it is accepted."""
    if path != SOCKET:
        return _refused(404, "Not found.")
    origins = headers.get_all("Origin")
    if origins not in ([f"http://{host}"], [f"https://{host}"]):
        return _refused(
            403,
            f"The page's origin {', '.join(origins) or '(none)'} does not match the host {host}. A proxy must pass the "
            "Host header on, or name the public host in X-Forwarded-Host (raycam view --proxy ADDRESS).",
        )
    offered = _protocols(headers)
    token = token_of(headers)
    if not token or not accepts(token):
        return _refused(401, "The token is missing or wrong: open the address that raycam printed.")
    if PROTOCOL not in offered:
        return _refused(400, f"This server requires the protocol {PROTOCOL}: reload the page.")
    return None


def token_of(headers: Headers) -> str:
    """The token of a request that opens a WebSocket.

    The result is empty unless the request has exactly one token.
    """
    tokens = [word.removeprefix("token.") for word in _protocols(headers) if word.startswith("token.")]
    return tokens[0] if len(tokens) == 1 else ""


def _protocols(headers: Headers) -> list[str]:
    return [word.strip() for line in headers.get_all("Sec-WebSocket-Protocol") for word in line.split(",")]


def _refused(status: int, text: str) -> Answer:
    return Answer(status, "text/plain; charset=utf-8", f"{text}\n")


@functools.cache
def response_headers() -> dict[str, str]:
    """Returns the headers of every answer.

    The policy allows the page's own inline start script and style.
    """
    script, style = source_hash(bundle("start.js")), source_hash(style_sheet())
    return {
        "Content-Security-Policy": f"default-src 'none'; script-src 'self' '{script}'; style-src '{style}'; "
        "img-src 'self' blob: data:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
        "X-Content-Type-Options": "nosniff",
        "Referrer-Policy": "no-referrer",
        "Cache-Control": "no-store",
        "Cross-Origin-Opener-Policy": "same-origin",
        "Cross-Origin-Resource-Policy": "same-origin",
    }


def prepare_page() -> None:
    """Assembles the page and its script, so that the first request does not wait for them."""
    response_headers()
    _page()
    bundle()


@functools.cache
def _page() -> str:
    """The page of the live view."""
    return filled(
        {
            "head": f'<link rel="preload" href="{CLIENT}" as="script">\n'
            # The browser lays out the page only once, when its last element is complete.
            '<link rel="expect" href="#explained" blocking="render">\n'
            f"<script>{bundle('start.js')}</script>",
            "title": "raycam",
            "style": f"<style>{style_sheet()}</style>",
            "data": "",
            "script": "",
        }
    )
