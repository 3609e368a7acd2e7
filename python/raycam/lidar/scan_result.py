"""`Scan`: the points of one frame, with their ground truth."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..arguments import Floats, flag, real
from ..elementary import acos
from ..errors import LidarError, Notice, nearest
from ..io.atomic_files import write
from .files.ouster_packets import save_ouster_packets
from .files.packets import Firings, pcap_bytes
from .files.save import save_scan
from .pattern import Pattern
from .pose import transform
from .waveform import waveform_offsets

if TYPE_CHECKING:
    from .lidar import Lidar

__all__ = ["Scan"]

Array = npt.NDArray[Any]


class Scan(Mapping[str, Array]):
    """The points of a lidar's frame: a read-only mapping from field names to arrays.

    Arrays have one row for each point. `raycam.scan` lists the fields. `lidar` is the lidar that was used, `pattern`
    its pulses.
    """

    __slots__ = ("_columns", "_lidar", "_notices", "_pattern", "_up")

    def __init__(
        self,
        columns: dict[str, Array],
        *,
        lidar: Lidar,
        pattern: Pattern,
        up: str = "z",
        notices: Iterable[Notice] = (),
    ) -> None:
        self._columns, self._lidar, self._pattern, self._up = columns, lidar, pattern, up
        self._notices = tuple(notices)
        for array in columns.values():
            array.setflags(write=False)

    def __getitem__(self, name: str) -> Array:
        """Returns a field; raises `LidarError` with the most similar name for an unknown field."""
        if name not in self._columns:
            raise LidarError(nearest("field of a scan", name, list(self._columns)), code="unknown_name")
        return self._columns[name]

    def __contains__(self, name: object) -> bool:
        """True if the scan has a field of this name."""
        return name in self._columns

    def __iter__(self) -> Iterator[str]:
        """Iterates over the names of the fields."""
        return iter(self._columns)

    def __len__(self) -> int:
        """Returns the number of fields; `count` is the number of points."""
        return len(self._columns)

    def __repr__(self) -> str:
        """Shows the device and the number of points."""
        return f"<raycam.Scan of {self._lidar.title}: {self.count} points, {len(self._columns)} fields>"

    @property
    def count(self) -> int:
        """The number of rows."""
        return len(self._columns["time"])

    @property
    def lidar(self) -> Lidar:
        """The lidar that was used."""
        return self._lidar

    @property
    def notices(self) -> tuple[Notice, ...]:
        """The notices that the scan issued."""
        return self._notices

    @property
    def pattern(self) -> Pattern:
        """The pulses of the frame."""
        return self._pattern

    @property
    def poses(self) -> Floats:
        """The pose world_from_sensor at the time of each point, float64 [n, 4, 4]."""
        turns, places = self._lidar.track.at(self["time"])
        matrices = np.zeros((self.count, 4, 4))
        matrices[:, :3, :3], matrices[:, :3, 3], matrices[:, 3, 3] = turns, places, 1.0
        return matrices

    @property
    def waveform_offsets(self) -> Floats:
        """The distances of the samples of `waveform` from the echo's maximum, metres, float64 [65].

        The maximum is at the point's distance without noise.
        """
        return waveform_offsets(self._lidar.pulse_extent)

    def in_world(self) -> Floats:
        """Returns the measured points in world coordinates, float64 [n, 3].

        Each point is transformed by the pose at its own time.
        """
        turns, places = self._lidar.track.at(self["time"])
        return transform(turns, self["position"]) + places

    def deskewed(self, time: float | None = None) -> Floats:
        """Returns the points in the sensor axes at one time, float64 [n, 3].

        The points are as if all pulses had been emitted from the sensor's pose at that time. `time` is in seconds from
        the frame's start (default: its middle).
        """
        moment = (
            0.5 / self._lidar.rate
            if time is None
            else real("time", time, what="a time in seconds", error=LidarError)
        )
        turns, places = self._lidar.track.at(np.array([moment]))
        apart = self.in_world() - places
        return transform(np.broadcast_to(turns[0].T, (len(apart), 3, 3)), apart)

    def image(self, field: str = "distance", *, staggered: bool = True, echo: int = 0) -> Array:
        """Returns a field as an image [rings, columns, ...], as the device sends it.

        Row 0 has the highest elevation. `echo` is the echo's number if the lidar reports several per pulse. Pixels
        without a point are NaN, 0 for unsigned and -1 for other integers. With `staggered=False`, the rows of an Ouster
        are shifted by `pixel_shift_by_row`, as by Ouster's `destagger`. Raises `LidarError` for patterns without rows
        and columns.
        """
        rows, columns = self._pattern.shape
        if not rows:
            raise LidarError(
                f"{self._lidar.name}: images are not supported, because this pattern has no rows and columns",
                code="wrong_shape",
            )
        values = self[field]
        chosen = (self["lost"] == 0) & (self["return"] == echo)
        missing: Any = np.nan if values.dtype.kind == "f" else 0 if values.dtype.kind == "u" else -1
        picture = np.full((rows, columns, *values.shape[1:]), missing, values.dtype)
        top_down = _rows_from_top(self._pattern)
        picture[top_down[self["laser"][chosen]], self["column"][chosen]] = values[chosen]
        if not flag("staggered", staggered):
            for row, shift in enumerate(_pixel_shifts(self._lidar, self._pattern)):
                picture[row] = np.roll(picture[row], shift, axis=0)
        return picture

    def _firings(self) -> Firings:
        """Returns the data that the device's packets require.

        Raises `LidarError` for devices that are not Velodyne's.
        """
        lidar = self._lidar
        return Firings(
            lidar.name,
            lidar.returns,
            lidar.rate,
            lidar.firing_cycle,
            lidar.settings["step"],
            self._pattern.shape,
        )

    def _scan_angles(self) -> npt.NDArray[np.float32]:
        """Returns the angle of each beam from straight down in degrees.

        Angles are positive on the sensor's right side.
        """
        vertical = "xyz".index(self._up)
        turns, _ = self._lidar.track.at(self["time"])
        ways = transform(turns, self._pattern.directions[self["pulse"]])
        down = np.degrees(acos(np.clip(-ways[:, vertical], -1.0, 1.0)))
        left = (ways * turns[:, :, 1]).sum(axis=1)
        angles: npt.NDArray[np.float32] = np.where(left > 0.0, -down, down).astype(np.float32)
        return angles

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        fields: Iterable[str] | None = None,
        in_world: bool = False,
        text: bool = False,
        compress: bool = False,
    ) -> None:
        """Writes the points to a file; the extension selects the format.

        `.pcd` (0.7, binary; text with `text`, compressed with `compress`), `.ply`, `.npz`, `.csv`, `.las` (1.4,
        point format 6), `.laz` (requires `raycam[laz]`), `.feather` of Argoverse 2 (requires `raycam[feather]`;
        coordinates are float16), and `.bin` of KITTI (x, y, z and intensity from 0 to 1, float32). `fields` are written
        in addition to the position (default: the fields that readers of the format expect, and ids); with `in_world`,
        positions are in world coordinates. Lost pulses are not written, except to .npz. `.pcap` contains the packets
        that a VLP-16, Puck Hi-Res, VLP-32C, HDL-32E, HDL-64E, VLS-128 or Ouster sends in this frame; the same name with
        .json contains Ouster's metadata. Raises `LidarError` for an unknown extension or field.
        """
        if Path(path).suffix.lower() == ".pcap":
            if fields is not None or in_world or text or compress:
                raise LidarError(
                    "packets contain distances and intensities only; omit fields, in_world, text and compress",
                    code="conflicting_values",
                )
            if self._lidar.family == "ouster":
                gain = self._lidar.settings["near_ir_gain"]
                save_ouster_packets(Path(path), self, self._lidar.metadata, self._lidar.returns, gain)
            else:
                write(path, pcap_bytes(self, self._firings()))
            return
        points = self.in_world() if flag("in_world", in_world) else self["position"]
        columns: Mapping[str, Array] = self
        if Path(path).suffix.lower() in (".las", ".laz"):
            columns = {**self, "scan_angle": self._scan_angles()}
        save_scan(columns, points, path, fields, flag("text", text), flag("compress", compress))


def _rows_from_top(pattern: Pattern) -> npt.NDArray[np.int64]:
    """Returns the row of each laser in an image whose first row has the highest elevation."""
    lasers = pattern.shape[0]
    height = pattern.directions[:lasers, 2]
    rows = np.empty(lasers, np.int64)
    rows[np.argsort(-height, kind="stable")] = np.arange(lasers)
    return rows


def _pixel_shifts(lidar: Lidar, pattern: Pattern) -> list[int]:
    """Returns the columns by which Ouster shifts each row to the right.

    Raises `LidarError` for other devices.
    """
    if lidar.family != "ouster":
        raise LidarError(f"{lidar.name}: staggered=False requires an Ouster device", code="wrong_device")
    return lidar.pixel_shifts(pattern.shape[1])
