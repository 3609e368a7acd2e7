"""Several cameras at once: up to four images next to each other.

Each image has its own refinement.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..stills import SAMPLED
from .images import Images
from .view import View

__all__ = ["Pane", "update_panes"]


class Pane:
    """One of several images: a camera of the session's world, in the session's channel and look."""

    def __init__(self, name: str, view: View, samples: int | None, threads: int | None) -> None:
        self.name = name
        """The camera's name; empty for the camera of the main view."""
        self.view = view
        self.images = Images(samples, threads)
        self.images.restart()

    def show(self, view: View) -> None:
        """Shows another view of the camera.

        The camera's image is rendered or sent again only if necessary.
        """
        before, self.view = self.view, view
        if not view.renders_like(before):
            self.images.restart()
        elif (view.exposure, view.transform) != (before.exposure, before.transform):
            self.images.show_again()

    @property
    def is_due(self) -> bool:
        """True if an image is to be rendered or sent."""
        if self.view.channel not in SAMPLED:
            return not self.images.is_shown(self.view.channel)
        return self.is_still_due or self.samples < self.images.samples_of(self.view)

    @property
    def is_still_due(self) -> bool:
        """True if the image must be sent again, because the channel or the exposure has changed."""
        return self.images.still is not None and not self.images.is_shown(self.view.channel)

    @property
    def samples(self) -> int:
        """The samples per pixel so far."""
        progress = self.images.progress
        return 0 if progress is None else progress.samples


def update_panes(
    panes: Sequence[Pane], names: Sequence[str], view: View, samples: int | None, threads: int | None
) -> tuple[Pane, ...]:
    """Returns the panes of `names` for a session's view.

    Earlier panes of the same cameras keep their samples.

    Each pane has half the width and half the height of the view's space. Names of cameras that the world no longer
    has are dropped.
    """
    half = (max(1, view.space[0] // 2), max(1, view.space[1] // 2))
    kept = {pane.name: pane for pane in panes}
    updated = []
    for name in dict.fromkeys(names):
        if name and name not in view.base.cameras:
            continue
        shown = (view.through(name) if name else view).with_space(half)
        if name in kept:
            kept[name].show(shown)
        else:
            kept[name] = Pane(name, shown, samples, threads)
        updated.append(kept[name])
    for pane in panes:
        if pane not in updated:
            pane.images.cancel.cancel()
    return tuple(updated)
