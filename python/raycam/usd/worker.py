"""The process that reads a USD file: `python -m raycam.usd.worker FILE FOLDER LIMITS`.

It writes `world.json`, the arrays of meshes and objects, `materials.mtl` and the images into FOLDER. Supported are
meshes and solids with their instances, UsdPreviewSurface materials, cameras and lights. `"notices"` lists unsupported
prims that a renderer would show.
"""

from __future__ import annotations

import json
import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pxr import Tf, Usd, UsdGeom

from ..io.limited_process import apply_rlimits
from .confinement import Confinement, UsdRejected
from .images import Images
from .layers import find_layer_problems, read_unit
from .notices import StageNotice, group_notices
from .stage import ReadOptions, StageReader, rate_of
from .variants import UnknownVariant, list_variants, select_variants

__all__: list[str] = []

MAX_VARIANTS = 20
"""Maximum number of variants listed in a notice."""


@dataclass(frozen=True)
class Options:
    """Options of reading a file, and its limits."""

    memory: int
    bytes: int
    seconds: float
    corners: int
    folder: str
    """The folder that contains all files."""
    time: float | None = None
    """The time in seconds; None for the first time of the animation."""
    single: bool = False
    """True if all meshes become one object."""
    up: str | None = None
    """The up axis to which objects are turned; None for that of the file."""
    variant: str | None = None
    """The variants to select; None for the variants that the file selects."""


def read_stage(path: Path, folder: Path, options: Options) -> dict[str, Any]:
    """Reads the file, and returns the world without the parts that are written to the folder.

    Arrays, materials and images are written to the folder.
    """
    confinement = Confinement(path, Path(options.folder), options.bytes)
    layers = confinement.open_layers()  # kept open, because the stage uses open layers
    stage = Usd.Stage.Open(layers[0])
    if stage is None:
        raise UsdRejected("syntax", "Pixar's library cannot open the file as a stage")
    if options.variant is not None:
        try:
            select_variants(stage, options.variant)
        except UnknownVariant as unknown:
            return {"unknown_variant": str(unknown), "variants": list_variants(stage)[0]}
    images = Images(confinement, folder)
    settings = ReadOptions(options.time, options.single, options.up, options.corners)
    reader = StageReader(stage, images, settings)
    reader.read()
    names, order = reader.materials.write(folder / "materials.mtl", reader.handover.used_materials)
    reader.handover.write(folder, order)
    confinement.check_loaded()
    problems = find_layer_problems(stage, confinement.stage_folder)
    notices = group_notices([*confinement.notices, *problems, *images.notices, *reader.notices])
    if not reader.handover.names:
        has_lost = bool(confinement.has_lost or problems or reader.has_lost)
        _check_empty(stage, has_lost, notices, options)
        notices.append(StageNotice("empty_file", "the stage contains no meshes or solids"))
    variants, selected = list_variants(stage)
    notices.extend(_notices_of_stage(stage, reader, options, variants, selected))
    return {
        "world": {"up": reader.up}
        | ({} if options.single else {"light": reader.lights, "camera": reader.cameras}),
        "names": reader.handover.names,
        "materials": names,
        "notices": [(notice.code, str(notice)) for notice in notices],
        "files": images.files,
        "variants": variants,
    }


def _notices_of_stage(
    stage: Usd.Stage, reader: StageReader, options: Options, variants: list[str], selected: list[str]
) -> list[StageNotice]:
    """Notices about the stage as a whole."""
    notices = []
    unit = read_unit(stage.GetRootLayer()) or UsdGeom.GetStageMetersPerUnit(stage)
    if unit != 1.0:
        notices.append(
            StageNotice("assumed_convention", f"the file's unit is {unit:g} m; coordinates are not converted")
        )
    if reader.moves and options.time is None:
        notices.append(StageNotice("first_only", _describe_times(stage)))
    others = len(reader.lights) + len(reader.cameras)
    if options.single and others:
        notices.append(
            StageNotice(
                "ignored_element",
                f"lights and cameras ({others}) are ignored, because the file is loaded as one object",
            )
        )
    if len(variants) > 1 and options.variant is None:
        more = f" and {len(variants) - MAX_VARIANTS} more" if len(variants) > MAX_VARIANTS else ""
        chosen = f"; selected: {', '.join(selected[:MAX_VARIANTS])}" if selected else ""
        text = f"variants: {', '.join(variants[:MAX_VARIANTS])}{more}{chosen}; select one with variant={variants[-1]!r}"
        notices.append(StageNotice("first_only", text))
    return notices


def _check_empty(stage: Usd.Stage, has_lost: bool, notices: list[StageNotice], options: Options) -> None:
    """Raises `UsdRejected` for a stage without objects, unless all its prims are supported.

    The stage is also rejected if `options.single` is set, or if the stage has no prims.
    """
    if has_lost or options.single or not stage.GetRootLayer().rootPrims:
        reasons = "".join(f"; {notice}" for notice in notices[:5])
        raise UsdRejected(
            "nothing_visible", f"the file contains no meshes or solids that can be shown{reasons}"
        )


def _describe_times(stage: Usd.Stage) -> str:
    """The notice for a stage with several times."""
    rate = rate_of(stage)
    ends = f" ({stage.GetStartTimeCode() / rate:g} to {stage.GetEndTimeCode() / rate:g} s)"
    span = ends if stage.HasAuthoredTimeCodeRange() else ""
    return f"the first time of the animation is shown; for another time{span}, use raycam.load(path, time=SECONDS)"


def main(path: Path, folder: Path, options: Options) -> None:
    """Writes the world or the error to `world.json`."""
    apply_rlimits(options.memory, options.seconds, options.bytes)
    # OpenUSD also searches for layers in the current folder.
    os.chdir(folder)
    answer: dict[str, Any]
    try:
        answer = read_stage(path, folder, options)
    except UsdRejected as error:
        answer = {"code": error.code, "error": str(error)}
    except Tf.ErrorException as error:
        answer = {
            "code": "syntax",
            "error": "Pixar's library: " + "; ".join(part.commentary for part in error.args),
        }
    except MemoryError:
        answer = {
            "code": "budget_exceeded",
            "error": f"the file exceeds the limits: {options.memory} bytes of memory, {options.corners} face corners",
        }
    (folder / "world.json").write_text(json.dumps(answer), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), Options(**json.loads(sys.argv[3])))
    # All output is written. Unloading OpenUSD while its threads run can abort, so the process exits immediately.
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)
