"""Snapshots of a live view, as bytes for the browser to save."""

from __future__ import annotations

import time

from ...errors import Notice, SettingsError
from ...render.frame import Frame
from ...world.gltf_robots import gltf_bytes
from ..page import page
from ..scene.world_file import world_file
from ..session import Session, View
from ..stills import shares, truth
from .film import filmed

__all__ = ["film", "snapshot"]

MEDIA = {
    "png": "image/png",
    "html": "text/html",
    "npz": "application/octet-stream",
    "glb": "model/gltf-binary",
    "toml": "application/toml",
}


SAMPLES_TIMEOUT_S = 15.0
"""Seconds for which a snapshot waits for the first samples of a view that was just changed."""
STILL_INTERVAL_S = 0.05


def snapshot(session: Session, format: str) -> tuple[str, str, bytes]:
    """Returns name, media type and bytes of the still image or the world, in a format.

    The formats "glb" and "toml" contain the world, other formats the still image. Raises `SettingsError` if the image
    has no samples yet.
    """
    view = session.view
    title = view.opened.title
    if format == "glb":
        data, notices = gltf_bytes(view.base)
        for notice in notices:
            session.notify(str(notice))
        return f"{_stem(title)}.glb", MEDIA[format], data
    if format == "toml":
        text = world_file(view.opened.source, view.opened.edits.opened, view.base, view.camera)
        return f"{_stem(title)}_changed.toml", MEDIA[format], text.encode()
    view, still = _first_still(session)
    channels = dict(still)
    if format != "png":
        if "alpha" not in channels:
            channels |= dict(shares(view.world, view.still_camera))
        channels |= dict(truth(view.world, view.still_camera))
    frame = Frame(
        channels,
        camera=view.still_camera,
        size=still.size,
        exposure=view.exposure,
        view=view.transform,
        notices=[*still.notices, Notice(f"light: {view.integrator}", "preview_light")],
    )
    if format == "png":
        data = frame.to_png()
    elif format == "npz":
        data = frame._npz()
    else:
        data = page(frame, world=view.world, title=title).encode()
    return f"{_stem(title)}.{format}", MEDIA[format], data


def _first_still(session: Session) -> tuple[View, Frame]:
    """Returns the view and its still image, after waiting for the first samples.

    Raises `SettingsError` if the image has no samples.
    """
    deadline = time.monotonic() + SAMPLES_TIMEOUT_S
    while True:
        with session.lock:
            view, still = session.view, session.images.still
        if still is not None:
            return view, still
        if time.monotonic() > deadline:
            raise SettingsError(
                "the image has no samples yet; save the image after the camera has stopped", code="no_samples"
            )
        time.sleep(STILL_INTERVAL_S)


def film(session: Session, seconds: float, degrees: float) -> tuple[str, str, bytes]:
    """Name, media type and bytes of a video whose camera turns by `degrees` around the pivot.

    For 0 degrees, the video shows the world's motion.
    """

    def report(done: int, total: int) -> None:
        session.connection.send({"type": "filming", "done": done, "total": total})

    try:
        ending, media, data = filmed(session, seconds, degrees, report)
    finally:
        report(0, 0)
    kind = "turntable" if degrees else "animation"
    return f"{_stem(session.view.opened.title)}_{kind}{ending}", media, data


def _stem(title: str) -> str:
    """A title converted to a file name."""
    kept = "".join(letter if letter.isalnum() or letter in "._-" else "_" for letter in title)
    return kept.lstrip("._-").rsplit(".", 1)[0][:60] or "raycam"
