"""Renders models next to other renderers' images from the same cameras, to compare by eye.

    python benchmarks/khronos_pictures.py MODELS REFERENCES config.json pairs.jpg --light room.hdr [--only NAME]

REFERENCES contains a folder for each scenario (`khronos-ToyCar`) with an image by each renderer
(`blender-cycles-golden.png`). These images, and the scenarios in `config.json` (cameras and sizes), come from
github.com/KhronosGroup/glTF-Render-Fidelity-Generator; glTF-Render-Fidelity contains smaller versions. Their
light is `lightroom_14b.hdr`; with another light, highlights and reflections are at other positions.
"""

from __future__ import annotations

import argparse
import json
import shutil
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import raycam
from PIL import Image, ImageDraw

RENDERERS = ("blender-cycles", "three-gpu-pathtracer", "vray", "dspbr-pt", "gltf-sample-viewer", "filament")

# Images are rendered at this multiple of their size and reduced after tone mapping, like the reference images, so that
# thin dark lines stay dark.
OVER = 2


def aces(color: npt.NDArray[np.floating[Any]]) -> npt.NDArray[np.uint8]:
    """Returns displayed colours, computed as for the references.

    The tone mapping is S. Hill's fit of ACES with white at 1/0.6, followed by the sRGB curve.
    """
    into = np.array([[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]])
    back = np.array(
        [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]]
    )
    v = color.astype(np.float64) / 0.6 @ into.T
    v = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081)
    v = np.clip(v @ back.T, 0, 1)
    v = np.where(v <= 0.0031308, 12.92 * v, 1.055 * v ** (1 / 2.4) - 0.055)
    shown: npt.NDArray[np.uint8] = np.round(255 * v).astype(np.uint8)
    return shown


def camera_of(scenario: dict[str, Any], width: int) -> raycam.Camera:
    """Returns the orbit camera: theta from +z towards +x, phi from +y downwards, in degrees."""
    sides = {"width": 768, "height": 768} | scenario.get("dimensions", {})
    orbit = {"theta": 0.0, "phi": 90.0, "radius": 1.0} | scenario.get("orbit", {})
    theta, phi = np.radians(orbit["theta"]), np.radians(orbit["phi"])
    away = np.array([np.sin(phi) * np.sin(theta), np.cos(phi), np.sin(phi) * np.cos(theta)])
    at = np.array([scenario.get("target", {}).get(axis, 0.0) for axis in "xyz"])
    size = (width, round(width * sides["height"] / sides["width"]))
    eye = at + away * max(orbit["radius"], 1e-5)
    return raycam.Camera.look_at(eye, at, [0, 1, 0], size=size, fov=scenario.get("verticalFoV", 45))


def picture(path: Path, scenario: dict[str, Any], options: argparse.Namespace) -> Image.Image:
    with tempfile.TemporaryDirectory() as name:
        # A world reads only files in its folder.
        folder = Path(shutil.copytree(path.parent, Path(name) / "model"))
        light = f"light{options.light.suffix}"
        shutil.copy(options.light, folder / light)
        world = raycam.load(folder / path.name)
        world.add_light(type="environment", image=light, scale=options.scale, yaw=options.yaw)
    sky = scenario.get("renderSkybox", False)
    frame = raycam.render(
        world,
        camera_of(scenario, OVER * options.width),
        integrator="path",
        samples=options.samples // OVER**2,
        clamp=20,
        channels=["color"] if sky else ["color", "alpha"],
        transparent_background=not sky,
    )
    color, alpha = frame["color"], np.ones(frame["color"].shape[:2]) if sky else frame["alpha"]
    shown = aces(color / np.where(alpha > 0, alpha, 1)[..., None])
    large = Image.fromarray(np.dstack([shown, np.uint8(np.round(255 * alpha))]), "RGBA")
    return over_white(large).reduce(OVER)


def over_white(image: Image.Image) -> Image.Image:
    return Image.alpha_composite(Image.new("RGBA", image.size, "white"), image.convert("RGBA")).convert("RGB")


def model_of(folder: Path, name: str) -> Path | None:
    found = sorted(path for path in folder.rglob(f"{name}.gl*") if path.suffix in (".gltf", ".glb"))
    return found[0] if found else None


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("models", type=Path)
    parser.add_argument("references", type=Path)
    parser.add_argument("scenarios", type=Path)
    parser.add_argument("sheet", type=Path)
    parser.add_argument("--light", type=Path, required=True)
    parser.add_argument(
        "--yaw",
        type=float,
        default=-90,
        help="rotation of the environment image in degrees; -90 moves the image centre to +x",
    )
    parser.add_argument("--scale", type=float, default=1, help="brightness factor of the environment image")
    parser.add_argument("--width", type=int, default=256)
    parser.add_argument("--samples", type=int, default=128)
    parser.add_argument("--columns", type=int, default=4, help="images per row")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    rows: list[tuple[str, list[tuple[str, Image.Image]]]] = []
    for scenario in json.loads(options.scenarios.read_text())["scenarios"]:
        name = scenario["name"].removeprefix("khronos-")
        path = model_of(options.models, name)
        pictures = {p.name.split("-golden")[0]: p for p in (options.references / scenario["name"]).glob("*")}
        if options.only.lower() not in name.lower() or path is None or not pictures:
            continue
        row = [("raycam", picture(path, scenario, options))]
        for renderer in [r for r in RENDERERS if r in pictures][: options.columns - 1]:
            reference = over_white(Image.open(pictures[renderer]))
            row.append((renderer, reference.resize(row[0][1].size, Image.Resampling.LANCZOS)))
        rows.append((name, row))
        print(name, flush=True)
    line, width = 12, options.width
    height = sum(row[0][1].height + line for _, row in rows)
    sheet = Image.new("RGB", (options.columns * width, height), "white")
    draw, y = ImageDraw.Draw(sheet), 0
    for name, row in rows:
        for column, (renderer, image) in enumerate(row):
            sheet.paste(image, (column * width, y + line))
            draw.text((column * width + 2, y), f"{name} {renderer}"[: width // 6], fill="black")
        y += row[0][1].height + line
    sheet.save(options.sheet, quality=88)


if __name__ == "__main__":
    main()
