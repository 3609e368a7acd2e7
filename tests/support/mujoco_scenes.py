"""MuJoCo models with stored images by MuJoCo's own renderer.

The images are in `tests/interop/mujoco/references`. To render them again, with OSMesa, run in the folder
tests: MUJOCO_GL=osmesa python -m support.mujoco_scenes
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from PIL import Image

REFERENCES = Path(__file__).parents[1] / "interop" / "mujoco" / "references"
SIZE = (160, 120)

LIT = """<mujoco><statistic center="0 0 .5" extent="3"/>
  <asset>
    <texture name="sky" type="skybox" builtin="gradient" rgb1=".4 .6 .8" rgb2="0 0 0" width="64" height="384"/>
    <texture name="grid" type="2d" builtin="checker" rgb1=".1 .2 .3" rgb2=".4 .5 .6" width="64" height="64"/>
    <texture name="check" type="cube" builtin="checker" rgb1=".8 .2 .2" rgb2=".2 .2 .8" width="64" height="384"/>
    <material name="grid" texture="grid" texrepeat="1 1" texuniform="true" reflectance=".3"/>
    <material name="check" texture="check" specular=".3"/>
    <material name="shiny" rgba=".2 .7 .3 1" specular="1" shininess=".3" emission=".1"/>
  </asset>
  <worldbody>
    <light pos="0 -1 4" dir="0 .2 -1" diffuse=".7 .7 .7" cutoff="60" exponent="1" attenuation="1 .05 0"/>
    <light type="directional" dir="-1 .5 -1" diffuse=".3 .3 .3" castshadow="false"/>
    <geom type="plane" size="3 3 .1" material="grid"/>
    <geom type="box" size=".3 .2 .4" pos="-1 0 .4" material="check" euler="0 0 30"/>
    <geom type="sphere" size=".4" pos="0 .3 .5" rgba=".9 .6 .2 1"/>
    <geom type="capsule" size=".2 .3" pos=".9 0 .5" euler="30 20 0" material="check"/>
    <geom type="ellipsoid" size=".2 .3 .4" pos="-.4 -1 .5" material="shiny"/>
    <geom type="box" size=".2 .2 .2" pos=".6 -1 .3" rgba=".2 .4 .9 .4"/>
    <site type="sphere" size=".1" pos="0 -.8 1.1" rgba="1 0 0 1"/>
    <camera name="main" pos="0 -4 2" xyaxes="1 0 0 0 .4 1" fovy="45" resolution="160 120"/>
  </worldbody></mujoco>"""


HAZY = """<mujoco><statistic center="0 0 .5" extent="{extent}"/><visual><rgba haze=".9 .5 .2 1" fog=".2 .8 .4 1"/>
    <map haze=".4" fogstart="1" fogend="6"/></visual>
  <asset>
    <texture name="sky" type="skybox" builtin="gradient" rgb1=".4 .6 .8" rgb2="0 0 0" width="64" height="384"/>
    <material name="floor" rgba=".3 .4 .5 1" reflectance=".2" specular="0"/></asset>
  <worldbody><light type="directional" dir="0 .3 -1" diffuse=".5 .5 .5" castshadow="false"/>
    <geom type="plane" size="0 0 .1" material="floor"/>
    <geom type="box" size=".3 .3 .6" pos="-1 0 .6" rgba=".8 .2 .2 1"/>
    <geom type="box" size="1 1 2.5" pos="4 30 2" rgba=".2 .8 .2 1"/>
    <geom type="sphere" size=".4" pos=".8 0 .7" rgba=".2 .3 .9 .5"/>
    <camera name="main" pos="0 -4 1.5" xyaxes="1 0 0 0 .1 1" fovy="50" resolution="160 120"/>
  </worldbody></mujoco>"""

LAYERED = """<mujoco><worldbody><light pos="0 -2 3" dir="0 .5 -1"/>
    <geom type="plane" size="3 3 .1" pos="0 3 0" euler="90 0 0" rgba=".6 .5 .4 1"/>
    <geom type="box" size=".6 .6 .6" rgba=".8 .2 .2 .4"/>
    <geom type="sphere" size=".4" pos=".3 -.1 0" rgba=".2 .8 .2 .5"/>
    <geom type="capsule" size=".2 .7" pos="-.5 -1 0" euler="0 30 0" rgba=".2 .2 .9 .3"/>
    <geom type="sphere" size=".3" pos="-.2 1.2 .2" rgba=".9 .9 .1 .6"/>
    <camera name="main" pos="0 -4 0" xyaxes="1 0 0 0 0 1" fovy="35" resolution="160 120"/></worldbody></mujoco>"""

BEHIND = """<mujoco><asset>
    <texture name="grid" type="2d" builtin="checker" width="64" height="64" rgb1="1 1 1" rgb2="0 0 0"/>
    <material name="grid" texture="grid" texrepeat="2 2" rgba=".9 .6 .3 1"/></asset>
  <worldbody><light pos="0 0 3"/><geom type="plane" size="2 2 .1" material="grid"/>
    <geom type="plane" size="1 1 .1" pos="1 1 -.2" rgba=".3 .9 .3 .6"/>
    <geom type="box" size=".4 .4 .4" pos="0 0 .4" rgba=".8 .2 .2 1"/>
    <camera name="main" pos="0 -3 -2" xyaxes="1 0 0 0 -.6 1" fovy="45" resolution="160 120"/></worldbody></mujoco>"""

COINCIDENT = """<mujoco><worldbody><light pos="0 -2 3" dir="0 .5 -1" castshadow="false"/>
    <geom type="box" size=".3 .3 .3" pos="-.5 0 0" rgba="1 0 0 1"/>
    <geom type="box" size=".3 .3 .3" pos="-.5 0 0" rgba="0 1 0 1"/>
    <geom type="sphere" size=".3" pos=".5 0 0" rgba="1 0 0 1"/>
    <geom type="sphere" size=".3" pos=".5 0 0" rgba="0 0 1 .5"/>
    <camera name="main" pos="0 -3 1" xyaxes="1 0 0 0 .3 1" fovy="35" resolution="160 120"/></worldbody></mujoco>"""


MARKED = """<mujoco><statistic center="0 0 .5" extent="3"/>
  <visual><headlight ambient=".2 .2 .2" diffuse=".4 .4 .4" specular="0 0 0"/></visual>
  <worldbody><light type="directional" pos="0 0 4" dir="0 .3 -1" diffuse=".5 .5 .5"/>
    <geom name="floor" type="plane" size="3 3 .1" rgba=".6 .6 .6 1"/>
    <geom name="box" type="box" size=".15 .15 .15" pos="-1.3 1 .15" rgba=".8 .2 .2 1"/>
    <camera name="main" pos="0 -4 3" xyaxes="1 0 0 0 .6 1" fovy="45" resolution="160 120"/></worldbody></mujoco>"""

MARKERS = [
    ("SPHERE", [0.2, 0.2, 0.2]),
    ("CAPSULE", [0.1, 0.1, 0.3]),
    ("ELLIPSOID", [0.1, 0.2, 0.3]),
    ("CYLINDER", [0.15, 0.15, 0.25]),
    ("BOX", [0.1, 0.2, 0.15]),
    ("PLANE", [0.2, 0.3, 0.1]),
    ("ARROW", [0.06, 0.06, 0.9]),
    ("ARROW1", [0.06, 0.06, 0.9]),
    ("ARROW2", [0.06, 0.06, 0.9]),
    ("LINE", [4, 4, 0.7]),
    ("TRIANGLE", [0.5, 0.3, 0]),
]
"""Types (`mjtGeom`) and sizes of geoms that are added to the scene."""


def mapped(repeat: str, uniform: str) -> str:
    """A model of primitives whose texture shows its coordinates: s in red and t in green."""
    shapes = [("box", ".3 .2 .4"), ("sphere", ".4"), ("capsule", ".2 .3"), ("cylinder", ".3 .4")]
    shapes += [("ellipsoid", ".2 .3 .4"), ("plane", ".35 .45 1")]
    geoms = "".join(
        f'<geom type="{kind}" size="{size}" pos="{index % 3 - 1} 0 {0.6 - 1.2 * (index // 3)}" '
        f'euler="{60 if kind == "plane" else 20} 10 30" material="m"/>'
        for index, (kind, size) in enumerate(shapes)
    )
    return f"""<mujoco><visual><headlight ambient="1 1 1" diffuse="0 0 0" specular="0 0 0"/></visual>
      <asset><texture name="t" type="2d" file="ramp.png"/>
        <material name="m" texture="t" texrepeat="{repeat}" texuniform="{uniform}"/></asset>
      <worldbody>{geoms}
        <camera name="main" pos="0 -6 0" xyaxes="1 0 0 0 0 1" fovy="25" resolution="160 120"/>
      </worldbody></mujoco>"""


def ramp() -> bytes:
    """A PNG of 64 x 64 pixels: red rises to the right and green downwards."""
    pixels = np.zeros((64, 64, 3), np.uint8)
    pixels[..., 0], pixels[..., 1] = np.arange(64) * 4, np.arange(64)[:, None] * 4
    data = io.BytesIO()
    Image.fromarray(pixels).save(data, "png")
    return data.getvalue()


SCENES = {
    "lit": LIT,
    "mapped": mapped("1 1", "false"),
    "repeated": mapped("0.6 0.9", "false"),
    "uniform": mapped("1 2", "true"),
    "hazy": HAZY.format(extent=1),
    "foggy": HAZY.format(extent=2),
    "plain": HAZY.format(extent=1),
    "layered": LAYERED,
    "unshadowed": LAYERED,
    "behind": BEHIND,
    "coincident": COINCIDENT,
    "marked": MARKED,
}
FLAGS = {"foggy": {"FOG": 1}, "plain": {"HAZE": 0, "REFLECTION": 0}, "unshadowed": {"SHADOW": 0}}
"""Flags of `mjtRndFlag` that differ from their defaults."""


def load(name: str) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Returns the model of this name and its initial state."""
    files = {"ramp.png": ramp()} if "ramp.png" in SCENES[name] else {}
    model = mujoco.MjModel.from_xml_string(SCENES[name], files)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def set_flags(renderer: Any, name: str) -> None:
    """Sets the flags of a scene."""
    for flag, value in FLAGS.get(name, {}).items():
        renderer.scene.flags[getattr(mujoco.mjtRndFlag, f"mjRND_{flag}")] = value


