"""Writes the card of a data set as JSON and Markdown.

The card contains counts, seeds, options, versions and the fields of a licence.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any

from ... import _core
from ..plan import Index, Plan, Record
from .splits import split_names

__all__ = ["card_files"]


def card_files(format: str, plan: Plan, records: Callable[[], Iterator[Record]], licence: str) -> Index:
    """Creates `dataset_card.json` and `dataset_card.md`, and lists of source images.

    `source_images.json` lists the views' images and is written if cameras have images. `backgrounds.json` is
    written if a recipe draws backgrounds. The same data set always has the same bytes.
    """
    table = card(format, plan, records, licence)
    yield "dataset_card.json", [json.dumps(table, indent=2, default=str).encode() + b"\n"]
    yield "dataset_card.md", [markdown(table).encode()]
    if plan.recipe is not None and plan.recipe.backgrounds is not None:
        yield "backgrounds.json", backgrounds(plan)
    if any(view.image is not None for view in plan.shots):
        yield "source_images.json", source_images(plan)


def source_images(plan: Plan) -> Iterator[bytes]:
    """Yields the text of the table of source images.

    The table has a row for each view, by the view's number from 0.
    """
    for number, view in enumerate(plan.shots):
        row = {"view": number, "camera": view.label or view.name, "image": view.image}
        yield (b",\n" if number else b"[\n") + json.dumps(row).encode()
    yield b"\n]\n"


def backgrounds(plan: Plan) -> Iterator[bytes]:
    """Iterates over the text of the table of backgrounds: a row for each view."""
    for number, view in enumerate(plan.shots):
        shot = plan.shot(number)
        row = {"view": number, "world": view.world, "camera": view.name, "background": shot.background_name}
        yield (b",\n" if number else b"[\n") + json.dumps(row).encode()
    yield b"\n]\n"


def card(format: str, plan: Plan, records: Callable[[], Iterator[Record]], licence: str) -> Record:
    """Returns the card's table. Objects are counted by category in formats with annotations."""
    cameras = [view.camera for view in plan.shots if view.has_camera]
    sizes = Counter("{} x {}".format(*camera.size) for camera in cameras)
    found: Record = {
        "made_with": f"raycam {_core.__version__}",
        "format": format,
        "views": len(plan.shots),
        "sizes": dict(sizes),
        "lenses": dict(Counter(camera.model for camera in cameras)),
        "categories": [plan.categories[number] for number in sorted(plan.categories)],
        "options": dict(plan.options),
        "rendering": dict(plan.rendering),
    }
    if plan.recipe is not None:
        found["worlds"] = 1 + max(view.world or 0 for view in plan.shots)
        if plan.recipe.seed is not None:
            found["seed"] = plan.recipe.seed
    if "splits" in plan.options:
        found["splits"] = dict(Counter(split_names(plan)))
    objects = Counter(
        plan.categories[one["category_id"]] for record in records() for one in record.get("annotations", [])
    )
    if objects:
        found["objects"] = dict(sorted(objects.items()))
    found["licence"] = {
        "pictures": licence,
        "meshes": "as stated in their files",
        "textures and photographs": "as stated in their files",
    }
    return found


def markdown(table: Record) -> str:
    """Returns the card as Markdown."""
    lines = [
        "# Data set",
        "",
        f"{table['views']} views in the format {table['format']}, {table['made_with']}.",
        "",
    ]
    lines += ["| | |", "|---|---|"]
    for key, value in table.items():
        if key not in ("views", "format", "made_with"):
            lines.append(f"| {key} | {_text(value)} |")
    return "\n".join(lines) + "\n"


def _text(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key}: {_text(item)}" for key, item in value.items()) or "none"
    if isinstance(value, list):
        return ", ".join(map(_text, value)) or "none"
    return str(value) if value not in ("", None) else "not stated"
