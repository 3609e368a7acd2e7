"""The data set format "photos": ground truth for photographs, under the photographs' names."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from ... import _core
from ...arguments import Bools, one_of, words
from ...errors import CameraError, SettingsError
from ..lost import check_depth_scale, depth_units
from ..plan import Format, Index, Made, Plan, Record, png
from .files import colmap_map, mvsnet_camera, npy, pfm
from .names import photograph_names, stem
from .surfaces import CHANNELS, photograph_surfaces

__all__ = ["FORMAT", "LAYOUTS"]

LAYOUTS = ("plain", "scannetpp", "mvsnet", "colmap", "blendedmvs")
"""Folder layouts of the format."""

OPTIONS: dict[str, Any] = {
    "layout": "plain",
    "channels": ("depth",),
    "depth_format": "png",
    "depth_scale": 1.0,
    "normal_bits": 8,
    "normal_axes": "opencv",
    "facing": "both",
}
DEPTH_PLANES = {"mvsnet": 192, "blendedmvs": 128}
"""Number of depth hypotheses in the camera files of the layouts."""


def check(plan: Plan) -> None:
    """Raises `SettingsError` for invalid options.

    Raises `CameraError` for cameras that the layout does not support.
    """
    options = plan.options
    layout = one_of("layout", options["layout"], LAYOUTS)
    words("channel", options["channels"], CHANNELS)
    one_of("depth_format", options["depth_format"], ("png", "exr", "npy"))
    one_of("normal_axes", options["normal_axes"], ("opencv", "opengl"))
    one_of("facing", options["facing"], ("both", "front"))
    if options["normal_bits"] not in (8, 16):
        raise SettingsError(
            f"normal_bits is {options['normal_bits']!r}; expected 8 or 16", code="invalid_value"
        )
    check_depth_scale(options["depth_scale"])
    if options["depth_scale"] is None:
        raise SettingsError(
            "depth_scale is None; expected millimetres per unit, the same for all photographs",
            code="missing_value",
        )
    if layout != "plain":
        given = [name for name in words("channel", options["channels"], CHANNELS) if name != "depth"]
        if given:
            raise SettingsError(
                f"layout {layout!r} does not support channels {', '.join(given)}; use layout plain",
                code="conflicting_values",
            )
    if plan.recipe is not None:
        raise SettingsError(
            "the format photos cannot be used with a recipe; pass a single world", code="missing_value"
        )
    if layout in ("mvsnet", "colmap", "blendedmvs"):
        for number, view in enumerate(plan.shots):
            camera = view.camera
            if camera.model != "pinhole" or camera.K[0, 1] != 0.0 or camera.is_parallel:
                raise CameraError(
                    f"camera {view.label or number}: layout {layout!r} requires pinhole cameras without skew; use "
                    "undistorted cameras (camera.undistorted(), --undistort) or layout plain or scannetpp",
                    code="unsupported_camera",
                )


def make(plan: Plan, number: int) -> Made:
    """Creates the files of a photograph, and the photograph's record.

    The record contains the share of pixels without a surface.
    """
    shot, options = plan.shot(number), plan.options
    layout, name = options["layout"], photograph_names(plan)[number]
    channels = list(options["channels"]) if layout == "plain" else ["depth"]
    channels = [channels] if isinstance(channels, str) else channels
    if layout == "colmap":
        channels.append("normal")
    found = photograph_surfaces(shot, channels, options["facing"])
    hit = found["mask"]
    record: Record = {"photograph": name, "without_surface": 1.0 - float(np.count_nonzero(hit)) / hit.size}
    depth = np.where(hit, found["depth"], 0.0).astype(np.float32)
    if layout == "plain":
        files: dict[str, bytes] = {}
        for channel in channels:
            made, loss = _plain(channel, found, options)
            ending = made[0]
            files[f"{channel}/{stem(name)}.{ending}"] = made[1]
            record |= loss
        return files, record
    if layout == "scannetpp":
        units, _, loss = depth_units(np.where(hit, depth, np.inf), options["depth_scale"])
        return {f"render_depth/{stem(name)}.png": png(units)}, record | loss
    if layout == "colmap":
        return {
            f"stereo/depth_maps/{name}.geometric.bin": colmap_map(depth),
            f"stereo/normal_maps/{name}.geometric.bin": colmap_map(found["normal"]),
        }, record
    planes = DEPTH_PLANES[layout]
    nearest, farthest = (float(depth[hit].min()), float(depth[hit].max())) if hit.any() else (0.0, 0.0)
    camera = mvsnet_camera(shot.camera, nearest, farthest, planes)
    if layout == "mvsnet":
        return {
            f"Depths/depth_map_{number:04d}.pfm": pfm(depth),
            f"Depths/depth_visual_{number:04d}.png": png(np.where(hit, 255, 0).astype(np.uint8)),
            f"Cameras/{number:08d}_cam.txt": camera,
        }, record
    return {f"rendered_depth_maps/{number:08d}.pfm": pfm(depth), f"cams/{number:08d}_cam.txt": camera}, record


def _plain(
    channel: str, found: dict[str, npt.NDArray[Any]], options: dict[str, Any]
) -> tuple[tuple[str, bytes], Record]:
    """The ending and bytes of a channel in the layout "plain", and the loss of integer depths."""
    values = found[channel]
    if channel in ("depth", "distance"):
        kind = options["depth_format"]
        if kind == "png":
            units, _, loss = depth_units(values, options["depth_scale"])
            return ("png", png(units)), loss
        cleaned = np.where(found["mask"], values, 0.0).astype(np.float32)
        return (kind, npy(cleaned) if kind == "npy" else exr(channel, cleaned)), {}
    if channel == "position":
        return ("exr", exr(channel, values)), {}
    if channel == "normal":
        steps = normal_steps(values, found["mask"], options["normal_bits"], options["normal_axes"])
        return ("png", png(steps, fast=True)), {}
    if channel == "instance":
        ids = values + 1
        if ids.max(initial=0) > 65535:
            raise SettingsError(
                f"instance {ids.max() - 1} does not fit into a 16-bit PNG; the largest instance id is 65534",
                code="cannot_write",
            )
        return ("png", png(ids.astype(np.uint16))), {}
    if channel == "confidence":
        return ("png", png(np.rint(values * 255).astype(np.uint8))), {}
    return ("png", png(np.where(values, 255, 0).astype(np.uint8))), {}


def normal_steps(
    normals: npt.NDArray[np.float32], mask: Bools, bits: int, axes: str
) -> npt.NDArray[np.uint8 | np.uint16]:
    """Encodes unit normals [h, w, 3] as integers of 8 or 16 bits: 0..max is -1..1.

    `axes` is "opencv" or "opengl". The result is 0 outside of the mask [h, w].
    """
    half = np.float32((2**bits - 1) / 2)
    signs = np.array([1, 1, 1] if axes == "opencv" else [1, -1, -1], np.float32)
    steps = normals * (half * signs)
    steps += half
    np.rint(steps, out=steps)
    steps[~mask] = 0
    return steps.astype(np.uint8 if bits == 8 else np.uint16)


def exr(channel: str, values: npt.NDArray[Any]) -> bytes:
    """Encodes floats [h, w] or [h, w, 3] as an EXR file with one layer."""
    return _core.encode_exr([(channel, np.ascontiguousarray(values))], False, None, [])


def index(plan: Plan, records: Callable[[], Iterator[Record]]) -> Index:
    """Creates `error.json`, which contains each photograph's share of pixels without a surface.

    Layouts with numbered files also get the photographs' names in `photographs.json`. The layout "colmap"
    also gets the cameras in `sparse`.
    """
    rows = {record["photograph"]: round(record["without_surface"], 6) for record in records()}
    yield "error.json", [json.dumps({"without_surface": rows}, indent=1).encode() + b"\n"]
    names = photograph_names(plan)
    if plan.options["layout"] in DEPTH_PLANES:
        yield "photographs.json", [json.dumps(names, indent=1).encode() + b"\n"]
    if plan.options["layout"] == "colmap":
        cameras = [
            _core.Record.of(name, view.camera._core, name, None)
            for name, view in zip(names, plan.shots, strict=True)
        ]
        for name, data in _core.write_cameras(cameras, "sparse", "colmap-binary")[0]:
            yield f"sparse/{name}", [bytes(data)]


FORMAT = Format(make, index, check, OPTIONS)
