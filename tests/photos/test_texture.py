"""Textures from photographs: round trips, visible texels by brute force, and invalid input."""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
import pytest
import raycam
import trimesh
from PIL import Image
from raycam.cli import main
from raycam.io import memory_limits
from raycam.notices import collected
from support.box_table import ring
from support.raises import notice_codes, raises
from support.textured_ball import SIZE, away_from_rims, ball_texture, bumpy_ball, cameras_around
from support.textured_panel import inner, panel, pattern, psnr, shots

LENSES = [
    {},
    {"model": "fisheye", "distortion": [0.02, -0.01, 0.003, -0.001]},
    {"model": "opencv", "distortion": [-0.1, 0.02, 0.001, 0.0005]},
    {"model": "division", "distortion": [-0.05]},
    {"model": "fov", "distortion": [0.4]},
    {
        "model": "thin_prism_fisheye",
        "distortion": [0.02, -0.01, 0.001, 0.0005, 0.003, -0.001, 0.001, -0.0005],
    },
    {
        "model": "rad_tan_thin_prism_fisheye",
        "distortion": [0.02, -0.01, *[0.0] * 4, 0.001, 0.0005, *[0.001] * 4],
    },
    {"model": "omni", "distortion": [0.3, -0.05, 0.01, 0.001, 0.0005]},
    {"model": "eucm", "distortion": [0.5, 1.1]},
    {"model": "ds", "distortion": [0.1, 0.5]},
    {"moving": True},
]


METHODS: list[Literal["blend", "best", "detail"]] = ["blend", "best", "detail"]


def blocked_panel() -> raycam.World:
    """The panel below a box."""
    world = panel(cells=4)
    world.add_object(box={"size": [0.5, 0.5, 0.6]}, location=[0.2, 0, 0.35], color="red", type="unlit")
    return world


PLACES = [[0.3, 0.2, 2.4], [-0.5, 0.1, 2.4], [0.1, -0.4, 2.4]]


@pytest.mark.parametrize("lens", LENSES)
def test_texture_from_rendered_photographs_reaches_50_decibels_by_each_method(lens: dict) -> None:
    world = panel(cells=4)
    lens = dict(lens)
    moving = lens.pop("moving", False)
    cameras, photos = shots(world, [[0.3, 0.2, 2.4], [-0.5, 0.1, 2.4]], samples=1 if moving else 4, **lens)
    if moving:
        cameras = {name: moved_while_read(camera) for name, camera in cameras.items()}
        photos = {
            name: raycam.render(world, camera, samples=4).to_srgb8() for name, camera in cameras.items()
        }
    for method in METHODS:
        result = raycam.texture_from_photos(world, cameras, photos, size=64, method=method)
        assert result.seen.all()
        assert psnr(inner(result.texture), inner(pattern())) > 50, method
    frame = raycam.render(result.world, cameras["00.png"], samples=4).to_srgb8()
    assert psnr(frame[100:300, 100:300], photos["00.png"][100:300, 100:300]) > 38


def moved_while_read(camera: raycam.Camera) -> raycam.Camera:
    """The camera with a rolling shutter, which moves by about 15 pixels while its rows are read."""
    return camera.moving(camera.at_pose(camera.R, camera.location + np.array([0.1, 0.05, 0])), readout=0.02)


@pytest.mark.parametrize(
    "lens",
    [
        lens if number in (1, 10) else pytest.param(lens, marks=pytest.mark.proof)
        for number, lens in enumerate(LENSES)
    ],
)
def test_texture_of_a_curved_surface_reaches_43_decibels_by_each_method(lens: dict) -> None:
    world = bumpy_ball()
    lens = dict(lens)
    moving = lens.pop("moving", False)
    cameras = cameras_around(**lens)
    if moving:
        cameras = {name: moved_while_read(camera) for name, camera in cameras.items()}
    photos = {name: raycam.render(world, camera, samples=4).to_srgb8() for name, camera in cameras.items()}
    for method in METHODS:
        result = raycam.texture_from_photos(world, cameras, photos, size=SIZE, method=method)
        if method != "blend":
            assert len(np.unique(result.view[result.seen])) == 6
        known = away_from_rims(result.seen)
        assert known.mean() > 0.6
        assert psnr(result.texture[known], ball_texture()[known]) > 43, method


