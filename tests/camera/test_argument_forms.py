"""Paths and names in place of objects, bundled data, and the reprs of objects."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from support.raises import Fault, fault, raises

SIZE = (32, 24)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A world file with two cameras, a mesh and a calibration."""
    path = tmp_path_factory.mktemp("door")
    camera = "size = [32, 24]\nfocal = 30\npitch = 20\nlocation = [-3, 0, 1.2]\n"
    (path / "box.toml").write_text(
        f'[[camera]]\nname = "front"\n{camera}\n[[camera]]\nname = "far"\n{camera.replace("-3", "-6")}\n'
        '[[object]]\nname = "box"\nbox = {}\ncategory = "thing"\n[[light]]\ntype = "sky"\nradiance = 1.0\n'
    )
    (path / "tri.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    return path


@pytest.mark.parametrize("kind", [str, Path])
def test_render_accepts_paths_and_camera_names(folder: Path, kind: type) -> None:
    path = kind(folder / "box.toml")
    world = raycam.load(path)
    for name, camera in world.cameras.items():
        seen = raycam.render(path, name, samples=1)
        assert np.array_equal(seen["color"], raycam.render(world, camera, samples=1)["color"])
    assert raycam.render(path, samples=1).camera == world.camera("front")


def test_render_accepts_the_path_of_a_calibration(folder: Path) -> None:
    world = raycam.load(folder / "box.toml")
    raycam.save_cameras(folder / "far.yaml", world.camera("far"), "opencv")
    seen = raycam.render(world, folder / "far.yaml", samples=1)
    assert seen.size == SIZE


@pytest.mark.parametrize(
    ("camera", "error", "said"),
    [
        ("frnt", raycam.WorldError, fault("unknown_name", "front")),
        (7, raycam.SettingsError, fault("wrong_type")),
        ([1, 2], raycam.SettingsError, fault("wrong_type")),
    ],
)
def test_render_refuses_objects_that_are_not_cameras(
    folder: Path, camera: object, error: type[Exception], said: Fault
) -> None:
    with raises(error, **said):
        raycam.render(folder / "box.toml", camera)  # type: ignore[arg-type]


def test_several_cameras_in_place_of_one_raise(folder: Path) -> None:
    world = raycam.load(folder / "box.toml")
    with raises(raycam.SettingsError, code="wrong_type"):
        raycam.render(world, world.cameras)  # type: ignore[arg-type]


@pytest.mark.parametrize("world", [None, 3, {"object": []}])
def test_render_refuses_objects_that_are_not_worlds(world: object) -> None:
    with raises(raycam.SettingsError, code="wrong_type", mentions=["world"]):
        raycam.render(world)  # type: ignore[arg-type]


def test_label_explain_and_flow_use_the_default_camera(folder: Path) -> None:
    path = folder / "box.toml"
    world = raycam.load(path)
    assert len(raycam.label(path)) == 1
    explained = [
        raycam.explain(path, pixel=(16, 12)),
        raycam.explain(path, (16, 12)),
        raycam.explain(world, "front", (16, 12)),
    ]
    assert len({str(item) for item in explained}) == 1
    assert raycam.flow(path)["flow"].shape == (24, 32, 2)


def test_add_object_and_add_light_accept_names_and_paths(folder: Path) -> None:
    world = raycam.World()
    world.add_object(folder / "tri.obj")
    world.add_object(str(folder / "tri.obj"), location=[0, 0, 1])
    world.add_object("sphere", location=[2, 0, 0])
    world.add_light("sun", direction=[0, 0, -1], irradiance=3)
    assert [item.triangles for item in world.objects][:2] == [1, 1]
    assert [item.name for item in world.objects][2] == "sphere"
    assert world.lights == [
        {"type": "sun", "direction": [0, 0, -1], "irradiance": [3, 3, 3], "angular_diameter": 0}
    ]
    with raises(raycam.WorldError, code="unknown_name", mentions=["'sphere'"]):
        world.add_object("spere")
    with raises(raycam.WorldError, code="unknown_name", mentions=['"sun"']):
        world.add_light("sunn")
    with raises(raycam.WorldError, code="wrong_type"):
        world.add_object(3)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("short", "table"),
    [
        ({"box": [1, 2, 3]}, {"box": {"size": [1, 2, 3]}}),
        ({"box": 2}, {"box": {"size": 2}}),
        ({"plane": np.array([3, 4.0])}, {"plane": {"size": [3, 4]}}),
        ({"sphere": 0.5}, {"sphere": {"radius": 0.5}}),
        ({"cylinder": {}, "radius": 2, "height": 3}, {"cylinder": {"radius": 2, "height": 3}}),
        ({"torus": {"tube": 0.1}, "radius": 2.0}, {"torus": {"tube": 0.1, "radius": 2}}),
    ],
)
def test_shape_size_is_accepted_next_to_or_inside_the_shape(
    short: dict[str, Any], table: dict[str, Any]
) -> None:
    found, expected = raycam.World(), raycam.World()
    found.add_object(**short)
    expected.add_object(table)
    assert np.array_equal(found.triangles(), expected.triangles())
    word = next(iter(table))
    again = raycam.World()
    again.add_object(word, **table[word])
    assert np.array_equal(again.triangles(), expected.triangles())


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"cone": 2}, fault("wrong_type", "'radius'")),
        ({"box": "big"}, fault("wrong_type", "'big'")),
        ({"sphere": {"radius": 1}, "radius": 2}, fault("duplicate_name")),
        ({"mesh": "tri.obj", "radius": 2}, fault("unknown_key", '"radius"')),
        ({"box": {}, "radius": 2}, fault("unknown_key", '"radius"')),
    ],
)
def test_size_without_a_matching_shape_raises(keys: dict[str, Any], said: Fault) -> None:
    with raises(raycam.WorldError, **said):
        raycam.World().add_object(**keys)


