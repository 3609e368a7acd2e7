"""Compares the time and memory of loading files with trimesh, Open3D, Assimp, F3D and Blender.

    python benchmarks/loading_rivals.py [--before FOLDER] [--open3d PYTHON] [--others PYTHON] [--blender PYTHON]
        [--turns N] FILE ...

Each load has a process of its own: it imports the program, loads a small file of the same kind, and then loads
the file once. The files are in the file cache. Times are processor times of all threads and child processes, and
wall times; memory is the peak beyond the memory before the load (Linux: VmHWM). The programs run in alternation.
A rival that takes more than `CONTENTION` times the time of the fastest program in the first turn runs only once.

`--others` names an interpreter with trimesh, DracoPy, Pillow, assimp-py and F3D, `--blender` one with `bpy`.
A program that reads no triangles of a file has no result. trimesh reads images only on access; they are decoded
here. Results of programs that decode no image of the file (`IMAGE_KINDS`) are in brackets, and their ratios are
not counted. `write_loading_rivals.py` writes the large files.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from bench_loading import grid, write_glb

CONTENTION = 2.0
LIMIT_S = 300
# Kinds of images that programs decode; the others decode all kinds.
IMAGE_KINDS = {"trimesh": {"png", "jpeg", "webp"}, "open3d": {"png", "jpeg"}, "assimp": set()}
SETUPS = {
    "raycam": """
import warnings
import raycam
warnings.simplefilter("ignore")
load = raycam.load
count = lambda world: sum(one.triangles for one in world.objects)
""",
    "trimesh": """
import logging
import trimesh
logging.disable()

def load(path):
    scene = trimesh.load_scene(path, process=False)
    for mesh in scene.geometry.values():
        for value in vars(getattr(mesh.visual, "material", None) or object).get("_data", {}).values():
            if hasattr(value, "load"):
                value.load()
        if hasattr(getattr(getattr(mesh.visual, "material", None), "image", None), "load"):
            mesh.visual.material.image.load()
    return scene

count = lambda scene: sum(len(one.faces) for one in scene.geometry.values() if hasattr(one, "faces"))
""",
    "open3d": """
import open3d
open3d.utility.set_verbosity_level(open3d.utility.VerbosityLevel.Error)
model = lambda path: path.lower().endswith(("gltf", "glb"))
read = open3d.io
load = lambda path: (read.read_triangle_model if model(path) else read.read_triangle_mesh)(path)
count = lambda found: (
    sum(len(one.mesh.triangles) for one in found.meshes) if hasattr(found, "meshes") else len(found.triangles)
)
""",
    "assimp": """
