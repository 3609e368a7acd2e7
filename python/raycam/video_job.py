"""Former name of `raycam.video.job`, kept for one release."""

from __future__ import annotations

from .video.job import job_folder, make_video

__all__ = ["job_folder", "make_video"]
