"""Packages of jobs: equal for equal frames, and restored when read back."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.errors import FormatError
from raycam.jobs import job_package as module
from raycam.jobs.job_package import JobPackage
from support.raises import Fault, fault, raises


def world() -> raycam.World:
    world = raycam.World()
    world.add_object(box={"size": 1}, color="#c83c28", name="box")
    world.add_light({"type": "sky", "radiance": [1, 2, 3]})
    return world


def test_package_round_trips_and_renders_the_same_image() -> None:
    package = JobPackage("video", 7, {"b": (1, 2.5), "a": {"x": None}}, world())
    data = package.to_bytes()
    back = JobPackage.from_bytes(data, "p", package.id)
    assert (back.kind, back.frames, back.settings) == ("video", 7, {"b": [1, 2.5], "a": {"x": None}})
    assert (back.id, back.to_bytes(), back.describe()) == (package.id, data, package.describe())
    pictures = [raycam.render(one.world, one.world.default_camera((32, 24))) for one in (package, back)]
    for name in pictures[0]:
        np.testing.assert_array_equal(pictures[0][name], pictures[1][name])
    assert json.dumps(package.describe())


def test_stored_package_is_compressed_and_checked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = JobPackage("video", 7, {"numbers": [0.5] * 1000}, world())
    stored = package.to_file()
    assert len(stored) < 0.5 * len(package.to_bytes())
    assert JobPackage.from_bytes(stored, "p", package.id).settings == package.settings
    path = tmp_path / "package"
    path.write_bytes(stored)
    assert package.exists_in(path)
    for damaged in (stored + b"x", stored[:-1], b"x" + stored, b""):
        path.write_bytes(damaged)
        assert not package.exists_in(path)
        with raises(FormatError, code="damaged_job"):
            JobPackage.check(damaged, "p", package.id)
    monkeypatch.setattr(module, "COMPRESSION_LIMIT_BYTES", 1000)
    assert package.to_file() == package.to_bytes()


def test_package_id_depends_on_everything_that_affects_its_frames(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    base = JobPackage("video", 7, {"a": 1, "b": 2}, world())
    assert JobPackage("video", 7, {"b": 2, "a": 1}, world()).id == base.id
    brighter = world()
    brighter.add_light({"type": "sky", "radiance": [1, 1, 1]})
    others = [
        JobPackage("video", 8, {"a": 1, "b": 2}, world()),
        JobPackage("other", 7, {"a": 1, "b": 2}, world()),
        JobPackage("video", 7, {"a": 1, "b": 3}, world()),
        JobPackage("video", 7, {"a": 1, "b": 2}, brighter),
    ]
    with monkeypatch.context() as patch:
        patch.setattr(module, "__version__", "99.0")
        others.append(JobPackage("video", 7, {"a": 1, "b": 2}, world()))
    assert len({one.id for one in [base, *others]}) == 6

    # The folder of the files and the format of the world file do not affect the id.
    ids = set()
    for name, comment in (("one", ""), ("two", "# text\n")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "t.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 1\n3 0 1 2\n")
        (tmp_path / name / "w.toml").write_text(comment + '[[object]]\nname = "t"\nmesh = "t.off"\n')
        ids.add(JobPackage("video", 1, {}, raycam.load(tmp_path / name / "w.toml")).id)
    assert len(ids) == 1


def test_damaged_packages_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    package = JobPackage("video", 7, {}, world())
    with raises(raycam.FormatError, code="damaged_job"):
        JobPackage.from_bytes(package.to_bytes() + b"x", "p", package.id)
    junk = JobPackage("video", 1, {}, b"no world")
    with raises(raycam.FormatError, code="wrong_format"):
        JobPackage.from_bytes(junk.to_bytes(), "p", junk.id).world  # noqa: B018
    monkeypatch.setattr(module, "__version__", "99.0")
    with raises(raycam.JobError, code="changed_input", mentions=["99.0"]):
        JobPackage.from_bytes(package.to_bytes(), "p", package.id)


@pytest.mark.parametrize(
    ("frames", "settings", "message"),
    [
        (0, {}, fault("out_of_range")),
        (1, {"a": np.zeros(2)}, fault("wrong_type", "JSON")),
        (1, {"a": float("nan")}, fault("wrong_type", "JSON")),
    ],
)
def test_invalid_packages_raise_with_the_argument(
    frames: int, settings: dict[str, object], message: Fault
) -> None:
    with raises(raycam.JobError, **message):
        JobPackage("video", frames, settings, world())