def shown_by(camera: raycam.Camera, points: np.ndarray) -> np.ndarray:
    """True for panel points [h, w, 3] that are visible past the box, by brute force."""
    low, high = np.array([-0.05, -0.25, 0.05]), np.array([0.45, 0.25, 0.65])
    with np.errstate(divide="ignore"):
        a, b = (low - camera.C) / (points - camera.C), (high - camera.C) / (points - camera.C)
    enter, leave = np.minimum(a, b).max(axis=2), np.maximum(a, b).min(axis=2)
    hidden = (enter <= leave) & (leave >= 0) & (enter <= 1)
    assert 20 < hidden.sum() < 600
    pixels, _ = camera.project(points.reshape(-1, 3))
    inside = ((pixels >= -0.5) & (pixels < 399.5)).all(axis=1).reshape(32, 32)
    ways = camera.C - points
    steep = ways[..., 2] / np.linalg.norm(ways, axis=2) > np.cos(np.radians(80))
    shown: np.ndarray = ~hidden & inside & steep
    return shown


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("lens", LENSES[:2])
def test_only_texels_visible_to_a_camera_are_colored(
    lens: dict, method: Literal["blend", "best", "detail"]
) -> None:
    world = blocked_panel()
    cameras, photos = shots(world, [[2, 0.1, 1.5], [1.2, -1.5, 1.8]], samples=4, **lens)
    result = raycam.texture_from_photos(world, cameras, photos, size=32, show_unseen=True, method=method)
    grid = (np.arange(32) + 0.5) / 16 - 1
    points = np.stack([*np.meshgrid(grid, -grid), np.zeros((32, 32))], axis=2)
    expected = np.logical_or(*(shown_by(camera, points) for camera in cameras.values()))
    assert 0.2 < expected.mean() < 0.98
    np.testing.assert_array_equal(result.seen, expected)
    is_magenta = (result.texture == [255, 0, 255]).all(axis=2)
    np.testing.assert_array_equal(is_magenta, ~expected)
    # Without show_unseen, a texel that no photograph shows has the colour of a nearest visible texel.
    filled = raycam.texture_from_photos(world, cameras, photos, size=32, method=method).texture
    known, colors = points[result.seen], filled[result.seen].astype(int)
    for place, color in zip(points[~result.seen], filled[~result.seen].astype(int), strict=True):
        distance = np.linalg.norm(known - place, axis=1)
        assert (colors[distance <= distance.min() + 1e-9] == color).all(axis=1).any()


def test_hidden_texels_get_no_color_from_the_middle_of_another_sheet() -> None:
    # A green sheet with a red middle hides the middle of the blue sheet below it, which has the left half of the atlas.
    lower = np.array([[-1, 1, 0], [-1, -1, 0], [1, -1, 0], [1, 1, 0]])
    uvs = np.array([[0, 0], [0, 1], [0.5, 1], [0.5, 0]])
    picture = np.zeros((64, 64, 3), np.uint8)
    picture[:, :32, 2] = 255
    picture[:, 32:, 1] = 255
    picture[8:56, 36:60] = [255, 0, 0]
    world = raycam.World()
    world.add_mesh(
        np.concatenate([lower, 0.5 * lower + [0, 0, 0.1]]),
        np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]),
        uvs=np.concatenate([uvs, uvs + np.array([0.5, 0])]),
        material={"type": "unlit", "texture": raycam.Texture(picture, wrap="clamp")},
    )
    cameras, photos = shots(world, PLACES)
    result = raycam.texture_from_photos(world, cameras, photos, size=64)
    hidden = result.covered & ~result.seen
    assert hidden[:, :32].mean() > 0.1
    assert not hidden[:, 32:].any()
    assert result.texture[16:48, 40:56, 0].min() > 200
    assert result.texture[hidden][:, 0].max() < 100


def test_outlier_is_omitted_and_counted_as_disagreement() -> None:
    world = panel()
    cameras, photos = shots(world, [[0.3, 0.2, 2.4], [-0.5, 0.1, 2.4], [0.1, -0.4, 2.4]])
    clean = raycam.texture_from_photos(world, cameras, photos, size=64)
    photos["01.png"] = np.where(np.arange(400)[:, None, None] > 200, 255, photos["01.png"]).astype(np.uint8)
    result = raycam.texture_from_photos(world, cameras, photos, size=64)
    assert psnr(inner(result.texture), inner(pattern())) > 38
    assert result.disagreement[40:].mean() > 5 * clean.disagreement.mean()


