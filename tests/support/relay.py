"""A TCP relay that can be interrupted, like a network connection to a distant server."""

from __future__ import annotations

import contextlib
import socket
import threading


class Relay:
    """Listens on a local port, and relays to `target` until interrupted or closed."""

    def __init__(self, target: tuple[str, int]) -> None:
        self.target: tuple[str, int] | None = target
        """Where new connections go; None refuses them."""
        self._open: list[socket.socket] = []
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        while True:
            try:
                near, _ = self._listener.accept()
            except OSError:
                return
            if self.target is None:
                near.close()
                continue
            try:
                far = socket.create_connection(self.target)
            except OSError:
                near.close()
                continue
            self._open += [near, far]
            for source, sink in ((near, far), (far, near)):
                threading.Thread(target=_pump, args=(source, sink), daemon=True).start()

    def cut(self, target: tuple[str, int] | None) -> None:
        """Closes every connection abruptly; new connections go to `target`."""
        self.target = target
        for each in self._open:
            with contextlib.suppress(OSError):
                each.shutdown(socket.SHUT_RDWR)
            each.close()
        self._open.clear()

    def close(self) -> None:
        """Closes the relay."""
        self._listener.close()
        self.cut(None)


def _pump(source: socket.socket, sink: socket.socket) -> None:
    """Forwards bytes until either end is closed."""
    with contextlib.suppress(OSError):
        while data := source.recv(1 << 16):
            sink.sendall(data)
    for each in (source, sink):
        with contextlib.suppress(OSError):
            each.shutdown(socket.SHUT_RDWR)
