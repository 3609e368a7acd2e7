"""Series of images: each equals `render` byte for byte."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from PIL import Image
from support.raises import fault, raises

SIZE = (20, 16)


def camera(i: int, size: tuple[int, int] = SIZE) -> raycam.Camera:
    return raycam.Camera.look_at([4, -4 + 0.3 * i, 3], [0, 0, 0.3], [0, 0, 1], size=size, fov=40)


def world() -> raycam.World:
    made = raycam.World()
    made.add_object(plane={"size": 5}, name="floor")
    made.add_object(box={"size": 0.7}, name="cup", location=[0, 0, 0.4])
    made.add_object(sphere={"radius": 0.3, "level": 2}, name="lamp", location=[1, 1, 1], emission=3.0)
    made.add_light(type="sun", direction=[-1, 1, -2], irradiance=2)
    return made


def poses(count: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    found = np.tile(np.eye(4), (count, 1, 1))
    angle = 0.4 * np.arange(count)
    found[:, 0, 0] = found[:, 1, 1] = np.cos(angle)
    found[:, 1, 0], found[:, 0, 1] = np.sin(angle), -np.sin(angle)
    found[:, :3, 3] = np.stack(
        [0.1 * np.arange(count), -0.05 * np.arange(count), np.full(count, 0.5)], axis=1
    )
    return found


@pytest.mark.parametrize("integrator", ["flat", "direct", "path"])
@pytest.mark.parametrize("threads", [1, 3])
def test_render_many_equals_single_renders(integrator: str, threads: int) -> None:
    count, made = 5, world()
    matrices, cameras = poses(count), [camera(i) for i in range(count)]
    before = made.to_bytes()
    for moved, seen in (
        ({"cup": matrices}, [camera(0)]),
        ({"cup": matrices, 2: matrices[1]}, cameras),
        ({}, cameras),
    ):
        frames = raycam.render_many(
            made,
            seen,
            poses=moved,
            integrator=integrator,
            samples=2,
            channels="all",
            frame=7,
            threads=threads,
        )
        assert len(frames) == count
        for i, frame in enumerate(frames):
            other = made.copy()
            for which, given in moved.items():
                other.set_object(which, matrix=np.broadcast_to(given, (count, 4, 4))[i])
            expected = raycam.render(
                other, seen[i % len(seen)], integrator=integrator, samples=2, channels="all", frame=7 + i
            )
            assert [n for n in expected if frame[n].tobytes() != expected[n].tobytes()] == []
            assert frame.camera == seen[i % len(seen)]
    assert made.to_bytes() == before


def test_render_many_writes_into_given_arrays() -> None:
    made = world()
    out = {"depth": np.zeros((3, 16, 20), np.float32)}
    counted: list[tuple[int, int]] = []
    frames = raycam.render_many(
        made,
        camera(0),
        poses={"cup": poses(3)},
        channels=["depth", "color"],
        out=out,
        progress=lambda done, total: counted.append((done, total)),
    )
    assert frames["depth"] is out["depth"]
    assert frames["color"].shape == (3, 16, 20, 3)
    assert np.shares_memory(frames[1]["depth"], out["depth"])
    assert counted[-1] == (3, 3)
    assert [f.size for f in frames[1:]] == [SIZE, SIZE]
    part = raycam.render_many(made, camera(0), poses={"cup": poses(3)}, channels="depth", region=(4, 2, 8, 6))
    assert np.array_equal(part["depth"], frames["depth"][:, 2:8, 4:12])
    assert part[0].region == (4, 2, 8, 6)
    assert "3 Frames 8 x 6: depth" in repr(part)


def test_render_many_refuses_mismatched_arguments() -> None:
    made, error = world(), (raycam.SettingsError, raycam.WorldError)
    flat = poses(2)
    flat[1, 0, 0:3] = 0
    for call, said in (
        ({"cameras": [camera(0), camera(1)], "poses": {"cup": poses(3)}}, fault("wrong_shape", "'cup'")),
        ({"cameras": [camera(0), camera(1, (8, 8))]}, fault("wrong_shape", "20 x 16")),
        ({"cameras": [], "poses": {"cup": poses(3)}}, fault("missing_value")),
        ({"poses": {"cupp": poses(3)}}, fault("unknown_name", "cup")),
        ({"poses": {9: poses(3)}}, fault("index_out_of_range")),
        ({"poses": {"cup": poses(3)[:, :3]}}, fault("wrong_shape", "'cup'")),
        ({"poses": {"cup": flat}}, fault("invalid_world", '"cup"')),
        ({"poses": {"cup": poses(2).transpose(0, 2, 1)}}, fault("invalid_matrix", "'cup'")),
        ({"time_limit": 1.0}, fault("conflicting_values", "time_limit")),
        ({"samplse": 3}, fault("unknown_key", "samples")),
        (
            {"out": {"depth": np.zeros((1, 2, 3), np.float32)}, "channels": "depth"},
            fault("wrong_shape", "float32"),
        ),
        ({"out": {"uv": np.zeros(3)}, "channels": "depth"}, fault("unknown_name")),
    ):
        with raises(error, **said):
            raycam.render_many(made, **{"cameras": camera(0), **call})


@pytest.mark.parametrize("transparent", [True, False])
def test_render_many_supports_background_photos_and_shadow_catchers(
    tmp_path: Path, transparent: bool
) -> None:
    made, count = world(), 3
    made.set_object("floor", shadow_catcher=True)
    Image.fromarray(np.random.default_rng(5).integers(0, 255, (*SIZE[::-1], 3), np.uint8)).save(
        tmp_path / "a.png"
    )
    cameras = [camera(i).with_background(tmp_path / "a.png") for i in range(count)]
    matrices, channels = poses(count), ["color", "depth", "instance"]
    settings: dict[str, Any] = {"samples": 2, "channels": channels, "transparent_background": transparent}
    before = made.to_bytes()
    frames = raycam.render_many(made, cameras, poses={"cup": matrices}, frame=4, **settings)
    assert made.to_bytes() == before
    assert ("shadow" in frames.channels) == transparent
    depth = np.zeros((count, *SIZE[::-1]), np.float32)
    part = raycam.render_many(
        made, cameras, poses={"cup": matrices}, frame=4, out={"depth": depth}, **settings
    )
    np.testing.assert_array_equal(depth, part["depth"])
    for i, frame in enumerate(frames):
        made.set_object("cup", matrix=matrices[i])
        one = raycam.render(made, cameras[i], frame=4 + i, **settings)
        assert set(one) == set(frames.channels)
        for name in one:
            np.testing.assert_array_equal(frame[name], one[name])
        np.testing.assert_array_equal(frame.to_srgb8(), one.to_srgb8())
    assert (frames["instance"] != 0).all()
    mixed = [cameras[0], camera(1)]
    if not transparent:
        behind = raycam.render_many(made, [camera(0)], background=tmp_path / "a.png", samples=2)
        np.testing.assert_array_equal(
            behind["color"][0],
            raycam.render(made, camera(0), background=tmp_path / "a.png", samples=2)["color"],
        )
        one = raycam.render_many(made, mixed, samples=2)
        for i, camera_of in enumerate(mixed):
            np.testing.assert_array_equal(
                one["color"][i], raycam.render(made, camera_of, samples=2, frame=i)["color"]
            )