@pytest.mark.parametrize("method", METHODS)
def test_texture_does_not_depend_on_photograph_order_or_threads(
    method: Literal["blend", "best", "detail"],
) -> None:
    world = panel(cells=4)
    cameras, photos = shots(world, PLACES, samples=4)
    one, two = (
        raycam.texture_from_photos(world, given, photos, size=32, threads=threads, method=method)
        for given, threads in ((cameras, 1), (dict(reversed(cameras.items())), 2))
    )
    np.testing.assert_array_equal(one.texture, two.texture)


def test_memory_limit_does_not_change_the_texture(monkeypatch: pytest.MonkeyPatch) -> None:
    world = panel()
    cameras, photos = shots(world, PLACES)
    one = raycam.texture_from_photos(world, cameras, photos, size=64)
    monkeypatch.setattr("raycam.photos.photo_set.PART_TEXELS", 500)
    two = raycam.texture_from_photos(world, cameras, photos, size=64, memory=1)
    np.testing.assert_array_equal(one.texture, two.texture)
    np.testing.assert_array_equal(one.disagreement, two.disagreement)
    assert one.photographs == two.photographs


def test_photograph_of_another_size_is_refused() -> None:
    world = panel()
    cameras, photos = shots(world, PLACES[:1])
    small = {"00.png": photos["00.png"][::2, ::2]}
    with raises(raycam.SettingsError, code="photograph_size", mentions=["200 x 200", "400 x 400", "--size"]):
        raycam.texture_from_photos(world, cameras, small, size=8)


def test_missing_photograph_and_coordinates_are_refused(tmp_path: Path) -> None:
    world = panel()
    cameras, photos = shots(world, PLACES[:1])
    with raises(FileNotFoundError, code="file_not_found", mentions=["00.png", tmp_path]):
        raycam.texture_from_photos(world, cameras, tmp_path, size=8)
    bare = raycam.World()
    bare.add_mesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    with raises(raycam.WorldError, code="missing_texture_coordinates"):
        raycam.texture_from_photos(bare, cameras, photos, size=8)


def test_transparent_pixels_do_not_color_texels() -> None:
    world = panel()
    cameras, photos = shots(world, PLACES[:1])
    opaque = np.full((400, 400), 255, np.uint8)
    opaque[:, :200] = 0
    masked = {"00.png": np.dstack([np.where(opaque[..., None] > 0, photos["00.png"], 255), opaque])}
    result = raycam.texture_from_photos(world, cameras, masked, size=32)
    grid = (np.arange(32) + 0.5) / 16 - 1
    points = np.stack([*np.meshgrid(grid, -grid), np.zeros((32, 32))], axis=2).reshape(-1, 3)
    column = cameras["00.png"].project(points)[0][:, 0].reshape(32, 32)
    clear = np.abs(column - 199.5) > 8  # a texel is an average of about six pixels
    np.testing.assert_array_equal(result.seen[clear], (column > 199.5)[clear])
    shown = np.s_[3:-3, 20:-3]
    whole = raycam.texture_from_photos(world, cameras, photos, size=32).texture
    np.testing.assert_array_equal(result.texture[shown], whole[shown])


def test_vignetting_of_the_camera_is_undone() -> None:
    world = panel()
    cameras, _ = shots(world, PLACES[:1], samples=1)
    camera = cameras["00.png"].with_vignetting(cos4=True, polynomial=[-0.2, 0.05])
    photo = raycam.render(world, camera, samples=16).to_srgb8()
    result = raycam.texture_from_photos(world, {"a": camera}, {"a": photo}, size=64)
    assert psnr(inner(result.texture), inner(pattern())) > 40


@pytest.mark.parametrize(("size", "fit"), [(8, 256), (16, 256), (128, None)])
def test_texture_that_is_too_small_is_reported_with_the_size_that_fits(size: int, fit: int | None) -> None:
    world = panel()
    cameras, photos = shots(world, PLACES)
    with collected() as notices:
        raycam.texture_from_photos(world, cameras, photos, size=size)
    found = [notice for notice in notices if notice.code == "coarse_texture"]
    assert len(found) == (fit is not None)
    # The panel is 2 m wide at 2.4 m: 2 / 2.4 * 346 = 289 pixels.
    if fit:
        assert "size=512" in str(found[0]) or f"size={fit}" in str(found[0])


