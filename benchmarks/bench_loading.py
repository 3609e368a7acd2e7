"""Compares loading times with trimesh, Open3D and Mitsuba.

    python benchmarks/bench_loading.py [--peers PEERS/bin/python] [--before FOLDER] [--triangles N] [--rounds N]
        [FILE ...]

Without a FILE, the script generates files of a million triangles. `--before` names the folder that contains
the package `raycam` of another build; both builds then run in alternation.

Every reader loads every file in a process of its own. The process first loads a small file of the same kind,
so that everything is imported; then it loads the file once, and `rounds` more times. The first time is what a
program that loads one file experiences. The best of the other times applies to a program that has already
used this much memory and may still hold it. The table also contains the peak memory of the process in
addition to the memory before loading (Linux: VmHWM). The files are in the file cache.
"""

from __future__ import annotations

import argparse
import json
import os
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

OURS = "import raycam\nload = raycam.load"
READERS = {
    "raycam": OURS,
    "before": OURS,
    "trimesh": "import trimesh\nload = lambda path: trimesh.load(path, process=False)",
    "open3d": "import open3d\nload = lambda path: open3d.io.read_triangle_mesh(path)",
    "mitsuba": (
        "import mitsuba\nmitsuba.set_variant('scalar_rgb')\n"
        "load = lambda path: mitsuba.load_dict({'type': path.rsplit('.')[-1], 'filename': path})"
    ),
}

MEASURE = """
import json, sys, time
{setup}
path, small, rounds = sys.argv[1], sys.argv[2], int(sys.argv[3])
peak = lambda: int(open("/proc/self/status").read().split("VmHWM:")[1].split()[0]) / 1024
load(small)
with open(path, "rb") as file:
    while file.read(1 << 16):
        pass
before, times = peak(), []
for _ in range(rounds + 1):
    start = time.perf_counter()
    mesh = load(path)
    times.append(time.perf_counter() - start)
    del mesh
print(json.dumps([times[0], min(times[1:]), peak() - before]))
"""


