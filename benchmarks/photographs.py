"""Compares textures, depth and occlusion from photographs with other programs.

    python benchmarks/photographs.py [--faces N] [--cameras N] [--size N] [--photo W H] [--rays N] [--rounds N]
        [--open3d PYTHON] [--pyrender PYTHON] [--pymeshlab PYTHON] [--bpy PYTHON]

PYTHON is an interpreter with that library; programs without an interpreter are skipped. All programs use the
same arrays. Each program runs in a process of its own, in alternation with the others, `--rounds` times; the
table contains the medians. pyrender uses OSMesa. `difference` compares textures with the texture that the
photographs show, depth with raycam's depth, and occlusion with raycam's occlusion of 4096 rays.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import raycam

RIVALS = Path(__file__).with_name("photograph_rivals.py")
REFERENCE_RAYS = 4096
REFERENCE_FACES = 20_000
"""Faces above which occlusion is not compared with a reference, which would take most of the time."""

Arrays = dict[str, Any]


def ball(faces: int) -> Arrays:
    """Returns a bumpy ball of about `faces` triangles, and the texture for its photographs.

    The ball has texture coordinates.
    """
    side = round(np.sqrt(faces / 2))
    u, v = np.meshgrid(np.linspace(0, 1, side + 1), np.linspace(0.02, 0.98, side + 1))
    radius = 1 + 0.05 * np.sin(20 * u * np.pi) * np.sin(15 * v * np.pi)
    angle, polar = 2 * np.pi * u, np.pi * v
    points = np.stack([np.sin(polar) * np.cos(angle), np.sin(polar) * np.sin(angle), np.cos(polar)], axis=-1)
    corner = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
    a, b, c, d = corner, corner + side + 1, corner + side + 2, corner + 1
    x, y = np.meshgrid(np.arange(512), np.arange(512))
    picture = np.stack([x // 2, y // 2, 128 + 100 * np.sin(x / 9) * np.cos(y / 7)], axis=2).astype(np.uint8)
    return {
        "vertices": (points * radius[..., None]).reshape(-1, 3),
        "faces": np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]),
        "uvs": np.stack([u.ravel(), v.ravel()], axis=1),
        "picture": picture,
    }


def photographed(data: Arrays, count: int, photo: tuple[int, int]) -> Arrays:
    """Returns the arrays with cameras around the ball and their photographs."""
    turns = np.arange(count) * np.pi * (3 - np.sqrt(5))
    height = np.linspace(-0.8, 0.8, count)
    places = np.stack(
        [np.sqrt(1 - height**2) * np.cos(turns), np.sqrt(1 - height**2) * np.sin(turns), height]
    )
    cameras = [raycam.Camera.look_at(3 * place, [0, 0, 0], size=tuple(photo), fov=45) for place in places.T]
    world = raycam.World()
    material = {"type": "unlit", "texture": raycam.Texture(data["picture"], wrap="clamp")}
    world.add_mesh(data["vertices"], data["faces"], uvs=data["uvs"], material=material)
    poses = np.tile(np.eye(4), (count, 1, 1))
    for pose, camera in zip(poses, cameras, strict=True):
        pose[:3, :3], pose[:3, 3] = camera.R, camera.t
    images = [raycam.render(world, camera, samples=4).to_srgb8() for camera in cameras]
    return {
        **data,
        "k": np.stack([camera.K for camera in cameras]),
        "poses": poses,
        "images": np.stack(images),
        "photo": np.array(photo),
    }


class Race:
    """Programs that run in alternation on the same arrays."""

    def __init__(self, folder: Path, rounds: int) -> None:
        self.folder, self.rounds = folder, rounds

    def run(
        self, programs: dict[str, str | None], data: Arrays
    ) -> tuple[dict[str, list[float]], dict[str, Arrays]]:
        """Runs programs in alternation; returns median seconds (processor, elapsed) and results.

        `programs` maps each program to its interpreter; programs without an interpreter are skipped.
        """
        given = self.folder / "in.npz"
        np.savez(given, **data)
        used: dict[str, list[list[float]]] = {}
        results: dict[str, Arrays] = {}
        for _ in range(self.rounds):
            for name, interpreter in programs.items():
                if interpreter is None:
                    continue
                output = self.folder / f"{name}.npz"
                command = [interpreter, str(RIVALS), name, str(given), str(output)]
                done = subprocess.run(command, capture_output=True, text=True)
                lines = [line for line in done.stdout.splitlines() if line.startswith("MEASURED ")]
                if done.returncode or not lines:
                    print(f"{name} failed: {done.stderr.strip().splitlines()[-1:]}", file=sys.stderr)
                    continue
                used.setdefault(name, []).append(json.loads(lines[-1].removeprefix("MEASURED ")))
                with np.load(output) as arrays:
                    results[name] = dict(arrays)
        return {name: np.median(times, axis=0).tolist() for name, times in used.items()}, results


def print_rows(task: str, used: dict[str, list[float]], difference: dict[str, str]) -> None:
    """Prints the rows of a task."""
    for name, (processor, elapsed) in used.items():
        print(
            f"| {task} | {name} | {processor:.2f} | {elapsed:.2f} | {difference.get(name, '')} |", flush=True
        )


def texture_differences(results: dict[str, Arrays], data: Arrays, size: int) -> dict[str, str]:
    """Returns the mean absolute difference from the photographs' texture, for each program.

    Only texels that raycam covers are compared.
    """
    place = (np.arange(size) + 0.5) / size * 512
    truth = data["picture"][place.astype(int)[:, None], place.astype(int)].astype(float)
    known = next((found["known"] for name, found in results.items() if name.startswith("raycam")), None)
    if known is None:
        return {}
    return {
        name: f"{np.abs(found['texture'][known] - truth[known]).mean():.2f} of 255"
        for name, found in results.items()
    }


def depth_differences(results: dict[str, Arrays]) -> dict[str, str]:
    """Returns the mean relative difference from raycam's depth, for each program.

    Also returns the number of pixels that only one of the two programs covers.
    """
    own = results.get("raycam_depth", {}).get("depth")
    found = {}
    for name, each in results.items():
        both = (own > 0) & (each["depth"] > 0)
        lost = ((own > 0) != (each["depth"] > 0)).sum()
        off = np.abs(each["depth"][both] / own[both] - 1).mean()
        found[name] = f"{off:.1e}, {lost} other pixels"
    return found


def occlusion_differences(results: dict[str, Arrays], truth: Arrays | None) -> dict[str, str]:
    """Returns each program's RMS difference from raycam's occlusion with many rays."""
    if truth is None:
        return {}
    known = truth.get("known", np.isfinite(truth["ao"]))
    return {
        name: f"{np.sqrt(np.nanmean((each['ao'] - truth['ao'])[known] ** 2)):.4f}"
        for name, each in results.items()
    }


def main() -> None:
    """Prints a table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--faces", type=int, default=200_000)
    parser.add_argument("--cameras", type=int, default=20)
    parser.add_argument("--size", type=int, default=1024)
    parser.add_argument("--photo", type=int, nargs=2, default=(1200, 900))
    parser.add_argument("--rays", type=int, default=64)
    parser.add_argument("--rounds", type=int, default=3)
    for name in ("open3d", "pyrender", "pymeshlab", "bpy"):
        parser.add_argument(f"--{name}", metavar="PYTHON")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    own = sys.executable
    data = photographed(ball(options.faces), options.cameras, tuple(options.photo))
    data |= {"size": options.size, "rays": options.rays}
    faces, cameras = len(data["faces"]), options.cameras
    print("| task | program | processor s | elapsed s | difference |\n| --- | --- | --: | --: | --- |")
    with tempfile.TemporaryDirectory() as folder:
        race = Race(Path(folder), options.rounds)
        used, _ = race.run({"raycam_visibility": own}, data)
        print_rows(f"{faces} faces in {cameras} cameras", used, {})
        used, found = race.run({"raycam_depth": own, "pyrender_depth": options.pyrender}, data)
        print_rows(f"depth of {cameras} photographs", used, depth_differences(found))
        programs = {"raycam_blend": own, "raycam_best": own, "open3d_texture": options.open3d}
        used, found = race.run(programs, data)
        print_rows(f"texture of {options.size}²", used, texture_differences(found, data, options.size))
        for task, programs in (
            (f"occlusion of {options.size}²", {"raycam_occlusion": own, "cycles_occlusion": options.bpy}),
            (
                "occlusion at vertices",
                {"raycam_vertex_occlusion": own, "pymeshlab_occlusion": options.pymeshlab},
            ),
        ):
            used, found = race.run(programs, data)
            truth = None
            if faces <= REFERENCE_FACES:
                name = next(iter(programs))
                _, best = Race(Path(folder), 1).run({name: own}, {**data, "rays": REFERENCE_RAYS})
                truth = best.get(name)
            print_rows(task, used, occlusion_differences(found, truth))


if __name__ == "__main__":
    main()