def test_inside_out_mesh_is_textured_from_both_sides_with_a_notice() -> None:
    world = panel()
    cameras, photos = shots(world, PLACES)
    turned = raycam.World()
    square = [[-1, 1, 0], [-1, -1, 0], [1, -1, 0], [1, 1, 0]]
    turned.add_mesh(square, [[2, 1, 0], [3, 2, 0]], uvs=[[0, 0], [0, 1], [1, 1], [1, 0]])
    with collected() as notices:
        result = raycam.texture_from_photos(turned, cameras, photos, size=64)
    assert "inside_out_mesh" in notice_codes(notices)
    assert psnr(inner(result.texture), inner(pattern())) > 40


def test_non_manifold_mesh_with_degenerate_and_double_faces_is_textured() -> None:
    world = panel()
    cameras, photos = shots(world, PLACES)
    torn = raycam.World()
    square = [[-1, 1, 0], [-1, -1, 0], [1, -1, 0], [1, 1, 0], [0, 0, -1]]
    # The last faces are a fin below the square, a degenerate face and a duplicate.
    faces = [[0, 1, 2], [0, 2, 3], [0, 2, 4], [1, 1, 2], [0, 2, 3]]
    uvs = [[0, 0], [0, 1], [1, 1], [1, 0], [0.5, 0.5]]
    torn.add_mesh(square, faces, uvs=uvs)
    with collected() as notices:
        result = raycam.texture_from_photos(torn, cameras, photos, size=64)
    assert "overlapping_islands" in notice_codes(notices)
    assert psnr(inner(result.texture), inner(pattern())) > 40


def test_lack_of_memory_is_reported_before_anything_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    world = panel()
    cameras, photos = shots(world, PLACES[:1])
    monkeypatch.setattr(memory_limits, "available_bytes", lambda: 4 << 30)
    with raises(MemoryError, code="out_of_memory", mentions=["8192 x 8192", "5.0 GiB", "4.0 GiB"]):
        raycam.texture_from_photos(world, cameras, photos, size=8192)


class Rendered(Mapping):
    """Photographs that are rendered each time they are read."""

    def __init__(self, names: list[str]) -> None:
        self.names = names

    def __getitem__(self, name: str) -> np.ndarray:
        return np.full((30, 40, 3), 99, np.uint8)

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)


@pytest.mark.parametrize("method", ["blend", "best"])
def test_blending_and_survey_read_each_photograph_once(method: Literal["blend", "best"]) -> None:
    world = panel(cells=2)
    cameras, photos = shots(world, PLACES)
    reads: list[str] = []

    class Counted(Rendered):
        def __getitem__(self, name: str) -> np.ndarray:
            reads.append(name)
            return photos[name]

    raycam.texture_from_photos(world, cameras, Counted(list(cameras)), size=32, method=method)
    # "best" reads the photographs again for the colours of texels, and for the steps at seams.
    assert sorted(set(reads)) == sorted(cameras)
    assert all(reads.count(name) <= (1 if method == "blend" else 3) for name in cameras)


def peak_bytes(count: int, size: int) -> int:
    """The peak of Python's and NumPy's memory for a texture from `count` photographs."""
    world = panel()
    angles = np.linspace(0, 2 * np.pi, count)
    cameras = {
        f"{i:04d}": raycam.Camera.look_at(
            [np.cos(a), np.sin(a), 2.2], [0, 0, 0], up=[0, 1, 0], size=(40, 30), fov=60
        )
        for i, a in enumerate(angles)
    }
    with collected():
        tracemalloc.start()
        raycam.texture_from_photos(world, cameras, Rendered(list(cameras)), size=size, threads=1)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    return peak


@pytest.mark.parametrize("count", [300, pytest.param(2000, marks=pytest.mark.proof)])
def test_memory_of_many_photographs_is_bounded(monkeypatch: pytest.MonkeyPatch, count: int) -> None:
    monkeypatch.setattr("raycam.photos.survey.MAX_VIEWS", 1 << 14)
    few, many = peak_bytes(40, 8), peak_bytes(count, 8)
    # The gains of 2,000 photographs are one matrix of 2,000 x 2,000, and its factors.
    assert many - few < 6 * 8 * count**2 + (2 << 20)
    assert many < 300 << 20


