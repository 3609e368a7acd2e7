"""Unusual files described in public bug reports of other tools."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from PIL import Image
from support.raises import has_notice, raises

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"


def area(world: raycam.World) -> float:
    """The area of all triangles."""
    a, b, c = np.moveaxis(world.triangles(), 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def seen_color(world: raycam.World) -> Any:
    """The base colour at (0.3, 0.3, 0), from above."""
    camera = raycam.Camera.look_at([0.3, 0.3, 3], [0.3, 0.3, 0], [0, 1, 0], size=(1, 1), fov=1)
    return raycam.render(world, camera, channels=["albedo"])["albedo"][0, 0]


def write_exr(path: Path, channels: dict[str, np.ndarray]) -> None:
    """An uncompressed OpenEXR file; float16 and float32 planes may be mixed."""

    def attribute(name: str, kind: str, value: bytes) -> bytes:
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value

    planes = sorted(channels.items())
    height, width = planes[0][1].shape
    kinds = {np.dtype("f2"): 1, np.dtype("f4"): 2}
    listed = b"".join(
        name.encode() + b"\0" + struct.pack("<iB3xii", kinds[p.dtype], 0, 1, 1) for name, p in planes
    )
    box = struct.pack("<4i", 0, 0, width - 1, height - 1)
    head = struct.pack("<ii", 20000630, 2) + b"".join(
        [
            attribute("channels", "chlist", listed + b"\0"),
            attribute("compression", "compression", b"\0"),
            attribute("dataWindow", "box2i", box),
            attribute("displayWindow", "box2i", box),
            attribute("lineOrder", "lineOrder", b"\0"),
            attribute("pixelAspectRatio", "float", struct.pack("<f", 1)),
            attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)),
            attribute("screenWindowWidth", "float", struct.pack("<f", 1)),
            b"\0",
        ]
    )
    rows = []
    for y in range(height):
        row = b"".join(plane[y].tobytes() for _, plane in planes)
        rows.append(struct.pack("<ii", y, len(row)) + row)
    starts = np.cumsum([len(head) + 8 * height, *map(len, rows[:-1])]).astype("<u8")
    path.write_bytes(head + starts.tobytes() + b"".join(rows))


@pytest.mark.parametrize(
    "line",
    [
        "map_Kd wood a.png -s 1 1 1",  # three.js#7943
        "map_Kd wood a.png -clamp on -bm 1",
        "map_Kd -s 1 1 1 wood a.png -o 0 0",
        "map_Kd -o 0.0 -7.0 0.0 -s 1.0 10.0 1.0 -clamp on wood a.png",  # raylib#5535
        'map_Kd "wood a.png"',
        'map_Kd -s 1 "wood a.png" # oak',
        "map_Kd 'wood a.png'",
        "map_Kd wood%20a.png",
        "map_Kd file:wood a.png",
        "map_Kd .\\wood a.png",
        "map_Kd dash -s.png",
        "map_Kd -x 1.png",
    ],
)
def test_mtl_image_is_found_in_every_notation(tmp_path: Path, line: str) -> None:
    pillow = pytest.importorskip("PIL.Image")
    for name in ("wood a.png", "dash -s.png", "-x 1.png"):
        pillow.new("RGB", (4, 4), (10, 200, 30)).save(tmp_path / name)
    (tmp_path / "a.mtl").write_text(f"newmtl a\nKd 1 1 1\n{line}\n")
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\nusemtl a\n{TRIANGLE}")
    world = raycam.load(tmp_path / "a.obj")
    assert world.notices == []
    assert seen_color(world) == pytest.approx([0.003, 0.578, 0.013], abs=1e-3)


def test_mtl_options_after_the_file_name_are_applied(tmp_path: Path) -> None:
    pillow = pytest.importorskip("PIL.Image")
    image = pillow.new("RGB", (64, 64), (255, 255, 255))
    image.paste((0, 0, 0), (0, 0, 32, 64))
    image.save(tmp_path / "halves.png")
    found = []
    for line in ("map_Kd halves.png", "map_Kd halves.png -o 0.5 0", "map_Kd -o 0.5 0 halves.png"):
        (tmp_path / "a.mtl").write_text(f"newmtl a\nKd 1 1 1\n{line}\n")
        (tmp_path / "a.obj").write_text(f"mtllib a.mtl\nusemtl a\n{TRIANGLE}")
        found.append(float(seen_color(raycam.load(tmp_path / "a.obj"))[0]))
    assert found == [0, 1, 1]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.obj", "v 0 0 0\nv 1,5 0 0\nv 0 1 0\nf 1 2 3\n"),  # meshlab#418
        ("b.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0,0 0 1\nf 1 2 3\n"),
        ("a.off", "OFF\n3 1 0\n0 0 0\n1,5 0 0\n0 1 0\n3 0 1 2\n"),
        (
            "a.ply",
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
            "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1,5 0 0\n0 1 0\n3 0 1 2\n",
        ),
    ],
)
def test_decimal_comma_raises_with_the_number(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text(text)
    with raises(
        raycam.FormatError,
        code="wrong_type",
        mentions=[name, next(word for word in text.split() if "," in word)],
    ):
        raycam.load(tmp_path / name)


@pytest.mark.parametrize("name", ["V", "Z", "R", "Y", "luminance.Y"])
@pytest.mark.parametrize("alpha", [False, True])
def test_exr_image_with_one_channel_is_grey(tmp_path: Path, name: str, alpha: bool) -> None:
    # three.js#31493, wision-lab/visionsim#22
    plane = np.full((2, 4), 0.25, "f4")
    write_exr(tmp_path / "a.exr", {name: plane} | ({"A": np.ones((2, 4), "f2")} if alpha else {}))
    world = raycam.World()
    world.add_object(
        vertices=[[0, 0, 0], [1, 0, 0], [0, 1, 0]],
        triangles=[[0, 1, 2]],
        uvs=[[0, 0], [1, 0], [0, 1]],
        texture=str(tmp_path / "a.exr"),
    )
    assert seen_color(world) == pytest.approx([0.25] * 3, abs=1e-4)
    assert has_notice(world.notices, "assumed_convention", "a.exr", f" {name},") == (name != "Y")


def test_exr_image_with_two_unknown_channels_is_refused(tmp_path: Path) -> None:
    plane = np.ones((2, 4), "f4")
    write_exr(tmp_path / "a.exr", {"X": plane, "Z": plane})
    with raises(raycam.FormatError, code="unsupported_feature", mentions=["a.exr"]):
        raycam.World().add_light(type="environment", image=str(tmp_path / "a.exr"))


def test_exr_image_with_half_and_float_channels_is_read(tmp_path: Path) -> None:
    # OpenImageIO#1038
    def plane(value: float, kind: str) -> np.ndarray:
        return np.full((2, 4), value, kind)

    other = {"Diffuse.B": plane(9, "f2"), "Z": plane(7, "f4")}
    write_exr(
        tmp_path / "a.exr", {"R": plane(0.5, "f4"), "G": plane(0.25, "f2"), "B": plane(1, "f4")} | other
    )
    world = raycam.World()
    world.add_object(
        vertices=[[0, 0, 0], [1, 0, 0], [0, 1, 0]],
        triangles=[[0, 1, 2]],
        uvs=[[0, 0], [1, 0], [0, 1]],
        texture=str(tmp_path / "a.exr"),
    )
    assert seen_color(world) == pytest.approx([0.5, 0.25, 1], abs=1e-4)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_image_array_with_nan_or_infinity_is_refused(value: float) -> None:
    # RenderKit/oidn#210
    image = np.full((4, 8, 3), 0.5, "f4")
    image[1, 2, 0] = image[3, 3, 2] = value
    world = raycam.World()
    with raises(raycam.WorldError, code="invalid_world", mentions=["8 x 4"]):
        world.add_light(type="environment", image=image)
    with raises(raycam.WorldError, code="invalid_world", mentions=["8 x 4"]):
        world.add_object("sphere", texture=image)
    assert world.lights == []
    assert not len(world.objects)


def test_backslashes_in_image_paths_are_accepted(tmp_path: Path) -> None:
    # nerfstudio#874
    pillow = pytest.importorskip("PIL.Image")
    (tmp_path / "images").mkdir()
    pillow.new("RGB", (48, 32)).save(tmp_path / "images" / "a.png")
    frame = {"file_path": ".\\images\\a.png", "transform_matrix": np.eye(4).tolist()}
    (tmp_path / "transforms.json").write_text(json.dumps({"camera_angle_x": 0.8, "frames": [frame]}))
    cameras = raycam.load_cameras(tmp_path / "transforms.json")
    assert list(cameras) == ["images/a.png"]
    assert tuple(cameras["images/a.png"].size) == (48, 32)


def test_colmap_images_without_point_lines_raise_or_are_read(tmp_path: Path) -> None:
    # colmap#428
    (tmp_path / "cameras.txt").write_text("1 PINHOLE 64 48 50 50 32 24\n")
    lines = [f"{i} 1 0 0 0 {i} 0 0 1 {name}.jpg\n" for i, name in enumerate("abc", 1)]
    (tmp_path / "points3D.txt").write_text("")
    (tmp_path / "images.txt").write_text("".join(lines))
    with raises(raycam.FormatError, code="syntax", mentions=["images.txt:2"]):
        raycam.load_cameras(tmp_path)
    (tmp_path / "images.txt").write_text("\n".join(lines))
    assert list(raycam.load_cameras(tmp_path)) == ["a.jpg", "b.jpg", "c.jpg"]


POLYGONS = {
    "L": [(3, 1), (1, 1), (1, 3), (0, 3), (0, 0), (3, 0)],
    "comb": [(0, 0), (7, 0), (7, 3), (6, 1), (5, 3), (4, 1), (3, 3), (2, 1), (1, 3), (0, 1)],
}


@pytest.mark.parametrize("shape", POLYGONS)
@pytest.mark.parametrize("first", [0, 1, 3])
@pytest.mark.parametrize("kind", ["obj", "ply", "off"])
def test_concave_polygons_keep_their_area(tmp_path: Path, shape: str, first: int, kind: str) -> None:
    # trimesh#2519; the area by Gauss's formula
    points = POLYGONS[shape][first:] + POLYGONS[shape][:first]
    x, y = np.array(points, float).T
    expected = abs((x * np.roll(y, -1) - y * np.roll(x, -1)).sum()) / 2
    count = len(points)
    rows = [f"{a} {b} 0" for a, b in points]
    indices = " ".join(map(str, range(count)))
    text = {
        "obj": "".join(f"v {row}\n" for row in rows) + "f " + " ".join(map(str, range(1, count + 1))) + "\n",
        "off": "\n".join(["OFF", f"{count} 1 0", *rows, f"{count} {indices}", ""]),
        "ply": "\n".join(
            [
                f"ply\nformat ascii 1.0\nelement vertex {count}",
                *(f"property float {axis}" for axis in "xyz"),
                "element face 1\nproperty list uchar int vertex_indices\nend_header",
                *rows,
                f"{count} {indices}\n",
            ]
        ),
    }[kind]
    (tmp_path / f"a.{kind}").write_text(text)
    world = raycam.load(tmp_path / f"a.{kind}")
    assert area(world) == pytest.approx(expected)
    assert len(world.triangles()) == count - 2


@pytest.mark.parametrize("offset", [[0, 0, 0], [500000.25, 5423123.5, 312.75]])
def test_small_objects_far_from_the_origin_keep_their_size(tmp_path: Path, offset: list[float]) -> None:
    # PotreeConverter#247: a triangle of 1 mm in UTM coordinates
    points = np.array([[0, 0, 0], [0.001, 0, 0], [0, 0.001, 0]]) + offset
    (tmp_path / "a.obj").write_text(
        "".join("v {!r} {!r} {!r}\n".format(*p) for p in points.tolist()) + "f 1 2 3\n"
    )
    assert area(raycam.load(tmp_path / "a.obj")) == pytest.approx(5e-7, rel=1e-5)
    camera = raycam.Camera.look_at(
        points[0] + [2e-4, 2e-4, 0.01], points[0] + [2e-4, 2e-4, 0], [0, 1, 0], size=(1, 1)
    )
    assert raycam.render(tmp_path / "a.obj", camera)["depth"][0, 0] == pytest.approx(0.01, rel=1e-6)


@pytest.mark.parametrize("has_base", [False, True])
def test_sparse_accessor_without_a_base_is_read(tmp_path: Path, has_base: bool) -> None:
    # DiligentFX#265: without a bufferView the rest is zeros
    parts = [
        np.array([1, 2], "<u2").tobytes(),
        np.array([2, 0, 0, 0, 3, 0], "<f4").tobytes(),
        np.array([0, 0, 0] + [9] * 6, "<f4").tobytes(),
    ]
    starts = np.cumsum([0, *map(len, parts)])
    views = [
        {"buffer": 0, "byteOffset": int(start), "byteLength": len(part)}
        for start, part in zip(starts, parts, strict=False)
    ]
    sparse = {"count": 2, "indices": {"bufferView": 0, "componentType": 5123}, "values": {"bufferView": 1}}
    accessor: dict[str, Any] = {"componentType": 5126, "count": 3, "type": "VEC3", "sparse": sparse}
    accessor |= {"min": [0, 0, 0], "max": [2, 3, 0]} | ({"bufferView": 2} if has_base else {})
    data = base64.b64encode(b"".join(parts)).decode()
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [accessor],
        "bufferViews": views,
        "buffers": [
            {"byteLength": sum(map(len, parts)), "uri": f"data:application/octet-stream;base64,{data}"}
        ],
    }
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    assert area(raycam.load(tmp_path / "a.gltf")) == pytest.approx(3)


def test_mtl_image_without_kd_is_shown_unchanged(tmp_path: Path) -> None:
    """mikedh/trimesh#1943: materials with only an image.

    If the file specifies Kd 0 0 0, the image is multiplied by it and black, and a notice is given.
    """
    Image.fromarray(np.full((2, 2, 3), 188, np.uint8)).save(tmp_path / "a.png")
    (tmp_path / "a.obj").write_text(
        "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl m\nf 1/1 2/1 3/1\n"
    )
    camera = raycam.Camera.look_at([0.3, 0.3, 3], [0.3, 0.3, 0], [0, 1, 0], size=(8, 8), fov=5)
    shown = ((188 / 255 + 0.055) / 1.055) ** 2.4
    for kd, factor in (("", 1.0), ("Kd 0.5 0.5 0.5", 0.5), ("Kd 0 0 0", 0.0)):
        (tmp_path / "a.mtl").write_text(f"newmtl m\n{kd}\nmap_Kd a.png\n")
        world = raycam.load(tmp_path / "a.obj")
        seen = raycam.render(world, camera, samples=1, channels=["albedo"])["albedo"][4, 4]
        np.testing.assert_allclose(seen, factor * shown, rtol=1e-3)
        assert has_notice(world.notices, "implausible", "a.mtl:1", "Kd 0 0 0") == (factor == 0)


@pytest.mark.parametrize("value", ["inf 0 0", "nan 0 0", "0 -inf 0"])
@pytest.mark.parametrize("key", ["Kd", "Ke", "Ks"])
def test_mtl_colors_that_are_not_finite_are_ignored_with_a_notice(
    tmp_path: Path, key: str, value: str
) -> None:
    """The result equals that of a file without the line."""
    worlds = []
    for line in (f"{key} {value}\n", ""):
        (tmp_path / "a.mtl").write_text(f"newmtl m\n{line}")
        (tmp_path / "a.obj").write_text("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n")
        worlds.append(raycam.load(tmp_path / "a.obj"))
    assert has_notice(worlds[0].notices, "replaced_value", "a.mtl:2", key)
    camera = raycam.Camera.look_at([0.3, 0.3, 3], [0.3, 0.3, 0], [0, 1, 0], size=(8, 8), fov=5)
    with_line, without = (raycam.render(world, camera, samples=1, integrator="direct") for world in worlds)
    np.testing.assert_array_equal(with_line["color"], without["color"])


@pytest.mark.parametrize("name", ["a.MTL", "a.obj.mtl", "A.mtl", "A.Mtl"])
def test_renamed_material_library_is_found_with_a_notice(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("newmtl m\nKd 0.1 0.2 0.3\n")
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n")
    world = raycam.load(tmp_path / "a.obj")
    assert has_notice(world.notices, "substituted_file", "mtllib", name)
    camera = raycam.Camera.look_at([0.3, 0.3, 3], [0.3, 0.3, 0], [0, 1, 0], size=(8, 8), fov=5)
    seen = raycam.render(world, camera, samples=1, channels=["albedo"])["albedo"][4, 4]
    np.testing.assert_allclose(seen, [0.1, 0.2, 0.3], atol=1e-3)


def test_color_multiplied_with_mesh_colors_gives_a_notice(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nf 1 2 3\n")
    world = raycam.World()
    world.add_object(mesh=tmp_path / "a.obj", color="#00ff00")
    assert has_notice(world.notices, "multiplied_colors", "a.obj", "color")
    world = raycam.World()
    world.add_object(mesh=tmp_path / "a.obj")
    assert world.notices == []
    white = [[1.0, 1.0, 1.0]] * 3
    triangle = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    world.add_mesh(triangle, [[0, 1, 2]], vertex_colors=white, face_colors=white[:1])
    assert has_notice(world.notices, "multiplied_colors", "face_colors", "vertex_colors")


@pytest.mark.parametrize("size", [(1440, 1920), (480, 640)])
def test_intrinsics_of_a_rotated_image_give_a_notice(tmp_path: Path, size: tuple[int, int]) -> None:
    """DLR-RM/BlenderProc#581: K of a landscape image with the size of a portrait image."""
    k = [[1600, 0, size[1] / 2 - 0.5], [0, 1600, size[0] / 2 + 3], [0, 0, 1]]
    path = tmp_path / "a.json"
    for width, height, told in ((*size, True), (size[1], size[0], False)):
        path.write_text(json.dumps({"K": k, "image_width": width, "image_height": height}))
        notices = raycam.load_cameras(path).notices
        assert has_notice(notices, "implausible", "90 degrees") == told, notices