def grid(triangles: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns a wavy square: vertices [n, 3] float32, triangles [m, 3] int32."""
    side = max(1, round((triangles / 2) ** 0.5))
    x, y = np.meshgrid(np.linspace(-1, 1, side + 1), np.linspace(-1, 1, side + 1))
    vertices = np.stack([x, y, 0.1 * np.sin(9 * x) * np.cos(7 * y)], -1).reshape(-1, 3)
    first = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).reshape(-1)
    a, b, c, d = first, first + 1, first + side + 2, first + side + 1
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])
    return vertices.astype(np.float32), faces.astype(np.int32)


def write_files(folder: Path, triangles: int) -> list[Path]:
    """Writes the mesh as OBJ, binary PLY, binary STL and GLB, and returns the paths.

    OBJ is written with and without texture coordinates, GLB with and without normals.
    """
    vertices, faces = grid(triangles)
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices.tolist()]
    plain = folder / "plain.obj"
    plain.write_text("\n".join([*lines, *(f"f {a} {b} {c}" for a, b, c in (faces + 1).tolist()), ""]))
    uvs = [f"vt {x:.6f} {y:.6f}" for x, y, _ in ((vertices + 1) / 2).tolist()]
    corners = [f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in (faces + 1).tolist()]
    textured = folder / "textured.obj"
    textured.write_text("\n".join([*lines, *uvs, *corners, ""]))
    ply = folder / "binary.ply"
    rows = np.empty(len(faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, faces
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\nproperty float x\nproperty float y\n"
        f"property float z\nelement face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    ply.write_bytes(header.encode() + vertices.tobytes() + rows.tobytes())
    stl = folder / "binary.stl"
    solid = np.zeros(len(faces), dtype=[("numbers", "<f4", (4, 3)), ("unused", "<u2")])
    solid["numbers"][:, 1:] = vertices[faces]
    stl.write_bytes(bytes(80) + np.uint32(len(faces)).tobytes() + solid.tobytes())
    up = np.tile(np.array([0, 0, 1], np.float32), (len(vertices), 1))
    bare, shaded = folder / "bare.glb", folder / "shaded.glb"
    write_glb(bare, faces, POSITION=vertices)
    write_glb(shaded, faces, POSITION=vertices, NORMAL=up, TEXCOORD_0=((vertices[:, :2] + 1) / 2))
    return [plain, textured, ply, stl, bare, shaded]


def write_glb(path: Path, faces: np.ndarray, **attributes: np.ndarray) -> None:
    """Writes a GLB file with one primitive of indexed triangles."""
    arrays = [faces.astype(np.uint32).reshape(-1, 1), *(a.astype(np.float32) for a in attributes.values())]
    kinds = {1: "SCALAR", 2: "VEC2", 3: "VEC3"}
    views, accessors, start = [], [], 0
    for i, array in enumerate(arrays):
        views.append({"buffer": 0, "byteOffset": start, "byteLength": array.nbytes})
        accessors.append(
            {
                "bufferView": i,
                "componentType": 5125 if array.dtype == np.uint32 else 5126,
                "count": len(array),
                "type": kinds[array.shape[1]],
                "min": array.min(0).tolist(),
                "max": array.max(0).tolist(),
            }
        )
        start += array.nbytes
    primitive = {"attributes": {name: i + 1 for i, name in enumerate(attributes)}, "indices": 0}
    root = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": start}],
        "bufferViews": views,
        "accessors": accessors,
        "meshes": [{"primitives": [primitive]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }
    text = json.dumps(root).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sIII4s", b"glTF", 2, 28 + len(text) + start, len(text), b"JSON")
    binary = struct.pack("<I4s", start, b"BIN\0") + b"".join(array.tobytes() for array in arrays)
    path.write_bytes(head + text + binary)


def main() -> None:
    """Prints a row for each file: the seconds and the memory of each reader.

    The seconds are the first and the best; the memory is the additional memory in MiB.
    """
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--peers", help="Python interpreter with Open3D and Mitsuba")
    parser.add_argument("--before", help="package folder of another raycam build")
    parser.add_argument("--triangles", type=int, default=1_000_000)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("files", nargs="*", type=Path, help="files to load (default: generated files)")
    options = parser.parse_args()
    interpreters = {"raycam": sys.executable}
    if options.before:
        interpreters["before"] = sys.executable
    interpreters["trimesh"] = sys.executable
    if options.peers:
        interpreters |= {"open3d": options.peers, "mitsuba": options.peers}
    print("| file | MB | " + " | ".join(interpreters) + " |")
    print("| --- | --: |" + " --: |" * len(interpreters))
    with tempfile.TemporaryDirectory() as name:
        (Path(name) / "small").mkdir()
        small = {path.suffix: path for path in write_files(Path(name) / "small", 200)}
        for path in options.files or write_files(Path(name), options.triangles):
            found: dict[str, list[list[float]]] = {}
            for reader, python in [*interpreters.items()] * (3 if options.before else 1):
                script = MEASURE.format(setup=READERS[reader])
                sample = small.get(path.suffix.lower(), path)
                command = [python, "-c", script, str(path), str(sample), str(options.rounds)]
                environment = {**os.environ, "PYTHONPATH": options.before} if reader == "before" else None
                result = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
                turns = found.setdefault(reader, [])
                if result.returncode == 0:
                    turns.append(json.loads(result.stdout.splitlines()[-1]))
            cells = []
            for turns in found.values():
                first, best, memory = np.min(turns, axis=0) if turns else (np.nan,) * 3
                cells.append(f"{first:.3f}, {best:.3f} s, {memory:.0f} MiB" if turns else "-")
            print(
                f"| {path.name} | {path.stat().st_size / 1e6:.1f} | " + " | ".join(cells) + " |", flush=True
            )


if __name__ == "__main__":
    main()
