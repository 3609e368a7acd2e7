"""The faces that a lidar measures in a frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ..arguments import Floats
from .lidar import Lidar
from .scan_notices import warn_of_device, warn_of_empty_scan, warn_of_times
from .scanning import KEPT, detect_echoes, lost_reasons, select_echoes, trace_pulses

if TYPE_CHECKING:
    from ..world import World

__all__ = ["MeasuredFaces", "measured_faces"]


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
    pattern = exact.pattern()
    is_detected_by_energy = exact.settings["range_10"] is not None
    found = trace_pulses(world, exact, pattern, 0, threads, uses_energy=is_detected_by_energy)
    echoes, lost, _ = detect_echoes(pattern, found, exact, 0)
    chosen = select_echoes(echoes, lost == KEPT, exact)
    if not len(chosen):
        warn_of_empty_scan(lidar, lost_reasons(len(pattern), echoes, lost, found, chosen))
    row = echoes.main[chosen]
    row = row[(found.bounces[row] == 0) & (found.fields["instance"][row] >= 0)]
    fields = {name: array[row] for name, array in found.fields.items()}
    return MeasuredFaces(
        np.stack([fields["instance"], fields["triangle"]], axis=1),
        fields["barycentric"],
        np.cos(np.radians(fields["incidence"].astype(float))),
        fields["front"].astype(bool),
    )
