"""The playground in a browser: worlds, errors, dropped files, copies and links.

Requires Chromium: `make proof`.
"""

from __future__ import annotations

import base64
import functools
import http.server
import json
import struct
import subprocess
import sys
import threading
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.viewer.web.live_page import playground_page
from support.chromium import Tab, chromium
from support.node_core import needs_core

pytestmark = [pytest.mark.proof, needs_core]
BALL = "[[object]]\nname = 'ball'\nsphere = { radius = 1, level = 2 }\n"
CAMERA = "[camera]\nsize = [80, 60]\nfov = 40\nlocation = [4, 3, 2]\ntarget = [0, 0, 0]\n"
BOX = f"[[object]]\nname = 'crate'\nbox = {{ size = 1 }}\n\n{CAMERA}"
STILL = "document.getElementById('status').textContent.includes('sample')"


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("page") / "playground.html"
    path.write_text(playground_page({"ball": BALL, "crate": BOX}), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    with chromium(tmp_path_factory.mktemp("browser")) as made:
        made.show(1010, 420)
        yield made


@pytest.fixture
def tab(browser: Tab, page: Path) -> Iterator[Tab]:
    """The playground, opened from its file; it must not request anything else in any test."""
    browser.call("Page.navigate", url="about:blank")
    browser.said.clear()
    browser.requests.clear()
    browser.open(page.as_uri())
    yield browser
    assert all(each.startswith(("file:", "blob:", "data:", "about:")) for each in browser.requests)


def type_world(tab: Tab, text: str) -> None:
    """Puts a world into the editor, and waits until it is read."""
    tab.evaluate(
        "document.getElementById('status').textContent = ''; ((area) => {"
        f"area.value = {json.dumps(text)}; area.dispatchEvent(new Event('input'));"
        "})(document.getElementById('world-text'))"
    )


def drop(tab: Tab, files: dict[str, bytes]) -> None:
    """Drops files onto the page."""
    texts = json.dumps({name: base64.b64encode(data).decode() for name, data in files.items()})
    tab.evaluate(
        "document.getElementById('status').textContent = '', (() => { const given = new DataTransfer();"
        f"for (const [name, text] of Object.entries({texts}))"
        "  given.items.add(new File([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], name));"
        "document.body.dispatchEvent(new DragEvent('drop', { dataTransfer: given, bubbles: true })); })()"
    )


def problem(tab: Tab) -> str:
    return str(tab.evaluate("document.getElementById('world-problem').textContent"))


def about(tab: Tab) -> str:
    return str(tab.evaluate("document.getElementById('about').textContent"))


def test_error_is_shown_at_its_line_until_it_is_fixed(tab: Tab) -> None:
    type_world(tab, BALL + "\n[[object]]\nbox = { size = 1 }\ncolour = 'red'\n")
    tab.wait("document.querySelector('#world-lines .wrong') !== null")
    assert tab.evaluate("document.querySelector('#world-lines .wrong').textContent") == "7\n"
    assert "color" in problem(tab)
    type_world(tab, BALL + "\n[[object]]\nbox = { size = 1 }\ncolor = 'red'\n")
    tab.wait(STILL)
    assert tab.evaluate("document.querySelector('#world-lines .wrong')") is None
    assert problem(tab) == ""
    assert "2 objects" in about(tab)
    assert tab.said == []


def test_example_list_replaces_the_text(tab: Tab) -> None:
    tab.evaluate(
        "((list) => { list.value = 'crate'; list.dispatchEvent(new Event('change')); })"
        "(document.getElementById('example'))"
    )
    tab.wait("document.getElementById('about').textContent.includes('camera of 80 x 60')")
    assert tab.evaluate("document.getElementById('world-text').value") == BOX


def test_undo_restores_the_text_before_an_example(tab: Tab) -> None:
    own = BOX + "# my own world\n"
    type_world(tab, own)
    tab.evaluate(
        "((list) => { list.value = 'ball'; list.dispatchEvent(new Event('change')); })"
        "(document.getElementById('example'))"
    )
    tab.wait(f"document.getElementById('world-text').value === {json.dumps(BALL)}")
    tab.evaluate("document.getElementById('world-text').focus(), document.execCommand('undo')")
    assert tab.evaluate("document.getElementById('world-text').value") == own


def test_dropped_files_are_not_reported_as_refused(tab: Tab) -> None:
    tab.evaluate(
        "globalThis.texts = [], new MutationObserver(() => texts.push(document.getElementById('message').textContent))"
        ".observe(document.getElementById('message'), { childList: true, characterData: true, subtree: true })"
    )
    drop(tab, {"a.ply": PLY.encode()})
    tab.wait("document.getElementById('about').textContent.includes(', 1 triangle')")
    assert [each for each in tab.evaluate("texts") if "open" in each.lower()] == []


def glb() -> bytes:
    """One triangle."""
    data = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "scene": 0,
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "buffers": [{"byteLength": len(data)}],
        "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": 3,
                "type": "VEC3",
                "min": [0, 0, 0],
                "max": [1, 1, 0],
            }
        ],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


