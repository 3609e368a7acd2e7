"""Tracks of points in images, compared with a matrix in memory."""

from __future__ import annotations

import io

import numpy as np
import pytest
from raycam.dataset import colmap_tracks
from raycam.dataset.colmap_tracks import Tracks


@pytest.mark.parametrize("points", [1, 8, 65, 1000])
@pytest.mark.parametrize("pictures", [1, 300])
@pytest.mark.parametrize("cells", [1, 1 << 12, 1 << 16])
def test_tracks_equal_the_columns_of_the_observation_matrix(
    points: int, pictures: int, cells: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(colmap_tracks, "CELLS", cells)
    monkeypatch.setattr(colmap_tracks, "PART", cells)
    visible = np.random.default_rng(points).random((pictures, points)) < 0.3
    tracks = Tracks(points, io.BytesIO())
    for row in visible:
        tracks.add(row)
    found = list(tracks)
    assert len(found) == points
    places = visible.cumsum(axis=1) - 1
    for point, (which, place) in enumerate(found):
        np.testing.assert_array_equal(which, np.flatnonzero(visible[:, point]))
        np.testing.assert_array_equal(place, places[which, point])
