"""raycam compiled for WebAssembly, as elements of a page.

`make web` builds this core, and wheels contain it.
"""

from __future__ import annotations

import base64
import zlib
from importlib.resources import files

from ...errors import SettingsError

__all__ = ["core_blocks", "core_bytes", "deflated", "is_built", "packed"]

FOLDER = "wasm"
GLUE, CORE = "raycam_web.js", "raycam_web_bg.wasm.deflate"
"""The JavaScript interface of the WebAssembly core, and the core compressed as raw deflate."""
LEVEL = 9


def is_built() -> bool:
    """Returns True if raycam compiled for WebAssembly is next to this module."""
    return (files(__package__) / FOLDER / CORE).is_file()


def core_blocks() -> list[str]:
    """Returns the elements of a page that contain raycam.

    Raises `SettingsError` if the core was not built.
    """
    if not is_built():
        raise SettingsError(
            "live pages require raycam compiled for WebAssembly, which this installation does not contain; install a "
            "wheel from PyPI, or run `make web` in a clone",
            code="missing_dependency",
        )
    folder = files(__package__) / FOLDER
    glue = (folder / GLUE).read_text(encoding="utf-8")
    if "</script" in glue.lower() or "<!--" in glue:
        raise ValueError("the core's text contains the end of a script element, </script")
    return [
        f'<script type="text/plain" id="core-glue">{glue}</script>',
        f'<script type="text/plain" id="core-wasm">{_base64((folder / CORE).read_bytes())}</script>',
    ]


def core_bytes() -> bytes:
    """Returns raycam as WebAssembly; raises `FileNotFoundError` if the core was not built."""
    return zlib.decompress((files(__package__) / FOLDER / CORE).read_bytes(), -15)


def packed(data: bytes) -> str:
    """Raw deflate data in base64, which the client unpacks."""
    return _base64(deflated(data))


def deflated(data: bytes) -> bytes:
    """The bytes as raw deflate."""
    packer = zlib.compressobj(LEVEL, zlib.DEFLATED, -15)
    return packer.compress(data) + packer.flush()


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode()
