"""Calibration and pose files of other tools: reading and writing cameras."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Literal

from . import _core
from .arguments import size_of, word
from .camera import Camera
from .camera._arguments import Model, Size, Up
from .errors import CameraError, FormatError, Notice, SettingsError, nearest
from .io.atomic_files import write
from .io.html_form import html_table
from .notices import warn_all
from .rig import Rig

__all__ = ["FORMATS", "WRITTEN_FORMATS", "Cameras", "load_cameras", "save_cameras"]

FORMATS, WRITTEN_FORMATS = (tuple(names) for names in _core.calibration_formats())
"""The formats that `load_cameras` reads, and the formats that `save_cameras` writes."""


class Cameras(Mapping[str, Camera]):
    """The cameras of a file by name, in the file's order.

    `load_cameras` returns this mapping, and `save_cameras` accepts it.

    `images` are image names and `times` are seconds, both by camera name, if the file contains them. `notices` lists
    parts that were omitted or repaired. The file's numbers are kept as written, so that saving in the same format
    reproduces them to the last bit.
    """

    def __init__(
        self,
        records: list[_core.Record],
        notices: Sequence[Notice],
        up: Up,
        path: str,
        size: tuple[int, int] | None = None,
    ) -> None:
        self._path = path
        self._size = size
        self._records = {record.name: record for record in records}
        if len(self._records) != len(records):
            names = [record.name for record in records]
            twice = next(name for name in names if names.count(name) > 1)
            raise FormatError(
                f"two cameras have the name {twice!r}; camera names must be unique", code="duplicate_name"
            )
        self._up = up
        self._made: dict[str, Camera] = {}
        self.notices = tuple(notices)
        self.images = {record.name: record.image for record in records if record.image is not None}
        self.times = {record.name: record.time for record in records if record.time is not None}

    def __getitem__(self, name: str) -> Camera:
        """Returns the camera of this name.

        Raises `KeyError` for an unknown name, and `CameraError` for a camera without size or intrinsics.
        """
        if name not in self._made:
            if name not in self._records:
                raise KeyError(nearest("camera", str(name), list(self._records)))
            try:
                made = self._records[name].camera()
            except CameraError as fault:
                raise CameraError(f"{self._path}: {fault}", code=fault.code) from None
            self._made[name] = self._sized(name, Camera._of(made, self._up))
        return self._made[name]

    def _sized(self, name: str, camera: Camera) -> Camera:
        """Returns the camera resized to the given size.

        Raises `CameraError` if the given size has another aspect ratio.
        """
        if self._size is None or camera.size == self._size:
            return camera
        (width, height), (new_width, new_height) = camera.size, self._size
        if abs(new_width * height / (width * new_height) - 1.0) > 0.01:
            raise CameraError(
                f"{self._path}: camera {name!r} has {width} x {height} pixels, and size {new_width} x {new_height} "
                "has another aspect ratio; pass a size with the camera's aspect ratio, or crop the camera with "
                "cropped()",
                code="conflicting_values",
            )
        return camera.resized(self._size)

    def __iter__(self) -> Iterator[str]:
        """Iterates over the names of the cameras."""
        return iter(self._records)

    def __len__(self) -> int:
        """The number of cameras."""
        return len(self._records)

    @property
    def rigs(self) -> dict[str, Rig]:
        """The file's rigs at each of their poses, by the pose's name.

        In COLMAP, the pose's name is the frame's number. Each rig contains its cameras by name. COLMAP stores
        rigs in `rigs` and `frames`. The cameras of a Kalibr camchain, a KITTI calibration or OpenCV's
        `stereo_calib` form one rig, whose body frame is the file's world. The mapping is empty for files
        without rigs.
        """
        groups: dict[tuple[str, str], dict[str, Camera]] = {}
        bodies: dict[tuple[str, str], tuple[list[list[float]], list[float]]] = {}
        for name, record in self._records.items():
            if record.mount is not None:
                rig, frame, sensor, (r, c), body = record.mount
                camera = self[name].at_pose(r, c)
                groups.setdefault((rig, frame), {})[sensor] = camera
                bodies[rig, frame] = body
        return {
            frame: Rig(cameras, *bodies[rig, frame], name=rig, up=self._up)
            for (rig, frame), cameras in groups.items()
        }

    def __repr__(self) -> str:
        """The file and its cameras as text: name, size and lens of each, up to eight."""
        shown = ", ".join(" ".join(str(cell) for cell in row) for row in self._rows(8))
        more = f", ... {len(self) - 8} more" if len(self) > 8 else ""
        return f"Cameras of {self._path}: {len(self)} ({shown}{more})"

    def _repr_html_(self) -> str:
        """The HTML table shown by notebooks."""
        return html_table(
            f"{len(self)} cameras of {self._path}", ("name", "size", "lens"), self._rows(len(self))
        )

    def _rows(self, end: int) -> list[tuple[str, str, str]]:
        """Returns the name, size and lens of the first `end` cameras.

        The size is "not complete" for cameras without size or intrinsics.
        """
        rows = []
        for name in list(self)[:end]:
            try:
                camera = self[name]
            except CameraError:
                rows.append((name, "not complete", ""))
                continue
            lens = camera.model if camera.distortion is not None else "no lens"
            rows.append((name, f"{camera.size[0]} x {camera.size[1]}", lens))
        return rows

    def find(self, name: str) -> Camera:
        """Returns the camera of this name.

        For an unknown name, raises `CameraError` with the nearest name.
        """
        if name not in self._records:
            raise CameraError(nearest("camera", name, list(self._records)), code="unknown_name")
        return self[name]


def load_cameras(
    path: str | os.PathLike[str],
    format: str | None = None,
    *,
    size: Size | None = None,
    intrinsics: Camera | None = None,
    model: Model | None = None,
    direction: Literal["world_from_camera", "camera_from_world"] | None = None,
    axes: Literal["opencv", "opengl"] | None = None,
    up: Up = "z",
) -> Cameras:
    """Reads the cameras of a calibration or trajectory file; returns them by name.

    * "opencv": FileStorage, YAML, JSON, XML, `.npz`, `.npy`, also compressed (`.yml.gz`); K and lens may have the keys
      that users commonly choose (`mtx`, `dist`, `K1 D1 K2 D2 R T`, a map for each camera, or keys with the cameras'
      names, such as `K_event` and `dist_event`); poses may be maps of a quaternion and a translation; R and T may be in
      `extrinsics.json` next to `intrinsics.json`; arrays of several cameras may be stacked (K [n, 3, 3], poses
      [n, 4, 4]); also sensor files of EuRoC and Kimera
    * "ros": files of `camera_info_manager`, CameraInfo messages as text, and folders with left.yaml and right.yaml
    * "kalibr": camchain files, whose cameras form a rig, with poses from `T_cam_imu` or `T_imu_cam`, or else relative
      to cam0 from `T_cn_cnm1`
    * "orb-slam": settings of ORB-SLAM2 and 3, for one camera or a pair
    * "camodocal", "vins": cameras with `model_type` PINHOLE, PINHOLE_FULL, MEI or KANNALA_BRANDT; for VINS also the
      poses on the body
    * "ov2slam": settings of OV2SLAM; "ncamera": camera systems of SVO and maplab (`T_B_C`), and files of SVO and
      FAST-LIVO2 with `cam_model`
    * "basalt", "mrcal", "zed": calibrations of Basalt, mrcal and ZED cameras
    * "anipose": `calibration.toml` of Anipose, Pose2Sim and FreeMoCap
    * "colmap": a folder of text files, or one of them, with rigs and frames; also "colmap-binary"
    * "metashape", "opensfm", "alicevision", "openmvg", "bundler", "realitycapture" (CSV), "realitycapture-xmp":
      reconstructions
    * "nerf": transforms.json of NeRF, instant-ngp and nerfstudio; "blender": the same file with one field of view for
      all images; "blender-splits": a folder with such files for train, val and test
    * "3dgs": cameras.json of Gaussian splats; "polycam", "record3d": exports of these apps; "camera-path": a
      viewer's camera path
    * "poses": 4x4 matrices: one per file (ScanNet, 7-Scenes; also a folder of such files), 16 numbers per line
      (Replica), or `.npy`; in the same forms, or as 12 numbers per line, 3x4 camera matrices P = K R [I | -C] in pixels
      (DTU)
    * "open3d": Open3D's JSON; "redwood": `.log`; "arkit": ARKitScenes' `.traj` and `.pincam`
    * "mvsnet", "neus" (also files of DVR), "pmvs", "llff", "middlebury", "realestate10k": cameras of these benchmarks
    * "kapture": a folder with `sensors/`, or a file in `sensors/`
    * "cityscapes", "virtual-kitti", "tartanair", "scannetpp-iphone": cameras and poses of these data sets
    * "aria-mps": trajectories and `online_calibration.jsonl` of Project Aria's machine perception services
    * "kitti": `P0` to `P3`, or `calib_cam_to_cam.txt`; world coordinates are those of the rectified camera 0
    * "kitti-poses": 12 numbers per line; "kitti-360": the body's `poses.txt`, and `calib_cam_to_pose.txt`
    * "bop": `scene_camera.json` (millimetres become metres) and `camera.json`; "hot3d": `cam_model` of data sets from
      head-mounted cameras
    * "nuscenes", "argoverse", "waymo": cameras of vehicles, from JSON tables (for Argoverse 2 also CSV)
    * "replicator": a camera_params file of NVIDIA Replicator, or a folder of such files
    * "tum", "euroc": trajectories of a camera, or of the body for "euroc" (`data.csv`); if the file has a header with
      the columns' names, or comments that state the order of the quaternion, these determine the order.
      "tum-intrinsics": `calibration.txt`, also with the lens of DROID-SLAM (fx fy cx cy k1 k2 p1 p2)
    * "realsense": intrinsics printed by librealsense; "coco": the `images` of data sets that raycam writes

    Without `format`, the format is detected from the file's contents, then from its name; for a folder, from the
    files in it. For files that contain only poses, size, K and lens are taken from `intrinsics` (a camera or a
    calibration file), or from a calibration in the same folder. `size` (width, height) is required if neither the
    file nor an image next to it has a size; cameras of another size are resized, or rejected if the aspect ratio
    differs. `model` (as in `Camera`) is the lens model of coefficients for which the file does not specify one: four
    numbers under `D`, for example, may belong to `cv2.fisheye`. `direction` and `axes` describe poses in files
    that do not specify them. Without `direction`, a list of poses ("poses") is read as world_from_camera, with a
    notice; a pose next to K whose key specifies no direction raises `FormatError`. Without `axes`, the axes are
    OpenCV's. Each camera has the `pixel_center` of its format. World coordinates are the file's; `up` is the axis for
    roll, pitch and yaw.

    For the trajectory of a body ("euroc", "kitti-360"), the pose of `intrinsics` (`T_BS`) is the camera's pose on the
    body. Notices report what was assumed or omitted, and values that look wrong, such as a K for another resolution
    or a principal point outside the image.

    A lens is never dropped silently: an unknown key that looks like lens coefficients raises `FormatError`. Raises
    `FormatError` with file, line and key for a malformed file, `CameraError` for an invalid camera, and `OSError` if
    the file cannot be read.
    """
    if not isinstance(path, str | os.PathLike):
        raise SettingsError(
            f"path must be the path of a calibration, not {type(path).__name__}", code="wrong_type"
        )
    pair = None if size is None else size_of(size, error=CameraError)
    if not isinstance(intrinsics, Camera | None):
        raise SettingsError(
            f"intrinsics must be a Camera, not {type(intrinsics).__name__}", code="wrong_type"
        )
    core = None if intrinsics is None else intrinsics._core
    poses = _pose_hints(direction, axes)
    records, notices = _core.read_cameras(os.fspath(path), format, pair, core, model, poses)
    warn_all(notices)
    return Cameras(records, notices, up, os.fspath(path), pair)


def _pose_hints(direction: str | None, axes: str | None) -> tuple[bool | None, bool | None]:
    """Returns the arguments as booleans; None for a missing argument.

    The first value is True for world_from_camera poses, and the second for OpenGL's axes.
    """
    if direction not in (None, "world_from_camera", "camera_from_world"):
        raise CameraError(
            f'direction is {direction!r}; expected "world_from_camera" or "camera_from_world"',
            code="invalid_value",
        )
    if axes not in (None, "opencv", "opengl"):
        raise CameraError(f'axes is {axes!r}; expected "opencv" or "opengl"', code="invalid_value")
    return (
        None if direction is None else direction == "world_from_camera",
        None if axes is None else axes == "opengl",
    )


def save_cameras(
    path: str | os.PathLike[str],
    cameras: Mapping[str, Camera | Rig] | Camera,
    format: str,
    *,
    images: Mapping[str, str] | None = None,
    times: Mapping[str, float] | None = None,
) -> list[Notice]:
    """Writes cameras in one of `WRITTEN_FORMATS`.

    Returns notices about values that the format stores differently. `cameras` may also be a `Rig`, or a
    mapping from names to rigs. COLMAP's formats store a rig at many poses; each pose is a frame, and its
    images are named frame/camera. Kalibr and KITTI store one rig, in the axes of its body (KITTI: of its
    first camera if that is rotated). Other formats store the cameras in world coordinates.

    COLMAP's formats create a folder. The format "opencv" is YAML, or JSON or XML if `path` has that ending. `images`
    and `times` (seconds) are mappings by camera name; a TUM trajectory requires `times`, or cameras whose names are
    numbers.

    Raises `FormatError` with the reason (a lens, skew, ...) if the format cannot represent a camera, before any file
    is written, and `OSError`.
    """
    if not isinstance(cameras, Camera | Mapping):
        raise SettingsError(
            f"cameras must be a Camera, a Rig or a mapping from names to cameras or rigs, "
            f"not {type(cameras).__name__}",
            code="wrong_type",
        )
    images, times = dict(images or {}), dict(times or {})
    if isinstance(cameras, Cameras) and cameras._size is not None:
        images, times = {**cameras.images, **images}, {**cameras.times, **times}
    given: Mapping[str, Camera | Rig] = {"camera": cameras} if isinstance(cameras, Camera) else cameras
    records = []

    def add(name: str, camera: Camera, on: tuple[_core.Rig, str, str] | None = None) -> None:
        records.append(_core.Record.of(name, camera._core, images.get(name), times.get(name), on))

    if isinstance(given, Rig):
        for name, camera in given.items():
            add(name, camera, (given._core, given.name, name))
        given = {}
    for name in given:
        if isinstance(given, Cameras) and given._size is None:
            record = given._records[name]
            if name in images or name in times:
                record = record.replaced(images.get(name, record.image), times.get(name, record.time))
            records.append(record)
            continue
        item = given[name]
        if not isinstance(item, Camera | Rig):
            raise SettingsError(
                f"cameras[{name!r}] must be a Camera or a Rig, not {type(item).__name__}", code="wrong_type"
            )
        if isinstance(item, Rig):
            for own, camera in item.items():
                add(f"{name}/{own}", camera, (item._core, name, own))
        else:
            add(name, item)
    files, notices = _core.write_cameras(
        records, os.fsdecode(path), word("format", format, error=FormatError)
    )
    folder = Path(os.fsdecode(path))
    if any(name for name, _ in files):
        folder.mkdir(parents=True, exist_ok=True)
    for name, data in files:
        write(folder / name if name else folder, bytes(data))
    warn_all(notices)
    return notices