QUAD = "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\n"
PLY = (
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 0 1\n3 0 1 2\n"
)


@pytest.mark.parametrize(
    ("files", "triangles"),
    [
        ({"a.glb": glb()}, 1),
        ({"a.ply": PLY.encode()}, 1),
        (
            {
                "my quad.obj": f"mtllib m.mtl\n{QUAD}usemtl red\nf 1 2 3 4\n".encode(),
                "m.mtl": b"newmtl red\nKd 1 0 0\n",
            },
            2,
        ),
    ],
)
def test_dropped_model_is_shown(tab: Tab, files: dict[str, bytes], triangles: int) -> None:
    drop(tab, files)
    tab.wait(f"document.getElementById('about').textContent.includes(', {triangles} triangle')")
    assert next(iter(files)) in tab.evaluate("document.getElementById('world-text').value")
    assert problem(tab) == ""


@pytest.mark.parametrize(
    ("files", "word"),
    [
        ({"a.glb": glb()[:-9]}, "a.glb"),
        ({"a.ply": PLY.replace("vertex 3", "vertex 4000000000").encode()}, "a.ply"),
        ({"a.obj": b"f 1 2 3\n"}, "a.obj"),
        ({"world.toml": b"[[object]]\nsphere = { radius = 1, level = 30 }\n"}, "level"),
        (
            {
                "world.toml": b"[camera]\nsize = [1000000, 1000000]\nfov = 40\nlocation = [4, 0, 0]\n"
                + BALL.encode()
            },
            "pixels",
        ),
        ({"world.toml": b"[[object]]\nbox = { size = 1 }\nrefine = 12\n"}, "refine"),
        ({"notes.txt": b"x"}, "1 of 1 files"),
    ],
)
def test_hostile_files_do_not_break_the_page(tab: Tab, files: dict[str, bytes], word: str) -> None:
    drop(tab, files)
    tab.wait(f"document.getElementById('world-problem').textContent.includes({json.dumps(word)})")
    type_world(tab, BOX)
    tab.wait("document.getElementById('about').textContent.includes('camera of 80 x 60')")
    tab.wait(STILL)


def test_link_contains_the_world_up_to_a_limit(tab: Tab, page: Path) -> None:
    text = BOX + "# ü </script> \\ ''' 'end'\n"
    type_world(tab, text)
    tab.evaluate("document.getElementById('share').click()")
    tab.wait("location.hash.startsWith('#w=')")
    link = tab.evaluate("location.href")
    tab.call("Page.navigate", url="about:blank")
    tab.open(link)
    tab.wait("document.getElementById('world-text').value")
    assert tab.evaluate("document.getElementById('world-text').value") == text
    noise = base64.b64encode(np.random.default_rng(1).bytes(40000)).decode()
    type_world(tab, f"{text}# {noise}\n")
    tab.evaluate("document.getElementById('share').click()")
    tab.wait("document.getElementById('world-problem').textContent.includes('32768')")
    assert tab.evaluate("location.href") == link
    tab.call("Page.navigate", url="about:blank")
    tab.call("Page.navigate", url=f"{page.as_uri()}#w=AAAA")
    tab.wait("document.getElementById('world-problem')?.textContent.includes('damaged')")
    tab.open(page.as_uri())


