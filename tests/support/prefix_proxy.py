"""A reverse proxy that serves a server under a path, as nginx and jupyter-server-proxy do."""

from __future__ import annotations

import contextlib
import re
import socket
import threading


class PrefixProxy:
    """Serves `target` under `prefix`, such as "/lab/view/".

    A connection has one request or one WebSocket. `host` replaces the Host header (default: unchanged);
    `forwarded` adds X-Forwarded-Host.
    """

    def __init__(
        self, target: tuple[str, int], prefix: str, *, host: str = "", forwarded: bool = False
    ) -> None:
        self._target, self._prefix, self._host, self._forwarded = target, prefix, host, forwarded
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self._listener.getsockname()[1]}"
        threading.Thread(target=self._accept, daemon=True).start()

    def close(self) -> None:
        """Stops listening."""
        self._listener.close()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                near, _ = self._listener.accept()
                threading.Thread(target=self._serve, args=(near,), daemon=True).start()

    def _serve(self, near: socket.socket) -> None:
        with near, contextlib.suppress(OSError):
            request = b""
            while b"\r\n\r\n" not in request:
                part = near.recv(65536)
                if not part:
                    return
                request += part
            head, _, body = request.partition(b"\r\n\r\n")
            method, path, version = head.split(b"\r\n")[0].split(b" ")
            if not path.startswith(self._prefix.encode()):
                near.sendall(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\nConnection: close\r\n\r\n")
                return
            with socket.create_connection(self._target) as far:
                lines = [b" ".join([method, b"/" + path[len(self._prefix) :], version])]
                lines += self._headers(head.split(b"\r\n")[1:])
                far.sendall(b"\r\n".join(lines) + b"\r\n\r\n" + body)
                threading.Thread(target=_pump, args=(near, far), daemon=True).start()
                _pump(far, near)

    def _headers(self, lines: list[bytes]) -> list[bytes]:
        """The headers that the server receives."""
        changed = []
        for line in lines:
            is_host = re.match(rb"host:", line, re.I) is not None
            if is_host and self._forwarded:
                changed.append(b"X-Forwarded-Host:" + line.partition(b":")[2])
            changed.append(f"Host: {self._host}".encode() if is_host and self._host else line)
        return changed


def _pump(source: socket.socket, sink: socket.socket) -> None:
    with contextlib.suppress(OSError):
        while part := source.recv(65536):
            sink.sendall(part)
        sink.shutdown(socket.SHUT_WR)
