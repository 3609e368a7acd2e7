"""The gallery's recipes run, and the gallery's page shows their results.

The page shows the image of each recipe with the recipe and the credits of its models.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import raycam
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "examples" / "gallery"
TOOLS = {"arm", "common", "make", "ride", "town"}
RECIPES = sorted(path for path in FOLDER.glob("*.py") if path.stem not in TOOLS)
# Recipes that take more than 3 s even with few pixels.
SLOW = {"bin", "carousel", "caustics", "lanterns", "lidar"}
RENDERED = [pytest.param(path, marks=pytest.mark.proof) if path.stem in SLOW else path for path in RECIPES]
IMAGES = ROOT / "docs" / "images" / "models"
PAGE = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
MODEL = re.compile(r'assets / "([\w/.-]+)"')


def write_models(folder: Path) -> None:
    """Writes a small stand-in for each model that a recipe names."""
    ball = raycam.World()
    ball.add_object(sphere={"radius": 0.5, "level": 1}, name="ToyCar")
    corners = ball.triangles().reshape(-1, 3)
    lines = [f"v {x} {y} {z}" for x, y, z in corners]
    lines += [f"f {first} {first + 1} {first + 2}" for first in range(1, len(corners), 3)]
    names = {name for code in FOLDER.glob("*.py") for name in MODEL.findall(code.read_text(encoding="utf-8"))}
    assert len(RECIPES) > 4
    assert len(names) > 8  # several recipes share a model
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix in {".glb", ".gltf"}:
            ball.to_gltf(path)
        elif path.suffix == ".obj":
            path.write_text("\n".join(lines), encoding="utf-8")
        elif path.suffix == ".ply":
            header = f"ply\nformat ascii 1.0\nelement vertex {len(corners)}\n"
            header += "".join(f"property float {axis}\n" for axis in "xyz")
            header += (
                f"element face {len(corners) // 3}\nproperty list uchar int vertex_indices\nend_header\n"
            )
            body = [f"{x} {y} {z}" for x, y, z in corners]
            body += [f"3 {first} {first + 1} {first + 2}" for first in range(0, len(corners), 3)]
            path.write_text(header + "\n".join(body) + "\n", encoding="utf-8")
        else:
            shutil.copy(raycam.data.path("sky.hdr"), path)


@pytest.mark.parametrize("recipe", RENDERED, ids=lambda path: path.stem)
def test_recipe_renders_an_image_of_the_page_proportions(recipe: Path, tmp_path: Path) -> None:
    write_models(tmp_path / "assets")
    command = [sys.executable, "-W", "ignore", str(FOLDER / "make.py"), "assets", recipe.stem, "-o", "out"]
    command += ["--scale", "0.05", "--effort", "0.02", "--no-denoise"]
    done = subprocess.run(command, cwd=tmp_path, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    with Image.open(tmp_path / "out" / f"{recipe.stem}.jpg") as image:
        assert image.size == (48, 27)
        assert np.ptp(np.asarray(image)) > 30


@pytest.mark.parametrize("recipe", RECIPES, ids=lambda path: path.stem)
def test_page_shows_the_image_and_links_to_the_recipe(recipe: Path) -> None:
    assert f"](images/models/{recipe.stem}.jpg)" in PAGE
    assert f"](../examples/gallery/{recipe.name})" in PAGE
    text = recipe.read_text(encoding="utf-8")
    assert text.count("\n") < 80
    credited = (ROOT / "docs" / "images" / "CREDITS.md").read_text(encoding="utf-8")
    for name in MODEL.findall(text):
        assert f"`{name}`" in credited, f"{name} has no credit"


@pytest.mark.parametrize("path", sorted(IMAGES.glob("*.jpg")), ids=lambda path: path.stem)
def test_image_is_small_and_its_whites_are_not_clipped(path: Path) -> None:
    assert (FOLDER / f"{path.stem}.py").is_file(), "no recipe writes this image"
    assert path.stat().st_size < 250_000
    with Image.open(path) as image:
        assert image.size == (960, 540)
        white = (np.asarray(image.convert("RGB")) > 253).all(axis=2).mean()
    assert white < 0.01, f"{white:.1%} of the pixels are white"
