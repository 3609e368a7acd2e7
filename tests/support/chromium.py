"""Chromium without a window, driven over its DevTools protocol."""

from __future__ import annotations

import contextlib
import itertools
import json
import shutil
import subprocess
import time
import urllib.request
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from websockets.sync.client import ClientConnection, connect

from .patience import PATIENCE, until

NAMES = ("chromium", "chromium-browser", "google-chrome")
TERMINATION_S = 30.0
"""Seconds after which a browser that does not end is killed."""
OPTIONS = [
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync"),
    *("--disable-background-networking", "--disable-component-update"),
    *("--remote-debugging-port=0", "--remote-allow-origins=*"),
]


class Tab:
    """A page in the browser."""

    def __init__(self, socket: ClientConnection, pid: int = 0) -> None:
        self._socket = socket
        self.pid = pid
        """The process of the browser."""
        self._numbers = itertools.count(1)
        self.said: list[str] = []
        """The lines that the page wrote to its console, errors included."""
        self.requests: list[str] = []
        """The addresses that the page requested."""
        self._server: str | None = None
        """Host and port of the page that `open` loaded last."""
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """The result of a command."""
        number = next(self._numbers)
        self._socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        deadline = time.monotonic() + PATIENCE  # events of a busy page do not extend it
        while True:
            message = json.loads(self._socket.recv(timeout=max(0.0, deadline - time.monotonic())))
            self._note(message)
            if message.get("id") == number:
                assert "error" not in message, message
                result: dict[str, Any] = message["result"]
                return result

    def _note(self, message: dict[str, Any]) -> None:
        parameters = message.get("params", {})
        if message.get("method") in ("Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded"):
            self.said.append(json.dumps(parameters))
        if message.get("method") == "Network.requestWillBeSent":
            self.requests.append(parameters["request"]["url"])

    def evaluate(self, script: str) -> Any:
        """The value of a script, awaited."""
        found = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def wait(self, condition: str) -> None:
        """Waits until a script returns true. Errors are ignored while the page is loading."""
        until(lambda: self._is_true(condition), f"never true: {condition}")

    def _is_true(self, condition: str) -> bool:
        script = f"(() => {{ try {{ return Boolean({condition}); }} catch {{ return false; }} }})()"
        try:
            return bool(self.evaluate(script))
        except AssertionError as error:
            if "target navigated" in str(error):
                return False
            raise

    def show(self, width: int, height: int, scheme: str = "light", motion: str = "no-preference") -> None:
        """Sets the window size, the light or dark theme, and reduced motion ("reduce")."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )
        wishes = {"prefers-color-scheme": scheme, "prefers-reduced-motion": motion}
        features = [{"name": name, "value": value} for name, value in wishes.items()]
        self.call("Emulation.setEmulatedMedia", features=features)

    def open(self, url: str) -> None:
        """Loads a page and waits for its first image.

        If the page belongs to another server than the previous one, `said` starts again. A page whose server has
        ended reports a failed connection until the browser leaves it.
        """
        server = urlsplit(url).netloc
        if server != self._server:
            self.call("Page.navigate", url="about:blank")
            self.wait("location.href === 'about:blank'")
            self.said.clear()
            self._server = server
        self.wait("globalThis.isLeft = true")
        if "loaderId" not in self.call(
            "Page.navigate", url=url
        ):  # only the fragment of the address has changed
            self.wait("(globalThis.isLeft = false) === false")
        self.wait("!globalThis.isLeft && document.getElementById('status-picture')?.textContent")

    def mouse(self, kind: str, x: float, y: float, **more: Any) -> None:
        """A mouse event at CSS pixels of the window."""
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def click(self, x: float, y: float, modifiers: int = 0) -> None:
        """A click of the left button."""
        for kind in ("mousePressed", "mouseReleased"):
            self.mouse(kind, x, y, button="left", clickCount=1, modifiers=modifiers)

    def drop(self, x: float, y: float, paths: Sequence[Path]) -> None:
        """Drops files at CSS pixels of the window."""
        data = {"items": [], "files": [str(path) for path in paths], "dragOperationsMask": 1}
        for kind in ("dragEnter", "dragOver", "drop"):
            self.call("Input.dispatchDragEvent", type=kind, x=x, y=y, data=data)

    def press(self, key: str) -> None:
        """A key, pressed and released."""
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key)


@contextlib.contextmanager
def chromium(folder: Path, *more: str) -> Iterator[Tab]:
    """A new browser with one tab.

    `more` contains further command-line options. Raises `FileNotFoundError` if no browser is installed.
    """
    found = next(filter(None, map(shutil.which, NAMES)), None)
    if found is None:
        raise FileNotFoundError(f"there is no {' or '.join(NAMES)} (Debian, Ubuntu: apt install chromium)")
    with subprocess.Popen(
        [found, *OPTIONS, *more, f"--user-data-dir={folder}", "about:blank"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as process:
        try:
            told = folder / "DevToolsActivePort"
            until(lambda: told.exists() and "\n" in told.read_text(), "the browser did not start")
            port = told.read_text().split("\n")[0]
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/json/list", timeout=PATIENCE) as answer:
                (tab,) = [each for each in json.load(answer) if each["type"] == "page"]
            with connect(
                tab["webSocketDebuggerUrl"], max_size=None, proxy=None, ping_interval=None
            ) as socket:
                yield Tab(socket, process.pid)
        finally:
            process.terminate()
            try:
                process.wait(TERMINATION_S)
            except subprocess.TimeoutExpired:
                process.kill()
