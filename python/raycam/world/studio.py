"""The studio in which worlds without lights and cameras are shown.

The studio has a soft key light, a grey room that metals reflect, and a floor without a visible edge.

The room's radiance below the horizon equals the lit floor's radiance, so the floor's edge is invisible.
"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from .. import _core
from ..arguments import Floats, flag, real
from ..camera import Camera, check_camera
from ..errors import WorldError
from .building import WorldBuilding
from .contents import WorldContents
from .framing import axes_of, without_ground

__all__ = [
    "CLAY",
    "FLOOR",
    "add_clay",
    "add_ground",
    "add_studio",
    "add_studio_preview",
    "add_sun",
    "is_above",
    "lacks_materials",
    "studio_floor",
]

FLOOR = 0.62
"""Albedo of the studio's floor, and radiance of floor and background outside shadows."""

CLAY = 0.35
"""Albedo in the studio of models without materials; their own albedo, 0.8, hardly differs from the floor."""

FLOOR_SIDE, GROUND_SIDE = 4.0, 100.0
"""Side lengths of the studio's floor and of other grounds, in diagonals of the world's bounds."""
GROUND_GAP = 1e-4
"""Gap between the world and the ground, in half diagonals, so that no face lies in the ground's plane."""
KEY_AZIMUTH, KEY_ELEVATION, KEY_DIAMETER = -37.0, 50.0, 15.0
"""The key light's angle to the right of the camera, height above the horizon and diameter, in degrees."""
KEY_IRRADIANCE, ROOM_RADIANCE = 2.5, 0.55
"""Irradiance of the key light and radiance of the room, before both are scaled so that the floor has `FLOOR`."""
SOFTBOXES = ((35.0, 40.0, 30.0, 50.0, 1.5), (-110.0, 35.0, 16.0, 50.0, 1.0))
"""Soft boxes in the room: azimuth, elevation, width and height in degrees, and radiance."""
SUN_IRRADIANCE = 2.6
"""Irradiance of the sun of `add_sun`, in W/m²."""
SKY_RADIANCE = 0.4
"""Radiance of the sky of `add_sun`, in W/(m² sr)."""
ROOM_IMAGE_ROWS = 128
"""Rows of the room's image."""


def add_ground(
    world: WorldBuilding,
    *,
    height: float | None = None,
    size: float | None = None,
    color: Any = None,
    name: str = "ground",
    **material: Any,
) -> int:
    """Adds a level square under the world; see `World.add_ground`."""
    bounds = without_ground(world).bounds
    if bounds is None and (height is None or size is None):
        raise WorldError(
            "the world is empty; add objects first, or pass the ground's height and size",
            code="missing_value",
        )
    low, high = np.zeros((2, 3)) if bounds is None else bounds
    radius = float(np.sqrt(((high - low) ** 2).sum())) / 2 or 1.0
    axis = 2 if world.up == "z" else 1
    middle = (low + high) / 2
    middle[axis] = low[axis] - GROUND_GAP * radius if height is None else height
    side = 2 * GROUND_SIDE * radius if size is None else size
    right, front, upward = axes_of(world.up)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = right, -front, upward, middle
    taken = {item.name for item in world.objects}
    free = next(
        f"{name}{number or ''}" for number in range(len(taken) + 1) if f"{name}{number or ''}" not in taken
    )
    keys: dict[str, Any] = {"color": [FLOOR] * 3 if color is None else color, "matrix": matrix.tolist()}
    return world.add_object({"plane": {"size": [side, side]}, "name": free, **keys, **material})


def studio_floor(world: WorldContents) -> dict[str, float | None]:
    """Returns the height and the side of the studio's floor, as arguments of `add_ground`."""
    bounds = without_ground(world).bounds
    if bounds is None:
        return {"height": None, "size": 2 * FLOOR_SIDE}
    diagonal = float(np.sqrt(((bounds[1] - bounds[0]) ** 2).sum()))
    height = float(bounds[0][2 if world.up == "z" else 1]) - GROUND_GAP * (diagonal / 2 or 1.0)
    return {"height": height, "size": FLOOR_SIDE * (diagonal or 2.0)}


