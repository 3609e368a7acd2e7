"""The server: one port for the page and the WebSocket, in its own thread.

Client messages never open files: pages come from memory, and snapshots are sent to the browser as bytes.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import socket
import threading
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from http import HTTPStatus
from typing import Any

from .._core import Cancel
from ..arguments import whole
from ..errors import Error, NetworkError
from . import gate
from .answers import SLOW, Answers
from .client_messages import Follow, Hello, Hold, Probe, Size
from .messages import MAX_MESSAGE_BYTES, BadMessage, packed, parse_message
from .probe_limit import ProbeLimit
from .scheduler import Scheduler
from .session import MOST_FOLLOWERS, MOST_FREE, Following, Session
from .tokens import Tokens

__all__ = ["MOST_CONNECTIONS", "MOST_SESSIONS", "PORTS", "Server"]

PORTS = range(7421, 7431)
"""The ports that are tried if no port is given."""
MOST_SESSIONS = MOST_FREE
MOST_CONNECTIONS = 32
CONNECTIONS_OF_FOLLOWERS = 96
"""Number of additional connections if clients can follow, so that `MOST_FOLLOWERS` pages can open at once."""
HANDSHAKE_TIME = 5.0  # seconds for the handshake
KEPT = 600.0  # seconds for which a session waits for its client to reconnect
QUEUED_IN = 8
QUEUED_OUT = 64
WILDCARDS = ("0.0.0.0", "::")
STRIKES = 3
TRY_AGAIN_LATER, POLICY_VIOLATION, GOING_AWAY = 1013, 1008, 1001


class Server:
    """Serves sessions created by `make_session` until `close`.

    Raises `NetworkError` if the port cannot be used.
    """

    def __init__(
        self,
        make_session: Callable[[], Session],
        *,
        host: str = "127.0.0.1",
        port: int | None = None,
        allow_hosts: Collection[str] = (),
        proxies: Collection[str] = (),
        follow: bool = False,
        prepare: Callable[[Cancel], None] | None = None,
    ) -> None:
        """Creates a server that listens on `host`.

        Requests from the addresses `proxies` may specify their host in X-Forwarded-Host. `prepare` is called in
        the background before the first client connects, see `Scheduler`.
        """
        self._proxies = frozenset(proxies)
        self._tokens = Tokens(allows_followers=follow)
        self._most_connections = MOST_CONNECTIONS + (CONNECTIONS_OF_FOLLOWERS if follow else 0)
        self._make_session = make_session
        self._allowed = [*allow_hosts, f"[{host}]" if ":" in host else host]
        self._socket = _listening(host, port)
        self.address: tuple[str, int] = self._socket.getsockname()[:2]
        self.sessions: dict[str, Session] = {}
        self.following = Following(make_session(), self._tokens.follower) if follow else None
        """The leader and the followers, if clients can follow."""
        if self.following is not None:
            leader = self.following.leader
            self.sessions[leader.connection.id] = leader
        self._left: dict[str, float] = {}
        self.emptied: float | None = None
        """The monotonic time when the last client left; None while a client is connected, and before the first one."""
        self._connections = 0
        self._loop: asyncio.AbstractEventLoop | None = None
        self._ending: asyncio.Event | None = None
        self._started = threading.Event()
        self._ended = threading.Event()
        self.scheduler = Scheduler(lambda: list(self.sessions.values()), prepare)
        self.answers = Answers()
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="raycam server", daemon=True)
        self._thread.start()
        self._started.wait()
        if self._failure is not None:
            self._socket.close()
            raise self._failure
        self.scheduler.start()

    @property
    def token(self) -> str:
        """The server's own token, which stays valid; the tokens of invitations are valid once."""
        return self._tokens.own

    @property
    def url(self) -> str:
        """The address to open on this machine.

        The token is in the fragment of the address, which browsers never send.
        """
        return self.urls[0]

    @property
    def urls(self) -> list[str]:
        """All addresses of the page; one per network if the server listens on all networks."""
        host, port = self.address
        hosts = machine_addresses(host) if host in WILDCARDS else [host]
        return [f"http://{f'[{each}]' if ':' in each else each}:{port}/#t={self.token}" for each in hosts]

    @property
    def followers_urls(self) -> list[str]:
        """The addresses for followers; none if clients cannot follow."""
        urls = self.urls if self.following is not None else []
        return [f"{each.split('#')[0]}#t={self._tokens.follower}" for each in urls]

    def invitation(self) -> str:
        """An address on this machine with a token that is valid once.

        Browser histories therefore contain no valid token.
        """
        return f"{self.url.split('#')[0]}#t={self._tokens.invite()}"

    def close(self) -> None:
        """Notifies all clients, and stops the server."""
        loop, ending = self._loop, self._ending
        if loop is not None and ending is not None:
            with contextlib.suppress(RuntimeError):  # the event loop has ended
                loop.call_soon_threadsafe(ending.set)
        self._ended.wait()
        self.answers.close()
        self.scheduler.end()
        self.scheduler.join()

    def join(self, timeout: float | None = None) -> bool:
        """Waits until the server has ended; returns False if `timeout` seconds have passed before."""
        # The thread is not joined: in Python 3.11, Ctrl-C during a join makes the thread look as if it had
        # ended.
        return self._ended.wait(timeout)

    def _run(self) -> None:
        """Serves until `close`; an error before the start is stored for the waiting caller."""
        try:
            asyncio.run(self._serve())
        except Exception as failure:
            if self._started.is_set():
                raise
            self._failure = failure
            self._started.set()
        finally:
            self._ended.set()

    async def _serve(self) -> None:
        from websockets.asyncio.server import ServerConnection, serve
        from websockets.typing import Subprotocol

        server = self

        class Counted(ServerConnection):
            """A connection that is closed if there are too many."""

            counted = False

            def connection_made(self, transport: Any) -> None:
                if server._connections >= server._most_connections:
                    transport.abort()
                self.counted = True
                server._connections += 1
                super().connection_made(transport)

            def connection_lost(self, exc: Exception | None) -> None:
                if self.counted:
                    server._connections -= 1
                super().connection_lost(exc)

        self._loop, self._ending = asyncio.get_running_loop(), asyncio.Event()
        async with serve(
            self._talk,
            sock=self._socket,
            process_request=self._process,
            create_connection=Counted,
            subprotocols=[Subprotocol(gate.PROTOCOL)],
            compression=None,
            server_header=None,
            open_timeout=HANDSHAKE_TIME,
            max_size=MAX_MESSAGE_BYTES,
            max_queue=QUEUED_IN,
            logger=_silent(),
        ):
            self._started.set()
            await self._ending.wait()
            for session in self.sessions.values():
                session.connection.send({"type": "closing", "text": "The server has stopped."})
            await asyncio.sleep(0.05)
        for session in self.sessions.values():
            session.uploads.close()

    def _process(self, connection: Any, request: Any) -> Any:
        """The response to an HTTP request, or None for an accepted upgrade."""
        from websockets.datastructures import Headers
        from websockets.http11 import Response

        method = getattr(request, "method", "GET")  # websockets 16 and later also pass other methods here
        allowed = self._allowed
        if self.address[0] in WILDCARDS:  # an IP address cannot be redirected by a foreign DNS server
            own = connection.local_address[0].removeprefix("::ffff:")
            allowed = [*allowed, f"[{own}]" if ":" in own else own]
        forwarded = connection.remote_address[0].removeprefix("::ffff:") in self._proxies
        answer = gate.answer_to(
            request.path, request.headers, self._tokens.accept, allowed, method, forwarded=forwarded
        )
        if answer is None:
            return None
        body = answer.text.encode()
        headers = Headers(
            {
                **gate.response_headers(),
                "Content-Type": answer.media,
                "Content-Length": str(len(body)),
                "Connection": "close",
            }
        )
        return Response(answer.status, HTTPStatus(answer.status).phrase, headers, body)

    async def _talk(self, connection: Any) -> None:
        """Serves one client, from the message `hello` until the connection ends."""
        from websockets.exceptions import ConnectionClosed

        session: Session | None = None
        outgoing: asyncio.Queue[bytes] = asyncio.Queue(QUEUED_OUT)
        sending = asyncio.create_task(_send_all(connection, outgoing))
        try:
            session = await self._greeted(connection, outgoing)
            if session is not None:
                await self._listen(connection, session)
        except ConnectionClosed:
            pass
        finally:
            sending.cancel()
            if session is not None:
                session.connection.close()
                if self.following is not None:
                    self.following.disconnect(session)
                self._left[session.connection.id] = time.monotonic()
                if not any(each.connection.is_open for each in self.sessions.values()):
                    self.emptied = time.monotonic()

    async def _greeted(self, connection: Any, outgoing: asyncio.Queue[bytes]) -> Session | None:
        """Returns the session of a client that sends hello.

        The result is None for another message, after a timeout, or if there are too many sessions.
        """
        try:
            hello = parse_message(await asyncio.wait_for(connection.recv(), HANDSHAKE_TIME))
            if not isinstance(hello, Hello):
                raise BadMessage("the first message must be hello")
        except TimeoutError:  # probably a page on a slow machine, which will connect again
            await connection.close(GOING_AWAY, f"no hello within {HANDSHAKE_TIME:g} s")
            return None
        except BadMessage as error:
            await connection.close(POLICY_VIOLATION, str(error))
            return None
        may_lead = not self._tokens.is_follower(gate.token_of(connection.request.headers))
        session = self._session(hello.session, may_lead)
        if session is None:
            limit = MOST_SESSIONS if self.following is None else MOST_FOLLOWERS
            await connection.close(TRY_AGAIN_LATER, f"too many clients: the limit is {limit}")
            return None
        loop = asyncio.get_running_loop()

        def send(message: dict[str, Any], buffers: Sequence[bytes]) -> None:
            data = packed(message, buffers)
            with contextlib.suppress(RuntimeError):  # the event loop has ended
                loop.call_soon_threadsafe(_put, outgoing, data)

        # The window's size is processed before the welcome message, whose camera may depend on the window's shape.
        session.receive(Size(hello.width, hello.height, hello.ratio))
        session.connection.open(send)
        self.emptied = None
        token = self.token if may_lead else self._tokens.follower
        session.connection.send({"type": "token", "token": token})
        if self.following is None:
            session.greet()
        else:
            self.following.connect(session)
        # Clients ignore images that arrive before the welcome message, so the image is sent again after it.
        if not session.role.is_attached:
            session.images.show_again()
        self.scheduler.wake()
        return session

    def _session(self, resumed: str, may_lead: bool) -> Session | None:
        """The resumed session, or a new session; None if too many sessions exist.

        With followers, a client that may lead takes the leader's session if nobody leads; other clients follow.
        """
        following = self.following
        waiting = {id: left for id, left in self._left.items() if not self.sessions[id].connection.is_open}
        if resumed in waiting and (
            following is None or following.may_lead(self.sessions[resumed]) == may_lead
        ):
            self._left.pop(resumed)
            return self.sessions[resumed]
        if following is not None and may_lead and not following.leader.connection.is_open:
            self._left.pop(following.leader.connection.id, None)
            return following.leader
        if not self._make_room(waiting):
            return None
        session = self._make_session()
        self.sessions[session.connection.id] = session
        if following is not None:
            following.join(session, may_lead=may_lead)
        return session

    def _make_room(self, waiting: Mapping[str, float]) -> bool:
        """Ends sessions to make room; returns True if a session can start.

        Sessions whose clients left too long ago end. If there are still too many sessions, the session whose
        client left first ends, too.
        """
        following = self.following
        kind, most = (False, MOST_SESSIONS) if following is None else (True, MOST_FOLLOWERS)
        full = sum(each.role.is_attached == kind for each in self.sessions.values()) >= most
        for id, left in sorted(waiting.items(), key=lambda item: item[1]):
            session = self.sessions[id]
            if following is not None and session is following.leader:
                continue
            if (full and session.role.is_attached == kind) or time.monotonic() - left > KEPT:
                full = full and session.role.is_attached != kind
                self._end(session)
        return not full

    def _end(self, session: Session) -> None:
        """Forgets a session whose client has left."""
        session.uploads.close()
        self.sessions.pop(session.connection.id)
        self._left.pop(session.connection.id)
        if self.following is not None:
            self.following.remove(session)

    def _follow(self, session: Session, message: Follow | Hold) -> None:
        """Makes a client follow, look around or lead, or changes the pixel that followers show.

        Raises `SettingsError` if the change is not allowed, and `BadMessage` if the view has no leader.
        """
        if self.following is None:
            if isinstance(message, Follow):
                raise BadMessage("this view has no leader; start it with follow=True (--follow)")
            return
        if isinstance(message, Hold):
            self.following.hold(session, message.pixel)
        else:
            self.following.choose(session, message.mode)

    async def _listen(self, connection: Any, session: Session) -> None:
        """Carries out a client's messages until too many of them were invalid."""
        strikes, probes = 0, ProbeLimit(session)
        try:
            async for data in connection:
                try:
                    message = parse_message(data)
                    if isinstance(message, Hello):
                        raise BadMessage("hello must be sent only once")
                    refused = self.following.refusal(session, message) if self.following else ""
                    if refused:
                        session.notify(refused)
                    elif isinstance(message, Follow | Hold):
                        self._follow(session, message)
                        self.scheduler.wake()
                    elif isinstance(message, Probe):
                        await probes.answer(message)
                    elif isinstance(message, SLOW):
                        self.answers.queue_message(session, message)
                    else:
                        session.receive(message)
                        self.scheduler.wake()
                except BadMessage as error:
                    strikes += 1
                    session.complain(str(error))
                    if strikes >= STRIKES:
                        await connection.close(POLICY_VIOLATION, "too many invalid messages")
                        break
                except Error as error:
                    session.complain(str(error))
        finally:
            probes.close()
            self.answers.forget(session)


