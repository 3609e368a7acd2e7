"""Live pages: the client, a world, and raycam compiled for WebAssembly, in one file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ... import _core
from ...errors import SettingsError
from ..files.uploads import file_types
from .core import core_blocks, packed
from .document import assembled, json_text, still_image

if TYPE_CHECKING:
    from ...render.frame import Frame
    from ...world import World

__all__ = ["lecture_page", "live_page", "playground_page"]

CAMERA = "page"
"""The name of the frame's camera in the world of a page."""
NOT_IN_PAGES = ("shadow", "error")
"""The channels that a live page does not render."""
SCRIPTS, WORKERS = " 'wasm-unsafe-eval'", "worker-src blob:; "


def live_page(
    frame: Frame,
    world: World | None,
    unused: Mapping[str, Any],
    *,
    exposure: float | None,
    view: str | None,
    title: str | None,
    channel: str | None,
) -> str:
    """Returns the HTML text of a page that shows `world` with the camera of `frame`.

    Raises `SettingsError` without a world or a camera, and for options that a live page does not support.
    """
    from ...arguments import one_of
    from ...render.frame import CHANNELS, PASSES, VIEWS
    from ...render.options import check_option

    for name, value in unused.items():
        if value is not None and value is not False and value != ():
            raise SettingsError(
                f"{name} cannot be combined with live; a live page renders its own values",
                code="conflicting_values",
            )
    if world is None or frame.camera is None:
        raise SettingsError(
            "live requires a frame with a camera, and the world: save(path, world=world, live=True)",
            code="missing_value",
        )
    names = [name for name, each in world.cameras.items() if each == frame.camera]
    carried = world.copy()
    if not names:
        taken = set(world.cameras)
        carried.add_camera(frame.camera, CAMERA)
        names = [*set(carried.cameras) - taken]
    name = names[0]
    width, height = frame.size
    options = {
        "title": title or f"raycam {width} x {height}",
        "camera": name,
        "exposure": check_option("exposure", frame.exposure if exposure is None else exposure),
        "view": one_of("view", frame.view if view is None else view, VIEWS),
        "channel": one_of(
            "channel", channel or "color", [name for name in CHANNELS if name not in (*NOT_IN_PAGES, *PASSES)]
        ),
    }
    world_text = packed(bytes(_core.world_to_bytes(carried._core)))
    blocks = [
        still_image(frame, exposure, view, title),
        *core_blocks(),
        f'<script type="text/plain" id="core-world">{world_text}</script>',
        f'<script type="application/json" id="core-options">{json_text(options)}</script>',
    ]
    return assembled(str(options["title"]), blocks, SCRIPTS, WORKERS)


def playground_page(examples: Mapping[str, str]) -> str:
    """Returns the HTML text of the playground, which first shows the first example.

    `examples` are the texts of world files by name.
    """
    listed = [{"name": name, "text": text} for name, text in examples.items()]
    options = json_text({"playground": listed, "types": file_types()})
    blocks = [*core_blocks(), f'<script type="application/json" id="core-options">{options}</script>']
    return assembled("raycam playground", blocks, SCRIPTS, WORKERS)


def lecture_page() -> str:
    """Returns the HTML text of the interactive lecture.

    The page contains a rotatable world, each step of the calculation with its numbers, and exercises.
    """
    return assembled("Making Virtual Worlds", core_blocks(), SCRIPTS, WORKERS, "lecture/")
