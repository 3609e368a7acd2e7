"""Renders every model in a folder onto one sheet with file names, for visual inspection.

python benchmarks/contact_sheet.py FOLDER sheet.jpg [--size 160] [--samples 64] [--only NAME] [--light sky.hdr]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import raycam
from PIL import Image, ImageDraw


def moment(world: raycam.World) -> raycam.World:
    """Returns the world after a third of its first animation."""
    return world.at(world.animations[0].duration / 3, 0) if world.animations else world


def picture(path: Path, size: int, samples: int, light: str | None) -> tuple[np.ndarray, int]:
    world = moment(raycam.load(path))
    notices = len(world.notices)
    # Viewed from the front, because Khronos' flat test models face this direction.
    low, high = world.bounds
    flat = (high - low)[2] < 0.35 * (high - low).max()
    away = np.array([0.0, 0.0, 1.0] if flat else [0.55, 0.4, 1.0])
    away /= np.linalg.norm(away)
    corners = np.array(
        [[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    )
    eye = (low + high) / 2 + away * 1e3 * np.linalg.norm(high - low)
    aim = raycam.Camera.look_at(eye, (low + high) / 2, [0, 1, 0], size=(size, size), fov=30)
    seen = (corners - (low + high) / 2) @ aim.R.T
    # The smallest distance at which every corner of the bounds is in the image.
    distance = (np.abs(seen[:, :2]).max(axis=1) / (0.94 * np.tan(np.radians(15))) - seen[:, 2]).max()
    eye = (low + high) / 2 + away * distance
    camera = raycam.Camera.look_at(eye, (low + high) / 2, [0, 1, 0], size=(size, size), fov=30)
    if not world.lights:
        if light:
            world.add_light(type="environment", image=light)
        else:
            world.add_light(type="sky", zenith=[1.1] * 3, horizon=[0.7] * 3, ground=[0.35] * 3)
            world.add_light(type="sun", direction=[-1, -2, -1.5], irradiance=[1.2] * 3, angular_diameter=10)
    else:
        world.add_light(type="sky", radiance=[0.05] * 3)
    exposure = 0.0
    frame = raycam.render(world, camera, integrator="path", samples=samples, clamp=10, view="pbr_neutral")
    if (median := float(np.median(frame["color"][np.isfinite(frame["color"])]))) > 2:
        exposure = -float(np.log2(median))
    return frame.to_srgb8(exposure=exposure), notices


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("sheet", type=Path)
    parser.add_argument("--size", type=int, default=160)
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--columns", type=int, default=8)
    parser.add_argument("--only", default="")
    parser.add_argument("--light")
    options = parser.parse_args()
    files = sorted(
        [*options.folder.rglob("*.gltf"), *options.folder.rglob("*.glb")], key=lambda p: p.parent.name.lower()
    )
    files = [file for file in files if options.only.lower() in str(file).lower()]
    side, line = options.size, 14
    rows = -(-len(files) // options.columns)
    sheet = Image.new("RGB", (options.columns * side, rows * (side + line)), "white")
    draw = ImageDraw.Draw(sheet)
    for number, file in enumerate(files):
        x, y = number % options.columns * side, number // options.columns * (side + line)
        try:
            pixels, notices = picture(file, side, options.samples, options.light)
            sheet.paste(Image.fromarray(pixels), (x, y))
            print(f"{file.parent.name}: {notices} notices", flush=True)
        except raycam.Error as fault:
            draw.text((x + 4, y + 4), "refused", fill="red")
            print(f"{file.parent.name}: {fault}", flush=True)
        draw.text((x + 3, y + side + 1), file.parent.name[: side // 6], fill="black")
    sheet.save(options.sheet, quality=85)


if __name__ == "__main__":
    main()
