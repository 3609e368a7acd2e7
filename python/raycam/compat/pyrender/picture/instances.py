"""A raycam world that follows a scene of pyrender through incremental changes."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

import raycam

from ..constants import RenderFlags
from ..node import Node
from ..primitive import Primitive
from ..scene import Scene
from .fragments import by_edges

__all__ = ["Instance", "SceneWorld"]

Floats = npt.NDArray[Any]


@dataclass(eq=False)
class Instance:
    """A primitive at one of its poses, represented by an object of the world."""

    node: Node
    primitive: Primitive
    place: Floats
    """world_from_mesh [4, 4]."""
    visible: bool
    name: str

    def key(self) -> tuple[int, int, int]:
        """Node, primitive and vertices, which do not change when the instance moves."""
        return (id(self.node), id(self.primitive), id(self.primitive.positions))


class SceneWorld:
    """A world whose objects are the triangles of a scene, in the order of `instances`."""

    def __init__(self) -> None:
        self.world = raycam.World("y")
        self.instances: list[Instance] = []
        self._number = 0

    def follow(self, scene: Scene, shown: set[Node] | None, flags: int = RenderFlags.NONE) -> None:
        """Updates the world to the current scene; `shown` limits the visible nodes.

        Primitives that `flags` or their material show as wireframes have no faces in the world.
        """
        wanted: dict[tuple[int, int, int, int], tuple[Node, Primitive, Floats, bool]] = {}
        for node in scene._parents:
            mesh = node.mesh
            if mesh is None:
                continue
            pose = scene.get_pose(node)
            seen = mesh.is_visible and (shown is None or node in shown)
            for primitive in mesh.primitives:
                if not primitive.has_faces or len(primitive.faces) == 0 or by_edges(primitive, flags):
                    continue
                for i, place in enumerate(primitive.places):
                    key = (id(node), id(primitive), id(primitive.positions), i)
                    wanted[key] = (node, primitive, pose @ place, seen)
        known = self._known()
        gone = {instance.name for key, instance in known.items() if key not in wanted}
        for name in gone:
            self.world.remove_object(name)
        self.instances = [instance for instance in self.instances if instance.name not in gone]
        first: dict[int, str] = {}
        for instance in self.instances:
            first.setdefault(id(instance.primitive), instance.name)
        for key, (node, primitive, place, seen) in wanted.items():
            flat = abs(np.linalg.det(place[:3, :3])) < 1e-30 or not np.isfinite(place).all()
            if key in known:
                self._change(known[key], known[key].place if flat else place, seen and not flat)
            elif not flat:
                self._add(node, primitive, place, seen, first)

    def _known(self) -> dict[tuple[int, int, int, int], Instance]:
        found: dict[tuple[int, int, int, int], Instance] = {}
        counts: Counter[tuple[int, int, int]] = Counter()
        for instance in self.instances:
            key = instance.key()
            found[(*key, counts[key])] = instance
            counts[key] += 1
        return found

    def _change(self, instance: Instance, place: Floats, visible: bool) -> None:
        if not np.array_equal(instance.place, place):
            self.world.set_object(instance.name, matrix=place)
            instance.place = place
        if instance.visible != visible:
            self.world.set_object(instance.name, visible=visible)
            instance.visible = visible

    def _add(
        self, node: Node, primitive: Primitive, place: Floats, visible: bool, first: dict[int, str]
    ) -> None:
        """Adds an object.

        `first` contains the name of each primitive's first object, whose mesh the primitive's other objects
        share.
        """
        self._number += 1
        name = f"instance {self._number}"
        like = first.setdefault(id(primitive), name)
        if like != name:
            self.world.add_object(instance_of=like, name=name, matrix=place, visible=visible)
        else:
            self.world.add_mesh(
                primitive.positions, primitive.faces, name=name, matrix=place, visible=visible
            )
        self.instances.append(Instance(node, primitive, place, visible, name))
