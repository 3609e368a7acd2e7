"""Arguments: arrays, numbers and names; invalid values for every public call."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.arguments import as_number, floats, plain_numbers, real, size_of, whole
from raycam.errors import CameraError, SettingsError
from support.raises import raises


def test_floats_accepts_every_kind_of_number() -> None:
    for value in ([[1, 2]], np.array([[1, 2]], ">i2"), np.array([[1, 0, 2, 0]], np.float32)[:, ::2]):
        array = floats("a", value, ("n", 2))
        assert array.dtype == np.float64
        assert array.dtype.isnative
        assert array.flags.c_contiguous
        np.testing.assert_array_equal(array, [[1, 2]])
    assert floats("a", 3, ()).shape == ()
    assert floats("a", np.zeros((0, 3)), ("n", 3)).shape == (0, 3)


@pytest.mark.parametrize("value", [["1", "2", "3"], [1j, 0, 0], [True, False, True], None, {}, [[1], [2, 3]]])
def test_floats_refuses_values_that_are_not_numbers(value: object) -> None:
    with raises(CameraError, code="wrong_type", mentions=["points", "[3]"]):
        floats("points", value, (3,), error=CameraError)  # type: ignore[arg-type]


def test_floats_lists_all_accepted_shapes() -> None:
    with raises(SettingsError, code="wrong_shape", mentions=["[3]", "[n, 3]", "[2, 2]"]):
        floats("a", np.zeros((2, 2)), (3,), ("n", 3))


def test_whole_checks_type_and_range() -> None:
    assert whole("a", np.int16(3), 0, 5) == 3
    for bad in (1.0, "1", True, None, np.float32(1)):
        with raises(SettingsError, code="wrong_type", mentions=["a"]):
            whole("a", bad, 0, 5)
    with raises(SettingsError, code="out_of_range", mentions=["a", "6", "0", "5"]):
        whole("a", 6, 0, 5)


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (3, 3),
        (np.uint8(3), 3),
        (np.array(3), 3),
        (np.float32(0.5), 0.5),
        (np.array(0.5, np.float16), 0.5),
        (Fraction(1, 2), 0.5),
        (np.float64("inf"), float("inf")),
    ],
)
def test_as_number_returns_a_python_number(value: object, expected: float) -> None:
    number = as_number(value)
    assert type(number) is type(expected)
    assert number == expected


@pytest.mark.parametrize(
    "value",
    [
        *(True, np.True_, np.array(True), "3", b"3", None, 1j, np.complex64(1), [3], {}),
        *(np.array([3]), np.timedelta64(3, "s"), np.datetime64("2026-01-01"), np.ma.masked),
    ],
)
def test_as_number_returns_none_for_other_values(value: object) -> None:
    assert as_number(value) is None


def test_plain_numbers_converts_nested_scalars() -> None:
    array = np.zeros(3)
    found = plain_numbers(
        {"a": {np.int64(1): np.float32(0.5)}, "b": [np.array(2), "x", (np.uint8(3),)], "c": array}
    )
    assert found == {"a": {1: 0.5}, "b": [2, "x", (3,)], "c": array}
    assert found["c"] is array
    assert json.dumps(found["b"]) == '[2, "x", [3]]'


def test_real_with_above_excludes_the_lower_limit() -> None:
    assert real("a", np.float32(0.5), 0, above=True) == 0.5
    for bad in (0, -1, float("nan"), 2.0):
        with raises(SettingsError, code="out_of_range", mentions=["a", "0", "1"]):
            real("a", bad, 0, 1, above=True)
    with raises(SettingsError, code="wrong_type", mentions=["a"]):
        real("a", 10**400)


def test_size_of_checks_image_sizes() -> None:
    assert size_of(np.array([640, 480])) == (640, 480)
    for bad in ((1, 2, 3), (1,), 5, (1.5, 2), (-1, 2)):
        with pytest.raises(SettingsError):
            size_of(bad)  # type: ignore[arg-type]


class Tensor:
    """A tensor that supports only DLPack."""

    def __init__(self, values: object) -> None:
        self.values = np.asarray(values, dtype=np.float32)

    def __dlpack__(self, **options: object) -> object:
        return self.values.__dlpack__()

    def __dlpack_device__(self) -> tuple[int, int]:
        return (1, 0)


class Elsewhere(Tensor):
    """A tensor on a graphics card."""

    device = "cuda:0"

    def __array__(self, *_: object, **__: object) -> object:
        raise TypeError("not on the CPU")


def test_worlds_and_cameras_accept_tensors() -> None:
    import raycam

    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    pose = np.diag([2.0, 2, 2, 1])
    world = raycam.World()
    world.add_mesh(Tensor(corners), [[0, 1, 2]], name="a", matrix=Tensor(pose), color=Tensor([0.5, 0.25, 1]))
    assert world.triangles().tolist() == [(2 * np.array(corners)).tolist()]
    world.set_object("a", location=Tensor([1, 2, 3]), vertices=Tensor(2 * np.array(corners)))
    assert world.triangles()[0, 1].tolist() == [3, 2, 3]
    world.add_light("sun", direction=Tensor([0, 0, -1]), irradiance=Tensor([1, 2, 3]))
    lens = raycam.Camera.from_opencv(
        Tensor([[9, 0, 4], [0, 9, 4], [0, 0, 1]]), Tensor(np.eye(3)), [0, 0, 5], (8, 8)
    )
    assert np.asarray(lens.K)[0, 0] == 9
    before = world.to_bytes()
    for key in ("matrix", "vertices", "location", "color"):
        with raises(raycam.WorldError, code="wrong_type", mentions=[key, "cuda:0", ".cpu()"]):
            world.set_object("a", **{key: Elsewhere(pose)})
    assert world.to_bytes() == before


VERTICES = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
TRIANGLES = np.array([[0, 1, 2], [0, 1, 3], [1, 2, 3]])
ODD: list[Any] = [
    *(None, True, 0, -1, 2**31, 2**63, 10**400, float("nan"), float("inf"), 1e308, 1j, "", "\0", "nan", b"a"),
    *(
        [],
        [[]],
        [1, 2],
        [float("nan")] * 3,
        [None] * 3,
        ["a", "b"],
        {},
        {"a": 1},
        object(),
        range(3),
        lambda: 1,
    ),
    *(np.zeros(0), np.zeros((2, 2, 2)), np.array(["a"]), np.float16(2), np.array(5), np.full((4, 4), np.inf)),
    *(np.ma.masked_array([1, 2, 3], [False, True, False]), np.datetime64("2020-01-01")),
]


def calls(folder: Path) -> dict[str, tuple[Callable[..., Any], dict[str, Any]]]:
    """Calls of the public functions with valid arguments."""
    world = raycam.World()
    world.add_object(vertices=VERTICES, triangles=TRIANGLES, name="a")
    world.add_object(box=1, name="b", location=[2, 0, 0])
    world.add_light(type="sun", direction=[0, 0, -1], irradiance=[1, 1, 1])
    size = (8, 6)
    camera = raycam.Camera.look_at([5, 1, 1], [0, 0, 0], size=size, fov=40)
    rig = raycam.Rig.stereo(camera, 0.1)
    frame = raycam.render(world, camera, samples=1)
    k, eye = camera.K, np.eye(3)
    rays = {"origins": [[5, 0, 0.1]], "directions": [[-1, 0, 0]], "threads": 1}
    points = {"points": VERTICES + 0.1, "objects": [0], "threads": 1}
    lens = {"size": size, "distortion": [0.1, 0, 0, 0], "model": "opencv", "pixel_center": "integer"}
    rendered = {
        "samples": 1,
        "channels": ["color"],
        "integrator": "path",
        "max_depth": 3,
        "seed": 1,
        "threads": 1,
    }
    rendered |= {"exposure": 0.5, "view": "agx", "region": (0, 0, 4, 4), "clamp": 9.0, "filter": "box"}
    mesh = {"vertices": VERTICES, "triangles": TRIANGLES, "name": "c", "category": "q", "matrix": np.eye(4)}
    style = {"color": [1, 1, 1], "type": "principled", "roughness": 0.5, "opacity": 0.5, "visible": True}

    def copied(method: str) -> Callable[..., Any]:
        return lambda **given: getattr(world.copy(), method)(**given)

    def of(function: Callable[..., Any], *first: Any) -> Callable[..., Any]:
        return lambda **given: function(*first, **given)

    return {
        "add_object": (copied("add_object"), mesh | style),
        "add_shape": (
            copied("add_object"),
            {"sphere": 1, "location": [0, 0, 0], "yaw": 3, "scale": 2, "refine": 1},
        ),
        "add_mesh": (
            copied("add_mesh"),
            {"vertices": VERTICES, "faces": TRIANGLES, "material": {"color": [1, 1, 1]}},
        ),
        "add_light": (copied("add_light"), {"type": "point", "position": [0, 0, 3], "intensity": [1, 1, 1]}),
        "add_studio": (
            copied("add_studio"),
            {"camera": camera, "ground": True, "key": True, "exposure": 0.0},
        ),
        "add_camera": (copied("add_camera"), {"name": "x", "camera": camera}),
        "set_object": (
            lambda which, **keys: world.copy().set_object(which, **keys),
            {"which": 0, "visible": False},
        ),
        "set_light": (
            lambda number, **keys: world.copy().set_light(number, **keys),
            {"number": 0, "irradiance": 2},
        ),
        "remove_object": (copied("remove_object"), {"which": 0}),
        "remove_light": (copied("remove_light"), {"number": 0}),
        "cast_rays": (world.cast_rays, rays | {"t_min": 0.0, "t_max": 9.0, "objects": [0], "exclude": [1]}),
        "cast_rays of words": (
            world.cast_rays,
            rays | {"facing": "both", "surface": "first", "fields": ["t"], "exact": True, "coherent": True},
        ),
        "occluded": (world.occluded, rays | {"t_max": 9.0, "exact": False}),
        "intersections": (world.intersections, rays | {"objects": "a"}),
        "count_intersections": (world.count_intersections, rays | {"signed": True}),
        "closest_points": (world.closest_points, points | {"max_distance": 2.0}),
        "signed_distance": (world.signed_distance, points | {"sign": "auto"}),
        "inside": (world.inside, points),
        "winding_number": (world.winding_number, points),
        "visible": (world.visible, {"a": VERTICES, "b": VERTICES + 2, "surface": "first"}),
        "at": (world.at, {"time": 0.5, "animation": None}),
        "camera_at": (of(raycam.load(moving(folder)).camera_at), {"camera": camera, "time": 0.5}),
        "view_from": (world.view_from, {"direction": [1, 1, 1]}),
        "from_bytes": (raycam.World.from_bytes, {"data": world.to_bytes()}),
        "from_dict": (
            raycam.World.from_dict,
            {"description": {"object": [{"box": {}}]}, "texture_memory": 1 << 20},
        ),
        "render": (of(raycam.render, world), rendered | {"camera": camera, "surface": "first"}),
        "render of flags": (
            of(raycam.render, world, camera),
            {
                "samples": 1,
                "transparent_background": True,
                "denoise": False,
                "catcher_truth": False,
                "frame": 1,
            },
        ),
        "render until": (of(raycam.render, world, camera), {"noise_threshold": 9.0, "samples": 2}),
        "ambient_occlusion": (
            of(raycam.render, world, camera),
            {"integrator": "ao", "ambient_occlusion": 1.0},
        ),
        "render_many": (
            of(raycam.render_many, world),
            {"cameras": [camera], "samples": 1, "channels": ["depth"]},
        ),
        "progressive": (
            lambda **given: next(raycam.progressive(world, camera, **given)),
            {"samples": 2, "seed": 1},
        ),
        "flow": (
            of(raycam.flow, world),
            {"camera": camera, "world2": world, "camera2": camera, "threads": 1},
        ),
        "disparity": (
            of(raycam.disparity, world),
            {"left": rig["left"], "right": rig["right"], "of": "left"},
        ),
        "label": (of(raycam.label, world, camera), {"objects": ["a", 1], "margin": (3, 3), "threads": 1}),
        "label of a picture": (of(raycam.label, world, camera), {"instance": frame["instance"]}),
        "keypoints": (
            of(raycam.keypoints, world, camera),
            {"points": VERTICES, "objects": [0] * 4, "tolerance": 0.1},
        ),
        "box3d": (of(raycam.box3d, world), {"number": 0}),
        "explain": (of(raycam.explain, world, camera), {"pixel": (4, 3)}),
        "Camera": (raycam.Camera, lens | {"K": k, "R": eye, "C": [0, 0, 0], "up": "z"}),
        "look_at": (
            raycam.Camera.look_at,
            {"eye": [5, 1, 1], "target": [0, 0, 0], "up": "z", "size": size, "fov": 40},
        ),
        "from_pose": (
            raycam.Camera.from_pose,
            {"location": [1, 2, 3], "yaw": 4.0, "focal": 9.0, "size": size},
        ),
        "from_colmap": (
            raycam.Camera.from_colmap,
            {"model": "PINHOLE", "params": [9, 9, 4, 3], "R": eye, "t": [0, 0, 1], "size": size},
        ),
        "from_matrix": (raycam.Camera.from_matrix, {"P": camera.P, "size": size}),
        "from_opencv": (raycam.Camera.from_opencv, lens | {"K": k, "rvec": [0, 0, 1], "tvec": [0, 0, 1]}),
        "from_transform": (raycam.Camera.from_transform, lens | {"K": k, "world_from_camera": np.eye(4)}),
        "from_quaternion": (
            raycam.Camera.from_quaternion,
            {"K": k, "quaternion": [1, 0, 0, 0], "translation": [0, 0, 0], "size": size, "order": "wxyz"}
            | {"direction": "world_from_camera", "axes": "opencv"},
        ),
        "orthographic": (raycam.Camera.orthographic, {"location": [0, 0, 5], "pitch": -9.0, "height": 2.0}),
        "equirectangular": (raycam.Camera.equirectangular, {"location": [0, 0, 5], "size": (16, 8)}),
        "project": (camera.project, {"points": VERTICES}),
        "rays": (camera.rays, {"pixels": [[1, 2]]}),
        "pixel_map": (camera.pixel_map, {"source": camera}),
        "cropped": (camera.cropped, {"x": 1, "y": 1, "width": 4, "height": 4}),
        "resized": (camera.resized, {"size": size}),
        "replace": (camera.replace, lens | {"K": k, "R": eye, "C": [0, 0, 0], "up": "z"}),
        "undistorted": (camera.undistorted, {"balance": 0.5, "size": size}),
        "exposing": (camera.exposing, {"exposure": 0.1, "readout": 0.1, "direction": "down"}),
        "moving": (camera.moving, {"to": camera, "exposure": 0.1}),
        "with_aperture": (camera.with_aperture, {"radius": 0.1, "focus": 2.0, "blades": 5, "rotation": 3.0}),
        "with_vignetting": (camera.with_vignetting, {"cos4": True, "polynomial": [0.1]}),
        "Rig": (raycam.Rig, {"cameras": {"x": camera}, "R": eye, "C": [0, 0, 0], "name": "r"}),
        "stereo": (of(raycam.Rig.stereo, camera), {"baseline": 0.1, "name": "pair"}),
        "rectified": (rig.rectified, {"left": "left", "right": "right", "K": k, "size": size}),
        "rig.placed": (rig.placed, {"location": [0, 0, 0], "yaw": 4.0}),
        "rig.render": (rig.render, {"world": world, "channels": "depth", "pair": ("left", "right")}),
        "over": (raycam.render(world, camera, transparent_background=True).over, {"background": [1, 0, 0]}),
        "save .png": (
            of(frame.save, folder / "a.png"),
            {"bits": 8, "exposure": 0.0, "view": "agx", "channel": "color"},
        ),
        "save .exr": (of(frame.save, folder / "a.exr"), {"half": False}),
        "to_gltf": (world.to_gltf, {"path": folder / "a.glb"}),
        "load": (
            raycam.load,
            {"source": folder / "moving.toml", "texture_memory": 1 << 20, "folder": folder},
        ),
        "save_cameras": (
            raycam.save_cameras,
            {"cameras": {"x": camera}, "path": folder / "c.json", "format": "nerf"},
        ),
        "Recipe": (raycam.Recipe, {"recipe": {"world": {"object": [{"box": {}}]}}, "seed": 1}),
        "prepare": (world.prepare, {"threads": 1}),
    }


def moving(folder: Path) -> Path:
    """A world file with a video."""
    path = folder / "moving.toml"
    path.write_text(
        "[[object]]\nbox = {}\n[video]\nfps = 5\nseconds = 1\norbit = { target = [0, 0, 0], degrees = 360 }\n"
    )
    return path


def test_invalid_arguments_are_accepted_or_refused_by_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Invalid arguments cause only errors and notices of raycam.

    Errors of NumPy and errors about missing attributes are not allowed. Each argument of each call is tested.
    """
    monkeypatch.chdir(tmp_path)
    faults = []
    for call, (function, right) in calls(tmp_path).items():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", raycam.Notice)
            function(**right)
            for name in right:
                for value in ODD:
                    try:
                        function(**right | {name: value})
                    except (raycam.Error, OSError):
                        pass
                    except Exception as fault:
                        # Python writes these messages itself.
                        if "os.PathLike" not in str(fault) and "null byte" not in str(fault):
                            faults.append(f"{call}({name}={value!r}): {fault!r}")
    assert faults == []
