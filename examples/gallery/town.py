"""The scene of several images of the gallery: a street of plastered houses.

Cars, flags and foxes are in the street.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import raycam
from common import fractal, mix, ribbon, stand

WALLS = ("#c98d5a", "#d9c19a", "#9fb3a4", "#c46a52", "#d8b46a", "#a9a3b8")
FLAGS = ("#c8372d", "#e9b23c", "#2f6f9f", "#efe6d2", "#3f8f5f")


def cars(
    world: raycam.World,
    assets: Path,
    places: list[tuple[tuple[float, float, float], float]],
    height: float,
) -> list[int]:
    """Adds copies of the toy car without its cloth; returns the ids of their objects.

    Each car is `height` metres high and is placed at (location, yaw). With a yaw of 0, it points to +y.
    """
    toy = raycam.load(assets / "gltf/ToyCar/ToyCar.gltf")
    for item in toy.objects:
        if item.name == "Fabric":
            toy.remove_object(item.id)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "car.glb"
        toy.to_gltf(file)
        ids = [stand(world, file, height, places[0][0], yaw=places[0][1], name="car")]
        trial = raycam.World()
        trial.add_object(mesh=file)
    low, high = trial.bounds
    scale = height / (high[2] - low[2])
    for location, yaw in places[1:]:
        place = np.array(location) - [0, 0, scale * low[2]]
        ids.append(world.add_object(instance_of="car", scale=scale, location=place.tolist(), yaw=yaw))
    return ids


def house(world: raycam.World, side: int, near: float, far: float, floors: int, color: str) -> None:
    """Adds a house between y = `near` and y = `far`, with windows towards the street.

    `side` is 1 for houses at positive x, and -1 for houses at negative x.
    """
    height, face, middle, wide = 3.1 * floors + 0.5, 5.2 * side, (near + far) / 2, far - near
    plaster = 0.9 + 0.1 * fractal((256, 256), 1.3, seed=floors + round(abs(middle)))[..., None]
    base = np.array(list(bytes.fromhex(color[1:])))
    world.add_object(box=[8, wide, height], location=[face + 4 * side, middle, height / 2],
                     texture=(plaster * base).round().astype(np.uint8))  # fmt: skip
    for bottom, depth in ((3.1, 0.15), (height, 0.35)):
        world.add_object(
            box=[8 + 2 * depth, wide, 0.18], location=[face + 4 * side, middle, bottom], color="#ddd3c0"
        )
    ridge = height + 2.6
    outline = [(4.8, height), (13.2, height), (9.0, ridge)]
    corners = [[side * x, y, z] for y in (near, far) for x, z in outline]
    faces = np.array([[0, 2, 3], [2, 5, 3], [1, 4, 2], [2, 4, 5], [0, 1, 2], [3, 5, 4]])
    world.add_mesh(corners, faces[:, ::side], material={"color": "#8a4a37"})
    for row in range(floors):
        for y in np.arange(near + 1.3, far - 0.7, 2.1):
            tall, up = (1.6, 3.1 * row + 1.75) if row else (2.1, 1.35)
            world.add_object(instance_of="frame", location=[face, y, up], scale=[1, 1, tall], visible=True)
            world.add_object(instance_of="pane", location=[face, y, up], scale=[1, 1, tall], visible=True)
            if row:
                for shift in (-0.78, 0.78):
                    world.add_object(instance_of="shutter", location=[face, y + shift, up], scale=[1, 1, tall],
                                     visible=True)  # fmt: skip


def street(assets: Path) -> raycam.World:
    """Returns a street along the y axis with houses, cars, flags and foxes."""
    world = raycam.World()
    cells = np.indices((512, 512)) // 32
    shade = np.random.default_rng(2).uniform(0.55, 1, (16, 16))[cells[0], (cells[1] + cells[0] % 2) % 16]
    joint = (np.minimum(np.indices((512, 512)) % 32, 31 - np.indices((512, 512)) % 32) < 2).any(axis=0)
    stones = mix("#4a443e", "#a89a88", np.where(joint, 0, shade * (0.75 + 0.25 * fractal((512, 512), 1))))
    world.add_object(plane=160, texture=raycam.Texture(stones, repeat=60), type="principled", roughness=0.6)
    for side in (-1, 1):
        world.add_object(
            box=[2.2, 160, 0.28], location=[4.1 * side, 0, 0], color="#a39a8c", name=f"pavement {side}"
        )
    hidden = {"visible": False}
    world.add_object(box=[0.14, 1.15, 1.12], name="frame", color="#e8e2d4", **hidden)
    world.add_object(
        box=[0.18, 0.9, 0.96], name="pane", color="#27313a", type="principled", roughness=0.06, **hidden
    )
    world.add_object(box=[0.16, 0.36, 1.05], name="shutter", color="#3f6258", **hidden)
    random = np.random.default_rng(4)
    for side in (-1, 1):
        y, number = -24.0, 0 if side < 0 else 3
        while y < 60:
            wide = 2.1 * random.integers(3, 6) + 0.7
            house(world, side, y, y + wide, int(random.integers(2, 5)), WALLS[number % len(WALLS)])
            y, number = y + wide, number + 1
    cars(world, assets, [((2.0, -3.4, 0), 0), ((2.0, 4.2, 0), 0), ((-2.0, 7.5, 0), 180), ((-2.0, 15, 0), 180),
                         ((2.0, 17, 0), 0)], height=1.35)  # fmt: skip
    for place, yaw in (((-1.0, -6.1, 0), 205), ((-2.0, -3.4, 0), 120)):
        stand(world, assets / "gltf/Fox/Fox.glb", 0.75, place, yaw=yaw)
    for row, y in enumerate(np.arange(-8, 34, 5.0)):
        x = np.linspace(-5.1, 5.1, 41)
        z = 6.4 + 0.035 * x**2 - 0.9
        for number in range(40):
            top = np.array([[x[number], y, z[number]], [x[number + 1], y, z[number + 1]]])
            if number % 2:
                tip = top.mean(axis=0) - [0, 0.05, 0.42]
                world.add_mesh([*top, tip], [[0, 1, 2]], material={"color": FLAGS[(number // 2 + row) % 5],
                               "type": "principled", "diffuse_transmission": 0.5, "roughness": 0.8})  # fmt: skip
        rope = np.stack([x, np.full(41, y), z], axis=1)
        rim = np.concatenate([rope, rope + np.array([0, 0, 0.03])])
        world.add_mesh(rim, ribbon(40), material={"color": "#3a342e"})
    for y in (-4.5, 6.0, 18.0):
        for side in (-1, 1):
            world.add_object(
                cylinder={"radius": 0.06, "height": 3.4}, location=[3.3 * side, y, 1.7], color="#2b2f2d"
            )
            world.add_object(sphere=0.22, location=[3.3 * side, y, 3.55], color="#f2ead6", type="principled")
    world.add_light("sun", direction=[0.3, 0.8, -0.75], irradiance=[11, 8.6, 5.8], angular_diameter=0.6)
    world.add_light("sky", zenith=[0.25, 0.5, 1.2], horizon=[0.85, 1.0, 1.25])
    return world
