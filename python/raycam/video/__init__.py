"""Videos of a moving world, written to a video file or a folder of PNG images."""

from .video import VideoPlan, frame_range, with_orbit, write_video

__all__ = ["VideoPlan", "frame_range", "with_orbit", "write_video"]
