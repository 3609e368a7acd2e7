"""The selected object, its material, and drags as steps of undo."""

from __future__ import annotations

import numpy as np
import raycam
from raycam.viewer.client_messages import Gizmo
from raycam.viewer.scene.edits import Edits
from raycam.viewer.scene.selection import Selection


def said(stroke: int, end: list[float], handle: str = "all") -> Gizmo:
    return Gizmo(handle, stroke, [24.0, 16.0], end)


def test_drag_is_one_step_of_undo(small_world: raycam.World) -> None:
    edits = Edits(small_world)
    selection, camera = Selection(edits), small_world.camera("front")
    selection.choose(0, "move")
    first = np.array(small_world.objects[0].matrix)
    for step in range(1, 6):
        selection.drag(camera, said(1, [24.0 + step, 16.0]), "a")
    moved = np.array(edits.world.objects[0].matrix)
    assert not np.allclose(moved, first)
    selection.drag(camera, said(2, [20.0, 16.0]), "a")
    edits.undo()
    assert np.array_equal(edits.world.objects[0].matrix, moved)
    edits.undo()
    assert np.array_equal(edits.world.objects[0].matrix, first)
    assert edits.about()["undo"] == 0
    edits.redo()
    assert np.array_equal(edits.world.objects[0].matrix, moved)


def test_drag_result_does_not_depend_on_its_steps(small_world: raycam.World) -> None:
    camera = small_world.camera("front")
    found = []
    for ends in ([[30.0, 12.0]], [[26.0, 17.0], [40.0, 2.0], [30.0, 12.0]]):
        edits = Edits(small_world)
        selection = Selection(edits)
        selection.choose(0, "turn")
        for end in ends:
            selection.drag(camera, said(1, end, "z"), "a")
        found.append(np.array(edits.world.objects[0].matrix))
    assert np.array_equal(*found)


def test_removed_selection_has_no_handles(small_world: raycam.World) -> None:
    selection, camera = Selection(Edits(small_world)), small_world.camera("front")
    assert selection.handles(small_world, camera) == []
    selection.choose(99, "move")
    assert selection.handles(small_world, camera) == []
    assert selection.about()["material"] == {}
    selection.drag(camera, said(1, [30.0, 12.0]), "a")
    assert np.array_equal(selection.world.objects[0].matrix, small_world.objects[0].matrix)
    locked = Selection(Edits(small_world, allowed=False))
    locked.choose(0, "move")
    assert locked.handles(small_world, camera) == []


def test_selection_contains_the_material(small_world: raycam.World) -> None:
    selection = Selection(Edits(small_world))
    selection.choose(0, "none")
    material = selection.about()["material"]
    assert material["color"] == "#c83c28"
    assert (material["model"], material["emission"], material["textured"]) == ("phong", 0, False)
