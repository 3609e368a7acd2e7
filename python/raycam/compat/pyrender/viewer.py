"""The viewer of pyrender: the scene in raycam's live view in the browser."""

from __future__ import annotations

import threading
import time
import warnings
from typing import Any

import numpy as np
import numpy.typing as npt

import raycam

from .camera import Camera, PerspectiveCamera
from .constants import DEFAULT_SCENE_SCALE
from .light import DirectionalLight
from .node import Node
from .picture.path_traced import pinhole_camera, world_of
from .scene import Scene

__all__ = ["Viewer"]

Floats = npt.NDArray[Any]

RENDER_FLAGS: dict[str, Any] = {
    "flip_wireframe": False,
    "all_wireframe": False,
    "all_solid": False,
    "shadows": False,
    "vertex_normals": False,
    "face_normals": False,
    "cull_faces": True,
    "point_size": 1.0,
}
VIEWER_FLAGS: dict[str, Any] = {
    "mouse_pressed": False,
    "rotate": False,
    "rotate_rate": np.pi / 3,
    "rotate_axis": np.array([0.0, 0.0, 1.0]),
    "view_center": None,
    "record": False,
    "use_raymond_lighting": False,
    "use_direct_lighting": False,
    "lighting_intensity": 3.0,
    "use_perspective_cam": True,
    "save_directory": None,
    "window_title": "Scene Viewer",
    "refresh_rate": 30.0,
    "fullscreen": False,
    "show_world_axis": False,
    "show_mesh_axes": False,
    "caption": None,
}
EFFECTIVE = {"use_raymond_lighting", "use_direct_lighting", "lighting_intensity", "window_title", "shadows"}
"""The flags that have an effect; shadows are always shown."""
HANDLERS = {"on_draw", "on_resize", "on_key_press"} | {
    f"on_mouse_{event}" for event in ("press", "drag", "release", "scroll")
}
"""The names of a window's events in pyrender's viewer."""
PAUSE = 0.1
"""Seconds between two checks whether the scene has changed."""


