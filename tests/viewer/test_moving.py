"""Images in motion, and the preparation of a world."""

from __future__ import annotations

import pytest
import raycam
from raycam.viewer.moving import moving_frame, prepare
from raycam.viewer.session import Pace, Session


@pytest.mark.parametrize("channel", ["color", "depth", "error"])
def test_moving_frame_has_the_channel_in_the_given_size(small_world: raycam.World, channel: str) -> None:
    session = Session(small_world, small_world.camera("front"), start={"channel": channel})
    frame = moving_frame(session.view, (24, 16))
    assert frame.size == (24, 16)
    assert list(frame) == [channel]


def test_prepare_measures_the_render_time_per_pixel(small_world: raycam.World) -> None:
    session = Session(small_world, small_world.camera("front"))
    pace = Pace()
    prepare(session.view, pace, None, raycam.Cancel())
    assert pace.size((24, 16)) == (24, 16)  # without measurements, the size would be half
    assert pace.size((48000, 32000)) == (12000, 8000)


def test_cancelled_preparation_raises(small_world: raycam.World) -> None:
    session = Session(small_world, small_world.camera("front"))
    cancel = raycam.Cancel()
    cancel.cancel()
    with pytest.raises(raycam.Cancelled):
        prepare(session.view, Pace(), None, cancel)
