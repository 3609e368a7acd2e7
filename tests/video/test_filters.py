"""FFmpeg's filters."""

from fractions import Fraction

import numpy as np
import pytest
from raycam.video.filters import Filters, as_rate


@pytest.mark.parametrize(("components", "format"), [(3, "rgb24"), (4, "rgba")])
def test_identity_filter_returns_the_images(components, format):
    pictures = [np.full((6, 8, components), 40 * i, np.uint8) for i in range(3)]
    same = Filters(Fraction(10), [(format, (8, 6))], [("null", "")])
    out = [frame for picture in pictures for frame in same.push(picture)] + same.finish()
    assert [float(frame.pts * frame.time_base) for frame in out] == pytest.approx([0, 0.1, 0.2])
    np.testing.assert_array_equal([frame.to_ndarray(format=format) for frame in out], pictures)


def test_frame_rates_are_converted_to_fractions():
    assert as_rate(24) == 24
    assert as_rate(23.976) == Fraction(2997, 125)
    assert as_rate(30000 / 1001) == Fraction(30000, 1001)
