"""Compares every channel of many images, byte for byte, with another build of raycam.

    python benchmarks/same_pictures.py --against PYTHON [--isa avx512 avx2 portable] [--models FOLDER ...]

PYTHON is an interpreter with the other build. Each build renders the same list of images in a process of its
own, once per instruction set. An image counts as different if a byte of a channel that both builds have
differs; the exit status is then 1. The list contains the scenes of the path-tracing benchmark, all materials,
lights and lens models, textures, moving cameras, and every glTF, OBJ, PLY, STL and OFF file in the given
folders.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

SIZE = (64, 48)
SAMPLES = 4
ISA = ("avx512", "avx2", "portable")
ENDINGS = {".gltf", ".glb", ".obj", ".ply", ".stl", ".off"}

K = [[60.0, 0.0, 31.5], [0.0, 60.0, 23.5], [0.0, 0.0, 1.0]]
LENSES: dict[str, list[float] | None] = {
    "opencv": [-0.2, 0.05, 1e-3, -1e-3, 0.01],
    "fisheye": [0.02, -0.005, 1e-3, 0.0],
    "thin_prism_fisheye": [0.02, -0.005, 1e-3, -1e-3, 1e-3, 0.0, 1e-4, 1e-4],
    "fov": [0.9],
    "division": [-0.1],
    "eucm": [0.6, 1.1],
    "ds": [-0.2, 0.6],
    "equirectangular": None,
}
MATERIALS: dict[str, dict[str, Any]] = {
    "lecture": {"diffuse": 0.8, "specular": 0.2, "shininess": 40},
    "matte": {"type": "matte", "color": [0.7, 0.3, 0.2]},
    "unlit": {"type": "unlit", "color": [0.2, 0.6, 0.4]},
    "gold": {"type": "metal", "metal": "gold"},
    "brushed copper": {"type": "metal", "metal": "copper", "roughness": 0.3},
    "glass": {"type": "glass", "ior": 1.5},
    "frosted": {"type": "glass", "ior": 1.45, "roughness": 0.3},
    "prism": {"type": "glass", "ior": 1.6, "dispersion": 0.5},
    "tinted": {
        "type": "glass",
        "ior": 1.3,
        "attenuation_color": [0.2, 0.7, 0.9],
        "attenuation_distance": 0.4,
    },
    "thin": {"type": "glass", "ior": 1.5, "thin": True},
    "plastic": {"type": "principled", "color": [0.1, 0.4, 0.7], "roughness": 0.35},
    "steel": {"type": "principled", "metallic": 1.0, "roughness": 0.2, "anisotropy": 0.6},
    "car paint": {
        "type": "principled",
        "color": [0.6, 0.1, 0.1],
        "clearcoat": 1.0,
        "clearcoat_roughness": 0.1,
    },
    "cloth": {"type": "principled", "sheen_color": [0.8, 0.7, 0.6], "sheen_roughness": 0.4},
    "film": {"type": "principled", "metallic": 1.0, "iridescence": 1.0, "roughness": 0.1},
    "filmed plastic": {"type": "principled", "iridescence": 1.0, "roughness": 0.3},
    "milk": {"type": "principled", "transmission": 0.5, "roughness": 0.3},
    "leaf": {"type": "principled", "diffuse_transmission": 0.6},
    "half open": {"color": [0.5, 0.5, 0.5], "opacity": 0.5},
    "ember": {"color": [0.0, 0.0, 0.0], "emission": [3.0, 1.0, 0.2]},
}
LIGHTS: dict[str, list[dict[str, Any]]] = {
    "sky": [{"type": "sky", "radiance": [0.4, 0.5, 0.7]}],
    "gradient": [{"type": "sky", "zenith": [0.2, 0.3, 0.8], "horizon": [0.8, 0.7, 0.6]}],
    "sun": [
        {"type": "sun", "direction": [-1, 0.5, -2], "irradiance": [3, 2.8, 2.5], "angular_diameter": 0.53}
    ],
    "bulb": [{"type": "point", "position": [1.5, -1, 2], "intensity": [6, 5, 4]}],
    "globe": [{"type": "point", "position": [1.5, -1, 2], "power": [60, 55, 50], "radius": 0.2}],
    "spot": [
        {
            "type": "spot",
            "position": [0, -1, 3],
            "direction": [0, 0.3, -1],
            "power": [90, 80, 70],
            "outer": 40,
        }
    ],
    "area": [{"type": "area", "position": [0, 0, 3], "u": [1, 0, 0], "v": [0, -1, 0], "radiance": [8, 8, 7]}],
    "disk": [
        {"type": "disk", "position": [0, 0, 3], "direction": [0, 0, -1], "radius": 0.6, "radiance": [8, 7, 6]}
    ],
    "daylight": [{"type": "daylight", "direction": [-1, 0.5, -1], "turbidity": 3}],
    "several": [
        {"type": "sky", "radiance": [0.1, 0.1, 0.15]},
        {"type": "point", "position": [1.5, -1, 2], "intensity": [6, 5, 4]},
        {"type": "area", "position": [-1, 0, 3], "u": [1, 0, 0], "v": [0, -1, 0], "radiance": [4, 4, 7]},
    ],
}

Picture = Callable[[], Any]


def table(raycam: Any, material: dict[str, Any], lights: list[dict[str, Any]]) -> Any:
    """Returns a world with a ball of the given material, a box and a floor."""
    world = raycam.World()
    world.add_object(sphere={"radius": 0.6}, **material)
    world.add_object(box={"size": [0.5, 0.4, 0.7]}, location=[0.9, 0.3, -0.25], yaw=30, color=[0.3, 0.6, 0.3])
    world.add_object(plane={"size": [8, 8]}, location=[0, 0, -0.6], color=[0.6, 0.55, 0.5])
    for light in lights:
        world.add_light(light)
    return world


def camera_of(raycam: Any, **more: Any) -> Any:
    return raycam.Camera.look_at([1.8, -2.6, 1.1], [0.2, 0, -0.1], [0, 0, 1], size=SIZE, fov=45, **more)


def lens_camera(raycam: Any, lens: str) -> Any:
    pose = camera_of(raycam)
    return raycam.Camera(K, pose.R, pose.C, size=SIZE, distortion=LENSES[lens], model=lens)


def textured_pictures(raycam: Any, camera: Any) -> Iterator[tuple[str, Picture]]:
    """Yields images with textures, for narrow and wide lenses.

    The textures are magnified, minified, blended or emissive, or normal maps.
    """
    import numpy as np

    noise = np.random.default_rng(0).integers(0, 256, (512, 512, 4)).astype(np.uint8)
    blue = np.array([0, 0, 1]) * 255
    bumps = (0.8 * blue + 0.2 * noise[..., :3]).astype(np.uint8)
    wide = raycam.Camera.look_at([0, -2, 1.5], [0, 0, 0], size=SIZE, fov=130)
    cameras = {"narrow": camera, "wide": wide, "fisheye": lens_camera(raycam, "fisheye")}
    surfaces: dict[str, dict[str, Any]] = {
        "magnified": {"texture": noise[:4, :4, :3].copy()},
        "minified": {"texture": noise[..., :3].copy()},
        "blended": {"texture": noise, "alpha": "blend"},
        "emissive": {"textures": {"emission": noise[..., :3].copy()}, "emission": [1.0, 1.0, 1.0]},
        "bumpy metal": {
            "type": "principled",
            "metallic": 1.0,
            "roughness": 0.1,
            "textures": {"normal": bumps},
        },
    }
    for name, surface in surfaces.items():
        world = raycam.World()
        world.add_object(plane={"size": [8, 8]}, **surface)
        world.add_light(LIGHTS["gradient"][0])
        for lens, view in cameras.items():
            for integrator in ("flat", "path"):
                yield (
                    f"texture {name}, {lens}, {integrator}",
                    lambda w=world, c=view, i=integrator: raycam.render(
                        w, c, integrator=i, samples=SAMPLES, channels="all"
                    ),
                )


def pictures(raycam: Any, folder: Path, models: list[Path]) -> Iterator[tuple[str, Picture]]:
    """Returns the names of the images, with functions that render them."""
    import path_raycam
    import path_scenes

    for name, scene in path_scenes.scenes(folder).items():
        for seed in (0, 7):
            render = path_raycam.picture(scene, SIZE)
            yield f"scene {name} {seed}", lambda render=render, seed=seed: {"color": render(SAMPLES, seed)[0]}
    camera = camera_of(raycam)
    for name, material in MATERIALS.items():
        for lights in ("several", "sun"):
            world = table(raycam, material, LIGHTS[lights])
            for integrator in ("flat", "direct", "path", "ao"):
                yield (
                    f"{name} under {lights}, {integrator}",
                    lambda w=world, i=integrator: raycam.render(
                        w, camera, integrator=i, samples=SAMPLES, channels="all"
                    ),
                )
    for name, lights in LIGHTS.items():
        world = table(raycam, MATERIALS["plastic"], lights)
        yield f"light {name}", lambda w=world: raycam.render(w, camera, integrator="path", samples=SAMPLES)
        glass = table(raycam, MATERIALS["glass"], lights)
        yield (
            f"light {name}, glass",
            lambda w=glass: raycam.render(
                w, camera, integrator="path", samples=SAMPLES, filter="blackman-harris"
            ),
        )
    yield from textured_pictures(raycam, camera)
    world = table(raycam, MATERIALS["lecture"], LIGHTS["several"])
    for lens in LENSES:
        yield (
            f"lens {lens}",
            lambda lens=lens: raycam.render(
                world, lens_camera(raycam, lens), samples=SAMPLES, channels="all"
            ),
        )
    x, y, z = camera.C
    further = camera.at_pose(camera.R, [x + 0.2, y + 0.1, z])
    cameras = {
        "thin lens": camera.with_aperture(0.1, focus=2.5, blades=6),
        "exposed while it moves": camera.moving(further, exposure=0.02),
        "rolling": camera.moving(further, exposure=0.01, readout=0.02),
    }
    for name, moved in cameras.items():
        yield f"camera {name}", lambda c=moved: raycam.render(world, c, samples=SAMPLES, channels="all")
    yield (
        "noise",
        lambda: raycam.render(
            world, camera, integrator="path", noise_threshold=0.005, channels=["color", "error"]
        ),
    )
    yield (
        "region",
        lambda: raycam.render(world, camera, samples=SAMPLES, region=(5, 7, 31, 17), channels="all"),
    )
    for path in sorted(
        file for folder in models for file in folder.rglob("*") if file.suffix.lower() in ENDINGS
    ):
        yield (
            f"file {path.name}",
            lambda path=path: raycam.render(
                raycam.load(path),
                raycam.load(path).default_camera(SIZE),
                integrator="path",
                samples=SAMPLES,
                channels="all",
            ),
        )


def digest(frame: Any) -> dict[str, str]:
    """Returns the hash of each channel."""
    import numpy as np

    names = frame if isinstance(frame, dict) else frame.channels
    return {
        name: hashlib.sha256(np.ascontiguousarray(frame[name]).tobytes()).hexdigest()[:16] for name in names
    }


def worker(folder: str, models: list[str]) -> None:
    """Renders all images and prints a line of JSON for each."""
    import warnings

    import raycam

    warnings.simplefilter("ignore")
    print(json.dumps(["build", {"raycam": str(Path(raycam.__file__).parent)}]), flush=True)
    for name, picture in pictures(raycam, Path(folder), [Path(model) for model in models]):
        try:
            result = digest(picture())
        except Exception as error:  # the other build must raise the same error
            result = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps([name, result]), flush=True)


def run(python: str, isa: str, folder: str, models: list[str]) -> dict[str, dict[str, str]] | None:
    """Renders all images with one build and instruction set, and returns their hashes.

    Returns None if the processor does not support the instruction set.
    """
    environment = os.environ | {"RAYCAM_ISA": isa}
    command = [python, __file__, "--worker", folder, *models]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    if done.returncode:
        if "RAYCAM_ISA" in done.stderr:
            return None
        raise SystemExit(done.stderr)
    return dict(map(json.loads, done.stdout.splitlines()))


def main() -> None:
    if sys.argv[1:2] == ["--worker"]:
        return worker(sys.argv[2], sys.argv[3:])
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--against", metavar="PYTHON", required=True, help="Python interpreter with the other raycam build"
    )
    parser.add_argument("--isa", nargs="+", default=list(ISA))
    parser.add_argument("--models", metavar="FOLDER", nargs="*", default=[])
    options = parser.parse_args()
    different = 0
    with tempfile.TemporaryDirectory() as folder:
        for isa in options.isa:
            mine, other = (
                run(python, isa, folder, options.models) for python in (sys.executable, options.against)
            )
            if mine is None or other is None:
                print(f"{isa}: this processor does not support the instruction set")
                continue
            print(isa, mine.pop("build")["raycam"], "and", other.pop("build")["raycam"])
            names = []
            for name in {**mine, **other}:
                here, there = mine.get(name, {}), other.get(name, {})
                both = here.keys() & there.keys()
                wrong = sorted(channel for channel in both if here[channel] != there[channel])
                if wrong or not both:
                    names.append(name)
                    print(f"  {name}: {', '.join(wrong) or f'{here} and {there}'}")
            failed = sum("error" in result and len(result) == 1 for result in mine.values())
            print(
                f"{isa}: {len(mine)} images ({failed} of them refused by both builds), {len(names)} differ",
                flush=True,
            )
            different += len(names)
    sys.exit(bool(different))


if __name__ == "__main__":
    main()