import assimp_py
load = lambda path: assimp_py.import_file(path, assimp_py.Process_Triangulate)
count = lambda scene: sum(len(one.indices) // 3 for one in scene.meshes)
""",
    "f3d": """
import f3d
f3d.Log.set_verbose_level(f3d.Log.VerboseLevel.QUIET)
f3d.Engine.autoload_plugins()

def load(path):
    engine = f3d.Engine.create_none()
    engine.scene.add(path)
    return engine

count = lambda engine: engine.scene.get_scene_info().number_of_cells
""",
    "blender": """
import bpy
bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
readers = {
    "obj": bpy.ops.wm.obj_import, "ply": bpy.ops.wm.ply_import, "stl": bpy.ops.wm.stl_import,
    "glb": bpy.ops.import_scene.gltf, "gltf": bpy.ops.import_scene.gltf,
    "usdc": bpy.ops.wm.usd_import, "usda": bpy.ops.wm.usd_import,
}

def load(path):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    readers[path.rsplit(".")[-1].lower()](filepath=path)
    for image in bpy.data.images:
        if image.source == "FILE":
            len(image.pixels)

count = lambda _: sum(len(one.loop_triangles) or len(one.polygons) for one in bpy.data.meshes)
""",
}
SETUPS["before"] = SETUPS["raycam"]
MEASURE = """
import json, os, resource, sys, time
{setup}
path, small = sys.argv[1:]
ended = lambda: resource.getrusage(resource.RUSAGE_CHILDREN)
cpu = lambda: time.process_time() + ended().ru_utime + ended().ru_stime
status = lambda key: int(open("/proc/self/status").read().split(key + ":")[1].split()[0]) / 1024
load(small)
open("/proc/self/clear_refs", "w").write("5")
held, start, since = status("VmRSS"), time.perf_counter(), cpu()
found = load(path)
times = [cpu() - since, time.perf_counter() - start, status("VmHWM") - held]
print("\\n" + json.dumps([*times, count(found)]), flush=True)
os._exit(0)
"""


def write_small(folder: Path) -> dict[str, Path]:
    """Writes a mesh of 200 triangles in each format; returns the paths by extension."""
    vertices, faces = grid(200)
    write_glb(folder / "small.glb", faces, POSITION=vertices)
    points = [f"{x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices.tolist()]
    corners = [f"f {a} {b} {c}" for a, b, c in (faces + 1).tolist()]
    (folder / "small.obj").write_text("\n".join([*(f"v {point}" for point in points), *corners, ""]))
    header = (
        f"ply\nformat ascii 1.0\nelement vertex {len(vertices)}\nproperty float x\nproperty float y\n"
        f"property float z\nelement face {len(faces)}\nproperty list uchar int vertex_indices\nend_header"
    )
    rows = [f"3 {a} {b} {c}" for a, b, c in faces.tolist()]
    (folder / "small.ply").write_text("\n".join([header, *points, *rows, ""]))
    solid = np.zeros(len(faces), dtype=[("numbers", "<f4", (4, 3)), ("unused", "<u2")])
    solid["numbers"][:, 1:] = vertices[faces]
    (folder / "small.stl").write_bytes(bytes(80) + np.uint32(len(faces)).tobytes() + solid.tobytes())
    usd = ", ".join(f"({x:.6f}, {y:.6f}, {z:.6f})" for x, y, z in vertices.tolist())
    (folder / "small.usda").write_text(
        f'#usda 1.0\n(upAxis = "Z")\ndef Mesh "grid" {{\n    point3f[] points = [{usd}]\n'
        f"    int[] faceVertexCounts = {[3] * len(faces)}\n"
        f"    int[] faceVertexIndices = {faces.ravel().tolist()}\n}}\n"
    )
    small = {path.suffix: path for path in folder.iterdir()}
    return {**small, ".gltf": small[".glb"], ".usdc": small[".usda"]}


def measure(program: str, python: str, package: Path | None, path: Path, small: Path) -> list[float] | str:
    """Returns processor seconds, wall seconds, MiB and triangles of a load, or the reason of a failure."""
    environment = {**os.environ, **({"PYTHONPATH": str(package)} if package else {})}
    if program not in ("raycam", "before"):
        environment.pop("PYTHONPATH", None)
    command = [python, "-c", MEASURE.replace("{setup}", SETUPS[program]), str(path), str(small)]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, check=False, env=environment, timeout=LIMIT_S
        )
    except subprocess.TimeoutExpired:
        return f"over {LIMIT_S} s"
    lines = [line for line in done.stdout.splitlines() if line.startswith("[")]
    if done.returncode or not lines:
        return (done.stderr.strip().splitlines() or ["failed"])[-1]
    result = [float(value) for value in json.loads(lines[-1])]
    return result if result[3] else "no triangles"


def files_of(path: Path) -> list[Path]:
    """Returns the file, and for glTF the files in its folder."""
    return [path] if path.suffix != ".gltf" else [one for one in path.parent.iterdir() if one.is_file()]


def without_images(program: str, path: Path) -> bool:
    """Returns whether the program decodes no image of the glTF file."""
    if path.suffix not in (".glb", ".gltf"):
        return False
    kinds = re.findall(
        rb"image/(png|jpeg|webp|ktx2)|\.(png|jpeg|jpg|webp|ktx2)\"", path.read_bytes()[: 1 << 20]
    )
    found = {(mime or suffix).decode().replace("jpg", "jpeg") for mime, suffix in kinds}
    return bool(found) and not found & IMAGE_KINDS.get(program, found)


def cell(turns: list[list[float]]) -> str:
    """Returns best and median processor seconds, best wall seconds, and MiB."""
    cpu, wall, memory, _ = zip(*turns, strict=True)
    return f"{min(cpu):.3f}, {statistics.median(cpu):.3f}; {min(wall):.3f}; {min(memory):.0f}"


def main() -> None:
    """Prints a row for each file, with a cell for each program, and the ratio to the fastest rival."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--before", type=Path, help="package folder of another raycam build")
    parser.add_argument("--open3d", metavar="PYTHON", help="Python interpreter with Open3D")
    parser.add_argument(
        "--others", metavar="PYTHON", help="Python interpreter with trimesh, assimp-py and F3D"
    )
    parser.add_argument("--blender", metavar="PYTHON", help="Python interpreter with bpy")
    parser.add_argument("--turns", type=int, default=5)
    parser.add_argument("files", nargs="+", type=Path)
    options = parser.parse_args()
    pythons: dict[str, Any] = {"raycam": sys.executable, "before": options.before and sys.executable}
    pythons |= {"trimesh": options.others, "open3d": options.open3d, "assimp": options.others}
    pythons |= {"f3d": options.others, "blender": options.blender}
    programs = {name: python for name, python in pythons.items() if python}
    print("| file | MB | triangles | " + " | ".join(programs) + " | of the fastest rival |")
    print("| --- | --: | --: |" + " --: |" * (len(programs) + 1))
    with tempfile.TemporaryDirectory() as name:
        small = write_small(Path(name))
        for path in options.files:
            print(row_of(path, small[path.suffix.lower()], programs, options), flush=True)


