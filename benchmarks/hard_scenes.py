"""Scenes with light that is difficult to find, in the form of `path_scenes.py`.

The scenes are closed rooms, caustics, and lamps behind glass. Lengths are in metres, and walls have the grey
value 0.7 unless a scene specifies otherwise. Every room is closed, so that no path escapes.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from path_scenes import Array, Scene, ball, sheet

DEPTH = 16
GREY: dict[str, Any] = {"matte": [0.7] * 3}
GOLD: dict[str, Any] = {"gold": True}
GLASS: dict[str, Any] = {"glass": 1.5}


def joined(*shapes: tuple[Array, Array]) -> tuple[Array, Array]:
    """Joins several meshes."""
    first = np.cumsum([0, *(len(vertices) for vertices, _ in shapes)])
    faces = [own + start for (_, own), start in zip(shapes, first, strict=False)]
    return np.concatenate([vertices for vertices, _ in shapes]), np.concatenate(faces)


def block(low: list[float], high: list[float]) -> tuple[Array, Array]:
    """Returns a box between two corners, facing outwards."""
    center, size = (np.array(low) + high) / 2, np.subtract(high, low).astype(float)
    sides = []
    for axis in range(3):
        u, v = np.eye(3)[(axis + 1) % 3] * size, np.eye(3)[(axis + 2) % 3] * size
        out = np.eye(3)[axis] * size / 2
        sides += [sheet(center + out, u, v), sheet(center - out, v, u)]
    return joined(*sides)


def inside_out(shape: tuple[Array, Array]) -> tuple[Array, Array]:
    return shape[0], shape[1][:, ::-1]


def moved(shape: tuple[Array, Array], offset: list[float], scale: float = 1.0) -> tuple[Array, Array]:
    return shape[0] * scale + offset, shape[1]


def grid(heights: Array, size: tuple[float, float]) -> tuple[Array, Array]:
    """Returns a surface over x and y that faces up."""
    rows, columns = heights.shape
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, columns) * size[0], np.linspace(-0.5, 0.5, rows) * size[1])
    number = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    faces = np.concatenate([np.stack(one, axis=-1).reshape(-1, 3) for one in ((a, b, c), (a, c, d))])
    return np.stack([x, y, heights], axis=-1).reshape(-1, 3), faces


def revolved(profile: list[tuple[float, float]], sides: int) -> tuple[Array, Array]:
    """Returns the surface of a profile that rotates about the z axis.

    The profile consists of (radius, height) pairs. The surface faces outwards where the height increases.
    """
    turn = 2 * np.pi * np.arange(sides) / sides
    around = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    rings = [np.column_stack([radius * around, np.full(sides, height)]) for radius, height in profile]
    faces = []
    for ring in range(len(profile) - 1):
        a = ring * sides + np.arange(sides)
        b = ring * sides + (np.arange(sides) + 1) % sides
        faces += [np.stack([a, b, b + sides], axis=1), np.stack([a, b + sides, a + sides], axis=1)]
    return np.concatenate(rings), np.concatenate(faces)


def holed_wall(x: float, size: float, radius: float, sides: int = 64) -> tuple[Array, Array]:
    """Returns a square wall at `x` around z = size / 2, with a round hole in its middle."""
    turn = 2 * np.pi * np.arange(sides) / sides
    inner = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    outer = inner / np.abs(inner).max(axis=1, keepdims=True) * size / 2
    points = np.concatenate([inner * radius, outer])
    vertices = np.column_stack([np.full(2 * sides, x), points[:, 0], points[:, 1] + size / 2])
    a, b = np.arange(sides), (np.arange(sides) + 1) % sides
    faces = np.concatenate([np.stack([a, a + sides, b + sides], axis=1), np.stack([a, b + sides, b], axis=1)])
    return vertices, faces


def lamp(center: list[float], size: float, radiance: float, across: float | None = None) -> dict[str, Any]:
    """Returns a rectangle that shines down."""
    color = [radiance, 0.9 * radiance, 0.75 * radiance]
    return {"area": [center, [size, 0, 0], [0, -(across or size), 0]], "radiance": color}


def room(low: list[float], high: list[float]) -> tuple[Array, Array]:
    return inside_out(block(low, high))


def without_wall(shape: tuple[Array, Array], x: float) -> tuple[Array, Array]:
    """Returns a room without its wall at `x`."""
    vertices, faces = shape
    return vertices, faces[~(np.abs(vertices[faces][:, :, 0] - x) < 1e-9).all(axis=1)]


class Builder:
    """Writes scenes' triangles to a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.scenes: dict[str, Scene] = {}

    def add(
        self,
        name: str,
        camera: tuple[list[float], list[float], float],
        lights: list[Any],
        objects: list[tuple[tuple[Array, Array], dict[str, Any]]],
    ) -> None:
        kept = []
        for number, ((vertices, faces), material) in enumerate(objects):
            path = self.folder / f"{name}-{number}.npz"
            np.savez(path, vertices=vertices.astype(np.float32), faces=faces.astype(np.uint32))
            kept.append((str(path), material))
        eye, target, fov = camera
        view = {"eye": eye, "target": target, "fov": fov}
        self.scenes[name] = {"camera": view, "lights": lights, "objects": kept, "depth": DEPTH}


