"""Endings of files from which worlds are loaded.

The core's table of formats lists most endings.
"""

from __future__ import annotations

from .. import _core, robots, usd

__all__ = ["MESH_ENDINGS", "MODEL_ENDINGS"]

_CORE = tuple(f".{extension}" for extension in _core.file_extensions()[0])
MODEL_ENDINGS = (*_CORE, ".vrm", *usd.SUFFIXES, *robots.SUFFIXES)
"""Endings of files that are worlds or models."""
MESH_ENDINGS = tuple(ending for ending in _CORE if ending not in (".toml", ".gltf", ".glb"))
"""Endings of mesh files, whose unit is unknown."""