def test_memory_for_a_texel_is_at_most_64_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("raycam.photos.survey.MAX_POINTS", 1 << 10)
    monkeypatch.setattr("raycam.photos.photo_set.PART_TEXELS", 1 << 12)
    monkeypatch.setattr("raycam.photos.blending.CHUNK_TEXELS", 1 << 12)
    monkeypatch.setattr("raycam.baking.texels.MAX_CANDIDATES", 1 << 12)
    small, large = peak_bytes(1, 128), peak_bytes(1, 512)
    views = 192 * (512**2 - 128**2)  # the option `memory` limits the number of these bytes
    assert (large - small - views) / (512**2 - 128**2) < 64


def test_command_texture_writes_a_glb(tmp_path: Path) -> None:
    world = panel(up="y")  # y is up, as in glTF
    cameras, photos = shots(world, [[0.3, 0.2, 2.4], [-0.5, 0.1, 2.4]])
    for name, pixels in photos.items():
        cv2.imwrite(str(tmp_path / name), pixels[..., ::-1])
    world.to_gltf(tmp_path / "panel.glb")
    raycam.save_cameras(tmp_path / "sparse", cameras, "colmap", images={name: name for name in cameras})
    common = ["texture", str(tmp_path / "panel.glb"), "--cameras", str(tmp_path / "sparse")]
    assert (
        main([*common, "--photos", str(tmp_path), "-o", str(tmp_path / "out.glb"), "--texture-size", "64"])
        == 0
    )
    assert raycam.load(tmp_path / "out.glb").counts["triangles"] == 2


@pytest.mark.parametrize(
    ("options", "code", "text"),
    [
        (["--orientation", "ignore"], 2, "240"),
        (["--orientation", "apply"], 0, ""),
        (["--texture-size", "99999"], 2, "--texture-size is 99999"),
    ],
)
def test_command_texture_accepts_an_orientation_and_names_the_option_of_the_size(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], code: int, text: str
) -> None:
    world = panel(up="y")
    camera = raycam.Camera.look_at([0.3, 0.2, 2.4], [0, 0, 0], up=[0, 1, 0], size=(320, 240), fov=50)
    photo = Image.fromarray(raycam.render(world, camera, samples=1).to_srgb8())
    exif = photo.getexif()
    exif[0x112] = 6  # a quarter turn clockwise makes the photograph upright
    photo.transpose(Image.Transpose.ROTATE_90).save(tmp_path / "a.png", exif=exif)
    world.to_gltf(tmp_path / "panel.glb")
    raycam.save_cameras(tmp_path / "sparse", {"a": camera}, "colmap", images={"a": "a.png"})
    common = ["texture", str(tmp_path / "panel.glb"), "--cameras", str(tmp_path / "sparse")]
    common += ["--photos", str(tmp_path), "-o", str(tmp_path / "out.glb"), "--texture-size", "32"]
    assert main([*common, *options]) == code
    assert text in capsys.readouterr().err


def test_command_texture_prints_the_scale_that_fits_before_the_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ball = trimesh.creation.icosphere(subdivisions=2)
    ball.apply_scale(1000)
    ball.export(tmp_path / "scan.ply")
    cameras = {f"{i}.png": camera for i, camera in enumerate(ring(4))}
    for name, camera in cameras.items():
        cv2.imwrite(str(tmp_path / name), np.zeros((camera.size[1], camera.size[0], 3), np.uint8))
    raycam.save_cameras(tmp_path / "sparse", cameras, "colmap", images={name: name for name in cameras})
    common = [
        "texture",
        str(tmp_path / "scan.ply"),
        "--cameras",
        str(tmp_path / "sparse"),
        "--atlas",
        "cells",
    ]
    assert (
        main([*common, "--photos", str(tmp_path), "-o", str(tmp_path / "out.glb"), "--texture-size", "64"])
        == 1
    )
    notice, error = capsys.readouterr().err.strip().split("\n")[-2:]
    assert notice.startswith("raycam: notice:")
    assert "scale the mesh by" in notice
    assert error.startswith("raycam: error:")
