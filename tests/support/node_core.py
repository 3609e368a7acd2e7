"""The WebAssembly core and the client's modules, run by Node."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
from collections.abc import Mapping
from importlib.resources import files
from typing import Any

import numpy as np
import pytest
from raycam.viewer import bundle as bundling
from raycam.viewer.web import core

from .patience import PATIENCE

NODE = shutil.which("node")
needs_node = pytest.mark.skipif(
    NODE is None, reason="Node.js is not installed (Debian, Ubuntu: apt install nodejs)"
)
needs_core = pytest.mark.skipif(not core.is_built(), reason="raycam for pages is not built; run: make web")


def run(script: str) -> Any:
    """The JSON output of a script in the scope of the page worker's modules."""
    return run_module("core/worker.js", script)


def run_module(entry: str, script: str) -> Any:
    """The JSON output of a script in the scope of a client module and its imports."""
    names = bundling.modules(entry)
    bodies = [bundling.EXPORT.sub("", bundling.IMPORT.sub("", bundling.client_file(name))) for name in names]
    text = "\n".join(
        [
            *bodies,
            f"(async () => {{ {script} }})().then((found) => "
            "require('node:fs').writeSync(1, JSON.stringify(found)));",
        ]
    )
    done = subprocess.run([str(NODE), "-"], input=text, capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stdout)


def run_core(script: str, worlds: Mapping[str, bytes] = {}) -> Any:
    """The JSON output of a script that uses the WebAssembly core.

    In the script, `core` is the core, and `worlds` contains bytes by name.
    """
    folder = files(core.__package__) / core.FOLDER
    packed = {name: base64.b64encode(data).decode() for name, data in worlds.items()}
    return run(
        "const fs = require('node:fs');\n"
        f"const glue = fs.readFileSync({json.dumps(str(folder / core.GLUE))}, 'utf8');\n"
        "const core = new Function(glue + '; return wasm_bindgen;')();\n"
        f"const packedCore = fs.readFileSync({json.dumps(str(folder / core.CORE))});\n"
        "await core({ module_or_path: require('node:zlib').inflateRawSync(packedCore) });\n"
        f"const worlds = Object.fromEntries(Object.entries({json.dumps(packed)})"
        ".map(([name, text]) => [name, new Uint8Array(Buffer.from(text, 'base64'))]));\n"
        "const base64 = (array) => Buffer.from(array.buffer, array.byteOffset, array.byteLength).toString('base64');\n"
        f"{script}"
    )


def array_of(text: str, like: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """The array in a base64 text, with dtype and shape of another array."""
    return np.frombuffer(base64.b64decode(text), like.dtype).reshape(like.shape)
