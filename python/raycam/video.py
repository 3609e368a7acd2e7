"""Videos: a world through time, frame by frame, into an MP4, a GIF or a folder of PNG pictures."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .arrays import whole
from .camera import Camera
from .errors import SettingsError, WorldError
from .frame import Frame
from .render import render
from .video_files import open_video
from .world import World

__all__ = ["Film", "write_video"]

DEFAULT_VIDEO = {"fps": 24.0, "seconds": 4.0}


class Film:
    """The frames of a video, each rendered when it is asked for.

    `world` moves as its `[video]` says; one without gets an orbit of 4 seconds around its middle, and `notices` says
    so. `camera` (default: the world's first, or one that frames everything) is moved where the video moves cameras.
    `fps` replaces the world's, and `seconds` plays the same motion faster or slower. `settings` are those of
    `raycam.render`: integrator, samples, filter, seed, ambient_occlusion, exposure, threads.

    What does not move is built once, before the first frame.
    """

    def __init__(
        self,
        world: World,
        camera: Camera | None = None,
        *,
        fps: float | None = None,
        seconds: float | None = None,
        **settings: Any,
    ) -> None:
        self.notices: list[str] = []
        """What the one who looks at it should know."""
        if world.video is None:
            world = with_orbit(world)
            self.notices.append("the world has no [video]: the camera orbits its middle in 4 seconds")
        video = world.video
        assert video is not None  # with_orbit gives it one
        self._world = world
        self.camera = world.default_camera() if camera is None else camera
        """The camera that moves."""
        self.fps = _positive("fps", fps, video.fps)
        """Frames per second."""
        self.seconds = _positive("seconds", seconds, video.seconds)
        """Its length."""
        self._pace = video.seconds / self.seconds
        self._settings = settings

    def __len__(self) -> int:
        """How many frames it has, at least one."""
        return max(1, round(self.fps * self.seconds))

    def time(self, number: int) -> float:
        """The time of a frame in the world, in seconds."""
        return number / self.fps * self._pace

    def frame(self, number: int) -> Frame:
        """The frame of that number, from 0; its random numbers differ from frame to frame."""
        number = whole("frame", number, 0, len(self) - 1)
        time = self.time(number)
        self._world.prepare(threads=self._settings.get("threads"))
        camera = self._world.camera_at(self.camera, time)
        return render(self._world.at(time), camera, frame=number, channels="color", **self._settings)
