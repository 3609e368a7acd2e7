"""Writes the images of pages: runs a page's code blocks and keeps the files that it shows.

    python docs/pictures.py                       all pages
    python docs/pictures.py docs/howto/glass.md   one page

A page shows NAME.jpg from `images/howto`, `images/gallery` or `images/pages`; one of its code blocks writes
NAME.png. Videos are written as NAME.gif and shown as NAME.webp. Figures are written and shown as NAME.svg. If
the blocks do not write an image, it belongs to another page and is not changed. Requires Pillow.
"""

from __future__ import annotations

import io
import json
import os
import re
import shlex
import shutil
import sys
import tempfile
from pathlib import Path

from PIL import Image, ImageDraw
from raycam import cli

DOCS = Path(__file__).resolve().parent
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.M | re.S)
SHOWN = re.compile(r"images/((?:howto|gallery|pages)/[\w-]+)\.jpg")
FIGURES = re.compile(r"images/(howto/[\w-]+\.svg)")
FILMS = re.compile(r"images/((?:howto|gallery|pages)/[\w-]+)\.webp")
MAX_BYTES = 60_000
MAX_FILM_BYTES = 120_000
MAX_SIDE = 480


def run(text: str, page: Path) -> None:
    """Runs the code blocks of a page in the current folder."""
    names: dict[str, object] = {}
    for language, block in BLOCK.findall(text):
        if language == "python":
            exec(compile(block, str(page), "exec"), names)
        elif language == "toml" and (named := re.match(r"# (\S+\.toml)\n", block)):
            Path(named[1]).write_text(block, encoding="utf-8")
        elif language == "sh":
            for line in block.replace("\\\n", " ").splitlines():
                words = shlex.split(line, comments=True)
                if words[:1] == ["raycam"]:
                    cli.main(words[1:])


def keep(name: str) -> None:
    """Converts an image of the current folder to a small JPEG file of the documentation.

    `name` is the image's path in `docs/images`, without ending.
    """
    with Image.open(f"{Path(name).name}.png") as image:
        picture = image.convert("RGBA")
    white = Image.new("RGBA", picture.size, "white")
    write_jpeg(Image.alpha_composite(white, picture).convert("RGB"), name)


def write_jpeg(picture: Image.Image, name: str, max_bytes: int = MAX_BYTES, max_side: int = MAX_SIDE) -> None:
    """Writes `docs/images/NAME.jpg`, with sides of at most `max_side` pixels.

    The quality is the best for which the file has at most `max_bytes`.
    """
    picture.thumbnail((max_side, max_side), Image.Resampling.LANCZOS)
    for quality in range(88, 30, -6):
        data = io.BytesIO()
        picture.save(data, "JPEG", quality=quality, optimize=True)
        if data.tell() <= max_bytes:
            break
    target = DOCS / "images" / f"{name}.jpg"
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_bytes(data.getvalue())
    print(f"{target.name}: {data.tell()} bytes")


def keep_film(name: str) -> None:
    """Converts a video of the current folder to a small WebP file of the documentation."""
    with Image.open(f"{Path(name).name}.gif") as film:
        times = film.info["duration"]
        pictures = [film.convert("RGB") for at in range(film.n_frames) if not film.seek(at)]
    for quality in range(80, 20, -6):
        data = io.BytesIO()
        pictures[0].save(
            data,
            "WEBP",
            save_all=True,
            append_images=pictures[1:],
            duration=times,
            loop=0,
            quality=quality,
            method=6,
        )
        if data.tell() <= MAX_FILM_BYTES:
            break
    (DOCS / "images" / f"{name}.webp").write_bytes(data.getvalue())
    print(f"{name}.webp: {data.tell()} bytes")


def labelled(folder: Path) -> None:
    """Writes `images/labelled.jpg`: the first image of a COCO data set with its labels.

    The labels are boxes, names and visible fractions.
    """
    index = json.loads((folder / "annotations" / "instances.json").read_text(encoding="utf-8"))
    first = index["images"][0]
    names = {item["id"]: item["name"] for item in index["categories"]}
    with Image.open(folder / "images" / first["file_name"]) as image:
        picture = image.convert("RGB")
    draw = ImageDraw.Draw(picture)
    colors = ("#e6194b", "#3cb44b", "#4363d8", "#f58231", "#911eb4", "#42d4f4")
    mine = [item for item in index["annotations"] if item["image_id"] == first["id"]]
    for number, item in enumerate(mine):
        x, y, width, height = item["bbox"]
        color = colors[number % len(colors)]
        draw.rectangle([x, y, x + width - 1, y + height - 1], outline=color, width=3)
        text = f"{names[item['category_id']]} {item['visible_fraction']:.0%}"
        draw.rectangle([x, y - 16, x + 7 * len(text) + 4, y], fill=color)
        draw.text((x + 3, y - 14), text, fill="white")
    picture.thumbnail((MAX_SIDE, MAX_SIDE), Image.Resampling.LANCZOS)
    picture.save(DOCS / "images" / "labelled.jpg", quality=86, optimize=True)


def strip() -> None:
    """Writes the image at the top of the README: four images next to each other."""
    names = ("models/toy_car", "models/street", "models/lanterns", "models/robot")
    height = 240
    parts = []
    for name in names:
        with Image.open(DOCS / "images" / f"{name}.jpg") as image:
            side = image.height * 5 // 4
            left = max(0, (image.width - side) // 2)
            cut = image.crop((left, 0, min(left + side, image.width), image.height))
            parts.append(cut.resize((height * cut.width // cut.height, height), Image.Resampling.LANCZOS))
    whole = Image.new("RGB", (sum(part.width + 4 for part in parts) - 4, height), "white")
    place = 0
    for part in parts:
        whole.paste(part, (place, 0))
        place += part.width + 4
    whole.save(DOCS / "images" / "strip.jpg", quality=84, optimize=True)


def main() -> None:
    """Writes the images of the given pages, or of all pages."""
    pages = [Path(name).resolve() for name in sys.argv[1:]] or sorted(DOCS.rglob("*.md"))
    for page in pages:
        text = page.read_text(encoding="utf-8")
        names = list(dict.fromkeys(SHOWN.findall(text)))
        films = list(dict.fromkeys(FILMS.findall(text)))
        figures = list(dict.fromkeys(FIGURES.findall(text)))
        if not names + films + figures:
            continue
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            run(text, page)
            for name in names:
                if Path(f"{Path(name).name}.png").exists():
                    keep(name)
            for name in films:
                if Path(f"{Path(name).name}.gif").exists():
                    keep_film(name)
            for name in figures:
                shutil.copy(Path(name).name, DOCS / "images" / name)
            if Path("toys/annotations").exists():
                labelled(Path("toys"))
            os.chdir(DOCS)
    strip()


if __name__ == "__main__":
    main()
