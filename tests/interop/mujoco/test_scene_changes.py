"""Differences between an `mjvScene` and its model."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
from raycam.interop.mujoco.model import GEOM_OBJECT
from raycam.interop.mujoco.scene_changes import GEOM_ARRAYS, GEOM_VALUES, SceneSnapshot


def test_geoms_of_mujoco_versions_without_texture_ids_are_compared() -> None:
    values = {name: 1 for name in GEOM_VALUES if name != "texid"} | {"objtype": GEOM_OBJECT}
    geom = SimpleNamespace(**values, **dict.fromkeys(GEOM_ARRAYS, np.zeros(3)))
    moved = SimpleNamespace(**values, **dict.fromkeys(GEOM_ARRAYS, np.ones(3)))
    snapshot = SceneSnapshot([geom], [])
    assert snapshot.changes([geom], []).geoms == []
    assert snapshot.changes([moved], []).removed == {(GEOM_OBJECT, 1)}
