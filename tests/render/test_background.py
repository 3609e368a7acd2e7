"""Background photos that are shown unchanged, warped or resampled.

They come from files, arrays and world files.
"""

from __future__ import annotations

import pickle
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from PIL import Image
from raycam.cli import main
from support.raises import Fault, fault, raises

SIZE = (64, 48)


def lens() -> raycam.Camera:
    """A wide camera with strong distortion."""
    return raycam.Camera.look_at([3, -4, 2.5], [0, 0, 0.4], fov=60, size=SIZE).replace(
        distortion=[-0.25, 0.06, 0.001, -0.002]
    )


def world() -> raycam.World:
    found = raycam.World()
    found.add_object(box={"size": 1.2}, location=[0, 0, 0.6], color="tomato")
    found.add_light("sun", direction=[1, 1, -2], irradiance=2)
    return found


def noise(size: tuple[int, int] = SIZE, seed: int = 3) -> np.ndarray[Any, Any]:
    return np.random.default_rng(seed).integers(0, 256, (size[1], size[0], 3), np.uint8)


def smooth(size: tuple[int, int]) -> np.ndarray[Any, Any]:
    """An image whose values change slowly."""
    x, y = np.meshgrid(np.linspace(0, 1, size[0]), np.linspace(0, 1, size[1]))
    planes = [110 + 90 * np.sin(5 * x + 2 * y), 120 + 80 * np.cos(4 * y), 60 + 150 * x * y]
    return np.stack(planes, axis=-1).round().astype(np.uint8)


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    path = tmp_path / "photo.png"
    Image.fromarray(noise()).save(path)
    return path


@pytest.mark.parametrize("view", ["standard", "agx", "pbr_neutral"])
@pytest.mark.parametrize("exposure", [0, 2.5])
def test_background_photo_is_shown_pixel_by_pixel_behind_the_world(
    photo: Path, view: Any, exposure: float
) -> None:
    camera = lens().with_background(photo)
    frame = raycam.render(
        world(), camera, samples=4, view=view, exposure=exposure, channels=["color", "alpha"]
    )
    clear = raycam.render(
        world(), lens(), samples=4, view=view, exposure=exposure, transparent_background=True
    )
    seen, alpha = frame.to_srgb8(), clear["alpha"]
    np.testing.assert_array_equal(frame["alpha"], alpha)
    np.testing.assert_array_equal(seen[alpha == 0], noise()[alpha == 0])
    shown = clear.to_srgb8().astype(int)
    assert np.abs(seen.astype(int) - shown)[alpha == 1].max() <= 1
    assert not frame.transparent
    rgba = clear.to_srgba8()
    edge = (alpha > 0) & (alpha < 1)
    assert edge.any()

    def linear(srgb: Any) -> Any:
        value = srgb / 255
        return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)

    expected = linear(rgba[..., :3]) * alpha[..., None] + (1 - alpha[..., None]) * linear(noise())
    if view == "standard" and exposure:
        return  # values above 1 are kept at edges
    np.testing.assert_allclose(linear(seen)[edge], expected[edge], atol=0.02)


def test_photo_of_another_lens_is_warped_as_in_opencv(tmp_path: Path) -> None:
    cv2 = pytest.importorskip("cv2")
    camera = lens()
    flat = camera.undistorted(balance=1, size=(160, 120))
    picture = smooth(flat.size)
    background = raycam.Background(picture, camera=flat)
    empty = raycam.World()
    empty.add_object(sphere={}, location=[0, 0, -50])
    seen = raycam.render(empty, camera, background=background, samples=1, integrator="flat").to_srgb8()
    table = camera.pixel_map(flat)
    expected = cv2.remap(picture, table[..., 0], table[..., 1], cv2.INTER_LINEAR)
    inside = np.isfinite(table).all(axis=2) & (table >= 1).all(axis=2) & (table < [158, 118]).all(axis=2)
    assert inside.mean() > 0.8
    assert np.abs(seen.astype(int) - expected)[inside].max() <= 2
    off = np.abs(seen.astype(int) - picture[: SIZE[1], : SIZE[0]])
    assert off.mean() > 10, "the warp matters"


def test_copies_of_a_camera_show_its_photo_through_their_own_intrinsics(photo: Path) -> None:
    camera = lens().with_background(photo)
    empty = raycam.World()
    empty.add_object(sphere={}, location=[0, 0, -50])

    def seen(camera: raycam.Camera) -> Any:
        return raycam.render(empty, camera, samples=1, integrator="flat").to_srgb8()

    part = camera.cropped(10, 6, 30, 20)
    np.testing.assert_array_equal(seen(part), noise()[6:26, 10:40])
    np.testing.assert_array_equal(seen(camera.replace(C=[0, 0, 9.0])), noise())
    np.testing.assert_array_equal(seen(camera.at_pose(np.eye(3), [1, 2, 3])), noise())
    np.testing.assert_array_equal(seen(camera.with_aperture(0.01, focus=3)), noise())
    half = seen(camera.resized((32, 24)))
    means = noise().reshape(24, 2, 32, 2, 3).mean(axis=(1, 3))
    assert np.abs(half - means).max() <= 1.01
    flat = camera.undistorted()
    assert flat.background is not None
    assert flat.background.camera is not None
    assert flat.background.camera.model == "opencv"
    again = raycam.Camera.from_dict(flat.to_dict())
    assert again == flat
    np.testing.assert_array_equal(seen(again), seen(flat))
    assert pickle.loads(pickle.dumps(flat)) == flat
    assert flat.with_background(None).background is None