def hard_scenes(folder: Path) -> dict[str, Scene]:
    """Returns the scenes by name, and writes their triangles to the folder."""
    builder = Builder(folder)
    rooms_of_two_meters(builder)
    spaces_for_long_paths(builder)
    spaces_with_glass(builder)
    return builder.scenes


def rooms_of_two_meters(builder: Builder) -> None:
    walls = room([-1, -1, 0], [1, 1, 2])
    view = ([-0.9, -0.9, 1.4], [0.3, 0.4, 0.6], 62.0)
    # A door leaves a gap of 0.1 to the next room, which contains the lamp.
    door = joined(block([0.98, -1, 0], [1.02, 0.6, 2]), block([0.98, 0.7, 0], [1.02, 1, 2]))
    rooms = room([-1, -1, 0], [3, 1, 2])
    things = [(ball([0.3, 0.2, 0.35], 0.35, 4), GREY), (block([-0.4, 0.4, 0], [0, 0.8, 0.6]), GREY)]
    builder.add("ajar", view, [lamp([2, 0, 1.98], 0.6, 90.0)], [(rooms, GREY), (door, GREY), *things])
    glass = [(walls, GREY), (ball([0.2, 0.1, 0.5], 0.36, 5), GLASS)]
    builder.add("caustic", view, [lamp([0.1, 0.2, 1.98], 0.12, 380.0)], glass)
    balls = [
        (ball([0.35, 0.1, 0.36], 0.36, 5), GOLD),
        (ball([-0.35, 0.45, 0.3], 0.3, 5), GOLD | {"roughness": 0.3}),
    ]
    builder.add("mirrors", view, [lamp([0, 0, 1.98], 0.3, 55.0)], [(walls, GREY), *balls])
    frosted = GLASS | {"roughness": 0.4}
    globe = [
        (ball([0.2, 0.2, 1.0], 0.25, 5), frosted),
        (inside_out(ball([0.2, 0.2, 1.0], 0.24, 5)), frosted),
        (ball([0.2, 0.2, 1.0], 0.05, 2), {"shines": [220.0, 200.0, 160.0]}),
    ]
    builder.add("lantern", view, [], [(walls, GREY), *globe])


