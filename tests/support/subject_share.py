"""The share of an image that shows its subject.

The subject is all objects except the ground, or the pixels that differ from the border.
"""

from __future__ import annotations

import functools
import os
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from PIL import Image
from raycam.world.framing import without_ground

MIN_SHARE = 0.05
"""Minimum share of an image's pixels that show its subject."""
WIDTH = 96
"""Width in pixels of the ground truth that is counted."""


def subject_share(world: Any, camera: raycam.Camera) -> float:
    """The share of a camera's pixels that show an object, without the ground that may hide it."""
    if isinstance(world, str | os.PathLike):
        world = raycam.load(world)
    width, height = camera.size
    scale = min(1.0, WIDTH / width)
    small = camera.resized((max(1, round(width * scale)), max(1, round(height * scale))))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", raycam.Notice)
        truth = _render(without_ground(world), small, channels=["instance"])
    return float((truth["instance"] >= 0).mean())


def border_share(picture: Path) -> float:
    """The share of pixels whose colour differs from the border's colour by more than 5 %.

    The border's colour is that of most pixels of the image's border.
    """
    with Image.open(picture) as image:
        pixels = np.asarray(image.convert("RGBA").convert("RGB"), np.int16)
    border = np.concatenate([pixels[0], pixels[-1], pixels[:, 0], pixels[:, -1]])
    colors, counts = np.unique(border // 8, axis=0, return_counts=True)
    main = colors[counts.argmax()] * 8 + 4
    return float((np.abs(pixels - main).max(axis=2) > 13).mean())


class SavedPictures:
    """Records the subject's share in each frame that a page renders and saves."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.shares: dict[str, float] = {}
        """The subject's share by the saved file's name."""
        self._rendered: dict[int, tuple[raycam.Frame, float]] = {}
        save = raycam.Frame.save

        @functools.wraps(_render)
        def render(world: Any, *arguments: Any, **options: Any) -> raycam.Frame:
            frame = _render(world, *arguments, **options)
            if frame.camera is not None and "region" not in options:
                self._rendered[id(frame)] = (frame, subject_share(world, frame.camera))
            return frame

        @functools.wraps(save)
        def save_and_record(frame: raycam.Frame, path: Any, **options: Any) -> None:
            save(frame, path, **options)
            if id(frame) in self._rendered:
                self.shares[Path(path).name] = self._rendered[id(frame)][1]

        monkeypatch.setattr(raycam, "render", render)
        monkeypatch.setattr(raycam.Frame, "save", save_and_record)

    def share_of(self, frame: object) -> float | None:
        """The subject's share in a frame that `raycam.render` has returned; None for other objects."""
        return self._rendered[id(frame)][1] if id(frame) in self._rendered else None


_render = raycam.render
