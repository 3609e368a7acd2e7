"""Compares the light of random worlds in raycam and Mitsuba 3.

A world consists of a floor, sometimes a wall, and up to five bodies that do not touch each other, under one
to three lights. Bodies are balls, boxes and sheets with random rotations. Their materials mean the same in
both renderers: matte, gold, clear glass, thin panes, and emissive. Each renderer computes eight images with
different random numbers. The difference of the means, and the largest difference among blocks of 6 x 6
pixels, are divided by their standard errors. They follow Student's t distribution with 14 degrees of freedom,
which exceeds 4.1 once in a thousand cases.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import path_raycam
import path_worker
import report
from path_scenes import DEPTH, Array, Scene, ball, sheet

SIZE = (48, 36)
PICTURES = 8
BLOCK = 6
LIGHTS = ("sky", "sun", "bulb", "area", "image")


def turned(random: np.random.Generator) -> Array:
    """Returns a random rotation."""
    q, r = np.linalg.qr(random.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return np.asarray(q if np.linalg.det(q) > 0 else -q)


def box() -> tuple[Array, Array]:
    """Returns a box of size 1 whose faces point outwards."""
    axes = np.eye(3)
    sides = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            u, v = axes[(axis + 1) % 3], axes[(axis + 2) % 3] * sign
            sides.append(sheet((axes[axis] * sign / 2).tolist(), u.tolist(), v.tolist()))
    faces = [side + 4 * number for number, (_, side) in enumerate(sides)]
    return np.concatenate([corners for corners, _ in sides]), np.concatenate(faces)


def color(random: np.random.Generator) -> list[float]:
    return np.round(random.uniform(0.05, 0.9, 3), 3).tolist()


def matter(random: np.random.Generator, closed: bool) -> dict[str, Any]:
    kind = random.choice(
        ["matte", "matte", "gold", "glass" if closed else "pane", "shines" if closed else "matte"]
    )
    if kind in ("glass", "pane"):
        return {str(kind): float(random.uniform(1.2, 1.9))}
    if kind == "shines":
        return {"shines": random.uniform(0.5, 4, 3).tolist()}
    return {"gold": True} if kind == "gold" else {"matte": color(random)}


def light(random: np.random.Generator, image: str | None) -> dict[str, Any]:
    kind = random.choice(LIGHTS[:5] if image else LIGHTS[:4])
    power = random.uniform(0.3, 1, 3) * random.uniform(3, 15)
    if kind == "image":
        return {"image": image}
    if kind == "sky":
        return {"sky": random.uniform(0.05, 0.6, 3).tolist()}
    if kind == "sun":
        down = random.uniform([-1, -1, -1], [1, 1, -0.3])
        return {"sun": down.tolist(), "irradiance": (power / 4).tolist()}
    if kind == "bulb":
        return {"bulb": random.uniform([-2, -2, 1.5], [2, 2, 3]).tolist(), "intensity": power.tolist()}
    center = random.uniform([-2, -2, 1.8], [2, 2, 4])
    towards = random.uniform(-0.6, 0.6, 3) - center
    u = np.cross(towards, random.normal(size=3))
    v = np.cross(towards, u)
    u, v = (axis / np.linalg.norm(axis) * random.uniform(0.4, 2) for axis in (u, v))
    return {"area": [center.tolist(), u.tolist(), v.tolist()], "radiance": power.tolist()}


def scene(seed: int, folder: Path, image: str | None) -> Scene:
    random = np.random.default_rng(seed)
    objects: list[tuple[str, dict[str, Any]]] = []

    def add(shape: tuple[Array, Array], material: dict[str, Any]) -> None:
        path = folder / f"{seed}-{len(objects)}.npz"
        vertices, faces = shape
        np.savez(path, vertices=vertices.astype(np.float32), faces=faces.astype(np.uint32))
        objects.append((str(path), material))

    add(sheet([0, 0, -1.1], [8, 0, 0], [0, 8, 0]), {"matte": color(random)})
    if random.random() < 0.5:
        add(sheet([0, 3, 1], [8, 0, 0], [0, 0, 6]), {"matte": color(random)})
    placed: list[tuple[Array, float]] = []
    for _ in range(random.integers(2, 6)):
        size = random.uniform(0.3, 0.8)
        center = random.uniform([-1.6, -1.6, 1.1 * size - 1.05], [1.6, 1.6, 0.9])
        if any(np.linalg.norm(center - other) < 1.1 * (size + its) for other, its in placed):
            continue
        placed.append((center, size))
        kind, rotation = random.choice(["ball", "box", "sheet"]), turned(random)
        if kind == "ball":
            shape = ball(center.tolist(), size, int(random.integers(1, 4)))
        elif kind == "box":
            corners, faces = box()
            shape = corners * (size * random.uniform(0.4, 1.15, 3)) @ rotation + center, faces
        else:
            u, v = 1.4 * size * rotation[:2]
            shape = sheet(center.tolist(), u.tolist(), v.tolist())
        add(shape, matter(random, kind != "sheet"))
    lights: list[dict[str, Any]] = []
    for _ in range(random.integers(1, 4)):
        more = light(random, image)
        around = ("sky", "image")
        if not any(key in more and any(key in old for key in around for old in lights) for key in around):
            lights.append(more)
    camera = {
        "eye": random.uniform([2, -4, 0.3], [4, -2, 2.5]).tolist(),
        "target": random.uniform(-0.3, 0.3, 3).tolist(),
        "fov": float(random.uniform(30, 60)),
    }
    return {"camera": camera, "lights": lights, "objects": objects}


def pictures(picture: Any, samples: int) -> Array:
    return np.array([picture(samples, 1 + seed)[0] for seed in range(PICTURES)], np.float64)


def t_of(mine: Array, theirs: Array, least: float) -> tuple[Array, Array]:
    """Returns the differences of means over the first axis, and their t values.

    A t value is the difference divided by its standard error, which is at least `least`.
    """
    variance = (mine.var(0, ddof=1) + theirs.var(0, ddof=1)) / PICTURES
    off = mine.mean(0) - theirs.mean(0)
    return off, off / np.maximum(np.sqrt(variance), least)


def blocks(images: Array) -> Array:
    count, height, width, _ = images.shape
    cut = images.reshape(count, height // BLOCK, BLOCK, width // BLOCK, BLOCK, 3)
    return np.asarray(cut.mean(axis=(2, 4, 5)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mitsuba", metavar="PYTHON", required=True, help="Python interpreter with Mitsuba")
    parser.add_argument("--variant", default="llvm_ad_rgb", help="Mitsuba variant")
    parser.add_argument("--seeds", type=int, nargs=2, default=(0, 30), metavar=("FROM", "TO"))
    parser.add_argument("--samples", type=int, default=1024, help="samples per pixel of each image")
    parser.add_argument(
        "--image", metavar="FILE", help="equirectangular environment image that some scenes use"
    )
    options = parser.parse_args()
    image = str(Path(options.image).resolve()) if options.image else None
    settings = {"variant": options.variant, "sampler": "independent"}
    rows, beyond, tested = [], 0, 0
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(*options.seeds):
            parts = scene(seed, Path(folder), image)
            mine = pictures(path_raycam.picture(parts, SIZE), options.samples)
            with path_worker.picture("mitsuba", options.mitsuba, parts, SIZE, **settings) as picture:
                theirs = pictures(picture, options.samples)
            mean = theirs.mean()
            off, t = t_of(mine.mean(axis=(1, 2, 3)), theirs.mean(axis=(1, 2, 3)), 1e-5 * mean)
            # Blocks of pixels without noise may differ by rounding errors of float32 only.
            of_block, block_t = t_of(blocks(mine), blocks(theirs), 3e-4 * mean)
            beyond += int((np.abs(block_t) > 4.1).sum())
            tested += block_t.size
            rows.append(
                [
                    str(seed),
                    " ".join(next(iter(material)) for _, material in parts["objects"]),
                    " ".join(next(iter(light)) for light in parts["lights"]),
                    f"{mine.mean():.5f}",
                    f"{100 * off / mean:+.3f} %",
                    f"{t:+.1f}",
                    f"{100 * np.abs(of_block).max() / mean:.2f} %",
                    f"{np.abs(block_t).max():.1f}",
                ]
            )
            print(*rows[-1], file=sys.stderr)
    head = [
        "seed",
        "objects",
        "lights",
        "mean radiance",
        "difference",
        "t",
        "largest difference of a block",
        "largest t",
    ]
    notes = [
        f"{SIZE[0]} x {SIZE[1]}, paths of at most {DEPTH} segments, box filter; {PICTURES} images "
        f"with {options.samples} samples by each renderer; Mitsuba uses {options.variant}. The worlds are generated.",
        f"In {beyond} of {tested} blocks, t exceeds 4.1. If noise is normal, this happens by chance once in a "
        "thousand.",
    ]
    report.write("random_scenes", "Random worlds compared with Mitsuba 3", notes, head, rows)


if __name__ == "__main__":
    main()
