"""Path tracing beside Mitsuba 3: the same six scenes, mean radiance, and samples per second at equal path length.

Mitsuba is another Python's (`--mitsuba PYTHON`, with `mitsuba` installed): its pictures come from a second process, one
at a time. A scene is the same triangles or spheres of triangles in both; an area light of Mitsuba blocks light, so
there is a black sheet behind ours.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

SIZE = (640, 480)
DEPTH = 6
Array = npt.NDArray[Any]

GOLD = ([0.091, 0.496, 1.468], [15.068, 2.262, 1.774])


def sheet(center: list[float], u: list[float], v: list[float]) -> tuple[Array, Array]:
    """A parallelogram that faces u x v."""
    c, u, v = np.array(center), np.array(u) / 2, np.array(v) / 2
    return np.array([c - u - v, c + u - v, c + u + v, c - u + v]), np.array([[0, 1, 2], [0, 2, 3]])


def ball(center: list[float], radius: float, level: int = 5) -> tuple[Array, Array]:
    from bench_flat_picture import rock

    vertices, faces = rock(level, 0)
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    return vertices * radius + center, faces


def scenes(folder: Path) -> dict[str, dict[str, Any]]:
    """name: {camera, lights, objects}; an object is (mesh file, material)."""
    from bench_flat_picture import rock

    made: dict[str, dict[str, Any]] = {}

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


def ours(scene: dict[str, Any], size: tuple[int, int] = SIZE) -> Any:
    """A function of samples and seed to (picture, seconds)."""
    import raycam

    world = raycam.World()
    for path, material in scene["objects"]:
        data = np.load(path)
        style: dict[str, Any] = {"color": material.get("matte", [1, 1, 1])}
        if "gold" in material:
            style = {"type": "metal", "metal": "gold"}
        if "glass" in material:
            style = {"type": "glass", "ior": material["glass"]}
        if "pane" in material:
            style = {"type": "glass", "ior": material["pane"], "thin": True}
        world.add_mesh(data["vertices"], data["faces"], material=style)
    for light in scene["lights"]:
        if "area" in light:
            center, u, v = light["area"]
            world.add_light(
                {"type": "area", "position": center, "u": u, "v": v, "radiance": light["radiance"]}
            )
            behind = np.array(center) - 1e-3 * np.cross(u, v) / np.linalg.norm(np.cross(u, v))
            vertices, faces = sheet(behind.tolist(), u, v)
            world.add_mesh(vertices, faces, material={"color": [0, 0, 0]})
        elif "bulb" in light:
            world.add_light({"type": "bulb", "position": light["bulb"], "intensity": light["intensity"]})
        elif "sun" in light:
            world.add_light({"type": "sun", "direction": light["sun"], "irradiance": light["irradiance"]})
        else:
            world.add_light({"type": "sky", "radiance": light["sky"]})
    view = scene["camera"]
    camera = raycam.Camera.look_at(view["eye"], view["target"], [0, 0, 1], size=size, fov=view["fov"])

    def picture(samples: int, seed: int) -> tuple[Array, float]:
        start = time.perf_counter()
        frame = raycam.render(
            world, camera, integrator="path", samples=samples, max_depth=DEPTH, seed=seed, channels="color"
        )
        return frame["color"], time.perf_counter() - start

    return picture


def theirs(
    scene: dict[str, Any], variant: str, size: tuple[int, int] = SIZE, sampler: str = "independent"
) -> Any:
    """The same by Mitsuba."""
    import mitsuba as mi

    mi.set_variant(variant)
    transform = mi.ScalarTransform4f
    view = scene["camera"]
    world: dict[str, Any] = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": DEPTH},
        "sensor": {
            "type": "perspective",
            "fov": view["fov"],
            "fov_axis": "y",
            "to_world": transform().look_at(origin=view["eye"], target=view["target"], up=[0, 0, 1]),
            "film": {
                "type": "hdrfilm",
                "width": size[0],
                "height": size[1],
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
            },
            "sampler": {"type": sampler},
        },
    }

    def rgb(value: list[float]) -> dict[str, Any]:
        return {"type": "rgb", "value": value}

    for number, (path, material) in enumerate(scene["objects"]):
        data = np.load(path)
        if "gold" in material:
            bsdf = {"type": "conductor", "eta": rgb(GOLD[0]), "k": rgb(GOLD[1])}
        elif "glass" in material:
            bsdf = {"type": "dielectric", "int_ior": material["glass"], "ext_ior": 1.0}
        elif "pane" in material:
            bsdf = {"type": "thindielectric", "int_ior": material["pane"], "ext_ior": 1.0}
        else:
            bsdf = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb(material["matte"])}}
        properties = mi.Properties()
        properties["mesh_bsdf"] = mi.load_dict(bsdf)
        mesh = mi.Mesh(f"m{number}", len(data["vertices"]), len(data["faces"]), props=properties)
        parameters = mi.traverse(mesh)
        parameters["vertex_positions"] = data["vertices"].ravel()
        parameters["faces"] = data["faces"].ravel()
        parameters.update()
        world[f"object{number}"] = mesh
    for number, light in enumerate(scene["lights"]):
        if "area" in light:
            center, u, v = map(np.array, light["area"])
            n = np.cross(u, v) / np.linalg.norm(np.cross(u, v))
            matrix = np.eye(4)
            matrix[:3] = np.stack([u / 2, v / 2, n, center], axis=1)
            world[f"light{number}"] = {
                "type": "rectangle",
                "to_world": transform(matrix),
                "bsdf": {"type": "diffuse", "reflectance": rgb([0, 0, 0])},
                "emitter": {"type": "area", "radiance": rgb(light["radiance"])},
            }
        elif "bulb" in light:
            world[f"light{number}"] = {
                "type": "point",
                "position": light["bulb"],
                "intensity": rgb(light["intensity"]),
            }
        elif "sun" in light:
            world[f"light{number}"] = {
                "type": "directional",
                "direction": light["sun"],
                "irradiance": rgb(light["irradiance"]),
            }
        else:
            world[f"light{number}"] = {"type": "constant", "radiance": rgb(light["sky"])}
    loaded = mi.load_dict(world)

    def picture(samples: int, seed: int) -> tuple[Array, float]:
        start = time.perf_counter()
        image = np.array(mi.render(loaded, spp=samples, seed=seed))
        return image, time.perf_counter() - start

    return picture


def measure(picture: Any, seconds: float) -> tuple[Array, float]:
    """The mean of enough pictures to fill the time, and the best samples per second."""
    picture(4, 0)
    _, once = picture(16, 1)
    samples = int(np.clip(16 * seconds / 3 / once, 4, 1024))
    pictures, best = [], 0.0
    for seed in range(3):
        image, took = picture(samples, 2 + seed)
        pictures.append(image)
        best = max(best, SIZE[0] * SIZE[1] * samples / took)
    return np.mean(pictures, axis=0), best


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mitsuba", metavar="PYTHON", help="a Python that has Mitsuba")
    parser.add_argument("--variant", default="llvm_ad_rgb")
    parser.add_argument("--seconds", type=float, default=6.0, help="per scene and renderer")
    parser.add_argument("--scenes", nargs="+", metavar="NAME")
    parser.add_argument("--worker", metavar="FILE", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        task = json.loads(Path(options.worker).read_text())
        image, rate = measure(theirs(task["scene"], options.variant), options.seconds)
        np.savez(task["out"], image=image, rate=rate)
        return
    import report

    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for scene, parts in scenes(folder).items():
            if options.scenes and scene not in options.scenes:
                continue
            image, rate = measure(ours(parts), options.seconds)
            row = [scene, f"{rate / 1e6:.2f}", f"{image.mean():.5f}"]
            if options.mitsuba:
                task, out = folder / "task.json", folder / "out.npz"
                task.write_text(json.dumps({"scene": parts, "out": str(out)}))
                command = [options.mitsuba, __file__, "--worker", str(task), "--variant", options.variant]
                subprocess.run([*command, "--seconds", str(options.seconds)], check=True)
                found = np.load(out)
                off = image.mean() / found["image"].mean() - 1
                row += [f"{found['rate'] / 1e6:.2f}", f"{found['image'].mean():.5f}", f"{100 * off:+.3f} %"]
            rows.append(row)
            print(*row, file=sys.stderr)
    head = ["scene", "raycam Msamples/s", "mean radiance"]
    if options.mitsuba:
        head += [f"Mitsuba {options.variant} Msamples/s", "mean radiance", "difference"]
    notes = [f"{SIZE[0]} x {SIZE[1]}, paths of at most {DEPTH} segments, box filter; best of three pictures."]
    report.write("path", "Path tracing beside Mitsuba 3", notes, head, rows)


if __name__ == "__main__":
    main()
