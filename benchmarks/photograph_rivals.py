"""Programs that `photographs.py` measures, each in its own process and interpreter.

    INTERPRETER benchmarks/photograph_rivals.py PROGRAM IN.npz OUT.npz

IN.npz contains the mesh, the cameras and the photographs. A program writes its result to OUT.npz, and prints
its processor seconds and elapsed seconds. These times do not include reading the arrays, importing libraries
and writing the result.
"""

from __future__ import annotations

import json
import os
import resource
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

Arrays = dict[str, Any]
USED: list[float] = [0.0, 0.0]


class Measured:
    """Adds the block's processor seconds (with child processes) and elapsed seconds to `USED`."""

    def __enter__(self) -> None:
        self.start = self.now()

    def __exit__(self, *_: object) -> None:
        for place, (after, before) in enumerate(zip(self.now(), self.start, strict=True)):
            USED[place] += after - before

    @staticmethod
    def now() -> tuple[float, float]:
        children = resource.getrusage(resource.RUSAGE_CHILDREN)
        return time.process_time() + children.ru_utime + children.ru_stime, time.perf_counter()


def raycam_world(data: Arrays) -> tuple[Any, dict[str, Any], dict[str, Any]]:
    """Returns the world, and the cameras and photographs by name."""
    import raycam

    world = raycam.World()
    world.add_mesh(data["vertices"], data["faces"], uvs=data["uvs"], name="ball")
    cameras = {
        f"{i:04d}": raycam.Camera(
            k, pose[:3, :3], -pose[:3, :3].T @ pose[:3, 3], tuple(data["photo"].tolist())
        )
        for i, (k, pose) in enumerate(zip(data["k"], data["poses"], strict=True))
    }
    return world, cameras, {name: data["images"][i] for i, name in enumerate(cameras)}


def raycam_texture(method: str) -> Callable[[Arrays], Arrays]:
    def program(data: Arrays) -> Arrays:
        import raycam

        world, cameras, photos = raycam_world(data)
        with Measured():
            found = raycam.texture_from_photos(world, cameras, photos, size=int(data["size"]), method=method)
        return {"texture": found.texture, "known": found.seen}

    return program


def raycam_depth(data: Arrays) -> Arrays:
    import raycam

    world, cameras, _ = raycam_world(data)
    with Measured():
        depth = [
            raycam.render(world, one, channels=["depth"], samples=1)["depth"] for one in cameras.values()
        ]
    return {"depth": np.where(np.isfinite(depth), depth, 0)}


def raycam_visibility(data: Arrays) -> Arrays:
    import raycam

    world, cameras, _ = raycam_world(data)
    with Measured():
        found = raycam.surface_visibility(world, cameras)
    return {"views": found.views}


def raycam_occlusion(target: str) -> Callable[[Arrays], Arrays]:
    def program(data: Arrays) -> Arrays:
        import raycam

        world, _, _ = raycam_world(data)
        size = int(data["size"])
        with Measured():
            maps = raycam.bake(world, ["ao"], to=target, size=size, samples=int(data["rays"]))
        if target == "texture":
            return {"ao": maps["ao"], "known": maps.covered}
        return {"ao": at_vertices(maps.vertices, maps["ao"], data["vertices"])}

    return program


def at_vertices(places: Any, values: Any, wanted: Any) -> Any:
    """Returns the values at the vertices `places` [n, 3] of the same mesh in another order."""
    known = {tuple(place): value for place, value in zip(np.float32(places).tolist(), values, strict=True)}
    return np.array([known.get(tuple(place), np.nan) for place in np.float32(wanted).tolist()])


def open3d_texture(data: Arrays) -> Arrays:
    import open3d

    mesh = open3d.t.geometry.TriangleMesh(data["vertices"].astype(np.float32), data["faces"].astype(np.int64))
    corners = data["uvs"][data["faces"]].astype(np.float32)
    corners[..., 1] = 1 - corners[..., 1]
    mesh.triangle.texture_uvs = open3d.core.Tensor(corners)
    images = [open3d.t.geometry.Image(np.ascontiguousarray(image)) for image in data["images"]]
    k, poses = ([open3d.core.Tensor(matrix) for matrix in data[name]] for name in ("k", "poses"))
    with Measured():
        albedo = mesh.project_images_to_albedo(images, k, poses, int(data["size"]), True)
    return {"texture": np.asarray(albedo.as_tensor().numpy())[..., :3]}


