"""Mesh files, compared with trimesh.

The triangles, their order and their colours must be equal.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
import trimesh

RANDOM = np.random.default_rng(5)
BALL = trimesh.creation.icosphere(subdivisions=2)

OBJ = {
    "indices from the end": "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf -4 -3 -2\nf -4 -2 -1\n",
    "faces of every form": "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvn 0 0 1\n"
    "f 1 2 3\nf 1/1 2/2 3/1\nf 1//1 2//1 4//1\nf 2/1/1 3/2/1 4/1/1\n",
    "groups and names with spaces": "o the first thing\ng some group\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    "usemtl a b c\ng another\nv 0 0 1\nf 1 2 4\n",
    "comments and odd spaces": "# c\nv  0\t0 0\nv 1 0 0\n\nv 0 1 0\nf  1   2  3\n",
    "exponents and signs": "v +0.5e1 -.25 1E-3\nv 1. 0 0\nv 0 1 0\nf 1 2 3\n",
    "lines and points beside faces": "v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2\np 3\nf 1 2 3\n",
    "ends of lines of Windows": "v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3\r\n",
}
"""OBJ files that trimesh reads as specified.

Other files are excluded: trimesh counts negative indices from the end of the file, does not continue lines, and
triangulates concave polygons as fans.
"""


def same(world: raycam.World, mesh: Any) -> None:
    """Asserts equal triangles as sets of vertices; the order of parts may differ."""

    def sorted_rows(triangles: Any) -> Any:
        rows = np.asarray(triangles, float).reshape(-1, 9)
        return rows[np.lexsort(rows.T)]

    np.testing.assert_array_equal(sorted_rows(world.triangles()), sorted_rows(mesh.triangles))


@pytest.mark.parametrize("name", OBJ)
def test_obj_triangles_equal_trimesh(tmp_path: Path, name: str) -> None:
    path = tmp_path / "a.obj"
    path.write_bytes(OBJ[name].encode())
    same(raycam.load(path), trimesh.load(path, process=False, force="mesh"))


def test_continued_lines_of_obj_are_joined(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("v 0 \\\n0 0\nv 1 0 0\nv 0 1 0\nf 1 \\\n 2 \\\n 3\n")
    (tmp_path / "b.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    np.testing.assert_array_equal(
        raycam.load(tmp_path / "a.obj").triangles(), raycam.load(tmp_path / "b.obj").triangles()
    )


@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian"])
@pytest.mark.parametrize("colors", [False, True])
def test_ply_triangles_and_colors_equal_trimesh(tmp_path: Path, encoding: str, colors: bool) -> None:
    ball = BALL.copy()
    if colors:
        ball.visual.vertex_colors = RANDOM.integers(0, 256, (len(ball.vertices), 4), np.uint8) | [
            0,
            0,
            0,
            255,
        ]
    path = tmp_path / "a.ply"
    path.write_bytes(trimesh.exchange.ply.export_ply(ball, encoding=encoding.split("_")[0]))
    world = raycam.load(path)
    again = trimesh.load(path, process=False)
    # trimesh reads text as float32.
    np.testing.assert_allclose(world.triangles(), again.triangles, rtol=1e-7)
    if colors:
        srgb = again.visual.vertex_colors[:, :3] / 255
        linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
        means = linear[again.faces].mean(axis=1)
        np.testing.assert_allclose(world.triangle_colors(), means, atol=1e-6)


@pytest.mark.parametrize("kind", ["stl", "stl_ascii", "off", "obj"])
def test_stl_off_and_obj_files_of_trimesh_are_read(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"a.{kind.split('_')[0]}"
    BALL.export(path, file_type=kind)
    same(raycam.load(path), trimesh.load(path, process=False, force="mesh"))
