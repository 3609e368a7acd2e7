"""The faces that cameras show, with their best views."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .._core import world_faces_in_sight
from ..arguments import Bools, Floats
from ..camera import Camera
from ..io.fork_guard import no_fork
from ..world import World
from ..world.face_geometry import face_normals
from .sight import Facing

__all__ = ["FaceSight", "find_face_sight"]


@dataclass(frozen=True)
class FaceSight:
    """Faces [n] that cameras show."""

    samples: npt.NDArray[np.int32]
    """The number of samples of each face [n]."""
    is_shown: Bools
    """True for the samples that any camera shows [m], face by face."""
    views: npt.NDArray[np.int32]
    """The number of cameras that show at least one sample [n]."""
    best_view: npt.NDArray[np.int32]
    """The index of the camera with the largest resolution [n], the first of several; -1 for none."""
    best_resolution: npt.NDArray[np.float32]
    """Resolution in that camera at the first visible sample [n], pixels per metre in the surface direction with fewer
    pixels; 0 for none.
    """
    best_cosine: Floats
    """The cosine of that sample's angle of incidence [n]; NaN for none."""
    faces_shown: npt.NDArray[np.int32]
    """The number of faces that each camera shows [cameras]."""
    pairs: npt.NDArray[np.int32]
    """(face, camera, number of visible samples) [k, 3], ascending. Empty unless requested."""


def find_face_sight(
    world: World,
    cameras: Sequence[Camera],
    corners: Floats,
    min_samples: npt.NDArray[np.uint16],
    pattern: Floats,
    *,
    facing: Facing = "front",
    pairs: bool = False,
    threads: int | None = None,
) -> FaceSight:
    """Returns which of the faces with `corners` [n, 3, 3] are visible from the cameras.

    A face has `min_samples` [n] samples; a face larger than 4 pixels in any camera has as many samples as pixels in
    the camera that shows it largest, up to the length of `pattern`. Samples have the first rows of `pattern` [k, 3]
    as weights of the corners. A sample is visible under the conditions of `find_sight`. All samples are tested with
    `pairs`, otherwise only samples that can change the result. For speed, neighbouring faces should follow each
    other.
    """
    query = {
        "corners": np.ascontiguousarray(corners, np.float64),
        "normals": face_normals(corners),
        "min_samples": np.ascontiguousarray(min_samples, np.uint16),
        "pattern": np.ascontiguousarray(pattern, np.float64),
        "both_sides": facing == "both",
        "pairs": pairs,
        "threads": threads,
    }
    with no_fork():
        world._core.prepare(threads)
    return FaceSight(**world_faces_in_sight(world._core, [camera._core for camera in cameras], query))