def add_sun(world: WorldBuilding, azimuth: float, elevation: float, *, sky: bool) -> None:
    """Adds a sun, and with `sky` a pale sky.

    The sun's direction is given by two angles in degrees: `azimuth` from the front towards the right, and `elevation`
    above the horizon.
    """
    right, front, upward = axes_of(world.up)
    across, above = math.radians(azimuth), math.radians(elevation)
    level = math.cos(across) * front + math.sin(across) * right
    to_sun = math.cos(above) * level + math.sin(above) * upward
    world.add_light(
        type="sun", direction=(-to_sun).tolist(), irradiance=SUN_IRRADIANCE, angular_diameter=0.53
    )
    if sky:
        world.add_light(type="sky", radiance=SKY_RADIANCE)


def lacks_materials(world: WorldContents) -> bool:
    """Returns True if no object has a material of its own, as in most STL files."""
    core = world._core
    return core.object_count > 0 and all(
        core.material(number, 0) == _default_material() for number in range(core.object_count)
    )


def add_clay(world: WorldBuilding) -> None:
    """Gives objects without a material the albedo `CLAY`."""
    core = world._core
    for number in range(core.object_count):
        if core.material(number, 0) == _default_material():
            world.set_object(number, color=[CLAY] * 3)


@functools.cache
def _default_material() -> str:
    """The description of the material of a mesh file without materials."""
    return _core.World.load_bytes(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a.obj", None).material(0, 0)


def add_studio(
    world: WorldBuilding,
    camera: Camera | None = None,
    *,
    ground: bool = True,
    key: bool = True,
    exposure: float = 0.0,
) -> None:
    """Adds the studio's lights, arranged around `camera`, and its floor; see `World.add_studio`."""
    camera = None if camera is None else check_camera(camera)
    ground, key = flag("ground", ground), flag("key", key)
    strength = 2.0 ** -real("exposure", exposure, -100, 100, what="a number of stops")
    toward, right, upward = _stage(world, camera)
    to_key = _to_key(toward, right, upward)
    sun = None if key else _sun_on_floor(world, upward) / strength
    image, scale = _room(world.up, toward, right, upward, sun)
    if ground and (camera is None or camera.is_parallel or is_above(world, camera)):
        add_ground(world, name="studio floor", size=studio_floor(world)["size"])
    world.add_light(type="environment", image=image * np.float32(strength))
    if key:
        world.add_light(
            type="sun",
            direction=(-to_key).tolist(),
            irradiance=KEY_IRRADIANCE * scale * strength,
            angular_diameter=KEY_DIAMETER,
        )


def _sun_on_floor(world: WorldBuilding, upward: Floats) -> float:
    """Returns the irradiance of the world's suns on a level floor, in W/m².

    The result is the mean of red, green and blue.
    """
    found = 0.0
    for light in world.lights:
        if light["type"] == "sun":
            direction = np.array(light["direction"], float)
            rise = -float((direction * upward).sum()) / math.sqrt(float((direction * direction).sum()))
            found += max(rise, 0.0) * float(np.mean(light["irradiance"]))
    return found


def add_studio_preview(
    world: WorldBuilding, camera: Camera, *, key: bool = True, exposure: float = 0.0
) -> None:
    """Adds lights that resemble those of `add_studio`, but require only one sample per pixel.

    One sample is sufficient with the integrator "direct". The sky's radiance is `FLOOR`. The sun has no size; its
    irradiance is such that the floor's radiance is also `FLOOR`: `FLOOR = FLOOR / pi * (pi * FLOOR + irradiance *
    sin(KEY_ELEVATION))`. Without `key`, there is no sun, and the sky has the radiance of the room's horizon.
    """
    if not key:
        toward, right, upward = _stage(world, camera)
        strength = 2.0**-exposure
        image, _ = _room(world.up, toward, right, upward, _sun_on_floor(world, upward) / strength)
        world.add_light(type="sky", radiance=float(image[-1, 0, 0]) * strength)
        return
    world.add_light(type="sky", radiance=FLOOR)
    world.add_light(
        type="sun",
        direction=(-_to_key(*_stage(world, camera))).tolist(),
        irradiance=math.pi * (1 - FLOOR) / math.sin(math.radians(KEY_ELEVATION)),
        angular_diameter=0.0,
    )


def _to_key(toward: Floats, right: Floats, upward: Floats) -> Floats:
    """The unit vector towards the key light."""
    azimuth, elevation = math.radians(KEY_AZIMUTH), math.radians(KEY_ELEVATION)
    level = math.cos(azimuth) * toward + math.sin(azimuth) * right
    direction: Floats = math.cos(elevation) * level + math.sin(elevation) * upward
    return direction


def _stage(world: WorldBuilding, camera: Camera | None) -> tuple[Floats, Floats, Floats]:
    """Level unit vectors towards the camera and to its right, and the vector up."""
    _, front, upward = axes_of(world.up)
    if camera is None:
        camera = world.default_camera()
    # The first usable axis: the camera's forward axis or, if the camera looks down, the image's up axis.
    for axis in (camera.R[2], -camera.R[1], front):
        level = axis - (axis * upward).sum() * upward
        length = float(np.sqrt((level * level).sum()))
        if length > 0.05:
            break
    toward = -level / length
    return toward, np.cross(upward, toward), upward


def is_above(world: WorldContents, camera: Camera) -> bool:
    """Returns True if the camera is above the world's lowest point.

    The camera is then above the ground, too.
    """
    bounds = without_ground(world).bounds
    axis = 2 if world.up == "z" else 1
    return bounds is not None and bool(camera.location[axis] > bounds[0][axis])


def _room(
    up: str, toward: Floats, right: Floats, upward: Floats, sun: float | None = None
) -> tuple[Any, float]:
    """The equirectangular image of the room, and the factor for the room and the key light.

    `sun` is the irradiance on the floor, in W/m², of suns that replace the key light. The room is as bright as with the
    key light; only its radiance below the horizon follows the floor's.
    """
    # NumPy's sine, exponential and sum are not used, because their last bits depend on the processor.
    heights = [90.0 - 180.0 * (row + 0.5) / ROOM_IMAGE_ROWS for row in range(ROOM_IMAGE_ROWS)]
    degrees = np.array(heights)[:, None]
    cosine = np.array([math.cos(math.radians(height)) for height in heights])[:, None]
    sine = np.array([math.sin(math.radians(height)) for height in heights])[:, None]
    # The middle column shows +x of a z-up world, or -z of a y-up world. Later columns are further to the right.
    ahead = np.array([1.0, 0, 0]) if up == "z" else np.array([0, 0, -1.0])
    start = math.degrees(math.atan2((ahead * right).sum(), (ahead * toward).sum()))
    # To the right in the image is clockwise seen from above; to the right of the camera is
    # counterclockwise.
    azimuth = start - (np.arange(2 * ROOM_IMAGE_ROWS) + 0.5 - ROOM_IMAGE_ROWS)[None] * (
        180.0 / ROOM_IMAGE_ROWS
    )
    sky = np.full((ROOM_IMAGE_ROWS, 2 * ROOM_IMAGE_ROWS), ROOM_RADIANCE)
    for at, above, wide, high, radiance in SOFTBOXES:
        across = np.abs((azimuth - at + 180) % 360 - 180) * cosine
        sky += radiance * _edge(wide / 2 - across, 4.0) * _edge(high / 2 - np.abs(degrees - above), 4.0)
    lifted = _edge(degrees - 16, 12.0)  # the room gets brighter above the horizon
    weight = np.where(degrees > 0, sine * cosine * (math.pi / ROOM_IMAGE_ROWS) ** 2, 0.0)
    received = math.fsum((lifted * sky * weight).ravel()) + KEY_IRRADIANCE * math.sin(
        math.radians(KEY_ELEVATION)
    )
    returned = math.fsum(((1 - lifted) * weight).ravel()) * 2 * ROOM_IMAGE_ROWS
    # The horizon h is the floor's radiance: h = albedo / pi (received + returned h).
    horizon = FLOOR / math.pi * received / (1 - FLOOR / math.pi * returned)
    scale = FLOOR / horizon
    if sun is not None:
        received += sun / scale - KEY_IRRADIANCE * math.sin(math.radians(KEY_ELEVATION))
        horizon = FLOOR / math.pi * received / (1 - FLOOR / math.pi * returned)
    radiance_map = np.where(degrees > 0, lifted * sky + (1 - lifted) * horizon, horizon)
    return np.repeat((radiance_map * scale)[..., None], 3, axis=-1).astype(np.float32), scale


def _edge(distance: Floats, softness: float) -> Floats:
    """A smooth step from 0 to 1 around the distance 0, `softness` to either side."""
    part = np.clip(distance / (2 * softness) + 0.5, 0.0, 1.0)
    found: Floats = part * part * (3 - 2 * part)
    return found
