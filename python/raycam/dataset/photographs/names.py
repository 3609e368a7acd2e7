"""Names of the photographs of a plan."""

from __future__ import annotations

from pathlib import PurePosixPath

from ..plan import Plan

__all__ = ["photograph_names", "stem"]

PHOTO_FORMATS = "jpg jpeg png tif tiff webp bmp exr hdr heic heif dng cr2 cr3 nef arw raw ppm pgm"
ENDINGS = {f".{name}" for name in PHOTO_FORMATS.split(" ")}
"""Endings of image files; another dot in a name, as in `frame.0001`, is part of the name."""


def photograph_names(plan: Plan) -> list[str]:
    """Returns the photographs' names.

    The names include folders and file extensions if the cameras' file contains them. For a camera without a
    photograph, the name is the camera's name, or the view's number with six digits. If two names differ only
    in their extension, the view's number is appended to the second name.
    """
    names: list[str] = []
    taken: set[str] = set()
    for number, view in enumerate(plan.shots):
        parts = PurePosixPath((view.image or view.label or "").replace("\\", "/")).parts
        kept = [part.replace(":", "_") for part in parts if part not in ("/", ".", "..")]
        name = "/".join(kept) or f"{number:06d}"
        if stem(name).casefold() in taken:
            own, ending = stem(name), name[len(stem(name)) :]
            name = f"{own}_{number:06d}{ending}"
        taken.add(stem(name).casefold())
        names.append(name)
    return names


def stem(name: str) -> str:
    """Returns a photograph's name with its folders and without the ending of its format."""
    path = PurePosixPath(name)
    return str(path.with_suffix("")) if path.suffix.lower() in ENDINGS else name
