"""Runs the same programs with pyrender and with raycam's replacement of it.

    python benchmarks/beside_pyrender.py --python INTERPRETER

The report compares depth, silhouettes and colours. INTERPRETER has pyrender 0.1.45, NumPy 1, trimesh, and EGL
or OSMesa for drawing without a screen. Each program runs unchanged in a process of its own, where `import
pyrender` loads pyrender, or raycam's replacement after `raycam.compat.pyrender.install`.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

SIZE = (320, 240)


def pose(x: float, y: float, z: float) -> np.ndarray:
    """Returns a pose without rotation."""
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def looking(eye: list[float], target: list[float]) -> np.ndarray:
    """Returns the pose of an OpenGL camera that looks at a point, y up."""
    back = np.subtract(eye, target)
    back = back / np.linalg.norm(back)
    right = np.cross([0, 1, 0], back)
    right = right / np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3] = np.stack([right, np.cross(back, right), back, eye], axis=1)
    return matrix


def single_mesh(pyrender: Any, trimesh: Any) -> Any:
    """Renders a mesh with a camera and a light, as in pyrender's README."""
    scene = pyrender.Scene(bg_color=[0, 0, 0, 0], ambient_light=[0.3, 0.3, 0.3])
    mesh = pyrender.Mesh.from_trimesh(trimesh.creation.icosphere(subdivisions=4, radius=0.7), smooth=False)
    scene.add(mesh)
    scene.add(pyrender.PerspectiveCamera(yfov=np.pi / 3.0), pose=pose(0, 0, 2.5))
    scene.add(pyrender.DirectionalLight(color=[1, 1, 1], intensity=2.0), pose=looking([2, 3, 2], [0, 0, 0]))
    return scene, {}


def boxes(pyrender: Any, trimesh: Any) -> Any:
    """Renders many instances of one mesh."""
    scene = pyrender.Scene(ambient_light=[0.5] * 3)
    box = trimesh.creation.box(extents=[0.3, 0.3, 0.3])
    poses = np.stack([pose(0.5 * i - 1, 0.4 * j - 0.8, -0.3 * i * j) for i in range(5) for j in range(5)])
    scene.add(pyrender.Mesh.from_trimesh(box, poses=poses, smooth=False))
    scene.add(pyrender.PerspectiveCamera(yfov=0.9), pose=looking([1, 1.5, 3], [0, 0, -0.5]))
    return scene, {}


def segmentation(pyrender: Any, trimesh: Any) -> Any:
    """Renders a segmentation image: each node has the colour that `seg_node_map` assigns to it."""
    scene = pyrender.Scene(ambient_light=[1.0] * 3)
    nodes = {}
    for i, x in enumerate([-0.8, 0.0, 0.8]):
        mesh = pyrender.Mesh.from_trimesh(trimesh.creation.icosphere(subdivisions=3, radius=0.45))
        nodes[scene.add(mesh, pose=pose(x, 0, -0.3 * i))] = [60 * (i + 1), 255 - 80 * i, 40 * i]
    scene.add(pyrender.PerspectiveCamera(yfov=0.8), pose=pose(0, 0, 3))
    return scene, {"flags": pyrender.RenderFlags.SEG, "seg_node_map": nodes}


def intrinsics(pyrender: Any, trimesh: Any) -> Any:
    """Renders a depth image with a camera that has calibrated intrinsics."""
    scene = pyrender.Scene()
    scene.add(
        pyrender.Mesh.from_trimesh(trimesh.creation.torus(0.6, 0.25)),
        pose=looking([0.4, 0.9, 0.2], [0, 0, 0]),
    )
    camera = pyrender.IntrinsicsCamera(fx=310.0, fy=290.0, cx=150.5, cy=128.25, znear=0.05, zfar=50.0)
    scene.add(camera, pose=looking([0.3, 0.8, 2.2], [0, 0, 0]))
    return scene, {"flags": pyrender.RenderFlags.DEPTH_ONLY}


def parallel(pyrender: Any, trimesh: Any) -> Any:
    """Renders the image of an orthographic camera."""
    scene = pyrender.Scene(ambient_light=[0.6] * 3)
    scene.add(pyrender.Mesh.from_trimesh(trimesh.creation.cylinder(0.4, 1.0), smooth=False))
    scene.add(pyrender.OrthographicCamera(xmag=1.0, ymag=0.75), pose=looking([1, 1, 2], [0, 0, 0]))
    return scene, {}


def spots(pyrender: Any, trimesh: Any) -> Any:
    """Renders point and spot lights on a coloured metallic-roughness floor."""
    scene = pyrender.Scene(ambient_light=[0.05] * 3)
    material = pyrender.MetallicRoughnessMaterial(
        baseColorFactor=[0.8, 0.5, 0.3, 1.0], metallicFactor=0.0, roughnessFactor=0.7
    )
    floor = trimesh.creation.box(extents=[4, 0.1, 4]).subdivide().subdivide()
    scene.add(pyrender.Mesh.from_trimesh(floor, material=material, smooth=False), pose=pose(0, -0.5, 0))
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.4)
    scene.add(pyrender.Mesh.from_trimesh(ball, material=material))
    scene.add(pyrender.PointLight(color=[1, 1, 1], intensity=6.0), pose=pose(1, 1.2, 1))
    light = pyrender.SpotLight(color=[1, 1, 1], intensity=10.0, innerConeAngle=0.2, outerConeAngle=0.5)
    scene.add(light, pose=looking([-1, 2, 0.5], [-0.5, -0.5, 0]))
    scene.add(pyrender.PerspectiveCamera(yfov=0.9), pose=looking([0, 1.2, 2.6], [0, -0.2, 0]))
    return scene, {}


