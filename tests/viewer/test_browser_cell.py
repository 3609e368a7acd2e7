"""The widget in a simulated VS Code notebook, which has messages but no address.

Frames have the sandboxes and policies of VS Code 1.139, `webview/browser/pre/index.html` and
`backLayerWebView.ts`.
"""

from __future__ import annotations

import base64
import functools
import http.server
import json
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import raycam
from raycam.viewer.session import Session
from raycam.viewer.widget import RELAY, Views, cell_page
from support.chromium import Tab, chromium
from support.patience import PATIENCE, until

pytestmark = pytest.mark.proof

SANDBOX = "allow-same-origin allow-pointer-lock allow-scripts allow-downloads"
ALLOW = "cross-origin-isolated; autoplay; local-network-access; clipboard-read; clipboard-write;"
SOURCE = "'self' https://*.vscode-cdn.net"
POLICY = (
    f"default-src 'none'; script-src {SOURCE} 'unsafe-inline' 'unsafe-eval'; style-src {SOURCE} 'unsafe-inline'; "
    f"img-src {SOURCE} https: http: data:; font-src {SOURCE} https:; connect-src https:; child-src https: data:;"
)
"""The policy of VS Code if `notebook.experimental.enableCsp` is set; by default, there is no policy."""

STILL = "data:image/svg+xml,<svg xmlns='http://www.w3.org/2000/svg' width='9' height='9'/>"

TOP = """<!DOCTYPE html><meta charset="utf-8"><link rel="icon" href="data:,"><title>workbench</title>
<style>html, body, iframe { margin: 0; border: 0; width: 100%; height: 100%; display: block }</style>
<iframe id="webview" src="webview.html"></iframe>
<script>
  window.said = [];
  addEventListener("message", ({ data }) => window.said.push(data));
  window.tell = (content, buffers) => document.getElementById("webview").contentWindow.postMessage(
    { content, buffers: buffers.map((text) => Uint8Array.from(atob(text), (each) => each.charCodeAt(0))) }, "*");
</script>"""

WEBVIEW = """<!DOCTYPE html><meta charset="utf-8">
<meta http-equiv="Content-Security-Policy"
  content="default-src 'none'; script-src 'unsafe-inline' 'self'; frame-src 'self'; style-src 'unsafe-inline';">
<body style="margin: 0; overflow: hidden; width: 100%; height: 100vh">
<script>
  addEventListener("message", ({ source, data }) => {
    const inner = document.getElementById("active-frame").contentWindow;
    source === parent ? inner.postMessage(data, "*") : parent.postMessage(data, "*");
  });
  const frame = document.createElement("iframe");
  frame.id = "active-frame";
  frame.setAttribute("sandbox", "SANDBOX");
  frame.setAttribute("allow", "ALLOW");
  frame.style.cssText = "display: block; margin: 0; border: 0; position: absolute; width: 100%; height: 100%";
  frame.src = "./fake.html";
  frame.onload = () => {
    frame.onload = null;
    const { contentDocument } = frame;
    contentDocument.open();
    contentDocument.write(CELLS);
    contentDocument.close();
  };
  document.body.append(frame);
</script>"""

CELLS = """<!DOCTYPE html><html lang="en"><head><meta charset="UTF-8">
<base href="https://file.vscode-cdn.net/x/">POLICY</head>
<body><div id="output"></div><script>
  const heard = [];
  const model = {
    get: (name) => ({ page: PAGE, height: 560, still: "STILL" })[name],
    send: (content) => parent.postMessage(content, "*"),
    on: (kind, told) => heard.push(told),
    off: () => {},
  };
  addEventListener("message", ({ data }) => {
    const views = data?.buffers?.map((each) => new DataView(each.buffer));
    if (data?.content) heard.forEach((told) => told(data.content, views));
  });
</script><script type="module">LOAD</script></body></html>"""


def script_text(value: str) -> str:
    return json.dumps(value).replace("<", "\\u003c")