@pytest.mark.parametrize("path", [None, 3, raycam.World()])
def test_load_refuses_objects_that_are_not_paths(path: object) -> None:
    with raises(raycam.SettingsError, code="wrong_type", mentions=[type(path).__name__]):
        raycam.load(path)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("keys", "ours"),
    [
        ({"box": {}, "position": [1, 2, 3]}, "location"),
        ({"cube": {}}, "box"),
        ({"box": {}, "rotation": 1}, "yaw"),
        ({"box": {}, "colr": 1}, "color"),
        ({"box": {}, "zzz": 1}, "instance_of"),
    ],
)
def test_object_keys_of_other_programs_raise_with_the_key_of_raycam(keys: dict[str, Any], ours: str) -> None:
    world = raycam.World()
    with raises(raycam.WorldError, code="unknown_key", mentions=[ours]):
        world.add_object(**keys)
    assert not world.objects


@pytest.mark.parametrize(
    ("kind", "word", "ours"),
    [
        ("point", "location", "position"),
        ("sun", "power", "irradiance"),
        ("sun", "strength", "irradiance"),
        ("area", "watts", "radiance"),
        ("environment", "intensity", "scale"),
    ],
)
def test_light_keys_of_other_programs_are_refused_with_the_key_of_raycam(
    kind: str, word: str, ours: str
) -> None:
    world = raycam.World()
    with raises(raycam.WorldError, code="unknown_key", mentions=[word, ours]):
        world.add_light(type=kind, **{word: 1})  # type: ignore[arg-type]
    assert not world.lights


def test_unsupported_shape_names_are_refused_with_the_supported_name() -> None:
    for word, ours in (("cube", "box"), ("ball", "sphere")):
        with raises(raycam.WorldError, code="unknown_name", mentions=[ours]):
            raycam.World().add_object(word)


@pytest.mark.parametrize("name", ["red", "Tomato", "rebeccapurple", "lightgoldenrodyellow", "#c83c28"])
def test_css_color_names_have_the_values_of_pillow(name: str) -> None:
    image_color = pytest.importorskip("PIL.ImageColor")
    world = raycam.World()
    world.add_object(box={}, color=name)
    bytes_ = np.array(image_color.getrgb(name)) / 255
    linear = np.where(bytes_ <= 0.04045, bytes_ / 12.92, ((bytes_ + 0.055) / 1.055) ** 2.4)
    assert world.triangle_colors()[0] == pytest.approx(linear, abs=1e-6)