def moving(pyrender: Any, trimesh: Any) -> Any:
    """Renders a node whose pose is changed repeatedly."""
    scene = pyrender.Scene(ambient_light=[0.8] * 3)
    node = scene.add(pyrender.Mesh.from_trimesh(trimesh.creation.box(extents=[0.5, 0.7, 0.9]), smooth=False))
    camera = scene.add(pyrender.PerspectiveCamera(yfov=0.7), pose=pose(0, 0, 3))
    scene.set_pose(node, pose=looking([0.7, 0.4, 1.0], [0, 0, 0]) @ pose(0.1, 0.2, 0.3))
    scene.set_pose(camera, pose=looking([1.5, 1.0, 3.0], [0, 0, 0]))
    return scene, {}


def vertex_colours(pyrender: Any, trimesh: Any) -> Any:
    """Renders a mesh with vertex colours, in flat light."""
    scene = pyrender.Scene(bg_color=[0.2, 0.4, 0.6, 1.0], ambient_light=[1.0] * 3)
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=0.8)
    shades = (mesh.vertices - mesh.vertices.min(axis=0)) / np.ptp(mesh.vertices, axis=0)
    mesh.visual.vertex_colors = (255 * np.c_[shades, np.ones(len(shades))]).astype(np.uint8)
    scene.add(pyrender.Mesh.from_trimesh(mesh))
    scene.add(pyrender.PerspectiveCamera(yfov=0.9), pose=pose(0, 0, 2.4))
    return scene, {"flags": pyrender.RenderFlags.FLAT}


PROGRAMS: list[Callable[..., Any]] = [
    single_mesh,
    boxes,
    segmentation,
    intrinsics,
    parallel,
    spots,
    moving,
    vertex_colours,
]


def run(folder: str, stand_in: bool) -> None:
    """Runs every program, and saves its image and depth in `folder`."""
    if stand_in:
        import raycam.compat.pyrender

        raycam.compat.pyrender.install()
    else:
        os.environ.setdefault("PYOPENGL_PLATFORM", "egl")
    import pyrender
    import trimesh

    renderer = pyrender.OffscreenRenderer(*SIZE)
    for program in PROGRAMS:
        scene, options = program(pyrender, trimesh)
        found = renderer.render(scene, **options)
        color, depth = (None, found) if isinstance(found, np.ndarray) else found
        arrays = {"depth": depth} if color is None else {"depth": depth, "color": color}
        np.savez(Path(folder) / f"{program.__name__}.npz", **arrays)
    renderer.delete()


def compare(ours: Path, theirs: Path) -> list[list[str]]:
    """Returns a row for each program."""
    rows = []
    for program in PROGRAMS:
        a, b = np.load(ours / f"{program.__name__}.npz"), np.load(theirs / f"{program.__name__}.npz")
        here, there = a["depth"] > 0, b["depth"] > 0
        both = here & there
        outline = f"{(here != there).sum()} of {there.sum()}"
        row = [program.__doc__.split(".")[0] if program.__doc__ else "", outline]
        if program is segmentation:
            equal = (a["color"] == b["color"]).all(axis=-1)
            row += ["-", f"{(~equal).sum()} pixels differ"]
        else:
            depth = np.abs(a["depth"] - b["depth"])[both] / b["depth"][both]
            row.append(f"{np.median(depth):.1e}, {np.quantile(depth, 0.99):.1e}")
            if "color" in a:
                apart = np.abs(a["color"][..., :3].astype(float) - b["color"][..., :3].astype(float))[both]
                row.append(f"{np.median(apart):.0f}, {np.quantile(apart, 0.99):.0f}")
            else:
                row.append("-")
        rows.append(row)
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--python", default=sys.executable, help="Python interpreter with pyrender")
    parser.add_argument("--run", metavar="FOLDER", help=argparse.SUPPRESS)
    parser.add_argument("--stand-in", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.run:
        run(options.run, options.stand_in)
        return
    import report

    with tempfile.TemporaryDirectory() as ours, tempfile.TemporaryDirectory() as theirs:
        clean = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        subprocess.run([sys.executable, __file__, "--run", ours, "--stand-in"], check=True)
        subprocess.run([options.python, __file__, "--run", theirs], check=True, env=clean)
        rows = compare(Path(ours), Path(theirs))
    sys.argv[1:] = ["--python", "INTERPRETER"]
    report.write(
        "beside-pyrender",
        "Programs for pyrender with raycam's replacement",
        [
            "Eight unchanged programs with pyrender 0.1.45 (OpenGL) and with `raycam.compat.pyrender`, "
            f"{SIZE[0]} x {SIZE[1]} pixels. outline: number of pixels that show a surface in only one image, and "
            "number "
            "of pixels that show a surface with pyrender. depth: relative difference of pixels that show a surface in "
            "both images, median and 99 %. colour: difference in steps of 255, median and 99 %.",
            "pyrender returns the depth of a sample next to the pixel's centre (MSAA), and converts depths of "
            "orthographic "
            "cameras as if they were perspective. raycam returns the depth of the pixel's centre, along the "
            "camera's axis.",
        ],
        ["program", "outline", "depth", "colour"],
        rows,
    )


if __name__ == "__main__":
    main()
