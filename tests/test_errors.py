"""Errors for invalid input contain the given value, the expected values and the location."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.errors import nearest
from support.raises import raises

K = np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]])
SIZE = (64, 48)
TRIANGLE = (np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]))


def with_entry(matrix: np.ndarray, i: int, j: int, value: float) -> np.ndarray:
    changed = np.array(matrix, dtype=float)
    changed[i, j] = value
    return changed


def mesh(vertices: object = TRIANGLE[0], faces: object = TRIANGLE[1], **keys: object) -> int:
    return raycam.World().add_mesh(vertices, faces, **keys)  # type: ignore[arg-type]


def camera(k: object = K, r: object = np.eye(3), c: object = (0, 0, 0), size: object = SIZE) -> raycam.Camera:
    return raycam.Camera(k, r, c, size)  # type: ignore[arg-type]


def box_world() -> raycam.World:
    world = raycam.World()
    world.add_object(box={"size": 1})
    return world


CASES: dict[str, tuple[Callable[[], object], type[Exception], list[str]]] = {
    # Errors of meshes
    "nan vertex": (
        lambda: mesh(with_entry(TRIANGLE[0], 1, 2, np.nan)),
        raycam.WorldError,
        ["vert", "1", "finite"],
    ),
    "infinite vertex": (
        lambda: mesh(with_entry(TRIANGLE[0], 2, 0, np.inf)),
        raycam.WorldError,
        ["vert", "finite"],
    ),
    "index too large": (lambda: mesh(faces=[[0, 1, 3]]), raycam.WorldError, ["3", "triangle"]),
    "index negative": (lambda: mesh(faces=[[0, 1, -1]]), raycam.WorldError, ["-1"]),
    "no faces": (
        lambda: mesh(faces=np.zeros((0, 3), int)),
        raycam.WorldError,
        ["faces", "empty", "triangle"],
    ),
    "no vertices": (lambda: mesh(vertices=np.zeros((0, 3))), raycam.WorldError, ["vert"]),
    "quads": (
        lambda: mesh(faces=[[0, 1, 2, 0]]),
        raycam.WorldError,
        ["faces", "[m, 3]", "[1, 4]", "triangles"],
    ),
    "float faces": (lambda: mesh(faces=[[0.0, 1.0, 2.0]]), raycam.WorldError, ["faces", "float64", "whole"]),
    "flat vertices": (
        lambda: mesh(vertices=[[0, 0], [1, 0]]),
        raycam.WorldError,
        ["vertices", "[n, 3]", "[2, 2]"],
    ),
    "text vertices": (lambda: mesh(vertices=[["a", "b", "c"]]), raycam.WorldError, ["vertices", "numbers"]),
    "ragged vertices": (lambda: mesh(vertices=[[0, 0, 0], [1]]), raycam.WorldError, ["vertices", "[n, 3]"]),
    "object array": (
        lambda: mesh(vertices=np.array([[None] * 3])),
        raycam.WorldError,
        ["vertices", "object"],
    ),
    "too few colours": (
        lambda: mesh(face_colors=np.ones((2, 3))),
        raycam.WorldError,
        ["face_colors", "2", "1"],
    ),
    "bytes as floats": (lambda: mesh(face_colors=[[255, 0, 0]]), raycam.WorldError, ["face_colors", "255"]),
    "negative colour": (lambda: mesh(material={"color": [-0.1, 0, 0]}), raycam.WorldError, ["color", "-0.1"]),
    "colour out of range": (
        lambda: mesh(material={"color": [0, 0, 1.5]}),
        raycam.WorldError,
        ["color", "1.5"],
    ),
    "colour text": (lambda: mesh(material={"color": "redd"}), raycam.WorldError, ["color", "red", "#rrggbb"]),
    "material key": (lambda: mesh(material={"specluar": 1}), raycam.WorldError, ["specluar", "specular"]),
    "name twice": (lambda: mesh(name="a", material={"name": "b"}), raycam.WorldError, ["name", "twice"]),
    "unknown shape": (lambda: raycam.World().add_object(sphre={}), raycam.WorldError, ["sphre", "sphere"]),
    "no shape": (lambda: raycam.World().add_object(name="a"), raycam.WorldError, ["box", "mesh"]),
    "singular transform": (lambda: mesh(scale=[1, 0, 1]), raycam.WorldError, ["0", "scale"]),
    "unknown light": (lambda: raycam.World().add_light(type="sn"), raycam.WorldError, ["sn", "sun"]),
    "dark sun": (
        lambda: raycam.World().add_light(type="sun", direction=[0, 0, 0], irradiance=[1, 1, 1]),
        raycam.WorldError,
        ["direction"],
    ),
    "up": (lambda: raycam.World(up="x"), raycam.Error, ["x", '"z"', '"y"']),  # type: ignore[arg-type]
    # Errors of cameras
    "zero focal": (lambda: camera(with_entry(K, 0, 0, 0)), raycam.CameraError, ["focal", "0"]),
    "negative focal": (lambda: camera(with_entry(K, 1, 1, -500)), raycam.CameraError, ["focal", "-500"]),
    "singular K": (lambda: camera(with_entry(K, 2, 2, 0)), raycam.CameraError, ["K"]),
    "K not triangular": (lambda: camera(with_entry(K, 2, 0, 1)), raycam.CameraError, ["K", "triangular"]),
    "nan K": (lambda: camera(with_entry(K, 0, 2, np.nan)), raycam.CameraError, ["K", "finite"]),
    "R is no rotation": (
        lambda: camera(r=1.1 * np.eye(3)),
        raycam.CameraError,
        ["R", "rotation", "2.100e-1"],
    ),
    "R reflects": (lambda: camera(r=np.diag([1.0, 1, -1])), raycam.CameraError, ["reflection"]),
    "nan C": (lambda: camera(c=[0, 0, np.nan]), raycam.CameraError, ["cent", "finite"]),
    "size 0": (lambda: camera(size=(0, 48)), raycam.CameraError, ["0 x 48"]),
    "size too large": (lambda: camera(size=(65537, 1)), raycam.CameraError, ["65537", "65536"]),
    "too many pixels": (lambda: camera(size=(65536, 65536)), raycam.CameraError, ["65536 x 65536"]),
    "size of one": (lambda: camera(size=640), raycam.CameraError, ["size", "(width, height)", "640"]),
    "fractional size": (lambda: camera(size=(64.5, 48)), raycam.CameraError, ["width", "64.5"]),
    "K shape": (lambda: camera(np.eye(4)), raycam.CameraError, ["K", "[3, 3]", "[4, 4]"]),
    "K none": (lambda: camera(None), raycam.CameraError, ["K", "object"]),
    "rank 2": (
        lambda: raycam.Camera.from_matrix(np.diag([1.0, 1, 0]) @ np.eye(3, 4), SIZE),
        raycam.CameraError,
        ["rank"],
    ),
    "distortion": (
        lambda: raycam.Camera.from_opencv(K, [0, 0, 0], [0, 0, 0], SIZE, [0.1, 0, 0]),
        raycam.CameraError,
        ["distortion", "0.1", "3 coefficients", "14"],
    ),
    "transposed pose": (
        lambda: raycam.Camera.from_opengl(K, with_entry(np.eye(4), 3, 0, 1), SIZE),
        raycam.CameraError,
        ["0 0 0 1", "transposed"],
    ),
    "two intrinsics": (
        lambda: raycam.Camera.from_pose([0, 0, 0], focal=500, fov=45),
        raycam.CameraError,
        ["one of focal, fov and K", "focal and fov"],
    ),
    "no intrinsics": (
        lambda: raycam.Camera.from_pose([0, 0, 0]),
        raycam.CameraError,
        ["focal, fov and K", "none"],
    ),
    "wide fov": (
        lambda: raycam.Camera.from_pose([0, 0, 0], fov=180),
        raycam.CameraError,
        ["180", "field of view"],
    ),
    "look at itself": (
        lambda: raycam.Camera.look_at([1, 1, 1], [1, 1, 1]),
        raycam.CameraError,
        ["eye", "target", "different"],
    ),
    "look along up": (
        lambda: raycam.Camera.look_at([0, 0, 5], [0, 0, 0]),
        raycam.CameraError,
        ["up", "parallel"],
    ),
    "pixel centre": (
        lambda: raycam.Camera(K, np.eye(3), [0, 0, 0], SIZE, pixel_center="centre"),  # type: ignore[arg-type]
        raycam.CameraError,
        ["centre", '"integer"', '"half"'],
    ),
    "skew twice": (
        lambda: raycam.Camera(with_entry(K, 0, 1, 2), np.eye(3), [0, 0, 0], SIZE, skew=3),
        raycam.CameraError,
        ["skew", "K[0, 1]"],
    ),
    "points": (
        lambda: camera().project(np.zeros((2, 2))),
        raycam.SettingsError,
        ["points", "[n, 3]", "[2, 2]"],
    ),
    "pixels": (lambda: camera().rays(np.zeros((2, 3))), raycam.SettingsError, ["pixels", "[n, 2]", "[2, 3]"]),
    # Errors of rendering
    "channel": (
        lambda: raycam.render(box_world(), channels=["dpeth"]),
        raycam.SettingsError,
        ["dpeth", "'depth'"],
    ),
    "integrator": (
        lambda: raycam.render(box_world(), integrator="falt"),  # type: ignore[arg-type]
        raycam.SettingsError,
        ["falt", '"flat"'],
    ),
    "filter": (
        lambda: raycam.render(box_world(), filter="blackmanharris"),  # type: ignore[arg-type]
        raycam.SettingsError,
        ["blackmanharris", '"blackman-harris"'],
    ),
    "samples 0": (lambda: raycam.render(box_world(), samples=0), raycam.SettingsError, ["samples", "0", "1"]),
    "samples float": (
        lambda: raycam.render(box_world(), samples=1.5),  # type: ignore[arg-type]
        raycam.SettingsError,
        ["samples", "whole", "1.5"],
    ),
    "threads 0": (lambda: raycam.render(box_world(), threads=0), raycam.SettingsError, ["threads", "0"]),
    "no channels": (
        lambda: raycam.render(box_world(), channels=[]),
        raycam.SettingsError,
        ["channels", "empty"],
    ),
    "region outside": (
        lambda: raycam.render(box_world(), region=(600, 0, 100, 10)),
        raycam.SettingsError,
        ["600", "640"],
    ),
    "region short": (
        lambda: raycam.render(box_world(), region=(0, 0, 1)),
        raycam.SettingsError,
        ["region", "height"],
    ),
    "negative occlusion": (
        lambda: raycam.render(box_world(), ambient_occlusion=-1.0),
        raycam.SettingsError,
        ["ambient_occlusion", "-1"],
    ),
    "samples of the reference": (
        lambda: raycam.render(box_world(), integrator="reference", samples=4),
        raycam.SettingsError,
        ["samples", "reference"],
    ),
    "nothing to see": (lambda: raycam.render(raycam.World()), raycam.Error, ["no objects"]),
    "rays": (
        lambda: box_world().cast_rays([[0, 0]], [[0, 0, 1]]),
        raycam.SettingsError,
        ["origins", "[1, 2]"],
    ),
    "uneven rays": (
        lambda: box_world().cast_rays(np.zeros((2, 3)), np.ones((3, 3))),
        raycam.SettingsError,
        ["[2, 3]", "[3, 3]", "same shape"],
    ),
    "t_max": (
        lambda: box_world().occluded(np.zeros((2, 3)), np.ones((2, 3)), [1, 2, 3]),
        raycam.SettingsError,
        ["t_max", "[2]", "[3]"],
    ),
    # Errors of descriptions
    "unknown key": (
        lambda: raycam.World.from_dict({"object": [{"box": {"sise": 1}}]}),
        raycam.WorldError,
        ["object[0].box", "sise", "size"],
    ),
    "unknown table": (
        lambda: raycam.World.from_dict({"objcet": []}),
        raycam.WorldError,
        ["objcet", "object"],
    ),
    "key is no text": (lambda: raycam.World.from_dict({1: 2}), raycam.WorldError, ["1", "string"]),  # type: ignore[dict-item]
    "value is no value": (
        lambda: raycam.World().add_object(box={"size": {1, 2}}),
        raycam.WorldError,
        ["box.size", "set"],
    ),
    "missing mesh": (
        lambda: raycam.World().add_object(mesh="nowhere.obj"),
        FileNotFoundError,
        ["nowhere.obj"],
    ),
    "mesh outside": (
        lambda: raycam.World.from_dict({"object": [{"mesh": "../a.obj"}]}),
        raycam.FormatError,
        ["../a.obj", "folder"],
    ),
    "camera name": (lambda: box_world().camera("front"), raycam.WorldError, ["front"]),
}


@pytest.mark.parametrize("name", CASES)
def test_invalid_input_raises_with_given_and_expected_values(name: str) -> None:
    call, kind, words = CASES[name]
    with pytest.raises(kind) as caught:
        call()
    message = str(caught.value)
    missing = [word for word in words if word not in message]
    assert not missing, f"{message!r} does not say {missing}"
    assert "\n" not in message


def test_raycam_errors_are_value_errors() -> None:
    for kind in (raycam.WorldError, raycam.CameraError, raycam.FormatError, raycam.SettingsError):
        assert issubclass(kind, raycam.Error)
        assert issubclass(kind, ValueError)


def test_failed_call_leaves_the_world_unchanged() -> None:
    world = box_world()
    before = world.counts
    for description in ({"box": {"size": -1}}, {"sphere": {}, "color": [2, 0, 0]}, {"torus": {}, "scale": 0}):
        with pytest.raises(raycam.WorldError):
            world.add_object(description)
    with pytest.raises(raycam.WorldError):
        world.add_light(type="bulb", position=[0, 0, 1])
    assert world.counts == before
    assert world.notices == []
    assert world.add_object(sphere={}) == 1


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("up = 3", ["1", "up"]),
        ('[[object]]\nbox = { size = 1 }\ncolour = "#ffffff"', ["3", "object[0]", "colour", "color"]),
        ("[camera]\nfocal = -2\nlocation = [0, 0, 0]", ["focal", "-2"]),
        ("[[object]\n", ["1"]),
    ],
)
def test_errors_in_world_files_contain_file_and_line(tmp_path: Path, text: str, words: list[str]) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(raycam.Error) as caught:
        raycam.load(path)
    message = str(caught.value)
    assert "bad.toml" in message
    assert re.search(r"bad\.toml(:\d+)?: ", message)
    assert not [word for word in words if word not in message], message


def test_unreadable_files_raise_with_their_name(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError) as missing:
        raycam.load(tmp_path / "nowhere.toml")
    assert missing.value.filename == str(tmp_path / "nowhere.toml")
    (tmp_path / "folder.ply").mkdir()
    with raises(OSError, code="file_unreadable", mentions=["folder.ply"]):
        raycam.load(tmp_path / "folder.ply")
    (tmp_path / "a.xyz").write_text("x")
    with raises(raycam.FormatError, code="unknown_format", mentions=[".toml"]):
        raycam.load(tmp_path / "a.xyz")
    for ending in (".toml", ".obj", ".ply", ".stl", ".off"):
        path = tmp_path / f"empty{ending}"
        path.write_bytes(b"")
        if ending != ".toml":
            with raises(raycam.Error, code="empty_file", mentions=[path.name]):
                raycam.load(path)
        path.write_bytes(bytes(range(256)))
        with raises(raycam.Error, mentions=[path.name]):
            raycam.load(path)


def test_nearest_suggests_similar_names() -> None:
    assert "did you mean 'depth'?" in nearest("channel", "Dept", ["color", "depth"])
    assert "did you mean" not in nearest("channel", "zzz", ["color", "depth"])
    assert "color, depth" in nearest("channel", "zzz", ["color", "depth"])
