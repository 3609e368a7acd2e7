"""A data set as a job: its package, and the function that makes its units of work."""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..camera import Camera
from ..errors import JobError, Notice
from ..io.temp_stream import Piece
from ..jobs.job_package import JobPackage
from ..jobs.kinds import FrameMaker, Progress, register
from ..randomize import Recipe
from ..sensors import describe_sensor, read_sensor
from ..world import World
from .formats import FORMATS
from .per_world import each_make
from .plan import Format, Plan, Record, View
from .sensor_files import sensor_files
from .world_sequence import WorldSequence

__all__ = ["job_package", "read_record", "record_name", "unit_maker"]

PREFIX = "view"


def record_name(unit: int) -> str:
    """Returns the name of a unit's record, a compressed file used to create the index files."""
    return f".raycam-dataset/{unit:06d}.json.zlib"


def read_record(path: Path) -> Record:
    """Reads a unit's record; raises `JobError` if it is damaged, `OSError` if it is unreadable."""
    try:
        record: Record = json.loads(zlib.decompress(path.read_bytes()))
    except (zlib.error, ValueError):
        raise JobError(
            f"{path}: the record of a view is damaged; remove this file and run the job's command again",
            code="damaged_job",
        ) from None
    return record


def job_package(format: str, plan: Plan) -> JobPackage:
    """Returns the package of a data set: world, cameras and options.

    For a recipe, the package contains the SHA-256 of the recipe's files, which every worker reads from their folder.
    """
    recipe = plan.recipe
    settings = {
        "format": format,
        "options": json.loads(json.dumps(plan.options, default=_plain)),
        "render": json.loads(json.dumps(plan.rendering, default=_plain)),
        "times": [shot.time for shot in plan.shots],
        "views": len(plan.shots),
    }
    if any(shot.sensors for shot in plan.shots):
        settings["sensors"] = [
            {name: describe_sensor(sensor) for name, sensor in shot.sensors.items()} for shot in plan.shots
        ]
    if plan.rigs:
        settings["rigs"] = [shot.rig for shot in plan.shots]
        settings["bodies"] = [
            shot.body and [shot.body[0].tolist(), shot.body[1].tolist()] for shot in plan.shots
        ]
    for key in ("label", "image"):
        values = [getattr(shot, key) for shot in plan.shots]
        if any(value is not None for value in values):
            settings[f"{key}s"] = values
    if recipe is None:
        cameras = [shot.optional_camera for shot in plan.shots]
        return JobPackage("dataset", FORMATS[format].units(plan), settings, _with(plan.world, cameras))
    worlds = 1 + max(shot.world or 0 for shot in plan.shots)
    names = [shot.name for shot in plan.shots if shot.world == 0]
    # The package's world only provides the lenses, because the poses of the cameras differ between worlds.
    lenses = _with(World(plan.world.up), [shot.camera for shot in plan.shots if shot.world == 0])
    if isinstance(recipe, WorldSequence):
        settings |= {"caller_worlds": worlds, "categories": list(recipe.categories.items()), "names": names}

        def factory(world: World, settings: Mapping[str, Any], threads: int | None) -> FrameMaker:
            own = Plan(plan.world, plan.shots, plan.rendering, plan.options, threads, recipe)
            return _maker(FORMATS[format], own)

        return JobPackage("dataset", FORMATS[format].units(plan), settings, lenses, factory)
    settings |= {
        "recipe": json.loads(json.dumps(recipe.description, default=_plain)),
        "seed": recipe.seed,
        "folder": str(recipe.folder),
        "files": recipe.files,
        "worlds": worlds,
        "names": names,
    }
    return JobPackage("dataset", FORMATS[format].units(plan), settings, lenses)


def unit_maker(world: World, settings: Mapping[str, Any], threads: int | None) -> FrameMaker:
    """Returns the frame maker of the kind "dataset".

    The frame maker makes the files of a unit and the unit's record.
    """
    return _maker(FORMATS[settings["format"]], _plan(world, settings, threads))


def _maker(kind: Format, plan: Plan) -> FrameMaker:
    """The frame maker of a plan."""

    def make(
        number: int, progress: Progress | None
    ) -> tuple[Mapping[str, bytes | Iterable[Piece]], list[Notice]]:
        plan.watch = progress
        apart = plan.recipe is not None and not kind.many_worlds
        parts, known = each_make(kind, plan, number) if apart else kind.make(plan, number)
        samples = sensor_files(plan, number, kind.units(plan), with_lidars=not kind.writes_lidars)
        return {**parts, **samples, record_name(number): zlib.compress(json.dumps(known).encode())}, []

    return make


register("dataset", unit_maker)


def _plan(world: World, settings: Mapping[str, Any], threads: int | None) -> Plan:
    known = world.cameras
    cameras = [known.get(view_name(number)) for number in range(settings["views"])]
    options, rendering = settings["options"], settings["render"]
    if "caller_worlds" in settings:
        raise JobError(
            "the worlds of this data set were created by a program (worlds=); to resume, repeat the program's "
            "call to raycam.dataset.write",
            code="missing_value",
        )
    if "recipe" not in settings:
        rigs = [rig and (rig[0], rig[1]) for rig in settings.get("rigs", [None] * len(cameras))]
        nothing = [None] * len(cameras)
        bodies = [body and (np.array(body[0]), np.array(body[1])) for body in settings.get("bodies", nothing)]
        placed = zip(cameras, settings["times"], rigs, bodies, strict=True)
        names = zip(settings.get("labels", nothing), settings.get("images", nothing), strict=True)
        sensors = [
            {name: read_sensor(table) for name, table in tables.items()}
            for tables in settings.get("sensors", [{}] * len(cameras))
        ]
        shots = [
            View(camera, time, rig=rig, body=body, label=label, image=image, sensors=own)
            for (camera, time, rig, body), (label, image), own in zip(placed, names, sensors, strict=True)
        ]
        return Plan(world, shots, rendering, options, threads)
    recipe = Recipe(settings["recipe"], folder=settings["folder"], seed=settings["seed"])
    if recipe.files != settings["files"]:
        changed = sorted(name for name, stamp in settings["files"].items() if recipe.files.get(name) != stamp)
        raise JobError(
            f"{settings['folder']}: {', '.join(changed)} changed since the job began; restore these files, or start a "
            "new job in another output folder",
            code="changed_input",
        )
    pairs = [(known[view_name(number)], name) for number, name in enumerate(settings["names"])]
    shots = [View(camera, None, i, name) for i in range(settings["worlds"]) for camera, name in pairs]
    return Plan(recipe.world(0), shots, rendering, options, threads, recipe)


def view_name(number: int) -> str:
    """Returns the reserved name of a view's camera in the package's world."""
    return f"{PREFIX}-{number:06d}"


def _with(world: World, cameras: Sequence[Camera | None]) -> World:
    """Returns the world with the cameras of the views, in their order and under reserved names."""
    taken = [name for name in world.cameras if name.startswith(f"{PREFIX}-")]
    if taken:
        raise JobError(
            f"the world has a camera {taken[0]!r}: names that begin with {PREFIX}- are reserved for views",
            code="duplicate_name",
        )
    return world.with_cameras(
        {view_name(number): camera for number, camera in enumerate(cameras) if camera is not None}
    )


def _plain(value: Any) -> Any:
    """Converts NumPy's numbers and arrays for JSON."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    raise TypeError(f"{value!r} is not a number, string, list or table")