def row_of(path: Path, small: Path, programs: dict[str, str], options: argparse.Namespace) -> str:
    """Measures all programs on a file; returns the row of the table."""
    for one in files_of(path):
        with one.open("rb") as file:
            while file.read(1 << 24):
                pass
    found: dict[str, list[list[float]]] = {name: [] for name in programs}
    running = list(programs)
    for turn in range(options.turns):
        for name in running[:: 1 if turn % 2 else -1]:
            package = options.before if name == "before" else None
            result = measure(name, programs[name], package, path, small)
            if isinstance(result, str):
                print(f"{path.name}: {name}: {result}", file=sys.stderr)
            else:
                found[name].append(result)
        best = [min(np.array(found[name])[:, :2].min(0).tolist()) for name in running if found[name]]
        running = [
            name
            for name in running
            if name in ("raycam", "before")
            or (found[name] and np.array(found[name])[:, :2].min() < CONTENTION * min(best))
        ]
    size = sum(one.stat().st_size for one in files_of(path)) / 1e6
    counts = ", ".join(sorted({f"{turns[0][3]:,.0f}" for turns in found.values() if turns}))
    cells, rivals = [], []
    for name, turns in found.items():
        bracketed = without_images(name, path)
        text = cell(turns) if turns else "-"
        cells.append(f"({text})" if turns and bracketed else text)
        if turns and not bracketed and name not in ("raycam", "before"):
            rivals.append(np.array(turns)[:, :3].min(0))
    ratios = "-"
    if rivals and found["raycam"]:
        least = np.maximum(np.min(rivals, axis=0), 1e-9)
        ratios = ", ".join(f"{one:.2f}" for one in np.array(found["raycam"])[:, :3].min(0) / least)
    return f"| {path.name} | {size:.1f} | {counts} | {' | '.join(cells)} | {ratios} |"


if __name__ == "__main__":
    main()
