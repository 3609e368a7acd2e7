"""Writes large files for `loading_rivals.py`: copies of two public meshes.

    python benchmarks/write_loading_rivals.py SKULL.obj FISH.obj FOLDER

SKULL.obj (100,002 triangles) has no texture coordinates, FISH.obj (21,568) has. The copies are on a grid, each
with a rotation of its own, so that their numbers differ. The largest file has 1.1 GB.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from bench_loading import write_glb

Mesh = tuple[np.ndarray, np.ndarray, np.ndarray | None]


def read(path: Path) -> Mesh:
    """Returns vertices [n, 3] float32, triangles [m, 3] int32 and texture coordinates [n, 2] or None."""
    points, uvs, corners = [], [], []
    for line in path.read_text().splitlines():
        kind, *values = line.split() or [""]
        if kind == "v":
            points.append([float(value) for value in values])
        elif kind == "vt":
            uvs.append([float(value) for value in values[:2]])
        elif kind == "f":
            corners.append([[int(part) - 1 for part in value.split("/")[:2]] for value in values])
    triangles = np.array(corners)
    if not uvs:
        return np.array(points, np.float32), triangles[..., 0].astype(np.int32), None
    pairs, index = np.unique(triangles.reshape(-1, 2), axis=0, return_inverse=True)
    return (
        np.array(points, np.float32)[pairs[:, 0]],
        index.reshape(-1, 3).astype(np.int32),
        np.array(uvs, np.float32)[pairs[:, 1]],
    )


def copies(mesh: Mesh, count: int) -> Mesh:
    """Returns `count` copies of a mesh on a grid, each rotated about z."""
    vertices, faces, uvs = mesh
    center, size = vertices.mean(0), float(np.ptp(vertices, axis=0).max())
    side = int(np.ceil(count**0.5))
    placed = np.empty((count, *vertices.shape), np.float32)
    for k in range(count):
        turn = 2.4 * k
        rotation = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
        offset = np.array([k % side, k // side, 0]) * 1.5 * size
        placed[k] = (vertices - center) @ rotation.T + offset
    first = (np.arange(count, dtype=np.int32) * len(vertices))[:, None, None]
    return (
        placed.reshape(-1, 3),
        (faces + first).reshape(-1, 3),
        None if uvs is None else np.tile(uvs, (count, 1)),
    )


def normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Returns area-weighted vertex normals [n, 3] float32."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    total = np.stack(
        [np.bincount(faces.ravel(), np.repeat(cross[:, k], 3), len(vertices)) for k in range(3)], -1
    )
    return (total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-20)).astype(np.float32)


def write_obj(path: Path, mesh: Mesh) -> None:
    """Writes Wavefront OBJ, with texture coordinates if present."""
    vertices, faces, uvs = mesh
    step = 1 << 20
    with path.open("w") as file:
        for start in range(0, len(vertices), step):
            file.write(
                "".join(f"v {x:.6f} {y:.6f} {z:.6f}\n" for x, y, z in vertices[start : start + step].tolist())
            )
        for start in range(0, 0 if uvs is None else len(uvs), step):
            assert uvs is not None
            file.write("".join(f"vt {u:.6f} {v:.6f}\n" for u, v in uvs[start : start + step].tolist()))
        row = "f {0} {1} {2}\n" if uvs is None else "f {0}/{0} {1}/{1} {2}/{2}\n"
        for start in range(0, len(faces), step):
            file.write("".join(row.format(*one) for one in (faces[start : start + step] + 1).tolist()))


def write_ply(path: Path, mesh: Mesh, binary: bool) -> None:
    """Writes PLY without attributes."""
    vertices, faces, _ = mesh
    header = (
        f"ply\nformat {'binary_little_endian' if binary else 'ascii'} 1.0\nelement vertex {len(vertices)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    if not binary:
        points = "".join(f"{x:.6f} {y:.6f} {z:.6f}\n" for x, y, z in vertices.tolist())
        path.write_text(header + points + "".join(f"3 {a} {b} {c}\n" for a, b, c in faces.tolist()))
        return
    rows = np.empty(len(faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, faces
    with path.open("wb") as file:
        file.write(header.encode())
        vertices.tofile(file)
        rows.tofile(file)


def write_stl(path: Path, mesh: Mesh) -> None:
    """Writes binary STL."""
    vertices, faces, _ = mesh
    solid = np.zeros(len(faces), dtype=[("numbers", "<f4", (4, 3)), ("unused", "<u2")])
    solid["numbers"][:, 1:] = vertices[faces]
    with path.open("wb") as file:
        file.write(bytes(80) + np.uint32(len(faces)).tobytes())
        solid.tofile(file)


def write_usd(path: Path, mesh: Mesh) -> None:
    """Writes a binary USD file with one mesh."""
    from pxr import Sdf, Usd, UsdGeom, Vt

    stage = Usd.Stage.CreateNew(str(path))
    prim = UsdGeom.Mesh.Define(stage, Sdf.Path("/mesh"))
    prim.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(mesh[0]))
    prim.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(mesh[1]), 3, np.int32)))
    prim.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(mesh[1].ravel()))
    stage.GetRootLayer().Save()


def write_scene(path: Path, mesh: Mesh) -> None:
    """Writes GLB with normals, and texture coordinates if present."""
    vertices, faces, uvs = mesh
    attributes = {"POSITION": vertices, "NORMAL": normals(vertices, faces)}
    write_glb(path, faces, **attributes, **({} if uvs is None else {"TEXCOORD_0": uvs}))


def main() -> None:
    """Writes the files."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("skull", type=Path)
    parser.add_argument("fish", type=Path)
    parser.add_argument("folder", type=Path)
    options = parser.parse_args()
    folder: Path = options.folder
    folder.mkdir(parents=True, exist_ok=True)
    skull, fish = read(options.skull), read(options.fish)
    few, many = copies(skull, 16), copies(skull, 64)
    write_obj(folder / "skulls_16.obj", few)
    write_ply(folder / "skulls_16_ascii.ply", few, binary=False)
    write_usd(folder / "skulls_16.usdc", few)
    write_scene(folder / "skulls_16.glb", few)
    write_stl(folder / "skulls_64.stl", many)
    write_scene(folder / "skulls_64.glb", many)
    write_obj(folder / "fish_64.obj", copies(fish, 64))
    write_scene(folder / "fish_64.glb", copies(fish, 64))
    del few, many
    write_obj(folder / "skulls_256.obj", copies(skull, 256))
    write_ply(folder / "skulls_512.ply", copies(skull, 512), binary=True)


if __name__ == "__main__":
    main()
