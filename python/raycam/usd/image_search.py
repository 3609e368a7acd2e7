"""Search for an image under names that differ from the given name.

The order is the same as in raycam's other readers.

A path is searched with other upper and lower case, then by its last parts (`textures/wood.png`, `wood.png` for
`C:/me/textures/wood.png`) from the folder of the stage, then in the folders that exporters use.
"""

from __future__ import annotations

import re
from pathlib import Path

__all__ = ["found_elsewhere"]

USUAL_FOLDERS = (
    "textures",
    "texture",
    "images",
    "maps",
    "materials/textures",
    "../materials/textures",
    "../textures",
)
"""Conventional names of image folders, relative to the stage's folder."""

MOST_LISTED = 10_000
"""Maximum number of names in a folder that are compared."""


def found_elsewhere(written: str, folder: Path) -> Path | None:
    """Returns an image that is found at another path; None if no image is found."""
    parts = [
        part
        for part in re.split(r"[\\/]+", written)
        if part not in ("", ".", "..") and not part.endswith(":")
    ]
    if not parts:
        return None
    places = [(folder, parts[start:]) for start in range(max(0, len(parts) - 8), len(parts))]
    places += [(folder / usual, parts[-1:]) for usual in USUAL_FOLDERS]
    for place, names in places:
        if found := _in_any_case(place, names):
            return found
    return None


def _in_any_case(folder: Path, names: list[str]) -> Path | None:
    """The file with these names below a folder, as written or in another case."""
    place = folder
    for name in names:
        if (place / name).exists():
            place /= name
            continue
        try:
            listed = sorted(entry.name for entry, _ in zip(place.iterdir(), range(MOST_LISTED), strict=False))
        except OSError:
            return None
        same = [other for other in listed if other.lower() == name.lower()]
        if not same:
            return None
        place /= same[0]
    return place if place.is_file() else None