def write_frames(folder: Path, policy: str) -> None:
    """Writes the pages of the frames.

    The policy forbids loading modules by address, as anywidget would do.
    """
    by_address = (
        f"const url = URL.createObjectURL(new Blob([{script_text(RELAY)}], {{ type: 'text/javascript' }}));"
    )
    load = f"{by_address} const widget = (await import(url)).default;"
    if policy:
        load = RELAY.replace("export default", "const widget =")
    meta = f'<meta http-equiv="Content-Security-Policy" content="{policy}">' if policy else ""
    cells = CELLS.replace(
        "LOAD", load + " globalThis.leave = widget.render({ model, el: document.getElementById('output') });"
    )
    cells = (
        cells.replace("POLICY", meta).replace("STILL", STILL).replace("PAGE", script_text(cell_page("spot")))
    )
    (folder / "index.html").write_text(TOP)
    (folder / "fake.html").write_text("<!DOCTYPE html><title>fake</title>")
    webview = WEBVIEW.replace("SANDBOX", SANDBOX).replace("ALLOW", ALLOW)
    (folder / "webview.html").write_text(webview.replace("CELLS", script_text(cells)))


class Kernel:
    """The kernel's side of the widget, which exchanges messages through the workbench page."""

    def __init__(self, tab: Tab, world: raycam.World) -> None:
        self.tab, self.pictures, self.kinds = tab, 0, set[str]()
        self.told: list[tuple[dict[str, Any], list[bytes]]] = []
        self.views = Views(
            lambda: Session(world, world.camera("front"), samples=4),
            lambda content, buffers: self.told.append((content, [bytes(each) for each in buffers])),
        )

    def pump(self, until: Any) -> None:
        """Forwards messages until a condition is true."""
        end = time.monotonic() + PATIENCE
        while not until():
            assert time.monotonic() < end, (self.kinds, self.tab.said)
            for content in self.tab.evaluate("window.said.splice(0)"):
                self.kinds.add(json.loads(content["said"])["type"] if content.get("said") else "gone")
                self.views.hear(content)
            while self.told:
                content, buffers = self.told.pop(0)
                self.pictures += content["message"]["type"] == "picture"
                packed = [base64.b64encode(each).decode() for each in buffers]
                self.tab.evaluate(f"window.tell({json.dumps(content)}, {json.dumps(packed)})")


@pytest.fixture
def browser(tmp_path: Path) -> Iterator[Tab]:
    """A browser that runs the cell's frame in the same process, so that scripts can reach it."""
    with chromium(tmp_path / "browser", "--disable-features=IsolateSandboxedIframes") as made:
        made.show(900, 620)
        yield made


@pytest.fixture
def address(tmp_path: Path) -> Iterator[str]:
    folder = tmp_path / "pages"
    folder.mkdir()
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=str(folder))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_address[1]}/index.html"
        server.shutdown()


def in_the_notebook(script: str) -> str:
    """A script wrapped so that it runs in the frame with the cells."""
    frames = (
        "document.getElementById('webview').contentDocument.getElementById('active-frame').contentDocument"
    )
    return f"((document) => {script})({frames})"


def in_the_cell(tab: Tab, script: str) -> Any:
    """The value of a script in the innermost frame."""
    node = tab.call("Page.getFrameTree")["frameTree"]
    while node.get("childFrames"):
        (node,) = node["childFrames"]
    context = tab.call("Page.createIsolatedWorld", frameId=node["frame"]["id"])["executionContextId"]
    found = tab.call("Runtime.evaluate", expression=script, contextId=context, returnByValue=True)
    assert "exceptionDetails" not in found, found
    return found["result"].get("value")


def middle_of_the_picture(tab: Tab) -> tuple[float, float]:
    """The window position of the image's middle.

    The frame's top left corner is at the margin of the page.
    """
    x, y = in_the_cell(
        tab,
        "(({ x, y, width, height }) => [x + width / 2, y + height / 2])"
        "(document.getElementById('picture').getBoundingClientRect())",
    )
    return x + 9, y + 9


