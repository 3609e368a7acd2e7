"""Reads the description of a job, and compares two jobs.

The description is in `.raycam/job.json`. The differences between two jobs are returned as text.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import Error, JobError
from .job_package import JobPackage

if TYPE_CHECKING:
    from ..world import World

__all__ = ["differences", "mismatch_message", "read_description", "world_differences"]

MAX_REPORTED = 8  # differences between two worlds


def read_description(path: Path) -> dict[str, Any] | None:
    """Reads a `job.json`, and returns None if the file does not exist.

    Raises `JobError` for a damaged file.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (FileNotFoundError, NotADirectoryError):
        return None
    except UnicodeDecodeError:
        text = ""
    try:
        fields = json.loads(text)
        if not isinstance(fields["job"], str) or not 1 <= fields["frames"] <= 1 << 31:
            raise ValueError
    except (ValueError, KeyError, TypeError):
        raise JobError(
            f"{path}: the job description is damaged; remove this file and repeat the command that created "
            "the job (finished frames are kept)",
            code="damaged_job",
        ) from None
    return dict(fields)


def mismatch_message(folder: Path, there: dict[str, Any], stored: Path, asked: JobPackage) -> str:
    """Returns the message that a folder contains another job.

    `there` describes the other job; `stored` is the other job's package file.
    """
    lines = list(differences(there, {"job": there["job"], **asked.describe()}))
    if there.get("world") != asked.describe()["world"]:
        try:
            before = JobPackage.from_bytes(stored.read_bytes(), str(stored), there["job"]).world
            lines += world_differences(before, asked.world)
        except (Error, OSError):
            pass  # the package has another version or is damaged, so only the hashes above are known
    return (
        f"{folder}: contains another job: {'; '.join(lines)}. Use another folder, or resume=False to start over "
        "and delete its results"
    )


def world_differences(there: World, asked: World) -> list[str]:
    """Returns the differences of the worlds `there` (old) and `asked` as texts.

    Objects, lights, cameras and settings are compared. At most `MAX_REPORTED` differences are listed; a final line
    counts the remaining differences. Meshes and materials, which have no short text, are only reported as different.
    """
    found = list(differences(_parts(there), _parts(asked)))
    if [one.triangles for one in there.objects] == [one.triangles for one in asked.objects]:
        before, after = there.triangle_colors(), asked.triangle_colors()
        start = 0
        for old, new in zip(there.objects, asked.objects, strict=True):
            part = slice(start, start := start + new.triangles)
            moved = old.matrix.tolist() != new.matrix.tolist()
            if not moved and (there.triangles(old.id) != asked.triangles(new.id)).any():
                found.append(f"object.{new.name}: the mesh differs")
            if (before[part] != after[part]).any():
                found.append(f"object.{new.name}: the colour differs")
    if not found:
        found.append("a material, a texture or a motion differs; the rest of the world is equal")
    more = len(found) - MAX_REPORTED
    return found if more <= 0 else [*found[:MAX_REPORTED], f"and {more} more in the world"]


def _parts(world: World) -> dict[str, Any]:
    video = world.video
    return {
        "up": world.up,
        "object": {
            one.name: {
                "category": one.category,
                "triangles": one.triangles,
                "matrix": [[float(value) for value in row] for row in one.matrix],
            }
            for one in world.objects
        },
        "light": {str(number): dict(light) for number, light in enumerate(world.lights)},
        "camera": {name: camera.to_dict() for name, camera in world.cameras.items()},
        "render": dict(world.render_settings),
        "video": None if video is None else {"fps": video.fps, "seconds": video.seconds},
        "textures": world.counts.get("textures"),
        "materials": world.counts.get("materials"),
    }


def differences(there: Any, asked: Any, key: str = "") -> Iterator[str]:
    """Yields the differences of the descriptions `there` (old) and `asked`: "key was 1, is 2"."""
    if isinstance(there, dict) and isinstance(asked, dict):
        for name in dict.fromkeys([*there, *asked]):
            yield from differences(there.get(name), asked.get(name), f"{key}.{name}" if key else name)
    elif there != asked:
        before, after = (_short(value) for value in (there, asked))
        yield f"{key} was {before}, is {after}"


def _short(value: Any) -> str:
    text = "not given" if value is None else json.dumps(value, default=str)
    return text if len(text) <= 60 else f"{text[:28]} ... {text[-28:]}"
