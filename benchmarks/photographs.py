"""Visibility, textures and ambient occlusion of photographs' surfaces: processor seconds, and Open3D next to them.

    python benchmarks/photographs.py [--faces N] [--cameras N] [--size N] [--open3d INTERPRETER]

Processor seconds of all threads are less sensitive to other work on the machine than elapsed ones. Open3D runs in its
own interpreter, since its wheel pins other packages.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import raycam

RIVAL = """
import json, resource, sys, time
import numpy as np, open3d as o3d
data = np.load(sys.argv[1])
mesh = o3d.t.geometry.TriangleMesh(data["vertices"], data["faces"])
mesh.triangle.texture_uvs = o3d.core.Tensor(data["uvs"])
images = [o3d.t.geometry.Image(image) for image in data["images"]]
k = [o3d.core.Tensor(matrix) for matrix in data["k"]]
poses = [o3d.core.Tensor(matrix) for matrix in data["poses"]]
start = time.process_time(), time.perf_counter()
albedo = mesh.project_images_to_albedo(images, k, poses, int(data["size"]), True)
used = time.process_time() - start[0], time.perf_counter() - start[1]
np.save(sys.argv[2], np.asarray(albedo.as_tensor().numpy()))
print(json.dumps(used))
"""


def measured(work: Callable[[], object]) -> tuple[object, float, float]:
    """The result, processor seconds and elapsed seconds."""
    start = time.process_time(), time.perf_counter()
    found = work()
    return found, time.process_time() - start[0], time.perf_counter() - start[1]


def ball(faces: int) -> tuple[raycam.World, np.ndarray, np.ndarray, np.ndarray]:
    """A bumpy ball of about `faces` triangles with texture coordinates, unlit, and its arrays."""
    side = round(np.sqrt(faces / 2))
    u, v = np.meshgrid(np.linspace(0, 1, side + 1), np.linspace(0.02, 0.98, side + 1))
    radius = 1 + 0.05 * np.sin(20 * u * np.pi) * np.sin(15 * v * np.pi)
    angle, polar = 2 * np.pi * u, np.pi * v
    points = np.stack([np.sin(polar) * np.cos(angle), np.sin(polar) * np.sin(angle), np.cos(polar)], axis=-1)
    corner = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
    a, b, c, d = corner, corner + side + 1, corner + side + 2, corner + 1
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    vertices, uvs = (points * radius[..., None]).reshape(-1, 3), np.stack([u.ravel(), v.ravel()], axis=1)
    x, y = np.meshgrid(np.arange(512), np.arange(512))
    picture = np.stack([x // 2, y // 2, 128 + 100 * np.sin(x / 9) * np.cos(y / 7)], axis=2).astype(np.uint8)
    world = raycam.World()
    material = {"type": "unlit", "texture": raycam.Texture(picture, wrap="clamp")}
    world.add_mesh(vertices, triangles, uvs=uvs, name="ball", material=material)
    return world, vertices, triangles, uvs


def main() -> None:
    """Prints a table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--faces", type=int, default=200_000)
    parser.add_argument("--cameras", type=int, default=20)
    parser.add_argument("--size", type=int, default=1024)
    parser.add_argument("--photo", type=int, nargs=2, default=(1200, 900))
    parser.add_argument("--open3d", metavar="INTERPRETER")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    world, vertices, triangles, uvs = ball(options.faces)
    turns = np.arange(options.cameras) * np.pi * (3 - np.sqrt(5))
    height = np.linspace(-0.8, 0.8, options.cameras)
    cameras = {
        f"{i:03d}": raycam.Camera.look_at(
            3 * np.array([np.sqrt(1 - z * z) * np.cos(a), np.sqrt(1 - z * z) * np.sin(a), z]),
            [0, 0, 0],
            size=tuple(options.photo),
            fov=45,
        )
        for i, (a, z) in enumerate(zip(turns, height, strict=True))
    }
    photos = {name: raycam.render(world, camera, samples=4).to_srgb8() for name, camera in cameras.items()}
    count = len(triangles)
    print("| | processor seconds | elapsed seconds |\n| --- | --: | --: |")

    def row(name: str, used: float, elapsed: float) -> None:
        print(f"| {name} | {used:.1f} | {elapsed:.1f} |", flush=True)

    _, used, elapsed = measured(lambda: raycam.surface_visibility(world, cameras))
    row(f"visibility of {count} faces in {len(cameras)} cameras", used, elapsed)
    for method in ("blend", "best"):
        _, used, elapsed = measured(
            lambda method=method: raycam.texture_from_photos(  # type: ignore[misc]
                world, cameras, photos, size=options.size, method=method
            )
        )
        name = f"texture of {options.size}² from {len(cameras)} photographs, {method}"
        row(name, used, elapsed)
    _, used, elapsed = measured(lambda: raycam.bake(world, ["ao"], size=options.size // 2, samples=64))
    row(f"ambient occlusion, {options.size // 2}², 64 rays", used, elapsed)
    if options.open3d:
        with tempfile.TemporaryDirectory() as folder:
            arrays, output = Path(folder) / "in.npz", Path(folder) / "out.npy"
            poses = []
            for camera in cameras.values():
                pose = np.eye(4)
                pose[:3, :3], pose[:3, 3] = camera.R, camera.t
                poses.append(pose)
            corners = uvs[triangles].astype(np.float32)
            corners[..., 1] = 1 - corners[..., 1]
            np.savez(
                arrays,
                vertices=vertices.astype(np.float32),
                faces=triangles.astype(np.int64),
                uvs=corners,
                images=np.stack(list(photos.values())),
                k=np.stack([camera.K for camera in cameras.values()]),
                poses=np.stack(poses),
                size=options.size,
            )
            command = [options.open3d, "-c", RIVAL, str(arrays), str(output)]
            text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
            used, elapsed = json.loads(text.splitlines()[-1])
            row(f"Open3D project_images_to_albedo, {options.size}²", used, elapsed)


if __name__ == "__main__":
    main()
