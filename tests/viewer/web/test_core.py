"""raycam compiled for pages returns the same bytes as raycam itself."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from raycam import _core
from raycam.render.frame import CHANNELS
from raycam.viewer.web import core
from support.chromium import chromium
from support.node_core import array_of, needs_core, needs_node, run_core
from support.picture_bytes import OTHERWISE, PICTURES, digest, kept, label, may_differ, options, render

pytestmark = [needs_node, needs_core]


def run_in_browser(script: str, worlds: Mapping[str, bytes], folder: Path) -> Any:
    """The result of `run_core`, computed in Chromium."""
    built = Path(core.__file__).parent / core.FOLDER
    packed = {name: base64.b64encode(data).decode() for name, data in worlds.items()}
    wasm = base64.b64encode(core.core_bytes()).decode()
    with chromium(folder) as tab:
        tab.evaluate(
            f"(0, eval)({json.dumps((built / core.GLUE).read_text() + ';globalThis.core = wasm_bindgen')}), null"
        )
        tab.evaluate(
            "globalThis.bytesOf = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)),"
            "globalThis.base64 = (array) => { let text = '';"
            " for (const byte of new Uint8Array(array.buffer, array.byteOffset, array.byteLength))"
            " text += String.fromCharCode(byte); return btoa(text); },"
            f"core({{ module_or_path: bytesOf('{wasm}') }}).then(() => null)"
        )
        return tab.evaluate(
            f"((worlds) => {{ {script} }})(Object.fromEntries(Object.entries({json.dumps(packed)})"
            ".map(([name, text]) => [name, bytesOf(text)])))"
        )


def run_by_node(script: str, worlds: Mapping[str, bytes], folder: Path) -> Any:
    return run_core(script, worlds)


@pytest.mark.parametrize("run_pictures", [run_by_node, pytest.param(run_in_browser, marks=pytest.mark.proof)])
def test_webassembly_images_equal_native_images(
    tmp_path: Path, run_pictures: Callable[[str, Mapping[str, bytes], Path], Any]
) -> None:
    worlds, jobs, frames = {}, [], []
    for number in range(len(PICTURES)):
        world, frame = render(number, tmp_path)
        worlds[str(number)] = bytes(_core.world_to_bytes(world._core))
        jobs.append({"world": str(number), "request": options(number)})
        frames.append(frame)
    hashes = kept()
    found = run_pictures(
        f"return {json.dumps(jobs)}.map(({{ world, request }}) => {{"
        "const loaded = core.World.unpack(worlds[world]);"
        "const frame = loaded.render(loaded.camera(undefined, 640, 480), JSON.stringify(request));"
        f"return Object.fromEntries({json.dumps(list(CHANNELS))}.map((name) => [name, base64(frame.plane(name))]));"
        "});",
        worlds,
        tmp_path / "browser",
    )
    for number, (frame, planes) in enumerate(zip(frames, found, strict=True)):
        for name, expected in frame.items():
            there = array_of(planes[name], expected)
            differs = there != expected
            if expected.dtype.kind == "f":
                differs &= ~(np.isnan(there) & np.isnan(expected))
            text = f"{label(number)}: {name} differs in {differs.sum()} of {expected.size}"
            if may_differ(number, name):
                assert np.allclose(there, expected, rtol=0, atol=1e-6, equal_nan=True), text
                assert differs.mean() < OTHERWISE[PICTURES[number][1]], text
            else:
                assert not differs.any(), text
                assert digest(there) == hashes[label(number)][name], (
                    f"{text}, the bytes differ from the stored hash"
                )


def test_files_are_read_from_memory_with_their_references() -> None:
    obj = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n"
    files = {
        "a.toml": "[[object]]\nmesh = 'models/a.obj'\n",
        "models/a.obj": obj,
        "models/m.mtl": "newmtl red\nKd 1 0 0\n",
    }
    found = run_core(
        f"const files = new core.Files(); for (const [name, text] of Object.entries({json.dumps(files)}))"
        " files.add(name, new TextEncoder().encode(text));"
        "const world = core.World.load('a.toml', files);"
        "const about = JSON.parse(world.about());"
        "return { about, corners: [...world.triangles()], colors: [...world.triangleColors()] };"
    )
    assert found["about"]["triangles"] == 1
    assert found["corners"] == [0, 0, 0, 1, 0, 0, 0, 1, 0]
    assert found["colors"] == [1, 0, 0]


@pytest.mark.parametrize(
    ("text", "line", "word"),
    [
        ("[[object]]\nbox = { size = 1 }\ncolour = 'red'\n", 3, "color"),
        ("[[object]]\nmesh = '../../etc/passwd'\n", 2, "passwd"),
        ("[[object]]\nmesh = 'none.glb'\n", 2, "none.glb"),
        ("[[object]\n", 1, ""),
        ("[camera]\nsize = [2000000000, 2000000000]\nfov = 45\n", None, ""),
    ],
)
def test_errors_contain_their_line(text: str, line: int | None, word: str) -> None:
    found = run_core(
        f"const files = new core.Files(); files.add('w.toml', new TextEncoder().encode({json.dumps(text)}));"
        "try { core.World.load('w.toml', files); } catch (error) { return JSON.parse(error); } return {};"
    )
    assert word in found["text"]
    if line is not None:
        assert (found["line"], found["file"]) == (line, "w.toml")