def _put(outgoing: asyncio.Queue[bytes], data: bytes) -> None:
    """Queues a message; it is dropped if the client does not read."""
    if not outgoing.full():
        outgoing.put_nowait(data)


async def _send_all(connection: Any, outgoing: asyncio.Queue[bytes]) -> None:
    while True:
        await connection.send(await outgoing.get())


REMEDIES = {
    errno.EADDRINUSE: "use another port, or omit the port to use the next free port",
    errno.EADDRNOTAVAIL: "expected an address of this machine, such as 127.0.0.1, or 0.0.0.0 for all addresses",
    errno.EACCES: "ports below 1024 require administrator rights; use a larger port number",
}
"""Remedies of the most common errors when a socket starts to listen."""


def _listening(host: str, port: int | None) -> socket.socket:
    """Returns a socket that listens on `port`, or on the first free port of `PORTS`.

    Raises `SettingsError` for an invalid port, and `NetworkError` if the socket cannot listen.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    for tried in PORTS if port is None else [whole("port", port, 0, 65535)]:
        made = socket.socket(family, socket.SOCK_STREAM)
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            made.bind((host, tried))
            made.listen(MOST_CONNECTIONS + CONNECTIONS_OF_FOLLOWERS)
            return made
        except OSError as error:
            made.close()
            if port is not None or error.errno != errno.EADDRINUSE:
                remedy = "".join(f"; {each}" for each in [REMEDIES.get(error.errno or 0)] if each)
                reason = error.strerror or "unknown error"
                text = f"cannot listen on {host}:{tried}: {reason[:1].lower()}{reason[1:]}{remedy}"
                raise NetworkError(error.errno, text, code="cannot_listen") from None
    raise NetworkError(
        errno.EADDRINUSE,
        f"ports {PORTS[0]} to {PORTS[-1]} are all in use; use another port (--port N, port=N)",
        code="cannot_listen",
    )


def machine_addresses(host: str) -> list[str]:
    """Returns the addresses of a server that listens on all networks.

    This machine's loopback address comes first.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    found = ["::1" if family == socket.AF_INET6 else "127.0.0.1"]
    with contextlib.suppress(OSError):
        found += [str(each[4][0]) for each in socket.getaddrinfo(socket.gethostname(), None, family)]
    with contextlib.suppress(OSError), socket.socket(family, socket.SOCK_DGRAM) as unsent:
        # `connect` sends nothing here, but determines this machine's address for other networks.
        unsent.connect(("2001:db8::1" if family == socket.AF_INET6 else "192.0.2.1", 9))
        found.append(str(unsent.getsockname()[0]))
    return list(dict.fromkeys(each.partition("%")[0] for each in found if not each.startswith("127.0.1.")))


def _silent() -> Any:
    """A logger that drops messages about malformed requests."""
    import logging

    logger = logging.getLogger("raycam.viewer")
    logger.propagate = False
    logger.addHandler(logging.NullHandler())
    return logger
