"""Height maps: shading normals against closed forms, normal maps and Mitsuba."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import raycam
from PIL import Image
from support.raises import raises, warns

Floats = npt.NDArray[np.floating[Any]]
SIDE = 512
AMPLITUDE = 0.01
SUN = np.array([0.3, 0.2, -1.0])


def waves(u: Floats, v: Floats) -> Floats:
    """Heights in metres by the coordinates in the image."""
    return AMPLITUDE * np.sin(8 * np.pi * u) * np.cos(6 * np.pi * v)


def wave_image() -> Floats:
    u, v = np.meshgrid(*2 * [(np.arange(SIDE) + 0.5) / SIDE])
    return waves(u, v).astype(np.float32)


def lit_plane(texture: object, matrix: Floats, above: bool = True, **keys: Any) -> dict[str, Floats]:
    """A white plane under a sun of irradiance pi on the camera's side.

    The radiance equals the cosine of the sun's angle.
    """
    world = raycam.World()
    world.add_object(
        plane=2, type="matte", color=[1, 1, 1], matrix=matrix, textures={"height": texture}, **keys
    )
    side = 1 if above else -1
    world.add_light("sun", direction=SUN * [1, 1, side], irradiance=np.pi)
    camera = raycam.Camera.look_at([0.1, 0, 3 * side], [0.1, 0, 0], up=[0, 1, 0], size=(96, 96), fov=20)
    channels = ["color", "position", "uv"]
    frame = raycam.render(world, camera, integrator="direct", samples=1, channels=channels)
    return {name: np.asarray(frame[name], np.float64) for name in channels}


MATRICES = {
    "identity": np.eye(4),
    "scaled": np.diag([3.0, 1.5, 2.0, 1.0]),
    "mirrored": np.diag([-1.0, 1.0, 1.0, 1.0]),
    "turned": np.array([[0.0, -1, 0, 0.1], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]),
}


@pytest.mark.parametrize("above", [True, False])
@pytest.mark.parametrize("place", MATRICES)
@pytest.mark.parametrize("style", [{}, {"repeat": [1.5, -2], "rotation": 30, "offset": [0.2, 0.7]}])
def test_normals_of_waves_equal_the_closed_form(style: dict[str, Any], place: str, above: bool) -> None:
    matrix = MATRICES[place]
    seen = lit_plane(raycam.Texture(wave_image(), **style), matrix, above, height_scale=2)
    x, y = np.moveaxis(seen["position"][..., :2], -1, 0)

    def height(x: Floats, y: Floats) -> Floats:
        """Height in metres over the world's xy plane."""
        place = np.linalg.inv(matrix) @ np.stack([x, y, 0 * x, 1 + 0 * x]).reshape(4, -1)
        u, v = (place[0] + 1) / 2, (1 - place[1]) / 2
        angle = np.radians(style.get("rotation", 0))
        (across, down), (right, below) = style.get("repeat", [1, 1]), style.get("offset", [0, 0])
        image_u = np.cos(angle) * across * u + np.sin(angle) * down * v + right
        image_v = -np.sin(angle) * across * u + np.cos(angle) * down * v + below
        return 2 * waves(image_u, image_v).reshape(x.shape)

    step = 1e-5
    slope_x = (height(x + step, y) - height(x - step, y)) / (2 * step)
    slope_y = (height(x, y + step) - height(x, y - step)) / (2 * step)
    normal = np.stack([-slope_x, -slope_y, np.ones_like(x)], -1)
    normal *= (1 if above else -1) / np.linalg.norm(normal, axis=-1, keepdims=True)
    to_sun = -SUN * [1, 1, 1 if above else -1] / np.linalg.norm(SUN)
    expected = np.clip(normal @ to_sun, 0, None)
    assert np.ptp(expected) > 0.05
    error = np.abs(seen["color"][..., 0] - expected)
    assert error.mean() < 0.002
    assert error.max() < 0.03  # linear interpolation has steps in its derivative