@pytest.mark.parametrize("more", ["", "# it's \"quoted\" \\ and ''' ended\nEND\n".replace("END", "# END")])
def test_copied_text_and_code_render_the_same_world(tab: Tab, tmp_path: Path, more: str) -> None:
    type_world(tab, BOX + more)
    tab.evaluate(
        "globalThis.copied = [], navigator.clipboard.writeText = async (text) => { copied.push(text); }, "
        "document.getElementById('copy-python').click(), document.getElementById('copy-command').click()"
    )
    tab.wait("copied.length === 2")
    python, command = tab.evaluate("copied")
    subprocess.run([sys.executable, "-c", python], cwd=tmp_path, check=True)
    assert (tmp_path / "world.toml").read_text(encoding="utf-8") == BOX + more
    first = (tmp_path / "picture.png").read_bytes()
    command = command.replace("raycam render", f"'{sys.executable}' -m raycam render --quiet")
    subprocess.run(["bash", "-c", command], cwd=tmp_path, check=True)
    assert (tmp_path / "world.toml").read_text(encoding="utf-8").rstrip() == (BOX + more).rstrip()
    assert (tmp_path / "picture.png").read_bytes() == first


def test_playground_sends_no_requests(browser: Tab, page: Path) -> None:
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=str(page.parent))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        address = f"http://127.0.0.1:{server.server_port}/{page.name}"
        browser.requests.clear()
        browser.open(address)
        browser.wait(STILL)
        assert [each for each in browser.requests if not each.startswith(("blob:", "data:"))] == [address]
        tried = browser.evaluate(
            "Promise.allSettled([fetch('/x'), fetch('https://example.org/')])"
            ".then((all) => all.map(({ status }) => status))"
        )
        assert tried == ["rejected", "rejected"]
        server.shutdown()


def test_numbers_of_the_page_equal_raycam(tab: Tab) -> None:
    type_world(tab, BOX)
    tab.wait("document.getElementById('about').textContent.includes('camera of 80 x 60')")
    told = about(tab).split("C = ")[1].split("\n")[0]
    world = raycam.World()
    world.add_object(box={"size": 1})
    expected = raycam.Camera.look_at([4, 3, 2], [0, 0, 0], [0, 0, 1], size=(80, 60), fov=40)
    assert np.allclose(json.loads(told), expected.C, atol=1e-12)


def test_link_that_unpacks_to_a_huge_text_is_refused(tab: Tab, page: Path) -> None:
    packer = zlib.compressobj(9, wbits=-15)
    packed = b"".join(packer.compress(b"#" * 2**20) for _ in range(16)) + packer.flush()
    link = base64.urlsafe_b64encode(packed).decode().rstrip("=")
    assert len(link) < 32 * 1024
    tab.call("Page.navigate", url="about:blank")
    tab.call("Page.navigate", url=f"{page.as_uri()}#w={link}")
    tab.wait("document.getElementById('world-problem')?.textContent.includes('damaged')")
    assert tab.evaluate("document.getElementById('world-text').value.length") < 10_000


def test_editor_of_a_long_text_draws_few_lines(tab: Tab) -> None:
    type_world(tab, BOX + "# line\n" * 20_000)
    tab.wait(STILL)
    assert tab.evaluate("document.getElementById('world-lines').textContent.length") < 20_000
    assert tab.evaluate("document.querySelectorAll('#world-lines *').length") < 500
