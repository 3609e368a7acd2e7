"""The faces that a lidar measures in a frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ..arguments import Floats
from ..elementary import cos
from .lidar import Lidar
from .pulse_tracer import PulseTracer
from .scan_notices import LOST, warn_of_device, warn_of_empty_scan, warn_of_times
from .scanning import KEPT, detect_echoes, lost_reasons, select_echoes

if TYPE_CHECKING:
    from ..world import World

__all__ = ["MeasuredFaces", "measured_faces"]

FIELDS = ("instance", "triangle", "barycentric", "incidence", "front")
"""Fields of contributions that describe a measured face."""


@dataclass(frozen=True, eq=False)
class MeasuredFaces:
    """The points of a frame without noise on directly visible surfaces, one row for each point."""

    ids: npt.NDArray[np.int32]
    """(instance, triangle) of the face, int32 [n, 2]."""
    barycentric: Floats
    """The position on the face as weights of its corners, [n, 3]."""
    cosine: Floats
    """The cosine of the angle of incidence, [n]."""
    front: npt.NDArray[np.bool_]
    """True if the beam meets the face's front, [n]."""


def measured_faces(world: World, lidar: Lidar, *, threads: int | None = None) -> MeasuredFaces:
    """Returns the faces on which a scan has points, in the order of pulses.

    The scan is `scan(world, lidar.replace(noise=False))`. Points behind mirrors and glass (`bounces` above 0)
    and echoes of fog are omitted. Notices are given as by `scan`.
    """
    exact = lidar.replace(noise=False)
    warn_of_device(lidar)
    warn_of_times(world, lidar)
    tracer = PulseTracer(world, exact, exact.pattern(), 0, threads)
    parts, counts = [], np.zeros(len(LOST), np.int64)
    for block in tracer.blocks():
        found = tracer.trace(block)
        echoes, lost, _ = detect_echoes(tracer, found, block)
        chosen = select_echoes(echoes, lost == KEPT, exact)
        counts += np.bincount(lost_reasons(block, echoes, lost, found, chosen), minlength=len(LOST))
        row = echoes.main[chosen]
        row = row[(found.bounces[row] == 0) & (found.fields["instance"][row] >= 0)]
        parts.append({name: found.fields[name][row] for name in FIELDS})
    if exact.settings["range_10"] is not None:  # otherwise, every echo is detected
        tracer.warn_of_colors()
    if not counts[KEPT]:
        warn_of_empty_scan(lidar, counts)
    fields = {name: np.concatenate([part[name] for part in parts]) for name in FIELDS}
    return MeasuredFaces(
        np.stack([fields["instance"], fields["triangle"]], axis=1),
        fields["barycentric"],
        cos(np.radians(fields["incidence"].astype(float))),
        fields["front"].astype(bool),
    )