def test_uint8_heights_resemble_float_heights_and_negative_scales_invert_them() -> None:
    image = np.round((wave_image() / AMPLITUDE + 1) / 2 * 255).astype(np.uint8)
    place = np.eye(4)
    exact = lit_plane(wave_image(), place, height_scale=4)["color"]
    smooth = {"filter": "linear"}
    coarse = lit_plane(raycam.Texture(image, **smooth), place, height_scale=8 * AMPLITUDE)["color"]
    assert coarse.mean() == pytest.approx(exact.mean(), rel=0.01)
    assert np.corrcoef(coarse.ravel(), exact.ravel())[0, 1] > 0.5
    turned = lit_plane(-wave_image(), place, height_scale=-4)["color"]
    assert turned == pytest.approx(exact, abs=1e-6)


NORMALS: dict[str, dict[str, Any]] = {
    "matte": {"type": "matte"},
    "phong": {"diffuse": 0.5, "specular": 0.5, "shininess": 50},
    "mirror": {"type": "metal", "metal": "silver"},
    "brushed": {"type": "metal", "metal": "gold", "roughness": 0.3},
    "glass": {"type": "glass"},
    "frosted": {"type": "glass", "roughness": 0.3},
    "plastic": {"type": "principled", "roughness": 0.2},
    "coated": {"type": "principled", "clearcoat": 1, "roughness": 0.6},
    "brushed along": {"type": "principled", "metallic": 1, "roughness": 0.3, "anisotropy": 0.8},
}


@pytest.mark.parametrize("material", NORMALS)
def test_height_map_equals_the_normal_map_of_the_same_relief(material: str) -> None:
    """Height maps and normal maps have the same effect in every reflection model.

    Hits are evaluated in batches and one by one.
    """
    u, v = np.meshgrid(*2 * [(np.arange(SIDE) + 0.5) / SIDE])
    slope_u = 3 * 8 * np.pi * AMPLITUDE * np.cos(8 * np.pi * u) * np.cos(6 * np.pi * v) / 2
    slope_v = 3 * -6 * np.pi * AMPLITUDE * np.sin(8 * np.pi * u) * np.sin(6 * np.pi * v) / 2
    normals = np.stack([-slope_u, slope_v, np.ones_like(u)], -1)
    normals = (normals / np.linalg.norm(normals, axis=-1, keepdims=True) + 1) / 2
    seen = []
    maps: dict[str, Any]
    for maps in ({"height": 3 * wave_image()}, {"normal": normals}, {}):
        if material == "coated" and "normal" in maps:
            maps |= {"clearcoat_normal": normals}
        world = raycam.World()
        world.add_object(plane=2, textures=maps, **NORMALS[material])
        world.add_light("sky", zenith=[4, 2, 1], horizon=[0, 1, 3], ground=[3, 0, 0])
        world.add_light("sun", direction=[0.5, 0.5, -1], irradiance=3)
        camera = raycam.Camera.look_at([0, -2, 2.5], [0, 0, 0], size=(48, 48), fov=25)
        frame = raycam.render(world, camera, integrator="path", samples=64, channels=["color"])
        seen.append(frame["color"])
    by_height, by_normal, flat = seen
    assert np.abs(by_height - flat).mean() > 0.02
    assert np.abs(by_height - by_normal).mean() < 0.1 * np.abs(by_height - flat).mean()


SCALE = 0.06
MITSUBA = {
    "plain": [0.9644, 0.9187, 0.8971, 0.9495, 0.9805, 0.9397, 0.9445, 0.9521, 0.9657],
    "mirrored": [0.9418, 0.9623, 0.9586, 0.9811, 0.9870, 0.9650, 0.9795, 0.9807, 0.9657],
    "repeated": [0.8810, 0.9052, 0.9204, 0.9266, 0.9384, 0.9340, 0.8943, 0.9142, 0.9169],
}
"""Mean radiance of 3 x 3 patches in the image's centre in Mitsuba 3.9.1 (`bumpmap`, 256 samples), by coordinates.

Cycles (Blender 4.5, node Bump with a filter width of 0.1) renders the first row within 0.0003.
"""


