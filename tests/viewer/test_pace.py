"""The size of images while the camera moves."""

from __future__ import annotations

import pytest
from raycam.viewer.session.pace import MAX_BYTES, SLOW_S, TARGET, Pace

STILL = (640, 480)


@pytest.mark.parametrize(
    ("share", "size"),
    [(0.5, STILL), (1.0, STILL), (2.0, (320, 240)), (4.0, (320, 240)), (5.0, (160, 120)), (1e6, (160, 120))],
)
def test_largest_size_within_the_target_time_is_used(share: float, size: tuple[int, int]) -> None:
    pace = Pace()
    pace.measured(STILL, share * TARGET)
    assert pace.size(STILL) == size


def test_first_moving_image_has_half_the_width_and_height_of_still_images() -> None:
    assert Pace().size(STILL) == (320, 240)
    assert Pace().size((1, 1)) == (1, 1)


def test_size_recovers_after_one_slow_image() -> None:
    pace = Pace()
    pace.measured(STILL, 100 * TARGET)
    for _ in range(20):
        pace.measured((160, 120), 0.1 * TARGET / 16)
    assert pace.size(STILL) == STILL


def test_new_view_can_start_with_the_measurements_of_another_view() -> None:
    first, second = Pace(), Pace()
    first.measured(STILL, 100 * TARGET)
    second.begin_like(first)
    assert second.size(STILL) == (160, 120)
    second.measured(STILL, 0.0)
    assert first.size(STILL) == (160, 120)


def test_slow_images_settle_in_half_size_before_full_size() -> None:
    pace = Pace()
    pace.measured(STILL, 2 * SLOW_S)
    assert pace.settling_size(STILL, (160, 120), reaches_full=True) == (320, 240)
    assert pace.settling_size(STILL, (160, 120), reaches_full=False) == (320, 240)
    assert pace.settling_size(STILL, (320, 240), reaches_full=True) == STILL
    assert pace.settling_size(STILL, (320, 240), reaches_full=False) is None
    assert pace.settling_size(STILL, STILL, reaches_full=True) is None


def test_fast_images_settle_in_full_size_at_once() -> None:
    pace = Pace()
    pace.measured(STILL, 0.5 * SLOW_S)
    assert pace.settling_size(STILL, (160, 120), reaches_full=True) == STILL
    assert pace.settling_size(STILL, (160, 120), reaches_full=False) is None


def test_images_with_many_bytes_are_smaller() -> None:
    pace = Pace()
    pace.measured(STILL, 0.1 * TARGET, 3 * MAX_BYTES, "depth")
    assert pace.size(STILL, "depth") == (320, 240)
    assert pace.size(STILL, "color") == STILL
