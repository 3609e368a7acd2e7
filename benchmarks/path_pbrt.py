"""Renders `path_scenes.py` with the executable of pbrt-v4, whose area lights block light.

pbrt is a spectral renderer; colours are passed to it as RGB. It has no principled material, so a coated
diffuse material with the same roughness is used instead. The reflectance of gold is the value at normal
incidence.
"""

from __future__ import annotations

import resource
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from path_scenes import DEPTH, GOLD, Array, Scene


def numbers(values: Any) -> str:
    return "[" + " ".join(f"{value:.9g}" for value in np.ravel(values)) + "]"


def rgb(name: str, value: Any) -> str:
    return f'"rgb {name}" {numbers(value)}'


def material(about: dict[str, Any]) -> str:
    # Without remapping, pbrt's roughness is the square of raycam's.
    rough = f'"float roughness" {about.get("roughness", 0.0) ** 2:.9g} "bool remaproughness" false'
    if "principled" in about:
        return f'"coateddiffuse" {rgb("reflectance", about["principled"])} {rough}'
    if "gold" in about:
        n, k = map(np.array, GOLD)
        return f'"conductor" {rgb("reflectance", ((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2))} {rough}'
    if "glass" in about:
        return f'"dielectric" "float eta" {about["glass"]} {rough}'
    if "pane" in about:
        return f'"thindielectric" "float eta" {about["pane"]}'
    return f'"diffuse" {rgb("reflectance", about.get("matte", [0, 0, 0]))}'


def light(about: dict[str, Any]) -> str:
    if "area" in about:
        center, u, v = map(np.array, about["area"])
        corners = [center + a * u / 2 + b * v / 2 for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        shape = f'Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" {numbers(corners)}'
        shines = f'AreaLightSource "diffuse" {rgb("L", about["radiance"])}'
        return f"AttributeBegin\nMaterial {material({})}\n{shines}\n{shape}\nAttributeEnd"
    if "bulb" in about:
        return f'LightSource "point" "point3 from" {numbers(about["bulb"])} {rgb("I", about["intensity"])}'
    if "sun" in about:
        to = f'"point3 from" [0 0 0] "point3 to" {numbers(about["sun"])}'
        return f'LightSource "distant" {to} {rgb("L", about["irradiance"])}'
    return f'LightSource "infinite" {rgb("L", about["sky"])}'


def write_ply(path: Path, vertices: Array, faces: Array) -> None:
    rows = np.zeros(len(faces), [("count", "u1"), ("indices", "<i4", 3)])
    rows["count"], rows["indices"] = 3, faces
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz")
    head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    path.write_bytes(head.encode() + vertices.astype("<f4").tobytes() + rows.tobytes())


def read_pfm(path: Path, size: tuple[int, int]) -> Array:
    data = path.read_bytes()
    values = np.frombuffer(data[-12 * size[0] * size[1] :], "<f4")
    return values.reshape(size[1], size[0], 3)[::-1]


def world(scene: Scene, folder: Path) -> str:
    lines = ["WorldBegin", *map(light, scene["lights"])]
    for number, (path, about) in enumerate(scene["objects"]):
        data = np.load(path)
        write_ply(folder / f"{number}.ply", data["vertices"], data["faces"])
        lines += ["AttributeBegin", f"Material {material(about)}"]
        if "shines" in about:
            lines.append(f'AreaLightSource "diffuse" {rgb("L", about["shines"])}')
        lines += [f'Shape "plymesh" "string filename" "{number}.ply"', "AttributeEnd"]
    return "\n".join(lines) + "\n"


def picture(
    scene: Scene, size: tuple[int, int], executable: str, sampler: str = "zsobol"
) -> Callable[[int, int], tuple[Array, float]]:
    """Returns a function that renders an image: (samples, seed) to (image, processor seconds).

    The time of an image with one sample is subtracted, because each call of pbrt also reads the scene.
    """
    kept = tempfile.TemporaryDirectory()
    folder = Path(kept.name)
    view = scene["camera"]
    about = world(scene, folder)
    # In pbrt, a path with maxdepth 0 has one segment. pbrt has no value for an unlimited number.
    bounces = (scene.get("depth", DEPTH) or 1000) - 1
    # pbrt's camera axes are left-handed.
    looks = [
        "Scale -1 1 1",
        f"LookAt {numbers([view['eye'], view['target'], [0, 0, 1]])[1:-1]}",
        f'Camera "perspective" "float fov" {view["fov"]}',
    ]

    def run(samples: int, seed: int) -> tuple[Array, float]:
        resolution = f'"integer xresolution" {size[0]} "integer yresolution" {size[1]}'
        head = [
            f'Film "rgb" {resolution} "string filename" "one.pfm"',
            'PixelFilter "box" "float xradius" 0.5 "float yradius" 0.5',
            f'Sampler "{sampler}" "integer pixelsamples" {samples} "integer seed" {seed}',
            f'Integrator "path" "integer maxdepth" {bounces}',
            *looks,
        ]
        (folder / "one.pbrt").write_text("\n".join([*head, about]), encoding="utf-8")
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([executable, "--quiet", "one.pbrt"], cwd=kept.name, check=True, capture_output=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        return read_pfm(folder / "one.pfm", size), seconds

    # Each call of pbrt includes reading the scene and building the tree.
    start = min(run(1, seed)[1] for seed in range(5))

    def render(samples: int, seed: int) -> tuple[Array, float]:
        assert kept.name  # keeps the temporary folder until the function returns
        image, seconds = run(samples, seed)
        return image, seconds - start

    return render
