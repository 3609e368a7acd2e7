"""Scenes for the comparison of path tracers, as data that each `path_RENDERER.py` reads.

There are seven scenes, and further scenes with rough and principled materials, several or many lamps, an
emissive mesh, or an environment image. A scene is {camera, lights, objects}; an object is (file of triangles,
material). Scenes are plain data, so that they can be sent to another interpreter: see `path_worker.py`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

SIZE = (640, 480)
DEPTH = 6
"""Segments of a path: 2 are direct light."""

# Complex index of refraction of gold (n, then k) at the wavelengths of red, green and blue.
GOLD = ([0.091, 0.496, 1.468], [15.068, 2.262, 1.774])

Array = npt.NDArray[Any]
Scene = dict[str, Any]


def sheet(center: list[float], u: list[float], v: list[float]) -> tuple[Array, Array]:
    """Returns a parallelogram that faces u x v."""
    c, u, v = np.array(center), np.array(u) / 2, np.array(v) / 2
    return np.array([c - u - v, c + u - v, c + u + v, c - u + v]), np.array([[0, 1, 2], [0, 2, 3]])


def behind(center: list[float], u: list[float], v: list[float]) -> tuple[Array, Array]:
    """Returns a sheet directly behind an area light, which blocks light.

    It is used with renderers whose area lights do not block light.
    """
    normal = np.cross(u, v) / np.linalg.norm(np.cross(u, v))
    return sheet((np.array(center) - 1e-3 * normal).tolist(), u, v)


def ball(center: list[float], radius: float, level: int = 5) -> tuple[Array, Array]:
    from bench_flat_picture import rock

    vertices, faces = rock(level, 0)
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    return vertices * radius + center, faces


def scenes(folder: Path) -> dict[str, Scene]:
    """Returns the seven scenes by name, and writes their triangles to the folder."""
    from bench_flat_picture import rock

    made: dict[str, Scene] = {}

    def mesh(name: str, shape: tuple[Array, Array]) -> str:
        path = folder / f"{name}.npz"
        np.savez(path, vertices=shape[0].astype(np.float32), faces=shape[1].astype(np.uint32))
        return str(path)

    floor = mesh("floor", sheet([0, 0, -1.1], [40, 0, 0], [0, 40, 0]))
    grey, white = {"matte": [0.5] * 3}, {"matte": [0.8] * 3}
    lamp = {"area": [[0, 0, 4], [2, 0, 0], [0, -2, 0]], "radiance": [12.0, 11.0, 9.0]}
    sky = {"sky": [0.4, 0.5, 0.7]}
    eye = {"eye": [2.9, 2.0, 1.3], "target": [0, 0, -0.1], "fov": 45}
    big = mesh("rock", rock(8, 1))
    small = mesh("ball", ball([0, 0, -0.1], 1.0))
    made["rock"] = {"camera": eye, "lights": [lamp, sky], "objects": [(big, white), (floor, grey)]}
    made["open"] = {"camera": eye, "lights": [sky], "objects": [(small, white), (floor, grey)]}
    bulb = {"bulb": [2.0, -1.0, 3.0], "intensity": [30.0, 25.0, 20.0]}
    made["bulb"] = {"camera": eye, "lights": [bulb, sky], "objects": [(small, white), (floor, grey)]}
    gold, glass = {"gold": True}, {"glass": 1.5}
    made["gold"] = {"camera": eye, "lights": [lamp, sky], "objects": [(small, gold), (floor, grey)]}
    made["glass"] = {"camera": eye, "lights": [sky], "objects": [(small, glass), (floor, grey)]}
    pane = mesh("pane", sheet([1.2, 0.9, 0.2], [-0.8, 1.0, 0], [0, 0, 1.2]))
    sun = {"sun": [-1.0, 0.5, -2.0], "irradiance": [3.0, 2.8, 2.5]}
    objects = [(small, white), (pane, {"pane": 1.5}), (floor, grey)]
    made["pane"] = {"camera": eye, "lights": [sun, sky], "objects": objects}
    walls = {
        "down": ([0, 0, -1], [2, 0, 0], [0, 2, 0], white),
        "up": ([0, 0, 1], [2, 0, 0], [0, -2, 0], white),
        "back": ([0, 1, 0], [2, 0, 0], [0, 0, 2], white),
        "left": ([-1, 0, 0], [0, 2, 0], [0, 0, 2], {"matte": [0.63, 0.065, 0.05]}),
        "right": ([1, 0, 0], [0, -2, 0], [0, 0, 2], {"matte": [0.14, 0.45, 0.091]}),
    }
    made["box"] = {
        "camera": {"eye": [0, -3.9, 0], "target": [0, 0, 0], "fov": 38},
        "lights": [{"area": [[0, 0, 0.98], [0.5, 0, 0], [0, -0.5, 0]], "radiance": [18.0, 14.0, 8.0]}],
        "objects": [(mesh(name, sheet(c, u, v)), m) for name, (c, u, v, m) in walls.items()]
        + [(mesh("low", ball([0.3, -0.2, -0.6], 0.4, 4)), white)],
    }
    return made


def further(folder: Path, image: Path) -> dict[str, Scene]:
    """Returns further scenes by name, which are not rendered with Cycles.

    `image` is an equirectangular HDR image.
    """
    made: dict[str, Scene] = {}
    seven = scenes(folder)
    (ball_file, white), (floor, grey) = seven["open"]["objects"]
    rock_file = seven["rock"]["objects"][0][0]
    lamp, sky = seven["rock"]["lights"]
    around = {"image": str(image.resolve())}
    red = {"area": [[3, -2, 2], [0.6, 0.8, 0], [0, 0, 1.0]], "radiance": [9.0, 4.0, 4.0]}
    blue = {"area": [[-3, -2, 3], [0.5, 0, 0], [0, -0.5, 0]], "radiance": [4.0, 4.0, 24.0]}
    plastic = {"principled": [0.7, 0.2, 0.1], "roughness": 0.4, "metallic": 0.0}
    steel = {"principled": [0.6, 0.6, 0.65], "roughness": 0.3, "metallic": 1.0}
    stone = {"principled": [0.5] * 3, "roughness": 0.6, "metallic": 0.0}
    lacquer = plastic | {"coat": 0.25}
    brushed, frosted = {"gold": True, "roughness": 0.4}, {"glass": 1.5, "roughness": 0.4}

    def add(name: str, lights: list[Any], thing: str, material: Any, ground: Any) -> None:
        objects = [(thing, material), (floor, ground)]
        made[name] = {"camera": seven["open"]["camera"], "lights": lights, "objects": objects}

    add("brushed", [lamp, sky], ball_file, brushed, grey)
    add("plastic", [lamp, sky], ball_file, plastic, stone)
    add("lacquer", [lamp, sky], ball_file, lacquer, grey)
    add("lamps", [lamp, red, blue], rock_file, white, grey)
    add("plastic under lamps", [lamp, red, blue], ball_file, plastic, stone)
    add("image", [around], ball_file, white, grey)
    add("steel", [around], ball_file, steel, stone)
    add("plastic rock", [around], rock_file, plastic, stone)
    add("frosted", [around], ball_file, frosted, grey)
    add("frosted under a lamp", [lamp, sky], ball_file, frosted, grey)
    shining = folder / "shining.npz"
    vertices, faces = ball([1.0, 1.2, -0.6], 0.4, 2)
    np.savez(shining, vertices=vertices.astype(np.float32), faces=faces.astype(np.uint32))
    add("shining", [], ball_file, white, grey)
    made["shining"]["objects"].append((str(shining), {"shines": [6.0, 5.0, 4.0]}))
    random = np.random.default_rng(1)
    places = random.uniform([-3, -3, 1.2], [3, 3, 2], (50, 3)).tolist()
    bulbs = [{"bulb": place, "intensity": [1.0, 0.9, 0.7]} for place in places]
    add("fifty bulbs", bulbs, ball_file, white, grey)
    return made