def add_geom(scene: Any, kind: str, size: Any, place: Any, turn: Any = None, rgba: Any = (0, 1, 0, 1)) -> Any:
    """Adds a geom to an `mjvScene`, as MuJoCo's documentation does, and returns it."""
    geom = scene.geoms[scene.ngeom]
    matrix = np.eye(3) if turn is None else turn
    arrays = [np.array(value, np.float64) for value in (size, place, matrix.ravel())]
    mujoco.mjv_initGeom(geom, getattr(mujoco.mjtGeom, f"mjGEOM_{kind}"), *arrays, np.array(rgba, np.float32))
    scene.ngeom += 1
    return geom


def add_markers(scene: Any, name: str) -> None:
    """Adds the geoms of a scene that are not part of its model."""
    if name != "marked":
        return
    angle = np.radians(40)
    turn = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    colors = np.random.default_rng(0).uniform(0.2, 1, (len(MARKERS), 3))
    for number, ((kind, size), color) in enumerate(zip(MARKERS, colors, strict=True)):
        place = [number % 4 - 1.5, 1.2 * (number // 4 - 1), 0.5]
        add_geom(scene, kind, size, place, turn, [*color, 1])
    add_geom(scene, "SPHERE", [0.3, 0.3, 0.3], [0, -1, 0.8], rgba=[0, 0, 1, 0.4])


def main() -> None:
    """Renders one PNG for each scene with MuJoCo."""
    for name in SCENES:
        model, data = load(name)
        with mujoco.Renderer(model, SIZE[1], SIZE[0]) as renderer:
            set_flags(renderer, name)
            renderer.update_scene(data, "main")
            add_markers(renderer.scene, name)
            Image.fromarray(renderer.render()).save(REFERENCES / f"{name}.png")


if __name__ == "__main__":
    main()