def spaces_for_long_paths(builder: Builder) -> None:
    shaft = room([-1, -1, 0], [1, 1, 6])
    floors = [block([-1 if side else -0.2, -1, z], [0.2 if side else 1, 1, z + 0.1])
              for side, z in ((0, 1.5), (1, 3.0), (0, 4.5))]  # fmt: skip
    builder.add(
        "stairwell",
        ([-0.8, -0.85, 0.5], [0.4, 0.5, 1.2], 70.0),
        [lamp([-0.5, 0, 5.98], 0.32, 150.0)],
        [(shaft, GREY), (joined(*floors), GREY)],
    )
    white = {"matte": [0.9] * 3}
    ledges = [
        block([-2, -2, 2.2], [-1.85, 2, 2.22]), block([1.85, -2, 2.2], [2, 2, 2.22]),
        block([-1.85, -2, 2.2], [1.85, -1.85, 2.22]), block([-1.85, 1.85, 2.2], [1.85, 2, 2.22]),
        block([-1.86, -1.86, 2.2], [-1.85, 1.86, 2.3]), block([1.85, -1.86, 2.2], [1.86, 1.86, 2.3]),
        block([-1.85, -1.86, 2.2], [1.85, -1.85, 2.3]), block([-1.85, 1.85, 2.2], [1.85, 1.86, 2.3]),
    ]  # fmt: skip
    up = [
        {"area": [[x, 0, 2.23], [0.05, 0, 0], [0, 3.4, 0]], "radiance": [60.0, 52.0, 40.0]}
        for x in (-1.93, 1.93)
    ] + [
        {"area": [[0, y, 2.23], [3.4, 0, 0], [0, 0.05, 0]], "radiance": [60.0, 52.0, 40.0]}
        for y in (-1.93, 1.93)
    ]
    things = [(ball([0.4, 0.6, 0.5], 0.5, 4), GREY), (block([-1, 0, 0], [-0.4, 0.7, 0.9]), white)]
    builder.add(
        "cove",
        ([-1.6, -1.7, 1.5], [0.2, 0.5, 0.8], 58.0),
        up,
        [(room([-2, -2, 0], [2, 2, 2.5]), white), (joined(*ledges), white), *things],
    )
    frame = [
        block([-1.5, 2, 0], [1.5, 2.05, 0.9]), block([-1.5, 2, 1.9], [1.5, 2.05, 2.5]),
        block([-1.5, 2, 0.9], [-0.6, 2.05, 1.9]), block([0.6, 2, 0.9], [1.5, 2.05, 1.9]),
        sheet([0, -2, 1.25], [3, 0, 0], [0, 0, 2.5]), sheet([-1.5, 0, 1.25], [0, 4, 0], [0, 0, 2.5]),
        sheet([1.5, 0, 1.25], [0, 4, 0], [0, 0, 2.5]), sheet([0, 0, 2.5], [3, 0, 0], [0, 4.2, 0]),
    ]  # fmt: skip
    tilt = np.radians(50)
    along = [0, -0.03 * np.cos(tilt), 0.03 * np.sin(tilt)]
    slats = [sheet([0, 1.98, 0.9 + 0.025 * (k + 0.5)], [1.2, 0, 0], along) for k in range(40)]
    builder.add(
        "blinds",
        ([-1.1, 1.5, 1.4], [0.3, -1.0, 0.6], 65.0),
        [{"sky": [1.0, 1.2, 1.5]}, {"sun": [0.3, -1.0, -0.75], "irradiance": [8.0, 7.6, 7.0]}],
        [
            (joined(*frame), GREY),
            (joined(*slats), GREY),
            (sheet([0, 0, 0], [3, 0, 0], [0, 4.2, 0]), {"matte": [0.5] * 3}),
            (ball([0.5, -0.6, 0.4], 0.4, 4), GREY),
        ],
    )
    hole = joined(holed_wall(0.95, 2, 0.04), holed_wall(1.05, 2, 0.04))
    tube = revolved([(0.04, -0.05), (0.04, 0.05)], 64)
    tube = (tube[0][:, [2, 0, 1]] + [1.0, 0, 1.0], tube[1])
    builder.add(
        "keyhole",
        ([0.85, -0.9, 1.5], [-0.9, 0.3, 0.8], 65.0),
        [lamp([2, 0, 1.98], 1.0, 400.0)],
        [
            (without_wall(room([-1, -1, 0], [0.95, 1, 2]), 0.95), GREY),
            (without_wall(room([1.05, -1, 0], [3, 1, 2]), 1.05), GREY),
            (hole, GREY),
            (tube, GREY),
            (ball([-0.4, 0.3, 0.3], 0.3, 4), GREY),
        ],
    )


