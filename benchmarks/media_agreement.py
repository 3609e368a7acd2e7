"""Compares images with homogeneous media with those of Mitsuba 3 (`volpath`).

    python benchmarks/media_agreement.py --mitsuba PYTHON     PYTHON has Mitsuba 3 installed

Each renderer computes independent images of eight scenes on one thread. The difference of the means is
reported with its standard error. The time to equal error is the processor time multiplied by the mean squared
error of an image; this product does not depend on the number of samples. The error is the variance of the
images, because both means agree. A ratio above 1 means that raycam is faster.

No scene has both a lamp and a sky, because lamps block the sky in Mitsuba, but not in raycam. The white
furnace contains media that do not absorb: every pixel must be 1. DRJIT_LIBLLVM_PATH is the path of the LLVM
library for Mitsuba's `llvm` variants.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from hard_scenes import block, inside_out
from path_scenes import ball, sheet

SIZE = 32
PICTURES = 8
FLOOR = sheet([0, 0, 0], [8, 0, 0], [0, 8, 0])
GREY = {"matte": [0.6, 0.55, 0.5]}
SKY = {"sky": [0.6, 0.8, 1.0]}
SUN = {"sun": [0.4, 0.5, -1], "irradiance": [4, 3.5, 3]}
LAMP = {"area": ([0, 0, 2.6], [0, 0.8, 0], [0.8, 0, 0]), "radiance": [12, 11, 10]}


def medium(absorption: list[float], scattering: list[float], g: float = 0.0) -> dict[str, Any]:
    """Returns a medium by its coefficients in 1/m."""
    return {"absorption": absorption, "scattering": scattering, "g": g}


def body(shape: Any, inside: dict[str, Any], ior: float | None = None) -> tuple[Any, dict[str, Any]]:
    """Returns an object that is filled with a medium.

    Its surface is glass with the index of refraction `ior`, or it has no surface if `ior` is None.
    """
    return shape, {"inside": inside, "ior": ior}


def view(eye: list[float], target: list[float], fov: float = 40) -> dict[str, Any]:
    """Returns a camera at `eye` that points at the target."""
    return {"eye": eye, "target": target, "fov": fov}


def scenes() -> dict[str, dict[str, Any]]:
    """Returns the scenes by name."""
    outside = view([0, -4, 1.6], [0, 0, 0.6])
    room = inside_out(block([-1, -1, 0], [1, 1, 2]))
    smoke = medium([0.3, 0.3, 0.3], [5.7, 5.7, 5.7], 0.9)
    made: dict[str, dict[str, Any]] = {
        "fog room with a bulb": {
            "objects": [(room, {"matte": [0.7] * 3})],
            "lights": [{"bulb": [0.3, 0.2, 1.5], "intensity": [1, 0.9, 0.8]}],
            "fog": medium([0.05] * 3, [0.45] * 3),
            "camera": view([0, -0.9, 1], [0, 1, 0.9], 70),
        },
        "sun through fog": {
            "objects": [
                (FLOOR, GREY),
                (ball([0.4, 0, 0.5], 0.3), {"matte": [0.8, 0.3, 0.2]}),
                body(block([-1.5, -1.5, 0.05], [1.5, 1.5, 1.6]), medium([0.02] * 3, [0.5] * 3, 0.5)),
            ],
            "lights": [SUN],
            "camera": outside,
        },
        "milk under a sky": {
            "objects": [body(ball([0, 0, 0.6], 0.5), medium([0.05, 0.1, 0.2], [8, 9, 10]), 1.33)],
            "lights": [SKY],
            "camera": outside,
        },
        "absorbing glass": {
            "objects": [(FLOOR, GREY), body(ball([0, 0, 0.6], 0.5), medium([0.3, 1.2, 3], [0] * 3), 1.5)],
            "lights": [SKY],
            "camera": outside,
        },
        "water box": {
            "objects": [
                (FLOOR, GREY),
                body(block([-0.8, -0.8, 0.05], [0.8, 0.8, 1]), medium([0.6, 0.2, 0.1], [1.5] * 3, 0.8)),
            ],
            "lights": [LAMP],
            "camera": outside,
        },
        "forward-scattering smoke": {
            "objects": [(FLOOR, GREY), body(ball([0, 0, 0.6], 0.5), smoke)],
            "lights": [SKY, SUN],
            "camera": outside,
        },
        "medium around the camera": {
            "objects": [
                (FLOOR, GREY),
                (ball([0, 1, 0.5], 0.45), {"matte": [0.2, 0.4, 0.8]}),
                body(block([-2, -5, 0.05], [2, 0.2, 2.2]), medium([0.1, 0.05, 0.02], [0.25] * 3, 0.3)),
            ],
            "lights": [LAMP],
            "camera": outside,
        },
        "two media side by side": {
            "objects": [
                (FLOOR, GREY),
                body(block([-0.9, -0.5, 0.05], [-0.02, 0.5, 1]), medium([0.1, 0.8, 1.2], [2] * 3)),
                body(block([0.02, -0.5, 0.05], [0.9, 0.5, 1]), medium([1.2, 0.5, 0.1], [2] * 3, 0.6)),
            ],
            "lights": [SKY],
            "camera": outside,
        },
    }
    made["white furnace"] = {
        "objects": [
            body(ball([-0.55, 0, 0.6], 0.5), medium([0] * 3, [3, 5, 8], 0.5), 1.33),
            body(ball([0.55, 0, 0.6], 0.5), medium([0] * 3, [3, 5, 8], -0.3)),
        ],
        "lights": [{"sky": [1, 1, 1]}],
        "camera": outside,
    }
    return made


def raycam_picture(scene: dict[str, Any]) -> Any:
    """Returns a function that renders a scene with raycam: (samples, seed) to image."""
    import raycam

    world = raycam.World()
    for (vertices, faces), material in scene["objects"]:
        if "matte" in material:
            keys: dict[str, Any] = {"type": "matte", "diffuse": 1, "color": material["matte"]}
        else:
            keys = {"medium": material["inside"], "type": "glass" if material["ior"] else "boundary"}
            keys |= {"ior": material["ior"]} if material["ior"] else {}
        world.add_mesh(vertices, faces, material=keys)
    for light in scene["lights"]:
        if "bulb" in light:
            world.add_light("bulb", position=light["bulb"], intensity=light["intensity"])
        elif "sun" in light:
            world.add_light("sun", direction=light["sun"], irradiance=light["irradiance"])
        elif "sky" in light:
            world.add_light("sky", radiance=light["sky"])
        else:
            position, u, v = light["area"]
            world.add_light("area", position=position, u=u, v=v, radiance=light["radiance"])
    if "fog" in scene:
        fog = {name: np.array(value) for name, value in scene["fog"].items()}
        extinction = fog["absorption"] + fog["scattering"]
        world.set_fog(
            extinction=extinction.tolist(),
            albedo=(fog["scattering"] / extinction).tolist(),
            g=float(fog["g"]),
        )
    place = scene["camera"]
    camera = raycam.Camera.look_at(place["eye"], place["target"], size=(SIZE, SIZE), fov=place["fov"])

    def render(samples: int, seed: int) -> Any:
        frame = raycam.render(
            world, camera, integrator="path", samples=samples, seed=seed, threads=1, channels="color"
        )
        return frame["color"]

    return render


def mitsuba_picture(scene: dict[str, Any], variant: str) -> Any:
    """Returns a function that renders a scene with Mitsuba: (samples, seed) to image."""
    import mitsuba as mi
    from path_mitsuba import bsdf, emitter, rgb

    mi.set_variant(variant)

    def homogeneous(inside: dict[str, Any]) -> dict[str, Any]:
        absorption, scattering = np.array(inside["absorption"]), np.array(inside["scattering"])
        phase = {"type": "hg", "g": inside["g"]} if inside["g"] else {"type": "isotropic"}
        extinction = absorption + scattering
        return {
            "type": "homogeneous",
            "sigma_t": rgb((extinction / extinction.max()).tolist()),
            "scale": float(extinction.max()),
            "albedo": rgb((scattering / extinction).tolist()),
            "phase": phase,
        }

    place = scene["camera"]
    to_world = mi.ScalarTransform4f().look_at(origin=place["eye"], target=place["target"], up=[0, 0, 1])
    sensor: dict[str, Any] = {
        "type": "perspective",
        "fov": place["fov"],
        "fov_axis": "y",
        "to_world": to_world,
        "film": {
            "type": "hdrfilm",
            "width": SIZE,
            "height": SIZE,
            "rfilter": {"type": "box"},
            "pixel_format": "rgb",
        },
        "sampler": {"type": "multijitter"},
    }
    around = None
    world: dict[str, Any] = {
        "type": "scene",
        "integrator": {"type": "volpath", "max_depth": -1, "rr_depth": 5},
    }
    if "fog" in scene:
        around = mi.load_dict(homogeneous(scene["fog"]))
    for number, ((vertices, faces), material) in enumerate(scene["objects"]):
        properties = mi.Properties()
        if "matte" in material:
            surface = bsdf(material)
        elif material["ior"]:
            surface = {"type": "dielectric", "int_ior": material["ior"], "ext_ior": 1.0}
        else:
            surface = {"type": "null"}
        properties["mesh_bsdf"] = mi.load_dict(surface)
        if "inside" in material:
            inside = mi.load_dict(homogeneous(material["inside"]))
            properties["interior"] = inside
            if not material["ior"] and contains(vertices, place["eye"]):
                around = inside
        mesh = mi.Mesh(f"m{number}", len(vertices), len(faces), props=properties)
        parameters = mi.traverse(mesh)
        parameters["vertex_positions"] = np.asarray(vertices, np.float32).ravel()
        parameters["faces"] = np.asarray(faces, np.uint32).ravel()
        parameters.update()
        world[f"object{number}"] = mesh
    if around is not None:
        sensor["medium"] = around
    for number, light in enumerate(scene["lights"]):
        world[f"light{number}"] = emitter(light, mi.ScalarTransform4f)
    world["sensor"] = sensor
    loaded = mi.load_dict(world)
    return lambda samples, seed: np.array(mi.render(loaded, spp=samples, seed=seed))


def contains(vertices: Any, point: list[float]) -> bool:
    """Returns whether a point is in the bounding box of a mesh."""
    low, high = np.min(vertices, axis=0), np.max(vertices, axis=0)
    return bool((low < point).all() and (point < high).all())


def measure(picture: Any, samples: int) -> tuple[Any, float]:
    """Returns independent images [n, h, w, 3], and the processor seconds of one image.

    A first image, which prepares the scene, is not measured. It has the same number of samples, because Mitsuba
    compiles kernels for each number of samples.
    """
    picture(samples, 999)
    start = time.process_time()
    images = np.array([picture(samples, 1 + 100_003 * number) for number in range(PICTURES)])
    return images, (time.process_time() - start) / PICTURES


def main() -> None:
    """Prints a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--mitsuba", required=True, help="Python interpreter with Mitsuba 3")
    parser.add_argument("--variant", default="llvm_ad_rgb", help="Mitsuba's variant")
    parser.add_argument("--samples", type=int, default=1024, help="samples per pixel of each of the 8 images")
    parser.add_argument("--only", nargs="*", help="render only scenes whose names contain one of these words")
    parser.add_argument("--worker", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    chosen = {
        name: scene
        for name, scene in scenes().items()
        if not given.only or any(part in name for part in given.only)
    }
    if given.worker:
        if given.variant.startswith("llvm"):
            import drjit

            drjit.set_thread_count(1)
        for number, scene in enumerate(chosen.values()):
            images, seconds = measure(mitsuba_picture(scene, given.variant), given.samples)
            np.savez(given.worker / f"{number}.npz", images=images, seconds=seconds)
        return
    print("| scene | mean | difference | standard error | processor s raycam, Mitsuba | ratio |")
    print("| --- | --: | --: | --: | --: | --: |")
    ratios = []
    with tempfile.TemporaryDirectory() as folder:
        command = [given.mitsuba, __file__, *sys.argv[1:], "--worker", folder]
        subprocess.run(command, check=True)
        for number, (name, scene) in enumerate(chosen.items()):
            theirs = np.load(f"{folder}/{number}.npz")
            images, seconds = measure(raycam_picture(scene), given.samples)
            off, error, ratio = compare(images, seconds, theirs["images"], float(theirs["seconds"]))
            times = f"{seconds:.2f}, {float(theirs['seconds']):.2f}"
            print(
                f"| {name} | {images.mean():.4f} | {100 * off:+.2f} % | {100 * error:.2f} % | {times} | {ratio:.2f} |",
                flush=True,
            )
            if "furnace" in name:
                print(
                    f"\nwhite furnace: worst region of 4 x 4: {abs(regions(images) - 1).max():.5f} from 1",
                    flush=True,
                )
            else:
                ratios.append(ratio)
    print(f"\ngeometric mean of the ratios: {np.exp(np.log(ratios).mean()):.2f}" if ratios else "")


def regions(images: Any) -> Any:
    """Returns the means of 4 x 4 regions, over all images and channels."""
    side = SIZE // 4
    return images.reshape(len(images), 4, side, 4, side, 3).mean(axis=(0, 2, 4, 5))


def compare(mine: Any, my_seconds: float, its: Any, its_seconds: float) -> tuple[float, float, float]:
    """Returns the comparison of two renderers' images of a scene.

    The values are the relative difference of the means, its standard error, and the ratio of times to equal
    error.
    """
    off = mine.mean() / its.mean() - 1
    spread = [images.mean(axis=(1, 2, 3)).std(ddof=1) / images.mean() for images in (mine, its)]
    error = np.hypot(*spread) / np.sqrt(PICTURES)
    cost = [
        seconds * images.var(axis=0, ddof=1).mean()
        for images, seconds in ((mine, my_seconds), (its, its_seconds))
    ]
    return float(off), float(error), float(cost[1] / cost[0])


if __name__ == "__main__":
    main()
