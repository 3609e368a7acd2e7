"""Writes HDF5 in BlenderProc's layout, with one file for each image.

Source: BlenderProc, WriterUtility.py. Requires `h5py`.
"""

from __future__ import annotations

import importlib
import io
import json
from collections.abc import Callable, Iterator
from types import ModuleType

import numpy as np

from ...errors import SettingsError
from ..plan import Format, Index, Made, Plan, Record

__all__ = ["FORMAT"]

BACKGROUND = 1e10
"""Depth and distance of the background in metres, as in Blender."""


def h5py() -> ModuleType:
    """Returns the module h5py; raises `SettingsError` with a remedy if h5py is not installed."""
    try:
        return importlib.import_module("h5py")
    except ImportError:
        raise SettingsError(
            "the format hdf5 requires h5py; pip install 'raycam[hdf5]'", code="missing_dependency"
        ) from None


def check(plan: Plan) -> None:
    """Raises `SettingsError` without h5py."""
    h5py()


def make(plan: Plan, number: int) -> Made:
    """Creates `N.hdf5` with an image and its annotations.

    The file contains colours, depth, distance, normals, segments of instances and categories, and the
    attributes of the instances.
    """
    shot = plan.shot(number)
    frame = shot.render(["color", "depth", "distance", "normal_camera", "instance", "category"])
    instance = frame["instance"]
    attributes = [
        {"idx": item.object + 1, "category_id": shot.category(item.object), "name": item.name}
        for item in shot.labels(instance)
        if item.visible_pixels
    ]
    normals = frame["normal_camera"] * np.array([1, -1, -1], dtype=np.float32)
    arrays = {
        "colors": frame.to_srgb8(),
        "depth": np.where(np.isfinite(frame["depth"]), frame["depth"], BACKGROUND).astype(np.float32),
        "distance": np.where(np.isfinite(frame["distance"]), frame["distance"], BACKGROUND).astype(
            np.float32
        ),
        "normals": ((np.nan_to_num(normals) + 1) / 2).astype(np.float32),
        "instance_segmaps": (instance + 1).astype(np.int32),
        "category_id_segmaps": np.maximum(shot.channel(frame, "category"), 0).astype(np.int32),
    }
    memory = io.BytesIO()
    with h5py().File(memory, "w", track_order=True) as file:
        for name, array in arrays.items():
            file.create_dataset(name, data=array, compression="gzip", track_times=False)
        file.create_dataset(
            "instance_attribute_maps", data=np.bytes_(json.dumps(attributes)), track_times=False
        )
        file.create_dataset("blender_proc_version", data=np.bytes_("raycam"), track_times=False)
    return {f"{number}.hdf5": memory.getvalue()}, {}


def index(plan: Plan, records: Callable[[], Iterator[Record]]) -> Index:
    """Creates the table of categories."""
    table = {str(number): name for number, name in sorted(plan.categories.items())}
    yield "categories.json", [json.dumps(table, indent=2).encode() + b"\n"]


FORMAT = Format(make, index, check, {}, many_worlds=True)