class Viewer:
    """Shows a scene in the browser with `raycam.view`: path traced, with raycam's navigation.

    Waits until the page is closed; with `run_in_thread`, the program continues and changes of the scene are shown.
    The viewer's own lights stay at the first camera pose. A `raycam.Notice` lists the options without effect. A scene
    without a camera is viewed obliquely from above, as in pyrender.
    """

    def __init__(
        self,
        scene: Scene,
        viewport_size: tuple[int, int] | None = None,
        render_flags: dict[str, Any] | None = None,
        viewer_flags: dict[str, Any] | None = None,
        registered_keys: dict[str, Any] | None = None,
        run_in_thread: bool = False,
        **kwargs: Any,
    ) -> None:
        self.scene, self.run_in_thread = scene, bool(run_in_thread)
        self.viewport_size = (640, 480) if viewport_size is None else viewport_size
        self.render_flags, self.viewer_flags = dict(RENDER_FLAGS), dict(VIEWER_FLAGS)
        self.registered_keys = dict(registered_keys or {})
        given = dict(render_flags or {}) | dict(viewer_flags or {}) | kwargs
        for name, value in given.items():
            (self.render_flags if name in RENDER_FLAGS else self.viewer_flags)[name] = value
        known = RENDER_FLAGS | VIEWER_FLAGS
        idle = [name for name in given if name not in EFFECTIVE and not _same(given[name], known.get(name))]
        idle += ["registered_keys"] if registered_keys else []
        if idle:
            said = raycam.Notice(
                f"arguments without effect in raycam's viewer: {', '.join(idle)}", "unused_option"
            )
            warnings.warn(said, stacklevel=2)
        self.render_lock = threading.RLock()
        self._seen: Any = None
        width, height = (int(length) for length in self.viewport_size)
        camera, pose = self._first_view()
        self._lights = self._own_lights(pose)
        self._view = raycam.view(
            self._world(),
            pinhole_camera(camera, pose, (width, height)),
            title=str(self.viewer_flags["window_title"]),
            block=False,
            cell=False,
        )
        self._active = True
        if self.run_in_thread:
            threading.Thread(target=self._follow, daemon=True).start()
            return
        try:
            self._view.wait(exit_when_closed=True)
        finally:
            self.close()

    @property
    def is_active(self) -> bool:
        """True until the page is closed."""
        return self._active

    def close(self) -> None:
        """Closes the page; may be called any number of times."""
        self._active = False
        self._view.close()

    close_external = on_close = close

    def save_gif(self, filename: Any = None) -> None:
        """Raises `NotImplementedError`, because GIFs are not supported."""
        raise NotImplementedError(
            "save_gif is not supported; raycam.video.write_video writes videos of a world"
        )

    def __getattr__(self, name: str) -> Any:
        """Raises `AttributeError` for an unknown attribute.

        For the handlers of pyrender's window, the error contains an alternative.
        """
        if name in HANDLERS:
            raise AttributeError(
                f"Viewer.{name}: not supported, because raycam's viewer is a web page without window events; "
                "use run_in_thread=True, and change the scene while holding render_lock"
            )
        raise AttributeError(f"Viewer has no attribute {name!r}")

    def _first_view(self) -> tuple[Camera, Floats]:
        node = self.scene.main_camera_node
        if node is not None and node.camera is not None and not hasattr(node.camera, "xmag"):
            return node.camera, self.scene.get_pose(node)
        size = self.scene.scale or DEFAULT_SCENE_SCALE
        half = np.sqrt(0.5)
        pose = np.eye(4)
        pose[:3, :3] = [[0, -half, half], [1, 0, 0], [0, half, half]]
        pose[:3, 3] = size / (2 * np.tan(np.pi / 6)) * np.array([1.0, 0, 1]) + self.scene.centroid
        return PerspectiveCamera(yfov=np.pi / 3), pose

    def _own_lights(self, pose: Floats) -> list[tuple[Any, Floats]]:
        """The lights selected by the flags; three suns for a scene without lights."""
        raymond, direct = (self.viewer_flags[f"use_{name}_lighting"] for name in ("raymond", "direct"))
        if not direct and (raymond or not self.scene.lights):
            nodes = self._create_raymond_lights()
        else:
            nodes = [self._create_direct_light()] if direct else []
        for node in nodes:
            node.light.intensity = self.viewer_flags["lighting_intensity"] / len(nodes)
        return [(node.light, pose @ node.matrix) for node in nodes]

    def _world(self) -> raycam.World:
        """Returns the current scene's world, and stores the scene's state as the last shown state."""
        with self.render_lock:
            self._seen = _state(self.scene)
            return world_of(self.scene, self._lights)

    def _follow(self) -> None:
        """Shows changes of the scene until the page is closed."""
        while self._active:
            time.sleep(PAUSE)
            with self.render_lock:
                changed = _state(self.scene) != self._seen
            if changed and self._active:
                self._view.world = self._world()

    def _create_raymond_lights(self) -> list[Node]:
        """Returns three suns of intensity 1 around the z axis.

        The suns are 30 degrees from the axis and 120 degrees apart.
        """
        nodes = []
        for turn in (0, 2 / 3, 4 / 3):
            polar, around = np.pi / 6, np.pi * turn
            back = np.array([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)])
            right = np.array([-back[1], back[0], 0.0]) / np.hypot(back[0], back[1])
            matrix = np.eye(4)
            matrix[:3, :3] = np.column_stack([right, np.cross(back, right), back])
            nodes.append(Node(light=DirectionalLight(color=np.ones(3), intensity=1.0), matrix=matrix))
        return nodes

    def _create_direct_light(self) -> Node:
        """A sun of intensity 1 along -z."""
        return Node(light=DirectionalLight(color=np.ones(3), intensity=1.0), matrix=np.eye(4))


def _same(one: Any, other: Any) -> bool:
    return bool(np.array_equal(one, other)) if isinstance(other, np.ndarray) else bool(one == other)


def _state(scene: Scene) -> Any:
    """Returns a description of the visible scene, to detect changes.

    The positions of primitives are compared by identity.
    """
    things: list[Any] = [scene.ambient_light.tobytes()]
    for node in scene.nodes:
        things.append((id(node), scene.get_pose(node).tobytes()))
        if node.mesh is not None:
            things.append((node.mesh.is_visible, [id(one.positions) for one in node.mesh.primitives]))
        if node.light is not None:
            things.append((node.light.color.tobytes(), node.light.intensity))
    return sorted(map(repr, things))
