"""Videos: a world through time, frame by frame, into a video file or a folder of PNG pictures."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import whole
from ..camera import Camera
from ..errors import CameraError, SettingsError, nearest
from ..jobs.job_package import JobPackage
from ..jobs.kinds import FrameMaker, register
from ..render import render
from ..render.frame import Frame
from ..rig import Rig
from ..world import Animation, World
from .files import check_video, open_video, picture_name

__all__ = ["VideoPlan", "write_video"]

Progress = Callable[[int, int], object]
MAX_FRAMES = 1_000_000
FPS = 24.0


class VideoPlan:
    """The frames of a video, each rendered when it is asked for.

    `world` moves as its `[video]` says; one without shows its `animation`, a name or number (the first where not
    given), from beginning to end; one without either gets an orbit of 4 seconds around its middle, and `notices` says
    so. `camera` (default: the world's first, or one that frames everything) is moved where the video moves the
    camera; a camera of the world moves with its animation. Instead of it, `rig`, a rig and the name of one of its
    cameras, shows what that one sees while the video moves the rig, as `World.rig_at` says. `fps` replaces the
    world's frames per second (24), `seconds` plays the same motion faster or slower. `settings` are those of
    `raycam.render`: integrator, samples, filter, seed, ambient_occlusion, exposure, transparent, threads.

    What does not move is built once, before the first frame.

    Raises `SettingsError` where `fps` or `seconds` is not a positive number or they make too many frames, and
    `CameraError` where the world has no camera and nothing to frame.
    """

    def __init__(
        self,
        world: World,
        camera: Camera | None = None,
        *,
        fps: float | None = None,
        seconds: float | None = None,
        animation: str | int | None = None,
        rig: tuple[Rig, str] | None = None,
        **settings: Any,
    ) -> None:
        self.notices: list[str] = []
        """What the one who looks at it should know."""
        self._rig = rig
        if rig is not None:
            if camera is not None:
                raise SettingsError("a rig and a camera: a film shows what one camera sees")
            if rig[1] not in rig[0]:
                raise CameraError(nearest("camera", rig[1], list(rig[0])))
            camera = rig[0][rig[1]]
        self.camera = world.default_camera() if camera is None else camera
        """The camera that moves."""
        animations = world.animations
        if animation is not None or animations:
            animation = _number(animations, animation)
        if world.video is None and animation is None:
            world = with_orbit(world)
            self.notices.append("the world has no [video], so the camera orbits its middle in 4 seconds")
        if settings.get("time") or world.render_settings.get("time"):
            self.notices.append(
                "time: how well a frame is sampled depends on the machine, and differs from run to run"
            )
        video = world.video
        self.fps = (FPS if video is None else video.fps) if fps is None else _positive("fps", fps)
        """Frames per second."""
        # An animation whose keyframes are all at 0 has one moment.
        length = video.seconds if video else max(animations[animation or 0].duration, 1 / self.fps)
        follows = rig is None and bool(animations)
        self._animation, self._follows = animation, _name_of(world, self.camera) if follows else None
        self.seconds = length if seconds is None else _positive("seconds", seconds)
        """Its length."""
        if self.fps * self.seconds > MAX_FRAMES:
            raise SettingsError(
                f"{self.seconds:g} seconds at {self.fps:g} frames a second are more than {MAX_FRAMES} frames"
            )
        self._world, self._pace, self._settings = world, length / self.seconds, settings

    @property
    def transparent(self) -> bool:
        """Whether its frames have an opacity."""
        return bool(self._settings.get("transparent"))

    def __len__(self) -> int:
        """How many frames it has, at least one."""
        return max(1, round(self.fps * self.seconds))

    def numbers(self, frames: tuple[int | None, int | None] | None) -> range:
        """The numbers of a part of its frames, counted as in a slice; None for all.

        Raises `SettingsError` where there are none.
        """
        start, stop = frames or (None, None)
        found = range(len(self))[start:stop]
        if not found:
            part = f"{'' if start is None else start}:{'' if stop is None else stop}"
            raise SettingsError(
                f"frames {part} are none: the video has {len(self)}, from 0 to {len(self) - 1}"
            )
        return found

    def time(self, number: int) -> float:
        """When in the world's own time frame `number` is, in seconds."""
        return number / self.fps * self._pace

    def frame(self, number: int, progress: Progress | None = None) -> Frame:
        """Frame `number`, from 0, with the channel `color`; its random numbers are its own.

        `progress` is that of `raycam.render`.
        """
        number = whole("frame", number, 0, len(self) - 1)
        # Every moment shares what has been built of the world by now.
        self._world.prepare(threads=self._settings.get("threads"))
        moment = self._world.at(self.time(number), self._animation)
        camera = self.camera
        if self._follows is not None:
            camera = _resized(moment.camera(self._follows), camera.size)
        if self._world.video is not None:
            camera = self._camera_at(camera, self.time(number))
        own: dict[str, Any] = {} if self._settings.get("integrator") == "reference" else {"frame": number}
        return render(moment, camera, channels="color", progress=progress, **own, **self._settings)

    def _camera_at(self, camera: Camera, time: float) -> Camera:
        """The camera, or the one of the rig, where the video has it at a time."""
        if self._rig is None:
            return self._world.camera_at(camera, time)
        rig, name = self._rig
        return self._world.rig_at(rig, time)[name]

    def package(self) -> JobPackage:
        """The film as a job, one PNG picture a frame."""
        name = self._follows
        world = self._world
        if name is None:
            name = next(name for name in _names("film") if name not in world.cameras)
            world = world.with_cameras({name: self.camera})
        settings = {
            "camera": name,
            "animation": self._animation,
            "view": self.camera.P.tolist(),  # for people: the camera itself is with the world
            "size": self.camera.size,
            "fps": self.fps,
            "seconds": self.seconds,
            "render": {key: value for key, value in self._settings.items() if key != "threads"},
        }
        if self._rig is not None:
            settings["rig"] = [self._rig[0].to_dict(), self._rig[1]]
        return JobPackage("video", len(self), settings, world)


def frame_maker(world: World, settings: Mapping[str, Any], threads: int | None) -> FrameMaker:
    """What a worker does for a job of kind "video": frame_0000.png and so on."""
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

    def make(number: int, progress: Progress | None) -> tuple[dict[str, bytes], list[str]]:
        frame = film.frame(number, progress)
        return {picture_name(number): frame.to_png()}, frame.notices

    return make


register("video", frame_maker)


def write_video(
    world: World,
    path: str | os.PathLike[str],
    *,
    camera: Camera | None = None,
    frames: tuple[int | None, int | None] | None = None,
    fps: float | None = None,
    seconds: float | None = None,
    lossless: bool = False,
    audio: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    **settings: Any,
) -> VideoPlan:
    """Renders the video of a world into a file (.mp4 .mov .mkv .webm .gif), or a folder as frame_0000.png and so on.

    `lossless` keeps every bit of the pictures. `audio` is a file whose first track of sound goes along, cut off or
    followed by silence where it is not as long. With `transparent=True` frames have an opacity, which .mov, .mkv, .webm
    and PNG pictures keep.

    `frames` (start, stop) renders a part, from `start` up to but not `stop`; either may be None, or negative
    to count from the end, as in a slice. `progress(done, total)` is called after every frame. The rest is as
    in `VideoPlan`, which is returned.

    A file has its name when it is complete: an error or Ctrl-C leaves none behind, and a folder keeps the
    pictures it has. The same call gives the same bytes.

    Raises `SettingsError` for unknown endings and what they do not have, an MP4 of odd width or height, a GIF of
    more than 50 frames a second and a range without frames, `FormatError` for `audio` without sound, and `OSError`
    where nothing can be read or written: all before anything is rendered.
    """
    sound = None if audio is None else Path(audio)
    check_video(Path(path), lossless=lossless, alpha=bool(settings.get("transparent")), audio=sound)
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
    """A function that has `work` done in order by a thread of its own while the next frame is rendered.

    It waits for the frame before, and raises what that has raised; so does the end of the block.
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
    """The `frames` of `write_video` from "A:B", where A, B or both may be missing."""
    start, colon, stop = text.partition(":")
    try:
        if not colon:
            raise ValueError
        return (int(start) if start.strip() else None), (int(stop) if stop.strip() else None)
    except ValueError:
        raise SettingsError(f"frames must be START:STOP, as in 0:24 or 24:, not {text!r}") from None


def with_orbit(world: World) -> World:
    """The world with a video: once around its middle in 4 seconds. Shares what is built."""
    moving = world.at(0.0)
    bounds = world.bounds
    middle = [0.0, 0.0, 0.0] if bounds is None else bounds.mean(axis=0).tolist()
    moving.set_video(orbit={"target": middle})
    return moving


def _number(animations: list[Animation], wanted: str | int | None) -> int:
    """The number of an animation; raises `SettingsError` where there is none of that name or number."""
    names = [animation.name for animation in animations]
    if isinstance(wanted, str) and wanted not in names and wanted.isdecimal():
        wanted = int(wanted)
    number = names.index(wanted) if isinstance(wanted, str) and wanted in names else wanted or 0
    if isinstance(number, str) or not 0 <= number < len(names):
        raise SettingsError(f"no animation {wanted!r}; there are {', '.join(map(repr, names)) or 'none'}")
    return number


def _name_of(world: World, camera: Camera) -> str | None:
    """The name of a camera of the world, in this size or another."""
    for name, other in world.cameras.items():
        placed = np.array_equal(other.R, camera.R) and np.array_equal(other.location, camera.location)
        if placed and np.array_equal(_resized(other, camera.size).K, camera.K):
            return name
    return None


def _resized(camera: Camera, size: tuple[int, int]) -> Camera:
    return camera if camera.size == size else camera.resized(size)


def _names(name: str) -> Iterator[str]:
    """The name, and more like it."""
    yield name
    yield from (f"{name}-{number}" for number in count(2))


def _positive(name: str, value: float) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < math.inf:
        raise SettingsError(f"{name} must be a number greater than 0, not {value!r}")
    return float(value)


Film = VideoPlan
"""Former name of `VideoPlan`, kept for one release."""
