"""Texts for the client's `Copy` message.

A text is the camera, or the command that renders the still image.
"""

from __future__ import annotations

import os
from collections.abc import Callable

import numpy as np

from ...camera import Camera
from ...render import lacks_surroundings
from ..scene.copies import FILES, camera_table, camera_text, render_command
from ..scene.look import SKY_IMAGE
from .view import View

__all__ = ["copied"]


def copied(view: View, format: str, samples: int, notify: Callable[[str], None]) -> str:
    """The view's camera as text with all digits, or its `raycam render` command.

    `notify` receives notices about omissions. Raises `FormatError` if the format does not support the camera.
    """
    if format == "command":
        return _command(view, samples, notify)
    if format in FILES:
        text, notices = camera_text(view.camera, format)
        for notice in notices:
            notify(str(notice))
        return text
    if format == "python":
        return f"camera = raycam.Camera.from_dict({view.camera.to_dict()!r}, up={view.camera.up!r})"
    return camera_table(view.camera)


def _command(view: View, samples: int, notify: Callable[[str], None]) -> str:
    """Returns the command that renders the still image.

    The command contains the camera's name, or first writes a calibration file for the camera.
    """
    opened = view.opened
    if view.base is not opened.edits.opened:
        notify(
            "The command renders the file without your edits. To include them, save the world as TOML or GLB and "
            "render that file."
        )
    if opened.source is None:
        notify(
            "This world was not loaded from a file: save it as TOML or GLB, and replace the first word after "
            "render with the name of that file."
        )
    settings = view.base.render_settings
    name = "" if view.camera_name in opened.added else view.camera_name
    width, height = view.size
    options = {
        "size": f"{width}x{height}",
        "integrator": view.integrator,
        "samples": samples,
        "at": view.time if view.seconds > 0 else None,
        "animation": view.animation or None,
        "variant": view.variant or None,
        "up": None if view.base.up == opened.edits.file_up else view.base.up,
        "exposure": view.exposure if view.exposure != settings.get("exposure", 0.0) else None,
        "view": view.transform if view.transform != settings.get("view", "standard") else None,
        **_look_options(view, notify),
    }
    camera: Camera | str | None = name or _camera_at_start(view, notify)
    if view.shape == "home":
        camera = None
        options |= {
            "view-from" if key == "direction" else key: value for key, value in opened.framing.items()
        }
    return render_command(opened.source or opened.title, camera, options)


def _look_options(view: View, notify: Callable[[str], None]) -> dict[str, object]:
    """The options of `raycam render` for the look of a view."""
    look = view.look

    def file_of(path: str | None) -> str | None:
        return os.path.basename(path) if path in look.uploaded else path

    options: dict[str, object] = {"background": file_of(look.background), **view.render_options}
    if look.light == "own" and view.shape == "home" and view.opened.is_model:
        options["no-studio"] = lacks_surroundings(view.base, {}) or None
    if look.light == "studio" and view.shape != "home":
        options["studio"] = True
        notify(
            "The command arranges the studio's lights around this camera; the view keeps them where they are."
        )
    if look.light == "room" and not (view.shape == "home" and view.opened.is_model):
        notify("The command does not add the studio's room: it renders only the lights of the file.")
    if look.light == "sun":
        options["sun"] = look.sun
    if look.light == "sky":
        options |= {"hdri": file_of(look.image) or SKY_IMAGE, "hdri-rotation": look.rotation or None}
    if look.ground not in ("auto", "none"):
        options["ground"] = True if look.ground == "plain" else look.ground
    return {key.replace("_", "-"): value for key, value in options.items()}


def _camera_at_start(view: View, notify: Callable[[str], None]) -> Camera:
    """The free camera without the video's motion, because `raycam render --at` adds the motion."""
    if view.base.video is None:
        return view.camera
    before = view.base.camera_at(view.camera, -view.time)
    if not np.allclose(view.base.camera_at(before, view.time).P, view.camera.P, rtol=1e-9, atol=1e-9):
        notify(
            f"The video moves its camera: the command renders the view of the video's camera at {view.time:.6g} s."
        )
    return before