def rough_sphere(change: str) -> dict[str, Any]:
    """A smooth sphere of radius 1, with texture coordinates along its circles."""
    u, v = np.meshgrid(np.linspace(0, 1, 97), np.linspace(0.02, 0.98, 49))
    polar, around = np.pi * v, 2 * np.pi * u
    points = [np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)]
    normals = np.stack(points, -1).reshape(-1, 3)
    uvs = np.stack([u, v], -1).reshape(-1, 2)
    uvs = {"plain": uvs, "mirrored": uvs * [-1, 1] + [1, 0], "repeated": uvs * [2, 3]}[change]
    first = np.arange(48 * 97).reshape(48, 97)[:, :-1].ravel()
    near = np.stack([first, first + 97, first + 1], -1)
    far = np.stack([first + 1, first + 97, first + 98], -1)
    faces = np.concatenate([near, far])
    return {"vertices": normals, "triangles": faces, "normals": normals, "uvs": uvs}


@pytest.mark.parametrize("change", MITSUBA)
def test_rough_sphere_equals_mitsuba(change: str) -> None:
    at = (np.arange(256) + 0.5) / 256
    random = np.random.default_rng(1)
    heights = np.zeros((256, 256))
    for _ in range(12):
        a, b = random.integers(-9, 10, 2)
        heights += np.sin(2 * np.pi * (a * at[None, :] + b * at[:, None]) + random.uniform(0, 6.28)) / 12
    world = raycam.World()
    look: dict[str, Any] = {
        "type": "matte",
        "color": [1, 1, 1],
        "textures": {"height": heights},
        "height_scale": SCALE,
    }
    world.add_object(**rough_sphere(change), **look)
    world.add_light("sun", direction=[-3, -2.3, -1.2], irradiance=np.pi)
    camera = raycam.Camera.look_at([3, 2.5, 1.5], [0, 0, 0], size=(160, 160), fov=30)
    frame = raycam.render(world, camera, integrator="path", samples=64, max_depth=2, channels=["color"])
    patches = frame["color"][56:104, 56:104, 0].reshape(3, 16, 3, 16).mean((1, 3))
    assert patches.ravel() == pytest.approx(np.array(MITSUBA[change]), rel=0.005)


def test_distant_relief_is_smooth() -> None:
    """One sample per pixel: slopes are averaged over the footprint."""
    world = raycam.World()
    heights = np.random.default_rng(3).random((64, 64)).astype(np.float32)
    bricks = raycam.Texture(heights, repeat=50)
    world.add_object(plane=1000, type="matte", color=[1, 1, 1], textures={"height": bricks}, height_scale=0.2)
    world.add_light("sun", direction=[0, 1, -1], irradiance=np.pi)
    camera = raycam.Camera.look_at([0, 0, 2], [0, 30, 0.5], size=(64, 64), fov=30)
    frame = raycam.render(world, camera, integrator="direct", samples=1, channels=["color", "depth"])
    depth = frame["depth"]
    far = frame["color"][..., 0][(depth > 300) & np.isfinite(depth)]
    near = frame["color"][..., 0][depth < 10]
    assert far == pytest.approx(np.sqrt(0.5), abs=0.02)
    assert near.std() > 0.1


def test_invalid_height_maps_are_refused() -> None:
    world = raycam.World()
    with raises(raycam.WorldError, code="missing_value", mentions=["height_scale"]):
        world.add_object(plane=1, height_scale=0.1)
    with raises(raycam.WorldError, code="out_of_range", mentions=["height_scale"]):
        world.add_object(plane=1, textures={"height": wave_image()}, height_scale=np.inf)
    with raises(raycam.WorldError, code="missing_value", mentions=["textures.height"]):
        world.add_object(
            vertices=[[0, 0, 0], [1, 0, 0], [0, 1, 0]],
            triangles=[[0, 1, 2]],
            textures={"height": wave_image()},
        )
    with raises(raycam.WorldError, code="conflicting_values", mentions=["filter"]):
        world.add_object(plane=1, textures={"height": raycam.Texture(wave_image(), filter="nearest")})
    with raises(raycam.WorldError, code="conflicting_values", mentions=["strength"]):
        world.add_object(plane=1, textures={"height": raycam.Texture(wave_image(), strength=2)})