def pyrender_depth(data: Arrays) -> Arrays:
    os.environ.setdefault("PYOPENGL_PLATFORM", "osmesa")
    import pyrender
    import trimesh

    width, height = data["photo"].tolist()
    mesh = pyrender.Mesh.from_trimesh(trimesh.Trimesh(data["vertices"], data["faces"], process=False))
    scene = pyrender.Scene()
    scene.add(mesh)
    depth = []
    with Measured():
        renderer = pyrender.OffscreenRenderer(width, height)
        for k, pose in zip(data["k"], data["poses"], strict=True):
            # Pixel centres have integer coordinates in `k`, but half-integer coordinates in OpenGL.
            place = k[0, 0], k[1, 1], k[0, 2] + 0.5, k[1, 2] + 0.5
            camera = pyrender.IntrinsicsCamera(*place, znear=0.05, zfar=100)
            node = scene.add(camera, pose=np.linalg.inv(pose) @ np.diag([1.0, -1, -1, 1]))
            depth.append(renderer.render(scene, flags=pyrender.RenderFlags.DEPTH_ONLY))
            scene.remove_node(node)
        renderer.delete()
    return {"depth": np.array(depth)}


def pymeshlab_occlusion(data: Arrays) -> Arrays:
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(data["vertices"], data["faces"]))
    with Measured():
        meshes.compute_scalar_ambient_occlusion(rays=int(data["rays"]))
    return {"ao": meshes.current_mesh().vertex_scalar_array()}


def cycles_occlusion(data: Arrays) -> Arrays:
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device, scene.cycles.samples = "CPU", int(data["rays"])
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.render.bake.margin = 0
    scene.world = bpy.data.worlds.new("world")
    scene.world.light_settings.distance = 1e4
    mesh = bpy.data.meshes.new("ball")
    mesh.from_pydata(data["vertices"].tolist(), [], data["faces"].tolist())
    layer = mesh.uv_layers.new()
    corners = data["uvs"][data["faces"]].reshape(-1, 2)
    layer.data.foreach_set("uv", np.stack([corners[:, 0], 1 - corners[:, 1]], axis=1).ravel())
    ball = bpy.data.objects.new("ball", mesh)
    scene.collection.objects.link(ball)
    size = int(data["size"])
    image = bpy.data.images.new("ao", size, size, alpha=False, float_buffer=True)
    material = bpy.data.materials.new("m")
    material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.nodes.active = node
    mesh.materials.append(material)
    bpy.context.view_layer.objects.active = ball
    ball.select_set(True)
    with Measured():
        bpy.ops.object.bake(type="AO")
    pixels = np.empty(size * size * 4, np.float32)
    image.pixels.foreach_get(pixels)
    return {"ao": pixels.reshape(size, size, 4)[::-1, :, 0]}


PROGRAMS: dict[str, Callable[[Arrays], Arrays]] = {
    "raycam_blend": raycam_texture("blend"),
    "raycam_best": raycam_texture("best"),
    "raycam_depth": raycam_depth,
    "raycam_visibility": raycam_visibility,
    "raycam_occlusion": raycam_occlusion("texture"),
    "raycam_vertex_occlusion": raycam_occlusion("vertices"),
    "open3d_texture": open3d_texture,
    "pyrender_depth": pyrender_depth,
    "pymeshlab_occlusion": pymeshlab_occlusion,
    "cycles_occlusion": cycles_occlusion,
}


def main() -> None:
    """Runs one program."""
    name, given, output = sys.argv[1:]
    with np.load(given) as arrays:
        data = dict(arrays)
    if name.startswith("raycam"):
        import warnings

        warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        found = PROGRAMS[name](data)
        np.savez(Path(output), **found)
    print("MEASURED " + json.dumps(USED), flush=True)


if __name__ == "__main__":
    main()
