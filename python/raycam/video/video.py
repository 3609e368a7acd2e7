"""Videos of a moving world, written to a video file or a folder of PNG images."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..arguments import Floats, real, whole
from ..camera import Camera
from ..errors import CameraError, Notice, SettingsError, nearest
from ..jobs.job_package import JobPackage
from ..jobs.kinds import FrameMaker, register
from ..notices import warn_all
from ..render import render
from ..render.arguments import camera_of, world_of
from ..render.camera_seed import with_camera_seed
from ..render.frame import Frame
from ..rig import Rig
from ..sensors import Sensor, sample_sensor
from ..sensors.sensor import require_sensor
from ..world import Animation, World
from ..world.framing import framing_camera, moments_of
from .files import check_video, open_video, picture_name

__all__ = ["VideoPlan", "write_video"]

Progress = Callable[[int, int], object]
MAX_FRAMES = 1_000_000
FPS = 24.0


class VideoPlan:
    """The frames of a video, each rendered on request.

    `world` moves by its `[video]`. A world without a video shows its `animation`, a name or number (default: the
    first), from beginning to end. A world without either gets an orbit of 4 seconds around its centre, with a notice.
    `camera` (default: the world's first camera, or a camera that frames the whole world) moves if the video moves the
    camera; a camera of the world also moves with its animation. Instead of `camera`, `rig` is a rig and the name of
    one of its cameras, while the video moves the rig as in `World.rig_at`. `fps` replaces the world's frames per
    second (24). `seconds` plays the same motion faster or slower. `settings` are those of `raycam.render`:
    integrator, samples, filter, seed, ambient_occlusion, exposure, transparent_background, threads.

    Parts that do not move are built once, before the first frame.

    Raises `SettingsError` if `fps` or `seconds` is not a positive number or there would be too many frames, and
    `CameraError` if the world has no camera and nothing to frame.
    """

    def __init__(
        self,
        world: World | str | os.PathLike[str],
        camera: Camera | str | os.PathLike[str] | None = None,
        *,
        fps: float | None = None,
        seconds: float | None = None,
        animation: str | int | None = None,
        rig: tuple[Rig, str] | None = None,
        **settings: Any,
    ) -> None:
        world = world_of(world)
        camera = None if camera is None else camera_of(world, camera)
        self.notices: list[Notice] = []
        """Notices for the user."""
        self._rig = rig
        if rig is not None:
            if camera is not None:
                raise SettingsError(
                    "rig and camera cannot be combined, because a video shows one camera; omit one of them",
                    code="conflicting_values",
                )
            if rig[1] not in rig[0]:
                raise CameraError(nearest("camera", rig[1], list(rig[0])), code="unknown_name")
            camera = rig[0][rig[1]]
        animations = world.animations
        if animation is not None or animations:
            animation = _number(animations, animation)
        if camera is None and world._first_camera is None:
            camera = framing_camera(world, moments=moments_of(world, animation))
        self.camera = world.default_camera() if camera is None else camera
        """The camera, before the video moves it."""
        if world.video is None and animation is None:
            world = with_orbit(world)
            message = "the world has no [video], so the camera orbits its centre for 4 seconds"
            self.notices.append(Notice(message, "default_video"))
        if settings.get("time_limit") or world.render_settings.get("time_limit"):
            message = (
                "time_limit: the number of samples per frame depends on the computer's speed; for reproducible "
                "videos, use samples"
            )
            self.notices.append(Notice(message, "varying_samples"))
        video = world.video
        self.fps = (FPS if video is None else video.fps) if fps is None else real("fps", fps, 0, above=True)
        """Frames per second."""
        # An animation whose keyframes are all at time 0 has a single frame.
        length = video.seconds if video else max(animations[animation or 0].duration, 1 / self.fps)
        follows = rig is None and bool(animations)
        self._animation, self._follows = animation, _name_of(world, self.camera) if follows else None
        self.seconds = length if seconds is None else real("seconds", seconds, 0, above=True)
        """The duration."""
        if self.fps * self.seconds > MAX_FRAMES:
            raise SettingsError(
                f"the video is too long: {self.seconds:g} s at {self.fps:g} frames per second; the limit is "
                f"{MAX_FRAMES} frames",
                code="too_large",
            )
        self._world, self._pace, self._settings = world, length / self.seconds, settings
        warn_all(self.notices)

    @property
    def transparent(self) -> bool:
        """True if the frames have an alpha channel."""
        return bool(self._settings.get("transparent_background"))

    def __repr__(self) -> str:
        """Frames, size and duration as text."""
        width, height = self.camera.size
        return (
            f"VideoPlan: {len(self)} frames of {width} x {height}, {self.fps:g} a second, {self.seconds:g} s"
        )

    def __len__(self) -> int:
        """The number of frames, at least 1."""
        return max(1, round(self.fps * self.seconds))

    def numbers(self, frames: tuple[int | None, int | None] | None) -> range:
        """The frame numbers of a slice (start, stop); None for all frames.

        Raises `SettingsError` for an empty range.
        """
        start, stop = frames or (None, None)
        found = range(len(self))[start:stop]
        if not found:
            part = f"{'' if start is None else start}:{'' if stop is None else stop}"
            raise SettingsError(
                f"frames {part} is empty; the video has frames 0 to {len(self) - 1}", code="out_of_range"
            )
        return found

    def time(self, number: int) -> float:
        """The time of frame `number` in the world, in seconds."""
        return number / self.fps * self._pace

    def frame(self, number: int, progress: Progress | None = None) -> Frame:
        """Renders frame `number`, from 0, with the channel `color`.

        Each frame has its own random numbers. `progress` is as in `raycam.render`.
        """
        number = whole("frame", number, 0, len(self) - 1)
        # The worlds of all frames share the acceleration structures built here.
        self._world.prepare(threads=self._settings.get("threads"))
        moment = self._world.at(self.time(number), self._animation)
        camera = self.camera
        if self._follows is not None:
            camera = _resized(moment.camera(self._follows), camera.size)
        if self._world.video is not None:
            camera = self._camera_at(camera, self.time(number))
        own: dict[str, Any] = {} if self._settings.get("integrator") == "reference" else {"frame": number}
        settings = self._settings if self._rig is None else with_camera_seed(self._settings, self._rig_index)
        return render(moment, camera, channels="color", progress=progress, **own, **settings)

    @property
    def _rig_index(self) -> int:
        """The index of the camera on its rig; 0 without a rig."""
        return 0 if self._rig is None else list(self._rig[0]).index(self._rig[1])

    def sample(
        self, number: int, sensors: Mapping[str, Sensor] | Rig | None = None
    ) -> dict[str, dict[str, npt.NDArray[Any]]]:
        """Samples sensors at the time of a frame; returns arrays by sensor and by name.

        `number` is the number of the frame, from 0. `sensors` are in world coordinates (default: `World.sensors` at
        that time). If `sensors` is a rig, the video moves the rig, and its `Rig.sensors` are sampled. The arrays
        include "world_from_sensor" and "times", as in `raycam.sensors.sample_sensor`.
        """
        number = whole("frame", number, 0, len(self) - 1)
        time = self.time(number)
        moment = self._world.at(time, self._animation)
        if sensors is None:
            sensors = moment.sensors
        if isinstance(sensors, Rig):
            rig = sensors if self._world.video is None else self._world.rig_at(sensors, time)
            sensors = rig.sensors
        threads = self._settings.get("threads")
        return {
            name: sample_sensor(require_sensor(name, sensor), moment, frame=number, threads=threads)
            for name, sensor in sensors.items()
        }

    def _camera_at(self, camera: Camera, time: float) -> Camera:
        """The camera, or the camera of the rig, as the video moves it, at a time in seconds."""
        if self._rig is None:
            return self._world.camera_at(camera, time)
        rig, name = self._rig
        return self._world.rig_at(rig, time)[name]

    def package(self) -> JobPackage:
        """The video as a job, with one PNG image per frame."""
        name = self._follows
        world = self._world
        if name is None:
            name = next(name for name in _names("film") if name not in world.cameras)
            world = world.with_cameras({name: self.camera})
        settings = {
            "camera": name,
            "animation": self._animation,
            "view": self.camera.P.tolist(),  # for readers of job.json: the camera itself is in the world
            "size": self.camera.size,
            "fps": self.fps,
            "seconds": self.seconds,
            "render": {key: value for key, value in self._settings.items() if key != "threads"},
        }
        if self._rig is not None:
            settings["rig"] = [self._rig[0].to_dict(), self._rig[1]]
        return JobPackage("video", len(self), settings, world)


def frame_maker(world: World, settings: Mapping[str, Any], threads: int | None) -> FrameMaker:
    """The frame maker of the kind "video": frame_0000.png and so on."""
    table, name = settings.get("rig", (None, ""))
    size = tuple(settings["size"])
    film = VideoPlan(
        world,
        _resized(world.camera(settings["camera"]), size) if table is None else None,
        rig=None if table is None else (Rig.from_dict(table, up=world.up), name),
        animation=settings["animation"],
        fps=settings["fps"],
        seconds=settings["seconds"],
        threads=None if settings["render"].get("integrator") == "reference" else threads,
        **settings["render"],
    )

    def make(number: int, progress: Progress | None) -> tuple[dict[str, bytes], list[Notice]]:
        frame = film.frame(number, progress)
        return {picture_name(number): frame.to_png()}, frame.notices

    return make


register("video", frame_maker)


def write_video(
    world: World | str | os.PathLike[str],
    path: str | os.PathLike[str],
    *,
    camera: Camera | str | os.PathLike[str] | None = None,
    frames: tuple[int | None, int | None] | None = None,
    fps: float | None = None,
    seconds: float | None = None,
    lossless: bool = False,
    audio: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    **settings: Any,
) -> VideoPlan:
    """Renders the video of a world to a file or to a folder of images.

    Files are .mp4, .mov, .mkv, .webm or .gif. Images are named frame_0000.png and so on.

    `lossless` keeps every bit of the images. `audio` is a file whose first audio track is added, cut or padded with
    silence to the length of the video. With `transparent_background=True`, frames have an opacity, which is stored in
    .mov, .mkv, .webm and PNG files.

    `frames` (start, stop) renders a part, as in a slice: `stop` is excluded, and either may be None, or negative to
    count from the end. `progress(done, total)` is called after every frame. Other arguments are as in `VideoPlan`,
    which is returned.

    The file appears only when it is complete: after an error or Ctrl-C, there is no file, but a folder keeps its
    images. The same call gives the same bytes.

    Raises, before anything is rendered, `SettingsError` for unknown endings and unsupported options, an MP4 of odd
    width or height, a GIF of more than 50 frames per second and an empty range, `FormatError` for `audio` without
    sound, and `OSError` if files cannot be read or written.
    """
    sound = None if audio is None else Path(audio)
    check_video(
        Path(path), lossless=lossless, alpha=bool(settings.get("transparent_background")), audio=sound
    )
    film = VideoPlan(world, camera, fps=fps, seconds=seconds, **settings)
    numbers = film.numbers(frames)
    shown = open_video(
        Path(path), film.camera.size, film.fps, lossless=lossless, alpha=film.transparent, audio=sound
    )

    def encode(number: int, frame: Frame) -> None:
        add(number, frame.to_srgba8() if film.transparent else frame.to_srgb8())

    with shown as add, _pipelined(encode) as hand_over:
        for done, number in enumerate(numbers):
            if progress is not None:
                progress(done, len(numbers))
            frame = film.frame(number)
            film.notices += [notice for notice in frame.notices if notice not in film.notices]
            hand_over(number, frame)
    if progress is not None:
        progress(len(numbers), len(numbers))
    return film


@contextmanager
def _pipelined(work: Callable[[int, Frame], None]) -> Iterator[Callable[[int, Frame], None]]:
    """Yields a function that runs `work` in a second thread, in order.

    Meanwhile, the next frame is rendered. Each call, and the end of the block, waits for the previous frame
    and raises its exception.
    """
    with ThreadPoolExecutor(1, "raycam-encode") as thread:
        last: Future[None] | None = None

        def hand_over(number: int, frame: Frame) -> None:
            nonlocal last
            if last is not None:
                last.result()
            last = thread.submit(work, number, frame)

        yield hand_over
        if last is not None:
            last.result()


def frame_range(text: str) -> tuple[int | None, int | None]:
    """Parses "A:B" as the `frames` of `write_video`; A, B or both may be missing."""
    start, colon, stop = text.partition(":")
    try:
        if not colon:
            raise ValueError
        return (int(start) if start.strip() else None), (int(stop) if stop.strip() else None)
    except ValueError:
        raise SettingsError(
            f"frames must be START:STOP, as in 0:24 or 24:, not {text!r}", code="invalid_value"
        ) from None


def with_orbit(world: World, target: Floats | None = None) -> World:
    """Returns a copy of the world with a video of a 4-second orbit.

    The copy shares the acceleration structures. The orbit's axis passes through the centre of the bounds `target` [2,
    3] (default: the world's bounds).
    """
    moving = world.at(0.0)
    bounds = world.bounds if target is None else target
    middle = [0.0, 0.0, 0.0] if bounds is None else bounds.mean(axis=0).tolist()
    moving.set_video(orbit={"target": middle})
    return moving


def _number(animations: list[Animation], wanted: str | int | None) -> int:
    """The index of an animation; raises `SettingsError` for an unknown name or number."""
    names = [animation.name for animation in animations]
    if isinstance(wanted, str) and wanted not in names and wanted.isdecimal():
        wanted = int(wanted)
    number = names.index(wanted) if isinstance(wanted, str) and wanted in names else wanted or 0
    if isinstance(number, str) or not 0 <= number < len(names):
        raise SettingsError(
            f"no animation {wanted!r}; available: {', '.join(map(repr, names)) or 'none'}",
            code="unknown_name",
        )
    return number


def _name_of(world: World, camera: Camera) -> str | None:
    """Returns the name of a camera in the world; None if the camera is not in the world.

    The camera in the world may have another image size.
    """
    for name, other in world.cameras.items():
        placed = np.array_equal(other.R, camera.R) and np.array_equal(other.location, camera.location)
        if placed and np.array_equal(_resized(other, camera.size).K, camera.K):
            return name
    return None


def _resized(camera: Camera, size: tuple[int, int]) -> Camera:
    return camera if camera.size == size else camera.resized(size)


def _names(name: str) -> Iterator[str]:
    """Yields the name, then name-2, name-3 and so on."""
    yield name
    yield from (f"{name}-{number}" for number in count(2))