def test_every_css_color_name_is_accepted() -> None:
    image_color = pytest.importorskip("PIL.ImageColor")
    world = raycam.World()
    for name in image_color.colormap:
        world.add_object(box={}, color=name)
    colors = world.triangle_colors()[::12]
    bytes_ = np.array([image_color.getrgb(name) for name in image_color.colormap]) / 255
    linear = np.where(bytes_ <= 0.04045, bytes_ / 12.92, ((bytes_ + 0.055) / 1.055) ** 2.4)
    assert colors == pytest.approx(linear, abs=1e-6)


@pytest.mark.parametrize("color", [[200, 60, 40], [0, 0, 2], (255, 255, 255), [128, 0, 1.0]])
def test_integer_colors_raise_with_the_hexadecimal_form(color: object) -> None:
    hexed = "#{:02x}{:02x}{:02x}".format(*(int(value) for value in color))  # type: ignore[attr-defined]
    world = raycam.World()
    with raises(raycam.WorldError, mentions=[hexed]):
        world.add_object(box={}, color=color)
    world.add_object(box={}, color=hexed)
    world.add_object(box={}, color=np.array(color, dtype=np.uint8))
    assert np.array_equal(*world.triangle_colors()[[0, 12]])


def test_grey_numbers_are_accepted_as_colors_and_float_colors_up_to_255_are_refused() -> None:
    world = raycam.World()
    world.add_object(box={}, color=0.25)
    assert world.triangle_colors()[0].tolist() == [0.25] * 3
    corners, faces = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]
    with raises(raycam.WorldError, code="out_of_range", mentions=["numpy.uint8"]):
        world.add_mesh(corners, faces, face_colors=[[255, 0, 0]])


def test_frames_convert_to_arrays_and_have_a_short_repr(folder: Path) -> None:
    frame = raycam.render(folder / "box.toml", samples=1)
    assert np.array_equal(np.asarray(frame), frame["color"])
    depth = raycam.render(folder / "box.toml", samples=1, channels="depth")
    assert np.array_equal(np.asarray(depth), depth["depth"])
    with raises(raycam.SettingsError, code="missing_value"):
        np.asarray(raycam.render(folder / "box.toml", samples=1, channels=["depth", "uv"]))
    for item in (raycam.label(folder / "box.toml")[0], raycam.explain(folder / "box.toml", (16, 12))):
        assert len(repr(item)) < 200
        assert "array(" not in repr(item)
        assert "object at 0x" not in repr(item)
        assert "box" in repr(item)


def test_dir_lists_only_public_names() -> None:
    names = dir(raycam)
    assert set(raycam.__all__) <= set(names)
    assert {"explain", "sample", "dataset", "selfcheck", "data", "jobs", "video"} <= set(names)
    assert not {"TYPE_CHECKING", "Any", "_core", "annotations", "PAGES", "OPENERS"} & set(names)
    for name in names:
        getattr(raycam, name)


@pytest.mark.parametrize("given", ["front", b"a", 3, None, [1, 2], raycam.World()])
def test_errors_about_wrong_cameras_and_paths_name_the_argument(given: Any) -> None:
    with raises(raycam.SettingsError, code="wrong_type", mentions=["camera", "raycam.Camera"]):
        raycam.World().add_camera(given)
    if given is not None:
        with raises(raycam.SettingsError, code="wrong_type", mentions=["camera", "raycam.Camera"]):
            raycam.selfcheck(given)
    if not isinstance(given, str):
        with raises(raycam.SettingsError, code="wrong_type", mentions=["path"]):
            raycam.load_cameras(given)
        with raises(raycam.SettingsError, code="wrong_type", mentions=["recipe"]):
            raycam.sample(given)


def test_add_camera_with_exchanged_arguments_raises_with_the_signature() -> None:
    with raises(raycam.SettingsError, code="wrong_type", mentions=["add_camera(camera"]):
        raycam.World().add_camera("left", raycam.Camera.look_at([0, 0, 3], [0, 0, 0], "y"))  # type: ignore[arg-type]
