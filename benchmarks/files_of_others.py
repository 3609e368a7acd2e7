"""Reads every mesh and image in a folder, and compares the results with trimesh and Pillow.

    python benchmarks/files_of_others.py FOLDER [--damage 4]

Each library runs in a separate process. The script prints a line for each file that raycam refuses, and for
each file that differs: another number of triangles, other bounds, or texels that differ by more than 1.2 % of
the range. It also prints a line for each file whose refusal takes more than a second, or more memory than 64
MiB and 16 times the file's size. With `--damage`, the given number of damaged copies of each file is read
too: truncated, with a bit or eight bytes changed, or with a part missing.
"""

from __future__ import annotations

import argparse
import json
import logging
import os
import random
import resource
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import raycam

MESHES = {".gltf", ".glb", ".obj", ".ply", ".stl", ".off"}
IMAGES = {".png", ".jpg", ".jpeg", ".webp", ".ktx2", ".exr", ".hdr", ".tga", ".bmp"}


def apart(work: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """Runs a function in a fork of this process; returns its result, time and additional memory."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        before, start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.perf_counter()
        try:
            found = work()
        except (raycam.Error, OSError) as error:
            found = {"refused": f"{type(error).__name__}: {error}"}
        except BaseException as error:  # any error of a reader is reported
            found = {"fault": repr(error)}
        found["seconds"] = time.perf_counter() - start
        found["MiB"] = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
        os.write(writer, json.dumps(found).encode())
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader) as answer:
        said = answer.read()
    _, status = os.waitpid(child, 0)
    return json.loads(said) if said else {"fault": f"status {status}"}


def extent(triangles: np.ndarray) -> list[Any]:
    points = triangles.reshape(-1, 3)
    return [len(triangles), *points.min(axis=0).tolist(), *points.max(axis=0).tolist()]


def mesh(path: Path) -> dict[str, Any]:
    world = raycam.load(path)
    if not world.objects:
        return {"notices": world.notices}
    raycam.render(world, samples=1)
    return {"extent": extent(np.asarray(world.triangles())), "notices": world.notices}


def mesh_of_trimesh(path: Path) -> dict[str, Any]:
    import trimesh

    logging.disable()
    scene = trimesh.load(path, process=False, force="scene").to_geometry()
    return {"extent": extent(np.asarray(scene.triangles))}


def textured(path: Path) -> raycam.World:
    world = raycam.World()
    world.add_object(plane={"size": [2, 2]}, texture=raycam.Texture(path, filter="nearest", wrap="clamp"))
    return world


def image(path: Path) -> dict[str, Any]:
    """Renders an image with one pixel per texel, and compares it with Pillow's."""
    from PIL import Image

    world = textured(path)
    raycam.render(
        world, raycam.Camera.look_at([0, 0, 5], [0, 0, 0], [0, 1, 0], size=(2, 2), fov=30), samples=1
    )
    try:
        with Image.open(path) as opened:
            deep = opened.mode.startswith("I")
            table = np.asarray(opened if deep else opened.convert("RGB"), float) / (65535 if deep else 255)
    except (OSError, SyntaxError, ValueError):
        return {"others": "Pillow cannot read the file"}
    height, width = table.shape[:2]
    table = np.broadcast_to(table.reshape(height, width, -1), (height, width, 3))
    linear = np.where(table <= 0.04045, table / 12.92, ((table + 0.055) / 1.055) ** 2.4)
    K = [[width / 2, 0, width / 2], [0, height / 2, height / 2], [0, 0, 1]]
    camera = raycam.Camera(
        K=K, R=np.diag([1, -1, -1]), C=[0, 0, 1], size=(width, height), pixel_center="half"
    )
    seen = raycam.render(world, camera, samples=1, channels=["albedo"])["albedo"]
    return {"off": float((np.abs(seen - linear).max(axis=-1) > 0.012).mean())}


def image_alone(path: Path) -> dict[str, Any]:
    textured(path).prepare()
    return {}


def damaged(data: bytes, kind: int, draw: random.Random) -> bytes:
    changed, at = bytearray(data), draw.randrange(len(data))
    if kind % 4 == 0:
        return data[:at]
    if kind % 4 == 1:
        changed[at] ^= 1 << draw.randrange(8)
    elif kind % 4 == 2:
        for _ in range(8):
            changed[draw.randrange(min(len(data), 400))] = draw.randrange(256)
    else:
        del changed[at : at + draw.randrange(1, 64)]
    return bytes(changed)


def size_with_companions(path: Path) -> int:
    """Returns a file's size in bytes, from which its memory limit is computed.

    For glTF and OBJ files, which refer to other files, this is the size of the folder.
    """
    alone = path.suffix.lower() not in {".gltf", ".obj"}
    return sum(file.stat().st_size for file in ([path] if alone else path.parent.iterdir()) if file.is_file())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--damage", type=int, default=0)
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    counts: Counter[str] = Counter()

    def tell(path: Path, kind: str, words: object) -> None:
        counts[kind] += 1
        print(f"{kind}: {path.relative_to(arguments.folder)}: {words}")

    def bounded(path: Path, found: dict[str, Any], size: int) -> None:
        if "fault" in found:
            tell(path, "fault", found["fault"])
        elif "refused" in found and (found["seconds"] > 1 or found["MiB"] > 64 + 16 * size / 2**20):
            tell(path, "over", f"{found['seconds']:.2f} s, {found['MiB']:.0f} MiB")

    draw = random.Random(0)
    for path in sorted(file for file in arguments.folder.rglob("*") if file.is_file()):
        suffix = path.suffix.lower()
        if suffix not in MESHES | IMAGES:
            continue
        read = mesh if suffix in MESHES else image
        counts["files"] += 1
        found = apart(lambda path=path, read=read: read(path))
        bounded(path, found, size_with_companions(path))
        if "refused" in found:
            tell(path, "refused", found["refused"].replace(str(path), path.name))
        elif found.get("off"):
            tell(path, "other texels", f"{found['off']:.4f} of them")
        elif "extent" in found:
            other = apart(lambda path=path: mesh_of_trimesh(path)).get("extent")
            if other and not np.allclose(other, found["extent"], rtol=1e-4, atol=1e-4):
                tell(path, "other shape", f"{found['extent']}, trimesh {other}")
        with tempfile.NamedTemporaryFile(dir=path.parent, suffix=suffix) as copy:
            for kind in range(arguments.damage if path.stat().st_size else 0):
                Path(copy.name).write_bytes(damaged(path.read_bytes(), kind, draw))
                work = mesh if suffix in MESHES else image_alone
                counts["damaged"] += 1
                found = apart(lambda work=work, copy=copy: work(Path(copy.name)))
                bounded(path, found, size_with_companions(path))
    print(dict(counts))


if __name__ == "__main__":
    main()