def test_regions_with_a_background_equal_parts_of_the_whole_image(photo: Path) -> None:
    camera = lens().with_background(photo)
    whole = raycam.render(world(), camera, samples=2)
    parts = [raycam.render(world(), camera, samples=2, region=(x, 0, 32, 48)) for x in (0, 32)]
    np.testing.assert_array_equal(raycam.Frame.merge(parts)["color"], whole["color"])
    clear = raycam.render(world(), lens(), samples=2, region=(32, 0, 32, 48), transparent_background=True)
    np.testing.assert_array_equal(clear.over(noise())["color"], parts[1]["color"])
    np.testing.assert_array_equal(clear.over(noise()[:, 32:])["color"], parts[1]["color"])


def test_photo_of_another_size_is_resampled_and_another_aspect_ratio_refused(tmp_path: Path) -> None:
    large = smooth((256, 192))
    Image.fromarray(large).save(tmp_path / "large.png")
    frame = raycam.render(world(), lens().with_background(tmp_path / "large.png"), samples=1)
    assert any(notice.code == "resampled_background" for notice in frame.notices)
    clear = raycam.render(world(), lens(), samples=1, transparent_background=True)["alpha"] == 0
    means = large.reshape(48, 4, 64, 4, 3).mean(axis=(1, 3))
    assert np.abs(frame.to_srgb8() - means)[clear].max() <= 1.01
    Image.fromarray(smooth((48, 64))).save(tmp_path / "upright.png")
    with raises(raycam.SettingsError, code="wrong_shape", mentions=["upright.png", "48 x 64", "64 x 48"]):
        raycam.render(world(), lens().with_background(tmp_path / "upright.png"), samples=1)
    cover = raycam.Background(tmp_path / "upright.png", fit="cover")
    assert raycam.render(world(), lens().with_background(cover), samples=1).size == SIZE
    other = raycam.Background(large, camera=lens())
    with raises(raycam.SettingsError, code="wrong_shape", mentions=["256 x 192", "64 x 48"]):
        raycam.render(world(), lens(), background=other)


def test_pixels_outside_of_the_photo_are_counted_in_a_notice() -> None:
    camera = lens()
    narrow = camera.pinhole().cropped(10, 8, 40, 30)
    background = raycam.Background(noise((40, 30)), camera=narrow)
    frame = raycam.render(world(), camera, background=background, samples=1)
    said = next(notice for notice in frame.notices if notice.code == "uncovered_background")
    found = re.search(r"(\d+) pixel", str(said))
    assert found is not None, said
    count = int(found[1])
    table = camera.pixel_map(narrow)
    with np.errstate(invalid="ignore"):
        inside = (table >= -0.5).all(axis=2) & (table <= [39.5, 29.5]).all(axis=2)
    most = np.count_nonzero(~inside)
    # A pixel that is only partly outside of the photo is not counted.
    assert 0.95 * most <= count <= most


def test_world_files_define_background_photos(tmp_path: Path) -> None:
    (tmp_path / "photos").mkdir()
    Image.fromarray(noise()).save(tmp_path / "photos" / "a.png")
    text = '[[camera]]\nname = "a"\nfov = 60\nlocation = [0, -4, 0.5]\ntarget = [0, 0, 0]\nsize = [64, 48]\n'
    (tmp_path / "w.toml").write_text("[[object]]\nsphere = {}\n" + text + 'background = "photos/a.png"\n')
    found = raycam.load(tmp_path / "w.toml")
    behind = found.cameras["a"].background
    assert behind is not None
    assert Path(behind.file) == (tmp_path / "photos" / "a.png").absolute()
    np.testing.assert_array_equal(raycam.render(found).to_srgb8()[0, 0], noise()[0, 0])
    np.testing.assert_array_equal(
        raycam.render(raycam.World.from_bytes(found.to_bytes())).to_srgb8()[0, 0], noise()[0, 0]
    )
    assert raycam.render(found, transparent_background=True)["alpha"][0, 0] == 0
    table = 'background = { image = "photos/a.png", camera = { fov = 70, location = [0, 0, 0], size = [64, 48] } }\n'
    (tmp_path / "w.toml").write_text("[[object]]\nsphere = {}\n" + text + table)
    taker = raycam.load(tmp_path / "w.toml").cameras["a"].background
    assert taker is not None
    assert taker.camera is not None
    assert taker.camera.K[1, 1] < 40


