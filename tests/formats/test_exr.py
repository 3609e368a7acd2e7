"""EXR files with premultiplied alpha, cube maps, X Y Z and layers, written by OpenEXR."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenEXR
import pytest
import raycam
from support.raises import raises
from support.texels import albedo_of

COLUMNS, ROWS = 12, 6


def pixels(seed: int = 0, channels: int = 3) -> npt.NDArray[np.float32]:
    return np.random.default_rng(seed).random((ROWS, COLUMNS, channels)).astype(np.float32)


def write(path: Path, channels: dict[str, Any], **header: Any) -> None:
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage} | header
    OpenEXR.File(header, channels).write(str(path))


def check(path: Path, expected: npt.NDArray[Any], tolerance: float = 1e-6) -> list[str]:
    found, notices = albedo_of(path, (COLUMNS, ROWS))
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)
    return [notice.code for notice in notices]


def test_colors_are_divided_by_alpha(tmp_path: Path) -> None:
    color, alpha = pixels(), 0.1 + 0.9 * pixels(1, 1)
    alpha[0, :3] = 1
    write(tmp_path / "a.exr", {"RGBA": np.dstack([color * alpha, alpha])})
    assert check(tmp_path / "a.exr", color) == []


def test_transparent_image_of_raycam_keeps_its_colors_at_edges(tmp_path: Path) -> None:
    """Every pixel that shows the unlit green ball is green after reading the file back.

    The background is transparent.
    """
    world = raycam.World()
    world.add_object(sphere={"radius": 1}, type="unlit", color=[0.1, 0.7, 0.2])
    camera = raycam.Camera.look_at([0, -4, 0], [0, 0, 0], size=(COLUMNS, ROWS), fov=40)
    frame = raycam.render(world, camera, transparent_background=True, samples=64, integrator="flat")
    frame.save(tmp_path / "a.exr")
    partly = (frame["alpha"] > 0) & (frame["alpha"] < 1)
    assert partly.sum() > 4
    found, _ = albedo_of(tmp_path / "a.exr", (COLUMNS, ROWS))
    np.testing.assert_allclose(found[partly], np.broadcast_to([0.1, 0.7, 0.2], (partly.sum(), 3)), atol=2e-3)


def test_cie_xyz_channels_are_converted_to_linear_srgb(tmp_path: Path) -> None:
    color = pixels()
    # IEC 61966-2-1, the matrix to XYZ.
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    xyz = (color @ to_xyz.T).astype(np.float32)
    write(tmp_path / "a.exr", {name: np.ascontiguousarray(xyz[..., i]) for i, name in enumerate("XYZ")})
    assert check(tmp_path / "a.exr", color, tolerance=5e-4) == ["assumed_convention"]


@pytest.mark.parametrize("layer", ["ViewLayer.Combined", "rgba", "View Layer 1.diffuse"])
def test_layer_with_colors_is_read(tmp_path: Path, layer: str) -> None:
    color, other = pixels(), pixels(3)
    channels = {f"{layer}.{name}": np.ascontiguousarray(color[..., i]) for i, name in enumerate("RGB")}
    channels["ViewLayer.Depth.Z"] = np.ascontiguousarray(other[..., 0])
    write(tmp_path / "a.exr", channels)
    assert check(tmp_path / "a.exr", color) == []


def test_combined_layer_of_blender_is_preferred(tmp_path: Path) -> None:
    """The channels are those of Blender's multilayer files, which contain many passes.

    The names of other passes come first, and an alpha channel is present.
    """
    color, alpha = pixels(), 0.5 + 0.5 * pixels(1, 1)
    layers = {
        "ViewLayer.Combined": np.dstack([color * alpha, alpha]),
        "ViewLayer.AO": pixels(4),
        "A.Emit": pixels(5),
    }
    channels = {
        f"{layer}.{name}": np.ascontiguousarray(values[..., i])
        for layer, values in layers.items()
        for i, name in enumerate("RGBA"[: values.shape[-1]])
    }
    write(tmp_path / "a.exr", channels)
    assert check(tmp_path / "a.exr", color) == ["first_only"]


def test_first_of_several_parts_with_colors_is_read(tmp_path: Path) -> None:
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    parts = [
        OpenEXR.Part(dict(header), {"Z": np.ascontiguousarray(pixels(2)[..., 0])}, "depth"),
        OpenEXR.Part(dict(header), {"RGB": pixels()}, "left"),
        OpenEXR.Part(dict(header), {"RGB": pixels(1)}, "right"),
    ]
    OpenEXR.File(parts).write(str(tmp_path / "a.exr"))
    assert check(tmp_path / "a.exr", pixels()) == ["first_only"]


def test_luminance_chroma_image_is_refused_with_its_channels(tmp_path: Path) -> None:
    write(
        tmp_path / "a.exr",
        {name: np.ascontiguousarray(pixels()[..., i]) for i, name in enumerate(["Y", "RY", "BY"])},
    )
    with raises(raycam.FormatError, code="unsupported_feature", mentions=["RY", "BY"]):
        albedo_of(tmp_path / "a.exr", (COLUMNS, ROWS))


def cube_direction(face: int, column: float, row: float, side: int) -> npt.NDArray[np.float64]:
    """The direction of a cube map's texel, as documented in ImfEnvmap.h and ImfEnvmap.cpp.

    The function inverts `CubeMap::pixelPosition` to get the position in the face, and applies
    `CubeMap::direction`.
    """
    last = side - 1
    in_face = {
        0: (last - row, column),
        1: (last - row, last - column),
        2: (column, last - row),
        3: (column, row),
        4: (last - column, last - row),
        5: (column, last - row),
    }[face]
    x, y = (2 * np.array(in_face) / last - 1).tolist()
    return np.array([[1, x, y], [-1, x, y], [x, 1, y], [x, -1, y], [x, y, 1], [x, y, -1]][face])


def test_cube_map_shows_the_colors_of_its_directions(tmp_path: Path) -> None:
    """Colours encode directions, so each texel of the panorama must contain its own direction."""
    side = 64
    faces = [
        [[cube_direction(face, column, row, side) for column in range(side)] for row in range(side)]
        for face in range(6)
    ]
    directions = np.array(faces).reshape(6 * side, side, 3)
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    image = (0.5 + 0.5 * directions).astype(np.float32)
    write(tmp_path / "a.exr", {"RGB": image}, envmap=OpenEXR.ENVMAP_CUBE)
    size = (4 * side, 2 * side)
    found, notices = albedo_of(tmp_path / "a.exr", size)
    assert [notice.code for notice in notices] == ["approximated_value"]
    # ImfEnvmap.h, LatLongMap: longitude pi at the left, -pi at the right, 0 along +z; latitude pi / 2 at the top.
    longitude = np.pi * (1 - 2 * (np.arange(size[0]) + 0.5) / size[0])
    latitude = np.pi * (0.5 - (np.arange(size[1])[:, None] + 0.5) / size[1])
    sin, cos = np.sin(latitude), np.cos(latitude)
    expected = np.dstack(np.broadcast_arrays(np.sin(longitude) * cos, sin, np.cos(longitude) * cos))
    np.testing.assert_allclose(2 * found - 1, expected, atol=2e-3)


def test_panorama_that_is_not_twice_as_wide_as_high_gives_a_notice(tmp_path: Path) -> None:
    for name, shape, noticed in [
        ("a.exr", (16, 32), False),
        ("b.exr", (16, 16), True),
        ("c.exr", (96, 16), True),
    ]:
        write(tmp_path / name, {"RGB": np.full((*shape, 3), 0.5, np.float32)})
        world = raycam.World(folder=tmp_path)
        world.add_object(sphere={"radius": 1})
        world.add_light(type="environment", image=name)
        found = [notice for notice in world.notices if notice.code == "implausible"]
        assert len(found) == noticed
        assert all(name in notice.subjects[0] for notice in found)
