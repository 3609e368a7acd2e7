"""Values that a format's integers cannot represent.

The values are counted per image, and reported in one notice per kind.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from ..arguments import Bools, real
from ..errors import Notice
from .plan import Record

__all__ = ["DEPTH_SCALES", "KEY", "check_depth_scale", "depth_units", "lost", "lost_notices"]

MILLIMETRES = 1000.0
DEPTH_SCALES = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0]
KEY = "lost"
"""The record's key for the number of lost pixels and the total, by kind of value."""


def check_depth_scale(scale: Any) -> None:
    """Raises `SettingsError` for an invalid depth scale.

    A valid `scale` is None or a number of millimetres per unit, more than 0.
    """
    if scale is not None:
        real("depth_scale", scale, 0, above=True, what="a number of millimetres per unit")


def depth_units(
    depth: npt.NDArray[np.float32], scale: float | None
) -> tuple[npt.NDArray[np.uint16], float, Record]:
    """Returns depth [h, w] in metres as uint16, its unit in mm, and the record of lost pixels.

    The background and depth beyond the range become 0. The default unit is the finest of `DEPTH_SCALES` that can
    represent the farthest surface.
    """
    seen = np.isfinite(depth)
    with np.errstate(invalid="ignore"):
        millimetres = np.where(seen, depth.astype(np.float64) * MILLIMETRES, 0.0)
    farthest = millimetres.max(initial=0.0)
    fitting = [unit for unit in DEPTH_SCALES if farthest <= 65535 * unit]
    unit = float(scale if scale is not None else (fitting or DEPTH_SCALES[-1:])[0])
    steps = np.rint(millimetres / unit)
    near, far = seen & (steps < 1), seen & (steps > 65535)
    counts = {
        **lost("small_depth", f"depth below {unit / 2:g} mm, or behind the camera", near, seen).get(KEY, {}),
        **lost("depth", f"depth beyond {65.535 * unit:.6g} m", far, seen).get(KEY, {}),
    }
    kept = seen & ~near & ~far
    return np.where(kept, steps, 0).astype(np.uint16), unit, {KEY: counts} if counts else {}


def lost(
    kind: Literal["depth", "small_depth", "disparity", "flow"], what: str, pixels: Bools, of: Bools
) -> Record:
    """Returns the part of a record that counts lost pixels among the pixels with a value.

    The part is empty if no pixel is lost. `what` describes the values that the format cannot represent, for
    example "depth beyond 65.535 m".
    """
    count = int(np.count_nonzero(pixels))
    return {KEY: {what: [kind, count, int(np.count_nonzero(of))]}} if count else {}


def lost_notices(records: Iterator[Record] | Iterable[Record], format: str) -> list[Notice]:
    """Returns one notice for each kind of value that the format cannot represent.

    A notice contains the fraction of pixels with such values, and the number of images.
    """
    totals: dict[tuple[str, str], list[int]] = {}
    for record in records:
        for what, (kind, count, of) in record.get(KEY, {}).items():
            total = totals.setdefault((kind, what), [0, 0, 0])
            total[0], total[1], total[2] = total[0] + count, total[1] + of, total[2] + 1
    return [_lost_notice(format, kind, what, *total) for (kind, what), total in totals.items()]


def _lost_notice(format: str, kind: str, what: str, count: int, of: int, images: int) -> Notice:
    written = "marked as invalid" if kind == "flow" else "written as 0"
    share = f"{count} of {of} valid pixels ({100.0 * count / of:.3g} %)"
    where = f"in {images} image{'' if images == 1 else 's'}"
    remedy = ""
    if kind == "depth" and format != "kitti":
        remedy = "; use a larger depth_scale (millimetres per unit)"
    message = f"{format} cannot represent {what}: {share} are {written}, {where}{remedy}"
    return Notice(message, "values_lost")