@pytest.mark.parametrize(
    ("value", "error", "words"),
    [
        ('"none.png"', FileNotFoundError, fault("file_not_found", "none.png")),
        ('"../out.png"', raycam.FormatError, fault("outside_root", "w.toml:4", "camera[0].background")),
        (
            '{ image = "a.png", fit = "stretch" }',
            raycam.WorldError,
            fault("unknown_name", "w.toml:4", "camera[0].background.fit"),
        ),
        (
            '{ image = "a.png", fit = "cover", camera = { fov = 60, location = [0, 0, 0] } }',
            raycam.WorldError,
            fault("conflicting_values", "cover"),
        ),
        ('{ file = "a.png" }', raycam.WorldError, fault("unknown_key", "file")),
        ("3", raycam.WorldError, fault("wrong_type", "w.toml:4", "camera[0].background")),
    ],
)
def test_invalid_backgrounds_in_world_files_are_refused(
    tmp_path: Path, value: str, error: Any, words: Fault
) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    for path in (tmp_path / "out.png", inside / "a.png"):
        Image.fromarray(noise()).save(path)
    (inside / "w.toml").write_text(f"[camera]\nfov = 60\nlocation = [0, 0, 0]\nbackground = {value}\n")
    with raises(error, **words) as fault:
        raycam.load(inside / "w.toml")
    assert "background" in str(fault.value) or error is FileNotFoundError


def test_invalid_background_arguments_are_refused(photo: Path) -> None:
    with raises(raycam.CameraError, code="wrong_type"):
        lens().with_background(noise())  # type: ignore[arg-type]
    with raises(raycam.CameraError, code="unknown_name", mentions=["cover"]):
        raycam.Background(photo, fit="covers")  # type: ignore[arg-type]
    with raises(raycam.SettingsError, code="missing_value"):
        raycam.render(world(), lens(), background=photo, channels="depth")
    with raises(raycam.SettingsError, code="conflicting_values"):
        raycam.render(world(), lens(), background=photo, transparent_background=True)
    with pytest.raises(FileNotFoundError):
        raycam.render(world(), lens().with_background("nothing.png"))


def test_command_line_accepts_backgrounds(
    photo: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    table = "[camera]\nfov = 60\nlocation = [3, -4, 2]\ntarget = [0, 0, 0]\nsize = [64, 48]\n"
    (tmp_path / "w.toml").write_text("[[object]]\nbox = {}\n" + table)
    (tmp_path / "by.toml").write_text("[camera]\nfov = 90\nlocation = [0, 0, 0]\nsize = [64, 48]\n")
    words = ["render", "w.toml", "-o", "a.png", "--samples", "1", "--background", "photo.png"]
    assert main(words) == 0
    seen = np.asarray(Image.open("a.png"))
    np.testing.assert_array_equal(seen[0, :8], noise()[0, :8])
    assert main([*words, "--background-camera", "by.toml"]) == 0
    assert not np.array_equal(np.asarray(Image.open("a.png"))[0, :8], noise()[0, :8])
    assert main(["render", "w.toml", "-o", "a.png", "--background-camera", "by.toml"]) != 0


class _Tensor:
    """An array of another library, such as PyTorch or JAX, that has only `__array__`."""

    def __init__(self, array: np.ndarray[Any, Any]) -> None:
        self._array = array

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray[Any, Any]:
        return self._array if dtype is None else self._array.astype(dtype)


class _DlpackTensor:
    """A tensor that supports only DLPack."""

    def __init__(self, array: np.ndarray[Any, Any]) -> None:
        self._array = array

    def __dlpack__(self, **options: Any) -> Any:
        return self._array.__dlpack__(**options)

    def __dlpack_device__(self) -> tuple[int, int]:
        return self._array.__dlpack_device__()


@pytest.mark.parametrize("kind", [_Tensor, _DlpackTensor])
@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_tensors_are_accepted_as_backgrounds(kind: type, dtype: type) -> None:
    pixels = noise() if dtype is np.uint8 else (noise() / 255).astype(np.float32)
    frame = raycam.render(world(), lens(), samples=2, transparent_background=True)
    for wrap in (lambda x: x, raycam.Background):
        expected = frame.over(wrap(pixels))["color"]
        assert np.array_equal(frame.over(wrap(kind(pixels)))["color"], expected)
        assert np.array_equal(
            raycam.render(world(), lens(), samples=2, background=wrap(kind(pixels)))["color"], expected
        )


def test_uint16_backgrounds_are_srgb_and_other_integers_are_refused() -> None:
    frame = raycam.render(world(), lens(), samples=2, transparent_background=True)
    expected = frame.over(noise())["color"]
    assert np.allclose(frame.over(noise().astype(np.uint16) * 257)["color"], expected, atol=1e-5)
    with raises(raycam.SettingsError, code="wrong_type", mentions=["int64"]):
        frame.over(noise().astype(np.int64))
