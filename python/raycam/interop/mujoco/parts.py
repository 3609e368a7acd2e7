"""The geoms and cameras of a MuJoCo model as parts of a robot's links."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from ...arguments import Floats
from ...camera import Camera
from ...errors import Notice
from ...world import World
from .cameras import model_camera
from .deformable import rotation_of
from .lights import LightSources
from .materials import element_look, material_keys
from .model import GEOM_OBJECT, element_name
from .shapes import covered_geoms, element_shape, with_texture

__all__ = ["LinkCamera", "LinkGeom", "add_model_lights", "link_cameras", "link_geoms"]

VISIBLE_GROUPS = (0, 1, 2)
WORLD_BODY = 0
"""The body that contains all other bodies, which becomes the root link."""
FIXED_MODE = 0
"""The value of `mjtCamLight` for cameras that move with their body."""


class LinkGeom(NamedTuple):
    """A geom of a link."""

    body: int
    keys: dict[str, Any]
    """Keys of an object: its shape and material."""
    link_from_mesh: Floats
    is_visible: bool
    """True for geoms that MuJoCo's viewer shows."""


class LinkCamera(NamedTuple):
    """A camera of a link."""

    name: str
    body: int
    camera: Camera
    """The camera with its pose relative to the link."""


def link_geoms(model: Any, geometry: str) -> tuple[list[LinkGeom], list[Notice]]:
    """Returns the visible geoms of a model, and notices.

    Visible geoms are in the groups 0 to 2, as in MuJoCo's viewer, are not fully transparent, and are not covered by an
    equal geom. With `geometry="collision"`, the geoms that can collide are returned instead, and with "both", visible
    geoms and geoms that can collide.
    """
    covered = [] if geometry == "collision" else covered_geoms(model, VISIBLE_GROUPS)
    found, notices = [], []
    for geom in range(model.ngeom):
        rgba, material = element_look(model, GEOM_OBJECT, geom)
        collides = bool(model.geom_contype[geom]) or bool(model.geom_conaffinity[geom])
        visible = int(model.geom_group[geom]) in VISIBLE_GROUPS and rgba[3] > 0
        drawn = visible and geom not in covered
        chosen = {"visual": drawn, "collision": collides, "both": drawn or (collides and not visible)}
        if not chosen[geometry]:
            continue
        shape = element_shape(model, GEOM_OBJECT, geom)
        if shape is None:
            text = f"geom {element_name(model, 'geom', geom)!r}: this type of shape is not shown"
            notices.append(Notice(text, "ignored_element"))
            continue
        shape = with_texture(model, GEOM_OBJECT, geom, shape, material)
        pose = np.eye(4)
        pose[:3, :3] = rotation_of(np.asarray(model.geom_quat[geom], np.float64))
        pose[:3, 3] = model.geom_pos[geom]
        keys = {
            **shape.keys,
            **material_keys(
                model, np.maximum(rgba, [0, 0, 0, 1 if geometry == "collision" else 0]), material
            ),
        }
        found.append(LinkGeom(int(model.geom_bodyid[geom]), keys, pose, drawn))
    return found, notices


def link_cameras(model: Any) -> tuple[list[LinkCamera], list[Notice]]:
    """Returns the cameras on their bodies, and notices.

    Cameras that track or target a body keep their pose at the initial state, as cameras of the body `world`.
    """
    found, notices = [], []
    initial = None
    for number in range(model.ncam):
        name = element_name(model, "cam", number)
        if int(model.cam_mode[number]) != FIXED_MODE:
            initial = initial_state(model) if initial is None else initial
            found.append(LinkCamera(name, WORLD_BODY, model_camera(model, number, initial)))
            text = f"camera {name!r} tracks a body in MuJoCo; here, it keeps its pose at the initial state"
            notices.append(Notice(text, "approximated_value"))
            continue
        rotation = rotation_of(np.asarray(model.cam_quat[number], np.float64))
        poses = SimpleNamespace(cam_xmat={number: rotation.ravel()}, cam_xpos={number: model.cam_pos[number]})
        found.append(LinkCamera(name, int(model.cam_bodyid[number]), model_camera(model, number, poses)))
    return found, notices


def initial_state(model: Any) -> Any:
    """Returns MuJoCo's data of a model at its initial state."""
    import mujoco

    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return data


def add_model_lights(world: World, model: Any) -> list[Notice]:
    """Adds a model's lights to a world, and returns notices.

    The lights are in the model's initial state, as in `from_mujoco`. A model that has only a headlight adds
    no lights, so that raycam's own lights or the studio show it.
    """
    notices: list[Notice] = []
    if not np.asarray(model.light_active).any():
        return notices
    LightSources(world, model, initial_state(model), notices)
    moving = [
        element_name(model, "light", light) for light in range(model.nlight) if model.light_bodyid[light]
    ]
    if moving:
        text = f"lights {', '.join(moving)}: lights on links do not move with the joints"
        notices.append(Notice(text, "approximated_value"))
    return notices
