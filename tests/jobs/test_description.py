"""Descriptions of the differences between two jobs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import raycam
from raycam.errors import JobError
from raycam.jobs.description import differences, mismatch_message, read_description, world_differences
from raycam.jobs.job_package import JobPackage
from support.raises import raises


def room(**changed: Any) -> raycam.World:
    """A box over a floor, with the given changes."""
    world = raycam.World()
    world.add_object(
        box={"size": changed.get("size", 1)},
        color=changed.get("color", "#c83c28"),
        specular=changed.get("specular", 0.0),
        name=changed.get("name", "box"),
        location=changed.get("location", [0, 0, 0]),
    )
    world.add_object(plane={"size": [8, 8]}, location=[0, 0, -0.5], name="floor")
    world.add_light({"type": "sun", "direction": [0, 1, -2], "irradiance": changed.get("sun", [3, 3, 3])})
    world.add_camera(
        raycam.Camera.look_at([4, -3, 2], [0, 0, 0], size=(64, 48), fov=changed.get("fov", 30)), "front"
    )
    return world


CHANGES: dict[str, tuple[dict[str, Any], str]] = {
    "a material": ({"specular": 0.5}, "a material, a texture or a motion differs"),
    "a color": ({"color": "#c83c29"}, "object.box: the colour differs"),
    "a shape": ({"size": 1.5}, "object.box: the mesh differs"),
    "a place": ({"location": [0, 0, 1]}, "object.box.matrix was [[1.0, 0.0, 0.0, 0.0], [0.0, "),
    "a name": ({"name": "crate"}, 'object.box was {"category": null,'),
    "a light": ({"sun": [3, 3, 4]}, "light.0.irradiance was [3.0, 3.0, 3.0], is [3.0, 3.0, 4.0]"),
    "a camera": ({"fov": 31}, "camera.front.K was "),
}


@pytest.mark.parametrize("change", CHANGES)
def test_difference_between_worlds_is_described(change: str, tmp_path: Path) -> None:
    changed, words = CHANGES[change]
    there, asked = room(), room(**changed)
    found = world_differences(there, asked)
    assert found[0].startswith(words), found
    assert len(found) == (2 if change == "a name" else 1)
    before = JobPackage("video", 1, {}, there)
    (tmp_path / "package").write_bytes(before.to_bytes())
    described = {"job": before.id, **before.describe()}
    told = mismatch_message(tmp_path, described, tmp_path / "package", JobPackage("video", 1, {}, asked))
    assert words in told
    (tmp_path / "package").write_bytes(b"")  # without the package, only hashes can be compared
    told = mismatch_message(tmp_path, described, tmp_path / "package", JobPackage("video", 1, {}, asked))
    assert 'world was "' in told
    assert words not in told


def test_many_differences_are_summarised_with_their_count() -> None:
    there = room()
    for _ in range(20):
        there.add_light({"type": "sky", "radiance": [1, 1, 1]})
    assert world_differences(there, room())[8:] == ["and 12 more in the world"]


def test_differences_are_listed_by_key() -> None:
    assert list(differences({"a": {"b": 1, "c": 2}}, {"a": {"b": 1, "c": 3, "d": 4}})) == [
        "a.c was 2, is 3",
        "a.d was not given, is 4",
    ]


def test_invalid_job_description_raises_with_its_file(tmp_path: Path) -> None:
    path = tmp_path / "job.json"
    assert read_description(path) is None
    path.write_text('{"job": "a", "frames": 0}')
    with raises(JobError, code="damaged_job", mentions=["job.json"]):
        read_description(path)
