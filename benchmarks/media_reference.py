"""Computes a third estimate of a scene with the camera in a medium, to check two renderers.

    python benchmarks/media_reference.py --walks 4000000

The scene is "medium around the camera" of `media_agreement.py`; the estimate consists of analog random walks
in NumPy. Every walk belongs to one colour, and its distances are drawn by this colour's extinction only.
Lights are sampled at every vertex and found in no other way. There is no multiple importance sampling, no
equiangular sampling and no search for borders: the medium is a box, so the ends of a ray inside it have a
closed form. raycam only finds the nearest triangle of floor and ball (`cast_rays`), which is tested against
Embree.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np
import raycam
from media_agreement import LAMP, SIZE, raycam_picture, scenes

NAME = "medium around the camera"
BATCH = 200_000
Floats = Any


def ends(origin: Floats, direction: Floats, box: Floats) -> tuple[Floats, Floats]:
    """Returns the distances at which rays enter and leave a box, [n] each.

    Both distances are equal if the ray misses the box.
    """
    with np.errstate(divide="ignore"):
        sides = (box[:, None] - origin) / direction
    first = np.maximum(sides.min(0).max(1), 0)
    return first, np.maximum(sides.max(0).min(1), first)


def passed(origin: Floats, direction: Floats, length: Floats, box: Floats, extinction: Floats) -> Floats:
    """Returns the transmittance of rays up to the distance `length`, [n]."""
    first, last = ends(origin, direction, box)
    return np.exp(-extinction * (np.minimum(last, length) - np.minimum(first, length)))


def scatter(direction: Floats, g: float, random: Any) -> Floats:
    """Returns random directions of Henyey and Greenstein's phase function, unit [n, 3]."""
    squared = (1 - g * g) / (1 - g + 2 * g * random.random(len(direction)))
    cosine = (1 + g * g - squared * squared) / (2 * g)
    return around(direction, cosine, random)


def around(axis: Floats, cosine: Floats, random: Any) -> Floats:
    """Returns random directions with the given cosine to `axis`, unit [n, 3]."""
    other = np.where(np.abs(axis[:, :1]) < 0.7, [[1.0, 0, 0]], [[0, 1.0, 0]])
    right = np.cross(axis, other)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    angle = 2 * np.pi * random.random(len(axis))
    sine = np.sqrt(np.maximum(1 - cosine * cosine, 0))[:, None]
    side = np.cos(angle)[:, None] * right + np.sin(angle)[:, None] * np.cross(axis, right)
    return cosine[:, None] * axis + sine * side


