"""Notices are warnings at the user's line, once per cause, or errors on request."""

from __future__ import annotations

import concurrent.futures
import json
import pickle
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam import notices
from raycam.cli import main
from support.raises import raises


@pytest.fixture
def heard() -> Iterator[list[warnings.WarningMessage]]:
    """The warnings that pass Python's default filter."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("default")
        yield found


def said(heard: list[warnings.WarningMessage]) -> list[str]:
    assert all(issubclass(item.category, raycam.Notice) for item in heard)
    return [str(item.message) for item in heard]


@pytest.fixture
def odd_obj(tmp_path: Path) -> Path:
    """A mesh with a face of two corners, which is skipped with a notice."""
    path = tmp_path / "odd.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2\n")
    return path


def line_of(words: str) -> int:
    """The line of this file that ends in a comment."""
    lines = Path(__file__).read_text().splitlines()
    return next(number for number, line in enumerate(lines, 1) if line.endswith(f"# {words}"))


def test_load_warns_at_the_line_of_the_caller(odd_obj: Path, heard: list[warnings.WarningMessage]) -> None:
    world = raycam.load(odd_obj)  # this line loads the file
    assert said(heard) == [str(notice) for notice in world.notices] != []
    assert str(odd_obj) in said(heard)[0]
    assert heard[0].filename == __file__
    assert heard[0].lineno == line_of("this line loads the file")


def test_adding_warns_only_about_the_added_part(odd_obj: Path, heard: list[warnings.WarningMessage]) -> None:
    world = raycam.load(odd_obj)
    heard.clear()
    world.add_object(mesh=odd_obj, name="again")  # this line adds the object
    assert said(heard) == [str(notice) for notice in world.notices[1:]] != []
    assert heard[0].lineno == line_of("this line adds the object")
    heard.clear()
    world.add_object(box={})
    assert heard == []


def test_rendering_warns_once_for_one_line_and_cause(heard: list[warnings.WarningMessage]) -> None:
    world = raycam.World()
    world.add_object(box={})
    for _ in range(3):
        frame = raycam.render(world, samples=1)
    assert [notice.code for notice in frame.notices] == ["studio"]
    assert said(heard) == [str(notice) for notice in frame.notices]


def test_notices_that_differ_only_in_counts_warn_once(heard: list[warnings.WarningMessage]) -> None:
    for count in (3, 14, 159):
        notices.warn(raycam.Notice(f"room.toml: {count} of 1,000 samples are clamped", "clamped_samples"))
    assert said(heard) == ["room.toml: 3 of 1,000 samples are clamped"]
    for name in ("part1.obj", "part2.obj", "a/1.obj", "a/2.obj"):
        notices.warn(raycam.Notice(f"{name}: left out", "ignored_element"))
    assert len(heard) == 5, "names differ by their numbers"


def test_equal_notices_at_other_lines_warn_again(heard: list[warnings.WarningMessage]) -> None:
    notices.warn(raycam.Notice("left out", "ignored_element"))
    notices.warn(raycam.Notice("left out", "ignored_element"))
    assert [item.lineno for item in heard] == [heard[0].lineno, heard[0].lineno + 1]


@pytest.mark.parametrize("time", [0.0, 0.5])
def test_load_cameras_emits_warnings(
    tmp_path: Path, time: float, heard: list[warnings.WarningMessage]
) -> None:
    path = tmp_path / "transforms.json"
    frame = {
        "file_path": "a.png",
        "transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, time], [0, 0, 0, 1]],
    }
    path.write_text(json.dumps({"w": 64, "h": 48, "fl_x": 50, "aabb_scale": 16, "frames": [frame]}))
    cameras = raycam.load_cameras(path)
    assert said(heard) == [str(notice) for notice in cameras.notices]


def test_strict_raises_only_inside_its_block(odd_obj: Path, heard: list[warnings.WarningMessage]) -> None:
    with raycam.strict(), raises(raycam.Notice, code="dropped_geometry"):
        raycam.load(odd_obj)
    assert heard == []
    raycam.load(odd_obj)
    assert len(heard) == 1
    with raycam.strict(), raises(raycam.Notice, code="dropped_geometry"):
        raycam.load(odd_obj)  # the notice is raised although the same warning was shown before


def test_loading_in_a_user_thread_warns(odd_obj: Path, heard: list[warnings.WarningMessage]) -> None:
    with concurrent.futures.ThreadPoolExecutor(1) as pool:
        pool.submit(raycam.load, odd_obj).result()
    assert len(heard) == 1


@pytest.mark.parametrize("workers", [None, 1])
def test_data_sets_warn_once_and_return_their_notices(
    tmp_path: Path, workers: int | None, heard: list[warnings.WarningMessage]
) -> None:
    world = raycam.World()
    world.add_object(box={})
    for i in range(3):
        world.add_camera(raycam.Camera.look_at([4, i, 2], [0, 0, 0], [0, 0, 1], size=(32, 24), fov=40))
    written = raycam.dataset.write(world, tmp_path / "data", samples=1, workers=workers, threads=1)
    (notice,) = (notice for notice in written.notices if notice.code == "default_lights")
    assert said(heard).count(str(notice)) == 1
    assert {item.filename for item in heard} == {__file__}


def test_commands_print_each_notice_once_without_python_warnings(
    odd_obj: Path, capsys: pytest.CaptureFixture[str], heard: list[warnings.WarningMessage], tmp_path: Path
) -> None:
    assert (
        main(["render", str(odd_obj), "-o", str(tmp_path / "x.png"), "--samples", "1", "--size", "32x24"])
        == 0
    )
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == len(set(lines)) >= 2
    assert all(line.startswith("raycam: notice: ") for line in lines)
    assert heard == []


def test_copies_of_a_world_do_not_repeat_warnings(
    odd_obj: Path, heard: list[warnings.WarningMessage]
) -> None:
    world = raycam.load(odd_obj)
    heard.clear()
    raycam.World.from_bytes(world.to_bytes())
    world.with_cameras({})
    assert heard == []


def test_unknown_camera_arguments_raise_with_the_valid_names() -> None:
    for name in ("lens", "modle"):
        with raises(raycam.CameraError, code="unknown_key"):
            raycam.Camera.look_at([0, -3, 1], [0, 0, 0], focal=30, **{name: "fisheye"})  # type: ignore[arg-type]
    for make in (raycam.Camera.from_opengl, raycam.Camera.from_x_forward, raycam.Camera.from_transform):
        with raises(raycam.CameraError, code="unknown_key"):
            make(np.eye(3), np.eye(4), (4, 4), lens="fisheye")  # type: ignore[call-arg]
    with raises(TypeError, mentions=["lens"]):
        raycam.load_cameras(raycam.data.path("fisheye.yaml"), lens="fisheye")  # type: ignore[call-arg]


def test_unknown_render_options_raise_with_a_hint() -> None:
    for word, way in {"size": "resized", "spp": "samples"}.items():
        with raises(raycam.SettingsError, code="unknown_key", mentions=[way]):
            raycam.render(raycam.data.spot(), **{word: 1})  # type: ignore[arg-type]


def test_notices_about_several_parts_are_grouped() -> None:
    one = [raycam.Notice(f"off by {i}e-7", "repaired_rotation", [f"camera {i}"]) for i in range(1, 1834)]
    other = raycam.Notice("off by 2e-7", "implausible", ["camera 1"])
    grouped, alone = notices.distinct([*one, other])
    assert str(grouped) == "camera 1, camera 2, camera 3 and 1830 more: off by 1e-7"
    assert (grouped.code, grouped.count, alone) == ("repaired_rotation", 1833, other)


def test_cameras_of_a_file_share_one_notice(tmp_path: Path) -> None:
    path = tmp_path / "transforms.json"
    turn = [[1, 1e-5, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
    frames = [{"file_path": f"{i}.png", "transform_matrix": turn} for i in range(9)]
    path.write_text(json.dumps({"w": 64, "h": 48, "fl_x": 50, "frames": frames}))
    with pytest.warns(raycam.Notice):
        cameras = raycam.load_cameras(path)
    (notice,) = (notice for notice in cameras.notices if notice.code == "repaired_rotation")
    assert (len(notice.subjects), notice.count) == (3, 9)


def test_notice_survives_pickle_and_json() -> None:
    notice = raycam.Notice("not used", "ignored_key", ["a", "b"], 7)
    assert str(notice) == "a, b and 5 more: not used"
    for copy in (
        pickle.loads(pickle.dumps(notice)),
        raycam.Notice(**json.loads(json.dumps(notice.to_json()))),
    ):
        assert copy == notice
        assert (copy.code, copy.subjects, copy.count) == ("ignored_key", ("a", "b"), 7)
    assert notice != raycam.Notice(str(notice), "missing_value")


def test_errors_keep_their_code_when_pickled() -> None:
    error = raycam.SettingsError("samples: 0", code="out_of_range")
    assert pickle.loads(pickle.dumps(error)).code == "out_of_range"
    assert raycam.SettingsError("samples: 0").code == "invalid_settings"


def test_core_errors_have_codes(tmp_path: Path) -> None:
    with raises(FileNotFoundError, code="file_not_found", mentions=["gone.obj"]):
        raycam.load(tmp_path / "gone.obj")
    with raises(FileNotFoundError, code="file_not_found", mentions=["gone.obj", "object[0].mesh"]):
        raycam.World.from_dict({"object": [{"mesh": "gone.obj"}]}, folder=tmp_path)
    with raises(raycam.WorldError, code="unknown_key", mentions=["colr"]):
        raycam.World.from_dict({"object": [{"box": {}, "colr": "red"}]})
    with raises(raycam.WorldError, code="unknown_name", mentions=["box"]):
        world = raycam.World()
        world.add_object(box={}, name="box")
        world.remove_object("bxo")


def test_collected_contains_each_notice_once() -> None:
    with notices.collected() as found:
        for number in (1, 2, 1, 2, 1):
            notices.warn(raycam.Notice(f"object {number}", "ignored_key"))
    assert [str(notice) for notice in found] == ["object 1", "object 2"]