@pytest.mark.parametrize("policy", ["", POLICY], ids=["default", "policy"])
def test_widget_works_in_the_frames_of_vs_code(
    browser: Tab, address: str, small_world: raycam.World, tmp_path: Path, policy: str
) -> None:
    write_frames(tmp_path / "pages", policy)
    browser.call("Page.navigate", url=address)
    browser.wait("Boolean(window.tell)")
    kernel = Kernel(browser, small_world)
    try:
        kernel.pump(lambda: kernel.pictures >= 2 and "ack" in kernel.kinds)

        def shown(condition: str) -> None:
            kernel.pump(lambda: in_the_cell(browser, condition))

        shown("document.getElementById('status').textContent.includes('4 samples')")
        assert in_the_cell(browser, "document.getElementById('message').hidden")
        x, y = middle_of_the_picture(browser)
        browser.click(x, y)
        shown("document.querySelectorAll('#values tr').length > 5")
        in_the_cell(browser, "document.getElementById('copy').scrollIntoView({ block: 'center' })")
        x, y = in_the_cell(
            browser,
            "(({ x, y }) => [x, y])(document.getElementById('copy').getBoundingClientRect())",
        )
        browser.click(x + 14, y + 14)
        # If a copy is refused, a message of the class `error` reports this.
        shown(
            "(({ hidden, className }) => !hidden && className !== 'error')(document.getElementById('message'))"
        )
        in_the_cell(browser, "document.getElementById('explain').click()")
        shown("document.getElementById('explained').open")
        shown("document.querySelector('#explained-drawing canvas').dataset.labels")
        assert {"hello", "ack", "pick", "explain"} <= kernel.kinds
        refused = [line for line in browser.said if "Content Security Policy" in line]
        assert not refused
        assert all(
            url.startswith((address.rsplit("/", 1)[0], "blob:", "data:", "about:"))
            for url in browser.requests
        )
    finally:
        shot = browser.call("Page.captureScreenshot")["data"]
        (tmp_path / "cell.png").write_bytes(base64.b64decode(shot))
        kernel.views.close()


def test_cell_without_a_kernel_shows_the_image_and_reports_a_lost_kernel(
    browser: Tab, address: str, small_world: raycam.World, tmp_path: Path
) -> None:
    write_frames(tmp_path / "pages", "")
    browser.call("Page.navigate", url=address)
    browser.wait("Boolean(window.tell)")
    display = "['iframe', 'figure'].map((name) => document.querySelector(name).style.display).join()"
    browser.wait(in_the_notebook(f"{display} === 'none,block' && document.querySelector('img').naturalWidth"))
    kernel = Kernel(browser, small_world)
    try:  # the kernel is busy during these steps
        kernel.pump(lambda: kernel.pictures >= 2 and "ack" in kernel.kinds)
        assert browser.evaluate(in_the_notebook(display)) == "block,none"
        kernel.pump(lambda: in_the_cell(browser, "document.getElementById('status-picture').textContent"))
        browser.mouse("mouseMoved", *middle_of_the_picture(browser))  # this probe receives no answer
        message = "document.getElementById('message')"
        until(
            lambda: in_the_cell(
                browser, f"!{message}.hidden && {message}.textContent.includes('does not answer')"
            ),
            "the silence was not told",
        )
    finally:
        kernel.views.close()


def test_removed_output_closes_its_view_and_a_repeated_cell_starts_another(
    browser: Tab, address: str, small_world: raycam.World, tmp_path: Path
) -> None:
    write_frames(tmp_path / "pages", "")
    browser.call("Page.navigate", url=address)
    browser.wait("Boolean(window.tell)")
    kernel = Kernel(browser, small_world)
    try:
        kernel.pump(lambda: kernel.pictures >= 1)
        (first,) = kernel.views.sessions
        window = in_the_notebook("document.defaultView")
        browser.evaluate(f"{window}.leave(), document.body.dataset.left = 'yes'")
        kernel.pump(lambda: "gone" in kernel.kinds)
        assert kernel.views.sessions == {}
        assert kernel.views.scheduler is None
        browser.evaluate("document.getElementById('webview').contentWindow.location.reload()")
        kernel.pump(lambda: len(kernel.views.sessions) == 1)
        assert first not in kernel.views.sessions
    finally:
        kernel.views.close()