def test_height_scale_of_an_object_can_be_changed() -> None:
    world = raycam.World()
    number = world.add_object(plane=1, textures={"height": wave_image()}, height_scale=0.1)
    world.set_object(number, height_scale=0.2)
    expected = raycam.World()
    expected.add_object(plane=1, textures={"height": wave_image()}, height_scale=0.2)
    assert world.to_bytes() == expected.to_bytes()


def test_gltf_export_reports_the_height_map(tmp_path: Path) -> None:
    world = raycam.World()
    world.add_object(plane=1, textures={"height": wave_image()})
    with warns(raycam.Notice, code="not_written", mentions=["height"]):
        world.to_gltf(tmp_path / "a.glb")


def obj_plane(folder: Path, options: str) -> Path:
    """A plane of 2 x 2 m as an OBJ file with a bump map.

    The bump map is a 16-bit image of waves from 0 to 1.
    """
    values = (wave_image() / AMPLITUDE + 1) / 2
    Image.fromarray(np.round(values * 65535).astype(np.uint16)).save(folder / "waves.png")
    (folder / "a.mtl").write_text(f"newmtl m\nKd 1 1 1\nillum 1\nmap_Bump {options} waves.png\n")
    corners = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    (folder / "a.obj").write_text(f"mtllib a.mtl\n{corners}usemtl m\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n")
    return folder / "a.obj"


def seen_from_above(world: raycam.World) -> Floats:
    world.add_light("sun", direction=SUN, irradiance=np.pi)
    camera = raycam.Camera.look_at([0.1, 0, 3], [0.1, 0, 0], up=[0, 1, 0], size=(96, 96), fov=20)
    return raycam.render(world, camera, integrator="direct", samples=1, channels=["color"])["color"]


@pytest.mark.parametrize(("options", "scale"), [("", 1), ("-bm 3", 3), ("-s 2 2 1 -bm 3", 1.5)])
def test_mtl_bump_raises_white_by_a_texel(tmp_path: Path, options: str, scale: float) -> None:
    with warns(raycam.Notice, code="assumed_convention", mentions=["waves.png", "height_scale"]):
        world = raycam.load(obj_plane(tmp_path, options))
    by_file = seen_from_above(world)
    repeat = 2 if "-s" in options else 1
    heights = raycam.Texture(wave_image() / AMPLITUDE / 2, repeat=repeat)
    expected = raycam.World()
    look: dict[str, Any] = {"color": [1, 1, 1], "textures": {"height": heights}}
    expected.add_object(plane=2, **look, height_scale=scale * 2 / SIDE)
    assert by_file == pytest.approx(seen_from_above(expected), abs=2e-3)
    assert np.ptp(by_file) > 0.01


def test_height_scale_defines_the_unit_of_heights_in_mtl_files(tmp_path: Path) -> None:
    path = obj_plane(tmp_path, "")
    found, expected = raycam.World(), raycam.World()
    look: dict[str, Any] = {
        "color": [1, 1, 1],
        "textures": {"height": tmp_path / "waves.png"},
        "height_scale": 0.02,
    }
    expected.add_object(plane=2, **look)
    with raises(raycam.WorldError, code="missing_value", mentions=["height_scale"]):
        found.add_object(mesh=path, displace=True)
    number = found.add_object(mesh=path, height_scale=0.02)
    assert seen_from_above(found) == pytest.approx(seen_from_above(expected), abs=1e-5)
    found.set_object(number, displace={"max_edge": 0.1})
    assert np.ptp(found.triangles(number)[..., 2]) > 0.01