def spaces_with_glass(builder: Builder) -> None:
    x, y = np.meshgrid(np.linspace(-1, 1, 129), np.linspace(-1, 1, 129))
    waves = 0.03 * (np.sin(7 * x + 2 * y) + np.sin(5 * y - 3 * x + 1) + 0.6 * np.sin(11 * x - 9 * y)) / 2
    number = np.arange(129 * 129).reshape(129, 129)
    surface, up = grid(0.8 + waves, (1.998, 1.998))
    # The body of water: its waves, walls and floor, which are slightly inside the tank.
    rim = np.concatenate([number[0, :-1], number[:-1, -1], number[-1, :0:-1], number[:0:-1, 0]])
    bottom = surface[rim] * [1, 1, 0] + [0, 0, 0.002]
    a, b = np.arange(len(rim)), (np.arange(len(rim)) + 1) % len(rim)
    first = len(surface)
    skirt = np.concatenate(
        [np.stack([rim[a], first + a, first + b], axis=1), np.stack([rim[a], first + b, rim[b]], axis=1)]
    )
    middle = first + len(rim)
    base = np.stack([np.full(len(rim), middle), first + b, first + a], axis=1)
    water = np.concatenate([surface, bottom, [[0, 0, 0.002]]]), np.concatenate([up, skirt, base])
    tiles = [sheet([-0.9 + 0.2 * i, -0.9 + 0.2 * j, 0.001], [0.2, 0, 0], [0, 0.2, 0])
             for i in range(10) for j in range(10) if (i + j) % 2]  # fmt: skip
    builder.add(
        "pool",
        ([-0.2, -0.95, 2.2], [0.05, 0.15, 0.0], 60.0),
        [lamp([0.3, 0.2, 2.3], 0.1, 900.0)],
        [
            (room([-1, -1, 0], [1, 1, 2.5]), {"matte": [0.8] * 3}),
            (joined(*tiles), {"matte": [0.3, 0.4, 0.6]}),
            (water, {"glass": 1.33}),
        ],
    )
    profile = [(0.0, 0.0), (0.04, 0.0), (0.045, 0.06), (0.05, 0.13), (0.0485, 0.132),
               (0.047, 0.13), (0.042, 0.06), (0.037, 0.008), (0.0, 0.008)]  # fmt: skip
    tumbler = revolved(profile, 96)
    things: list[Any] = [(room([-1, -1, 0], [1, 1, 2]), GREY),
                         (block([-0.5, -0.4, 0.68], [0.5, 0.4, 0.72]), {"matte": [0.5, 0.4, 0.3]})]  # fmt: skip
    places = [(-0.25, -0.05), (-0.1, 0.1), (0.05, -0.1), (0.18, 0.08), (0.3, -0.05)]
    things += [(moved(tumbler, [x, y, 0.7205]), GLASS) for x, y in places]
    lamps = [lamp([x, y, 1.9], 0.08, 700.0) for x, y in ((-0.5, 0.3), (0.5, 0.4), (0.0, -0.5))]
    builder.add("tumblers", ([-0.1, -0.75, 1.15], [0.03, 0.0, 0.74], 45.0), lamps, things)
    floor = {"principled": [0.4, 0.35, 0.3], "roughness": 0.25, "metallic": 0.0}
    hall: list[Any] = [
        (room([-3, -3, 0], [3, 3, 4]), GREY),
        (sheet([0, 0, 0.001], [6, 0, 0], [0, 6, 0]), floor),
        (ball([0.6, 0.9, 0.6], 0.6, 4), GREY),
    ]
    for k in range(24):
        turn = 2 * np.pi * k / (10 if k < 10 else 14)
        radius, z = (0.35, 3.0) if k < 10 else (0.6, 2.75)
        at = [radius * np.cos(turn), radius * np.sin(turn), z]
        hall += [
            (ball(at, 0.05, 3), GLASS),
            (inside_out(ball(at, 0.048, 3)), GLASS),
            (ball(at, 0.015, 2), {"shines": [600.0, 540.0, 450.0]}),
        ]
    builder.add("chandelier", ([-2.4, -2.6, 1.7], [0.3, 0.4, 1.5], 62.0), [], hall)
    pane = block([-0.01, -0.999, 0.001], [0.01, 0.999, 1.999])
    from bench_flat_picture import rock

    statue = moved(rock(7, 3), [-0.8, 0.35, 0.5], 0.42)
    builder.add(
        "screen",
        ([-1.85, -0.85, 1.3], [-0.2, 0.2, 0.8], 65.0),
        [lamp([1.1, 0.1, 1.9], 0.4, 120.0)],
        [
            (room([-2, -1, 0], [2, 1, 2]), GREY),
            (pane, GLASS | {"roughness": 0.5}),
            (statue, GREY),
            (ball([-0.5, -0.5, 0.25], 0.25, 5), GOLD | {"roughness": 0.3}),
        ],
    )
