"""Compares the rendering of an animated, skinned glTF model with pyrender.

Four seconds of the animation are rendered at 1280 x 720 pixels with the integrator `flat`.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import report

SIZE = (1280, 720)
FPS, SECONDS = 24, 4


def film(model: str, samples: int, threads: int | None = None):
    import raycam
    from raycam.video import VideoPlan

    world = raycam.load(model)
    # A turntable would move the camera; here the camera rests and the animation plays.
    lower, upper = world.bounds
    middle = (lower + upper) / 2
    away = middle + np.array([1.0, 0.3, 0.7]) * (upper - lower).max() * 1.6
    camera = raycam.Camera.look_at(away, middle, up="y", size=SIZE, fov=35)
    world.set_video(
        fps=FPS, seconds=SECONDS, keyframe=[{"time": 0, "location": away.tolist(), "target": middle.tolist()}]
    )
    return world, camera, VideoPlan(world, camera, integrator="flat", samples=samples, threads=threads)


def raycam_frames(model: str, samples: int) -> tuple[float, float]:
    """Returns the seconds for rendering all frames as 8-bit images.

    The second value is the time for moving and preparing the worlds of these frames only.
    """
    world, _, movie = film(model, samples)
    movie.frame(0).to_srgb8()
    start = time.perf_counter()
    for number in range(len(movie)):
        movie.frame(number).to_srgb8()
    seconds = time.perf_counter() - start
    start = time.perf_counter()
    for number in range(len(movie)):
        world.at(movie.time(number)).prepare()
    return seconds, time.perf_counter() - start


def rebuilt(model: str) -> float:
    """Returns the seconds for moving and preparing all frames if no tree can be refitted."""
    world, _, movie = film(model, 1)
    start = time.perf_counter()
    for number in range(len(movie)):
        world.at(movie.time(number)).prepare()
    return time.perf_counter() - start


def raycam_video(model: str) -> float:
    """Returns the seconds of the complete video: reading, rendering, and encoding H.264."""
    from raycam.video import write_video

    start = time.perf_counter()
    _, camera, movie = film(model, 1)
    with tempfile.TemporaryDirectory() as folder:
        write_video(movie._world, Path(folder, "a.mp4"), camera=camera, integrator="flat", samples=1)
    return time.perf_counter() - start


def pyrender_frames(shapes: str) -> None:
    """Runs in pyrender's interpreter: uploads and draws the vertices of every frame.

    Prints the seconds, and the fraction of pixels that show the model.
    """
    os.environ["PYOPENGL_PLATFORM"] = "osmesa"
    np.infty = np.inf  # noqa: NPY201 - pyrender uses this name, which NumPy 2 has removed
    import pyrender
    import trimesh

    with np.load(shapes) as arrays:
        vertices, K, world_from_gl = arrays["vertices"], arrays["K"], arrays["world_from_gl"]
        model = str(arrays["model"])
    mesh = next(iter(trimesh.load(model, process=False).geometry.values()))
    corners = mesh.faces.reshape(
        -1
    )  # one vertex for each corner of each triangle, in the same order as in raycam
    material = pyrender.MetallicRoughnessMaterial(
        baseColorTexture=mesh.visual.material.baseColorTexture, metallicFactor=0.0
    )
    scene = pyrender.Scene(ambient_light=[1.0, 1.0, 1.0])
    scene.add(pyrender.IntrinsicsCamera(K[0, 0], K[1, 1], K[0, 2], K[1, 2]), pose=world_from_gl)
    renderer = pyrender.OffscreenRenderer(*SIZE)
    texture = np.asarray(mesh.visual.uv, np.float32)[corners]

    def draw(number: int) -> np.ndarray:
        shape = pyrender.Primitive(vertices[number].astype(np.float32), texcoord_0=texture, material=material)
        node = scene.add(pyrender.Mesh([shape]))
        color, _ = renderer.render(scene, flags=pyrender.RenderFlags.FLAT)
        scene.remove_node(node)
        return color

    picture = draw(0)
    start = time.perf_counter()
    for number in range(len(vertices)):
        draw(number)
    print(time.perf_counter() - start, float((picture.min(axis=2) < 255).mean()))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "model", help="a skinned glTF model with one mesh and one texture, such as Khronos' Fox.glb"
    )
    parser.add_argument("--peers", help="Python interpreter with pyrender and trimesh")
    parser.add_argument("--worker", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        pyrender_frames(options.worker)
        return
    world, camera, movie = film(options.model, 1)
    count = len(movie)
    with tempfile.TemporaryDirectory() as folder:
        shapes = str(Path(folder, "shapes.npz"))
        gl = np.eye(4)
        gl[:3, :3], gl[:3, 3] = camera.R.T @ np.diag([1.0, -1.0, -1.0]), camera.C
        half = np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
        vertices = [world.at(movie.time(number)).triangles().reshape(-1, 3) for number in range(count)]
        np.savez(
            shapes,
            vertices=vertices,
            K=camera.K + half,
            world_from_gl=gl,
            model=os.path.abspath(options.model),
        )
        command = [options.peers or sys.executable, __file__, "-", "--worker", shapes]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            print(done.stderr[-2000:], file=sys.stderr)
    theirs = float(done.stdout.split()[0]) if done.returncode == 0 else float("nan")
    once, moving = raycam_frames(options.model, 1)
    smooth, _ = raycam_frames(options.model, 4)
    anew = rebuilt(options.model)
    whole = raycam_video(options.model)

    def row(what: str, seconds: float) -> list[str]:
        return [what, f"{seconds:.2f} s", f"{1000 * seconds / count:.1f} ms", f"{seconds / once:.2f}"]

    rows = [
        row("raycam, frames as 8-bit images, 1 sample", once),
        row("raycam, the same, 4 samples", smooth),
        row("of this time: skinning, and refitting the moving meshes", moving),
        row("skinning, and rebuilding the tree instead of refitting it", anew),
        row("the whole command `raycam video`, with H.264, 1 sample", whole),
        row("pyrender with OSMesa, flat, with uploading of skinned vertices", theirs),
    ]
    notes = [
        f"{count} frames of {SIZE[0]} x {SIZE[1]}, {Path(options.model).name}, {len(vertices[0]) // 3:,} triangles, "
        "textured."
    ]
    report.write(
        "skinned",
        "A moving skinned model",
        notes,
        ["program", "total", "per frame", "relative to raycam"],
        rows,
    )


if __name__ == "__main__":
    main()
