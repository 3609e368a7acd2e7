"""Data sets of worlds that the caller provides."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import raycam
from raycam.dataset import write
from support.box_table import ring
from support.raises import raises

OPTIONS: dict[str, Any] = {"samples": 1, "integrator": "flat"}


def make_world(number: int) -> raycam.World:
    world = raycam.World()
    world.add_object(
        box={"size": [0.3, 0.3, 0.3]}, name="crate", category="crate", location=[0.2 * number, 0, 0.2]
    )
    if number % 2:
        world.add_object(sphere={"radius": 0.2}, name="ball", category="ball", location=[0, 0.6, 0.2])
    return world


def endless() -> Iterator[raycam.World]:
    while True:
        yield make_world(0)


class Scenes:
    """Worlds like a PyTorch data set, with a length and indices, but not iterable."""

    def __len__(self) -> int:
        return 3

    def __getitem__(self, number: int) -> raycam.World:
        return make_world(number)


def files(folder: Path) -> dict[str, bytes]:
    """The files of a data set, without the job's state."""
    found = (
        path
        for path in folder.rglob("*")
        if path.is_file() and ".raycam" not in str(path.relative_to(folder))
    )
    return {str(path.relative_to(folder)): path.read_bytes() for path in found}


@pytest.mark.parametrize("format", ["coco", "bop", "yolo"])
def test_worlds_as_list_function_and_iterator_give_the_same_files(tmp_path: Path, format: str) -> None:
    sources: dict[str, Any] = {
        "list": {"worlds": [make_world(i) for i in range(3)]},
        "function": {"worlds": make_world, "count": 3, "categories": ["crate", "ball"]},
        "indexed": {"worlds": Scenes(), "categories": ["crate", "ball"]},
        "iterator": {"worlds": map(make_world, range(3)), "count": 3, "categories": ["crate", "ball"]},
    }
    if format == "bop":
        with pytest.raises(raycam.SettingsError):
            write(folder=tmp_path / "refused", format=format, cameras=ring(2), **sources.pop("iterator"))
    for name, source in sources.items():
        result = write(folder=tmp_path / name, format=format, cameras=ring(2), **source, **OPTIONS)
        assert (result.frames, result.made, result.complete) == (6, 6, True)
    first, *others = (files(tmp_path / name) for name in sources)
    assert all(other == first for other in others)
    if format == "coco":
        table = json.loads(next(data for data in first.values() if b'"annotations"' in data))
        assert [row["name"] for row in table["categories"]] == ["crate", "ball"]
        counts = [
            sum(row["image_id"] == image["id"] for row in table["annotations"]) for image in table["images"]
        ]
        assert counts == [1, 1, 2, 2, 1, 1]


def test_iterable_with_a_length_requires_no_count(tmp_path: Path) -> None:
    worlds = {name: make_world(0) for name in "abc"}.values()
    assert write(worlds=worlds, folder=tmp_path / "a", cameras=ring(2), **OPTIONS).frames == 6


def test_interrupted_data_set_resumes_without_the_finished_worlds(tmp_path: Path) -> None:
    calls: list[int] = []

    def failing(limit: int) -> Callable[[int], raycam.World]:
        def make(number: int) -> raycam.World:
            calls.append(number)
            if number >= limit:
                raise KeyboardInterrupt
            return make_world(number)

        return make

    source = {"count": 5, "categories": ["crate", "ball"], "cameras": ring(1)}
    with pytest.raises(KeyboardInterrupt):
        write(worlds=failing(3), folder=tmp_path / "a", **source, **OPTIONS)
    calls.clear()
    result = write(worlds=failing(9), folder=tmp_path / "a", **source, **OPTIONS)
    assert result.complete
    assert result.made < 5
    assert set(calls) - {0} == set(range(5 - result.made, 5))
    write(worlds=make_world, folder=tmp_path / "b", **source, **OPTIONS)
    assert files(tmp_path / "a") == files(tmp_path / "b")


def test_shards_of_worlds_write_one_data_set(tmp_path: Path) -> None:
    source = {"worlds": make_world, "count": 4, "categories": ["crate", "ball"], "cameras": ring(1)}
    assert not write(folder=tmp_path / "a", shard=(1, 2), **source, **OPTIONS).complete
    assert write(folder=tmp_path / "a", shard=(2, 2), **source, **OPTIONS).complete
    write(folder=tmp_path / "b", **source, **OPTIONS)
    assert files(tmp_path / "a") == files(tmp_path / "b")


def test_cameras_of_each_world_are_used(tmp_path: Path) -> None:
    def make(number: int) -> raycam.World:
        world = make_world(0)
        world.add_camera(ring(4)[number], "eye")
        return world

    write(worlds=make, count=3, folder=tmp_path / "a", **OPTIONS)
    found = raycam.load_cameras(tmp_path / "a")
    for own, given in zip(found.values(), ring(4), strict=False):
        assert own.C.tolist() == pytest.approx(given.C.tolist())


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        ({"worlds": make_world}, raycam.SettingsError),
        ({"worlds": [make_world(0)], "count": 2}, raycam.SettingsError),
        ({"worlds": [make_world(0)], "world": make_world(0)}, raycam.SettingsError),
        ({"worlds": Scenes(), "count": 2}, raycam.SettingsError),
        ({"worlds": endless, "count": 2}, raycam.SettingsError),
        ({"worlds": 3, "count": 1}, raycam.SettingsError),
        ({"worlds": [], "count": 0}, raycam.SettingsError),
        ({"worlds": [make_world(0)], "workers": 2}, raycam.SettingsError),
        ({"worlds": [make_world(0)], "times": [0.0]}, raycam.SettingsError),
        ({"worlds": ["a.glb"]}, raycam.WorldError),
        ({"world": make_world(0), "categories": ["crate"]}, raycam.SettingsError),
        ({}, raycam.SettingsError),
    ],
)
def test_wrong_worlds_raise_before_rendering(
    tmp_path: Path, options: dict[str, Any], fault: type[Exception]
) -> None:
    with pytest.raises(fault):
        write(folder=tmp_path / "a", cameras=ring(1), **options)
    assert not (tmp_path / "a").exists()


def test_empty_worlds_raise_missing_value(tmp_path: Path) -> None:
    with raises(raycam.SettingsError, code="missing_value", mentions=["worlds"]):
        write(worlds=[], folder=tmp_path / "a", cameras=ring(1), **OPTIONS)


def test_unknown_category_of_a_world_fails_with_its_name(tmp_path: Path) -> None:
    with raises(raycam.JobError, code="failed_frames", mentions=["ball"]):
        write(worlds=make_world, count=2, folder=tmp_path / "a", cameras=ring(1), **OPTIONS)


def test_iterator_that_ends_early_fails_with_its_count(tmp_path: Path) -> None:
    with raises(raycam.JobError, code="failed_frames"):
        write(worlds=iter([make_world(0)]), count=2, folder=tmp_path / "a", cameras=ring(1), **OPTIONS)


def test_iterator_that_raises_fails_with_its_exception(tmp_path: Path) -> None:
    def failing() -> Iterator[raycam.World]:
        yield make_world(0)
        raise ValueError("the simulation diverged")

    with raises(raycam.JobError, code="failed_frames", mentions=["diverged"]):
        write(worlds=failing(), count=3, folder=tmp_path / "a", cameras=ring(1), **OPTIONS)