class Walks:
    """Random walks in the scene."""

    def __init__(self, seed: int) -> None:
        scene = scenes()[NAME]
        (floor, grey), (ball, blue), ((corners, _), filled) = scene["objects"]
        self.random = np.random.default_rng(seed)
        self.world = raycam.World()
        self.albedos = np.array([grey["matte"], blue["matte"]])
        for vertices, faces in (floor, ball):
            self.world.add_mesh(vertices, faces)
        place = scene["camera"]
        self.camera = raycam.Camera.look_at(
            place["eye"], place["target"], size=(SIZE, SIZE), fov=place["fov"]
        )
        inside = filled["inside"]
        self.box = np.array([np.min(corners, axis=0), np.max(corners, axis=0)])
        self.extinction = np.add(inside["absorption"], inside["scattering"])
        self.albedo = np.array(inside["scattering"]) / self.extinction
        self.g = inside["g"]
        self.lamp = [np.array(value, float) for value in LAMP["area"]]
        self.radiance = np.array(LAMP["radiance"], float)

    def light(self, position: Floats, color: Floats, response: Any) -> Floats:
        """Returns the light that points receive from one random point of the lamp, [n].

        `response` is a function that returns the fraction of light scattered from a direction towards the
        path.
        """
        center, u, v = self.lamp
        shift = self.random.random((2, len(position), 1)) - 0.5
        offset = center + shift[0] * u + shift[1] * v - position
        length = np.linalg.norm(offset, axis=1)
        towards = offset / length[:, None]
        normal = np.cross(u, v)
        solid = np.maximum(-towards @ normal, 0) / length**2  # the normal's length is the area
        value = self.radiance[color] * solid * response(towards)
        lit = np.flatnonzero(value > 0)
        dark = self.world.occluded(position[lit], towards[lit], t_max=length[lit] * (1 - 1e-9))
        value[lit[np.asarray(dark, bool)]] = 0
        return value * passed(position, towards, length, self.box, self.extinction[color])

    def batch(self, count: int) -> Floats:
        """Returns the radiance of `count` walks through random pixels, in random colours, [n]."""
        random = self.random
        total = np.zeros(count)
        pixels = random.random((count, 2)) * SIZE - 0.5
        position, direction = self.camera.rays(pixels)
        direction = direction / np.linalg.norm(direction, axis=1, keepdims=True)
        color = random.integers(0, 3, count)
        index, weight = np.arange(count), np.ones(count)
        for bounce in range(1000):
            if not len(index):
                break
            hits = self.world.cast_rays(position, direction)
            reach, extinction = hits["t"], self.extinction[color]
            first, last = ends(position, direction, self.box)
            flight = first + random.exponential(size=len(index)) / extinction
            inside = flight < np.minimum(last, reach)
            alive = inside | np.isfinite(reach)
            distance = np.where(inside, flight, reach)
            position, direction, color, index, weight, inside, distance = (
                values[alive] for values in (position, direction, color, index, weight, inside, distance)
            )
            surface, normal = hits["instance"][alive], hits["normal"][alive]
            position = position + distance[:, None] * direction
            normal = normal * -np.sign((normal * direction).sum(1, keepdims=True))
            normal[inside] = -direction[inside]
            position = np.where(inside[:, None], position, position + 1e-9 * normal)
            own = np.where(inside, self.albedo[color], self.albedos[surface, color])
            weight = weight * own
            before, around_it, in_medium, g = direction, normal, inside, self.g

            def response(
                towards: Floats,
                before: Floats = before,
                normal: Floats = around_it,
                inside: Floats = in_medium,
                g: float = g,
            ) -> Floats:
                cosine = (before * towards).sum(1)
                phase = (1 - g * g) / (4 * np.pi * (1 + g * g - 2 * g * cosine) ** 1.5)
                return np.where(inside, phase, np.maximum((normal * towards).sum(1), 0) / np.pi)

            total[index] += weight * self.light(position, color, response)
            direction = np.where(
                inside[:, None],
                scatter(before, g, random),
                around(normal, np.sqrt(random.random(len(index))), random),
            )
            if bounce >= 4:
                survives = random.random(len(index)) < np.minimum(weight, 1)
                weight = np.where(weight < 1, 1.0, weight)
                position, direction, color, index, weight = (
                    values[survives] for values in (position, direction, color, index, weight)
                )
        return total


def main() -> None:
    """Prints the mean over all pixels and colours of both estimates, with their standard errors."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--walks", type=int, default=4_000_000)
    parser.add_argument(
        "--samples", type=int, default=512, help="samples per pixel of each of raycam's 8 images"
    )
    given = parser.parse_args()
    start = time.process_time()
    walks = Walks(1)
    found = np.array([walks.batch(BATCH).mean() for _ in range(max(given.walks // BATCH, 2))])
    error = found.std(ddof=1) / np.sqrt(len(found))
    print(f"walks  {found.mean():.6f} +- {error:.6f} ({time.process_time() - start:.0f} s)", flush=True)
    render = raycam_picture(scenes()[NAME])
    means = np.array([render(given.samples, seed).mean() for seed in range(100, 108)])
    own = means.std(ddof=1) / np.sqrt(len(means))
    print(f"raycam {means.mean():.6f} +- {own:.6f}")
    off, both = means.mean() / found.mean() - 1, np.hypot(error, own) / found.mean()
    print(f"raycam differs by {100 * off:+.2f} % +- {100 * both:.2f} %")


if __name__ == "__main__":
    main()
