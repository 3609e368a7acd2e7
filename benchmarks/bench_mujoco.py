"""Compares raycam's replacement of `mujoco.Renderer` with MuJoCo's own renderer on OSMesa.

    MUJOCO_GL=osmesa python benchmarks/bench_mujoco.py

Run the script in the project's root; it requires MuJoCo and OSMesa. It prints a Markdown table of processor
times: the best and the median of the rounds, in milliseconds.
"""

from __future__ import annotations

import argparse
import statistics
import time
import warnings
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
import raycam
from raycam.compat.mujoco import Renderer

KINDS = ("box", "sphere", "capsule", "cylinder", "ellipsoid")


def primitives(count: int = 30) -> mujoco.MjModel:
    """Returns a model of a textured floor and `count` primitives on a grid.

    The model has a headlight and one light that casts shadows.
    """
    geoms = "".join(
        f'<body pos="{0.5 * (i % 6) - 1.25} {0.5 * (i // 6) - 1} 0.3"><freejoint/>'
        f'<geom type="{KINDS[i % 5]}" size="0.15 0.12 0.18" rgba="{i % 3 / 2} {i % 5 / 4} 0.5 1"/></body>'
        for i in range(count)
    )
    return mujoco.MjModel.from_xml_string(f"""<mujoco><visual><global offwidth="640" offheight="480"/></visual>
      <asset><texture name="grid" type="2d" builtin="checker" width="256" height="256"/>
        <material name="grid" texture="grid" texrepeat="4 4"/></asset>
      <worldbody><light pos="0 -1 4" dir="0 0.2 -1"/><geom type="plane" size="3 3 1" material="grid"/>{geoms}
      <camera name="main" pos="0 -4 2.5" xyaxes="1 0 0 0 0.5 1" fovy="45"/></worldbody></mujoco>""")


def mesh(triangles: int = 200_000) -> mujoco.MjModel:
    """Returns a model of a wavy ball of about `triangles` triangles above a floor."""
    rows = int((triangles / 4) ** 0.5)
    theta, phi = np.meshgrid(
        np.linspace(0.01, np.pi - 0.01, rows), np.linspace(0, 2 * np.pi, 2 * rows, endpoint=False)
    )
    radius = 0.5 + 0.03 * np.sin(13 * theta) * np.cos(11 * phi)
    points = radius[..., None] * np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=2
    )
    index = np.arange(2 * rows * rows).reshape(2 * rows, rows)
    a, b = index[:, :-1].ravel(), index[:, 1:].ravel()
    c, d = np.roll(index, -1, axis=0)[:, :-1].ravel(), np.roll(index, -1, axis=0)[:, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, d], axis=1), np.stack([a, d, c], axis=1)])
    spec = mujoco.MjSpec()
    spec.add_mesh(name="ball", uservert=points.ravel().tolist(), userface=faces.ravel().tolist())
    spec.worldbody.add_light(pos=[0, -1, 4], dir=[0, 0.2, -1])
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[3, 3, 1])
    body = spec.worldbody.add_body(pos=[0, 0, 0.6])
    body.add_freejoint()
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="ball", rgba=[0.8, 0.5, 0.3, 1])
    spec.worldbody.add_camera(name="main", pos=[0, -2.5, 1.2], xyaxes=[1, 0, 0, 0, 0.3, 1], fovy=45)
    return spec.compile()


def renderers(model: mujoco.MjModel, size: tuple[int, int]) -> dict[str, Callable[[mujoco.MjData, str], Any]]:
    """Returns a function for each renderer that updates a scene and renders one kind of image."""

    def runner(renderer: Any) -> Callable[[mujoco.MjData, str], Any]:
        def run(data: mujoco.MjData, mode: str) -> Any:
            renderer.disable_depth_rendering()
            renderer.disable_segmentation_rendering()
            if mode == "depth":
                renderer.enable_depth_rendering()
            elif mode == "ids":
                renderer.enable_segmentation_rendering()
            renderer.update_scene(data, "main")
            return renderer.render()

        return run

    width, height = size
    plain = model.__copy__()
    plain.vis.quality.offsamples = 0
    return {
        "MuJoCo": runner(mujoco.Renderer(model, height, width)),
        "raycam": runner(Renderer(model, height, width)),
        "raycam, 1 sample": runner(Renderer(plain, height, width)),
    }


def measure(name: str, model: mujoco.MjModel, size: tuple[int, int], rounds: int) -> None:
    """Prints the rows of one model."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    functions = renderers(model, size)
    for mode in ("color", "depth", "ids"):
        times: dict[str, list[float]] = {key: [] for key in functions}
        for turn in range(rounds + 1):
            data.qpos[0] = 0.01 * turn
            mujoco.mj_forward(model, data)
            for key, run in functions.items():
                start = time.process_time()
                run(data, mode)
                times[key].append(1e3 * (time.process_time() - start))
        cells = [f"{min(values[1:]):.1f} / {statistics.median(values[1:]):.1f}" for values in times.values()]
        print(f"| {name} | {mode} | {size[0]} x {size[1]} | {' | '.join(cells)} |", flush=True)


def measure_updates(model: mujoco.MjModel, rounds: int) -> None:
    """Prints the time of `update` and a depth image of 64 x 64."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    scene = raycam.from_mujoco(model, data)
    camera = scene.world.camera("main").resized((64, 64))
    updates, images = [], []
    for turn in range(rounds + 1):
        data.qpos[0] = 0.01 * turn
        mujoco.mj_forward(model, data)
        start = time.process_time()
        scene.update(data)
        middle = time.process_time()
        raycam.render(scene.world, camera, channels=["depth"])
        images.append(1e3 * (time.process_time() - middle))
        updates.append(1e3 * (middle - start))
    print(f"update: {min(updates[1:]):.2f} ms; depth of 64 x 64: {min(images[1:]):.2f} ms (best of {rounds})")


def main() -> None:
    """Measures both models."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=9)
    rounds = parser.parse_args().rounds
    warnings.simplefilter("ignore", raycam.Notice)
    print(
        "| model | image | size | MuJoCo (best / median ms) | raycam | raycam, 1 sample |\n|---|---|---|---|---|---|"
    )
    measure("30 primitives", primitives(), (640, 480), rounds)
    measure("200,000 triangles", mesh(), (640, 480), rounds)
    measure_updates(primitives(), rounds)


if __name__ == "__main__":
    main()
