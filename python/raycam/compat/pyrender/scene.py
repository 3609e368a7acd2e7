"""Scenes of pyrender: a tree of nodes with meshes, lights and cameras."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from .camera import Camera
from .colors import format_color_vector
from .light import DirectionalLight, Light, PointLight, SpotLight
from .mesh import Mesh
from .node import Node
from .primitive import Bounded
from .values import Converted, text

__all__ = ["Scene"]

Floats = npt.NDArray[Any]


class Scene(Bounded):
    """A tree of nodes, a background and ambient light.

    Integer colours are relative to 255, float colours are used unchanged. The background has four channels, is white
    by default, and is shown without gamma.
    """

    name = Converted(text)
    bg_color = Converted(lambda value: format_color_vector(1.0 if value is None else value, 4))
    ambient_light = Converted(lambda value: format_color_vector(0.0 if value is None else value, 3))

    def __init__(
        self,
        nodes: Iterable[Node] | None = None,
        bg_color: Any = None,
        ambient_light: Any = None,
        name: str | None = None,
    ) -> None:
        self.name = name
        self.bg_color = bg_color
        self.ambient_light = ambient_light
        self._parents: dict[Node, Node | None] = {}
        self._main_camera: Node | None = None
        given = list(nodes or ())
        below: set[int] = set()
        ahead = [child for node in given for child in node.children]
        while ahead:
            child = ahead.pop()
            if id(child) not in below:
                below.add(id(child))
                ahead += child.children
        # A node whose parent is also in the list is added with the parent.
        for node in given:
            if id(node) not in below and node not in self._parents:
                self.add_node(node)
        for node in given:
            if node not in self._parents:
                raise ValueError(f"the node {node.name!r} is its own descendant")

    # Nodes ------------------------------------------------------------------------------------------------

    def add(
        self,
        obj: Any,
        name: str | None = None,
        pose: npt.ArrayLike | None = None,
        parent_node: Node | None = None,
        parent_name: str | None = None,
    ) -> Node:
        """Adds a mesh, light or camera with a new node, and returns the node.

        `name` is the node's name, and `pose` [4, 4] its pose relative to the parent (default: the identity). Raises
        `TypeError` for another object, and `ValueError` if the parent is missing or ambiguous.
        """
        kinds = {"mesh": Mesh, "light": Light, "camera": Camera}
        kind = next((kind for kind, of in kinds.items() if isinstance(obj, of)), None)
        if kind is None:
            raise TypeError(f"expected a Mesh, Light or Camera, not {type(obj).__name__}")
        node = Node(name=name, matrix=pose, **{kind: obj})
        if parent_node is None and parent_name is not None:
            found = self.get_nodes(name=parent_name)
            if len(found) != 1:
                raise ValueError(
                    f"{len(found)} nodes have the name {parent_name!r}, expected one; pass parent_node instead"
                )
            parent_node = next(iter(found))
        self.add_node(node, parent_node)
        return node

    def add_node(self, node: Node, parent_node: Node | None = None) -> None:
        """Adds a node with its children; raises `ValueError` if the scene already contains the node."""
        if node in self._parents:
            raise ValueError(
                f"the scene already contains the node {node.name!r}; use set_pose to move it, or create another node"
            )
        if parent_node is not None and parent_node not in self._parents:
            raise ValueError(
                f"the scene does not contain the parent {parent_node.name!r}; add the parent first, with add_node"
            )
        if parent_node is not None and node not in parent_node.children:
            parent_node.children.append(node)
        self._attach(node, parent_node)

    def _attach(self, node: Node, parent: Node | None) -> None:
        self._parents[node] = parent
        if node.camera is not None and self._main_camera is None:
            self._main_camera = node
        for child in node.children:
            if child in self._parents:
                raise ValueError(f"the node {child.name!r} has two parents; create one node for each parent")
            self._attach(child, node)

    def remove_node(self, node: Node) -> None:
        """Removes a node with its children; raises `ValueError` if the node is not in the scene."""
        self._check(node)
        parent = self._parents[node]
        if parent is not None:
            parent.children.remove(node)
        self._detach(node)

    def _detach(self, node: Node) -> None:
        for child in node.children:
            self._detach(child)
        del self._parents[node]
        if self._main_camera is node:
            self._main_camera = next((other for other in self._parents if other.camera is not None), None)

    def has_node(self, node: Node) -> bool:
        """True if a node is in the scene."""
        return node in self._parents

    def clear(self) -> None:
        """Removes all nodes."""
        self._parents.clear()
        self._main_camera = None

    def _check(self, node: Node) -> None:
        if node not in self._parents:
            raise ValueError(
                f"the node {getattr(node, 'name', node)!r} is not in the scene; add it with add_node, or use get_nodes"
            )

    def set_pose(self, node: Node, pose: npt.ArrayLike) -> None:
        """Sets a node's pose parent_from_node [4, 4]; raises `ValueError` if the scene lacks it."""
        self._check(node)
        node.matrix = pose

    def get_pose(self, node: Node) -> Floats:
        """Returns world_from_node [4, 4]; raises `ValueError` if the node is not in the scene."""
        self._check(node)
        pose, above = node.matrix.copy(), self._parents[node]
        while above is not None:
            pose, above = above.matrix @ pose, self._parents[above]
        return np.asarray(pose)

    def get_nodes(
        self, node: Node | None = None, name: str | None = None, obj: Any = None, obj_name: str | None = None
    ) -> set[Node]:
        """Returns the nodes that match a node, a name, an object or an object's name."""

        def fits(one: Node) -> bool:
            things = [thing for thing in (one.mesh, one.light, one.camera) if thing is not None]
            return (
                (node is None or one is node)
                and (name is None or one.name == name)
                and (obj is None or any(thing is obj for thing in things))
                and (obj_name is None or any(thing.name == obj_name for thing in things))
            )

        return {one for one in self._parents if fits(one)}

    def _of(self, kind: str, of: type) -> set[Node]:
        return {node for node in self._parents if isinstance(getattr(node, kind), of)}

    @property
    def nodes(self) -> set[Node]:
        """All nodes."""
        return set(self._parents)

    @property
    def mesh_nodes(self) -> set[Node]:
        """The nodes with a mesh."""
        return self._of("mesh", Mesh)

    @property
    def light_nodes(self) -> set[Node]:
        """The nodes with a light."""
        return self._of("light", Light)

    @property
    def camera_nodes(self) -> set[Node]:
        """The nodes with a camera."""
        return self._of("camera", Camera)

    @property
    def directional_light_nodes(self) -> set[Node]:
        """The nodes with a `DirectionalLight`."""
        return self._of("light", DirectionalLight)

    @property
    def spot_light_nodes(self) -> set[Node]:
        """The nodes with a `SpotLight`."""
        return self._of("light", SpotLight)

    @property
    def point_light_nodes(self) -> set[Node]:
        """The nodes with a `PointLight` that is not a `SpotLight`."""
        return self._of("light", PointLight) - self.spot_light_nodes

    @property
    def meshes(self) -> set[Mesh]:
        """All meshes."""
        return {node.mesh for node in self.mesh_nodes if node.mesh is not None}

    @property
    def lights(self) -> set[Light]:
        """All lights."""
        return {node.light for node in self.light_nodes if node.light is not None}

    @property
    def directional_lights(self) -> set[Light]:
        """The lights of `directional_light_nodes`."""
        return {node.light for node in self.directional_light_nodes if node.light is not None}

    @property
    def spot_lights(self) -> set[Light]:
        """The lights of `spot_light_nodes`."""
        return {node.light for node in self.spot_light_nodes if node.light is not None}

    @property
    def point_lights(self) -> set[Light]:
        """The lights of `point_light_nodes`."""
        return {node.light for node in self.point_light_nodes if node.light is not None}

    @property
    def cameras(self) -> set[Camera]:
        """All cameras."""
        return {node.camera for node in self.camera_nodes if node.camera is not None}

    @property
    def main_camera_node(self) -> Node | None:
        """The active camera's node: the first added camera, or any other camera after its removal."""
        return self._main_camera

    @main_camera_node.setter
    def main_camera_node(self, node: Node) -> None:
        self._check(node)
        if node.camera is None:
            raise ValueError(
                f"the node {node.name!r} has no camera; use a node that add returned for a camera"
            )
        self._main_camera = node

    # Extent -----------------------------------------------------------------------------------------------

    @property
    def bounds(self) -> Floats:
        """The lower and upper corner [2, 3] of all meshes; zeros without meshes."""
        corners = []
        for node in self.mesh_nodes:
            if node.mesh is not None:
                low, high = node.mesh.bounds
                ends = [
                    [x, y, z, 1.0]
                    for x in (low[0], high[0])
                    for y in (low[1], high[1])
                    for z in (low[2], high[2])
                ]
                corners.append((np.array(ends) @ self.get_pose(node).T)[:, :3])
        if not corners:
            return np.zeros((2, 3))
        every = np.concatenate(corners)
        return np.stack([every.min(axis=0), every.max(axis=0)])

    @staticmethod
    def from_trimesh_scene(trimesh_scene: Any, bg_color: Any = None, ambient_light: Any = None) -> Scene:
        """Returns a scene with the meshes of a `trimesh.Scene`, and the given background and light."""
        scene = Scene(bg_color=bg_color, ambient_light=ambient_light)
        meshes = {name: Mesh.from_trimesh(mesh) for name, mesh in trimesh_scene.geometry.items()}
        for node in trimesh_scene.graph.nodes_geometry:
            pose, geometry = trimesh_scene.graph[node]
            scene.add(meshes[geometry], name=str(node), pose=pose)
        return scene
