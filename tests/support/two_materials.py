"""A square of two triangles, each with its own material."""

from __future__ import annotations

from pathlib import Path

import raycam

__all__ = ["two_materials"]


def two_materials(folder: Path) -> raycam.World:
    """Returns the world of the file m.obj, which is written to `folder`.

    The materials are "red" of the first triangle and "blue" of the second triangle.
    """
    (folder / "m.mtl").write_text("newmtl red\nKd 0.8 0.1 0.1\nnewmtl blue\nKd 0.1 0.1 0.9\n")
    faces = "usemtl red\nf 1/1 2/2 3/3\nusemtl blue\nf 2/2 4/4 3/3\n"
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvt 1 1\n"
    (folder / "m.obj").write_text(f"mtllib m.mtl\n{corners}{faces}")
    return raycam.load(folder / "m.obj")
