"""Writes WebDataset: shards as tar files, which are read sequentially.

Source: webdataset.github.io.
"""

from __future__ import annotations

import io
import json
import tarfile
from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np
import numpy.typing as npt

from ..arguments import whole
from ..io.temp_stream import Piece
from ..render import channel_names
from .coco import segmentation
from .plan import Format, Index, Made, Plan, Record, Shot

__all__ = ["FORMAT"]

OPTIONS = {
    "shard_size": 32,
    "channels": ["depth", "instance", "category", "normal_camera"],
    "segmentation": "rle",
}


def check(plan: Plan) -> None:
    """Raises `SettingsError` for invalid options."""
    whole("shard_size", plan.options["shard_size"], 1)
    channel_names(plan.options["channels"])


def units(plan: Plan) -> int:
    """Returns the number of shards, which are the units of work."""
    return -(-len(plan.shots) // int(plan.options["shard_size"]))


def make(plan: Plan, number: int) -> Made:
    """Creates one tar file of several views.

    For each view, the file contains `key.png`, `key.json`, and one `key.NAME.npy` for each channel.
    """
    size = plan.options["shard_size"]
    views = range(number * size, min((number + 1) * size, len(plan.shots)))
    return {f"shard-{number:06d}.tar": tar(plan, views)}, {"samples": len(views)}


def tar(plan: Plan, views: Iterable[int]) -> Iterator[Piece]:
    """Iterates over the pieces of a tar file.

    A view is rendered when its first piece is requested. Source: POSIX.1-1988, ustar.
    """
    size = 0
    for view in views:
        for ending, data in sample(plan.shot(view)):
            member = tarfile.TarInfo(f"{view:06d}.{ending}")
            member.size = sum(len(piece) for piece in data)
            rest = bytes(-member.size % tarfile.BLOCKSIZE)
            for piece in (member.tobuf(tarfile.USTAR_FORMAT), *data, rest):
                yield piece
                size += len(piece)
    end = 2 * tarfile.BLOCKSIZE
    yield bytes(end + -(size + end) % tarfile.RECORDSIZE)


def sample(shot: Shot) -> Iterator[tuple[str, Sequence[Piece]]]:
    """Iterates over the files of a view by ending, in pieces."""
    names = list(dict.fromkeys(["color", "instance", *shot.plan.options["channels"]]))
    frame = shot.render(names)
    camera = shot.camera
    description = {
        "K": camera.K.tolist(),
        "R": camera.R.tolist(),
        "C": camera.location.tolist(),
        "camera": camera.to_dict(),
        "size": list(camera.size),
        "pixel_center": camera.pixel_center,
        "model": camera.model,
        "distortion": None if camera.distortion is None else camera.distortion.tolist(),
        "time": shot.time,
        "categories": shot.plan.categories,
        "objects": [
            {
                "object": item.object,
                "name": item.name,
                "category": shot.category(item.object),
                "visible_box": item.visible_box,
                "amodal_box": item.amodal_box,
                "visible_fraction": item.visible_fraction,
                "segmentation": segmentation(item, shot.plan.options["segmentation"]),
                "box3d": {
                    "rotation": item.box3d.rotation.tolist(),
                    "center": item.box3d.center.tolist(),
                    "size": item.box3d.size.tolist(),
                },
            }
            for item in shot.labels(frame["instance"])
        ],
    }
    yield "png", [frame.to_png()]
    yield "json", [json.dumps(description).encode()]
    for name in shot.plan.options["channels"]:
        yield f"{name}.npy", npy(shot.channel(frame, name))


def npy(array: npt.NDArray[np.generic]) -> Sequence[Piece]:
    """Returns a .npy file in pieces: NumPy's header, and the array's memory without a copy."""
    array = np.ascontiguousarray(array)
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, np.lib.format.header_data_from_array_1_0(array))
    return head.getvalue(), array.data.cast("B")


def index(plan: Plan, records: Callable[[], Iterator[Record]]) -> Index:
    """Creates the index of `wids`: the number of samples of each shard."""
    shards = [
        {"url": f"shard-{number:06d}.tar", "nsamples": record["samples"]}
        for number, record in enumerate(records())
    ]
    head = {"__kind__": "wids-shard-index-v1", "wids_version": 1, "shardlist": shards, "name": "raycam"}
    yield "index.json", [json.dumps(head, indent=1).encode()]


FORMAT = Format(make, index, check, OPTIONS, units, many_worlds=True)
