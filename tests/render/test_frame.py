"""Frames and their files, read back by Pillow, OpenEXR and NumPy."""

from __future__ import annotations

import io
import os
import pickle
import warnings
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
import raycam
from PIL import Image
from raycam.render.frame import CHANNELS, PASSES, SAVERS, check_save
from support.raises import has_notice, raises, warns

SIZE = (7, 5)


def camera() -> raycam.Camera:
    return raycam.Camera(
        [[500.0, 2, 3], [0, 400, 2], [0, 0, 1]], np.eye(3)[[1, 2, 0]], [1, 2, 3], SIZE, pixel_center="half"
    )


def frame(names: tuple[str, ...] = tuple(CHANNELS), seed: int = 0) -> raycam.Frame:
    """A frame with every channel; the first pixel shows the background."""
    rng = np.random.default_rng(seed)
    miss = {"depth": np.inf, "distance": np.inf, "position": np.nan, "instance": -1, "triangle": -1}
    channels = {}
    for name in names:
        dtype, components = CHANNELS[name]
        shape = (SIZE[1], SIZE[0], components)[: 2 if components == 1 else 3]
        values = rng.integers(0, 1000, shape) if dtype == np.int32 else rng.uniform(0, 1, shape)
        channels[name] = values.astype(dtype)
        channels[name][0, 0] = miss.get(name, 0)
    return raycam.Frame(channels, camera=camera(), size=SIZE)


def srgb(linear: np.ndarray) -> np.ndarray:
    """The sRGB values of linear light (IEC 61966-2-1)."""
    linear = linear.astype(np.float64)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def test_channels_table_lists_dtypes_and_components() -> None:
    assert CHANNELS["color"] == (np.float32, 3)
    assert CHANNELS["position"] == (np.float64, 3)
    assert CHANNELS["instance"] == (np.int32, 1)
    assert set(CHANNELS) == {
        *("color", "albedo", "depth", "distance", "position"),
        *("normal", "normal_camera", "shading_normal", "shading_normal_camera"),
        *(
            "instance",
            "category",
            "triangle",
            "barycentric",
            "uv",
            "material",
            "coverage",
            "alpha",
            "shadow",
            "transmittance",
            "error",
        ),
        *("emission", "direct", "indirect", "diffuse", "specular", "volume"),
        *("roughness", "metallic", "nocs", "projector_uv"),
    }


def test_frames_are_mappings() -> None:
    one = frame()
    assert set(one) == set(CHANNELS) == set(one.channels)
    assert len(one) == len(CHANNELS)
    assert "depth" in one
    assert one["depth"].shape == (5, 7)
    assert "7 x 5" in repr(one)
    assert "depth" in repr(one)
    with raises(KeyError, mentions=["channels=[..., 'depth']"]):
        frame(("color",))["depth"]
    with raises(KeyError, mentions=["'depth'"]):
        one["dept"]


def test_png_with_8_bits_equals_the_srgb_values(tmp_path: Path) -> None:
    one = frame()
    one.save(tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as image:
        assert image.mode == "RGB"
        assert image.size == SIZE
        assert "srgb" in image.info
        read = np.asarray(image)
    np.testing.assert_array_equal(read, np.rint(srgb(one["color"]) * 255))
    np.testing.assert_array_equal(read, one.to_srgb8())
    with Image.open(io.BytesIO(one._repr_png_() or b"")) as image:
        np.testing.assert_array_equal(np.asarray(image), read)


def test_notebooks_show_the_colour_or_the_only_channel() -> None:
    assert frame()._repr_png_() == frame().to_png(channel="color")
    assert frame(("depth",))._repr_png_() == frame(("depth",)).to_png(channel="depth")
    assert frame(("depth", "instance"))._repr_png_() is None


def test_png_with_16_bits_equals_the_srgb_values(tmp_path: Path) -> None:
    import cv2

    one = frame()
    one.save(tmp_path / "a.png", bits=16)
    read = cv2.imread(str(tmp_path / "a.png"), cv2.IMREAD_UNCHANGED)[..., ::-1]
    assert read.dtype == np.uint16
    assert np.abs(read - srgb(one["color"]) * 65535).max() < 0.51


def test_srgb8_applies_the_exposure_and_clips_values_out_of_range() -> None:
    one = frame(("color",))
    one["color"][0, :5, 0] = [np.nan, np.inf, -np.inf, -1, 2]
    np.testing.assert_array_equal(one.to_srgb8()[0, :5, 0], [0, 255, 0, 0, 255])
    one["color"][1, 0] = 0.25
    assert (one.to_srgb8(exposure=1)[1, 0] == np.rint(srgb(np.array(0.5)) * 255)).all()
    one.exposure = -1
    assert (one.to_srgb8()[1, 0] == np.rint(srgb(np.array(0.125)) * 255)).all()
    assert (one["color"][1, 0] == 0.25).all()


def test_every_srgb_byte_round_trips_through_linear() -> None:
    from raycam import _core

    bytes_ = np.arange(256, dtype=np.uint8).reshape(1, 256, 1).repeat(3, axis=2)
    linear = _core.linear_from_srgb8(bytes_)
    one = raycam.Frame({"color": linear}, camera=None, size=(256, 1))
    np.testing.assert_array_equal(one.to_srgb8(), bytes_)


def test_exr_of_a_transparent_frame_is_premultiplied(tmp_path: Path) -> None:
    color = np.float32([[[0.25, 0.5, 0], [0, 0, 0]]])
    planes = {"color": color, "alpha": np.float32([[0.5, 0]])}
    one = raycam.Frame(planes, camera=None, size=(2, 1), transparent=True)
    one.save(tmp_path / "a.exr")
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        read = {name: channel.pixels for name, channel in file.channels().items()}
    assert set(read) == set("RGBA")
    np.testing.assert_array_equal(
        np.stack([read[name] for name in "RGBA"], -1)[0], [[0.25, 0.5, 0, 0.5], [0] * 4]
    )
    straight = np.rint(srgb(np.array([0.5, 1, 0])) * 255)
    assert one.to_srgba8().tolist() == [[[*straight, 128], [0, 0, 0, 0]]]


@pytest.mark.parametrize("half", [False, True])
def test_exr_file_contains_every_channel(tmp_path: Path, half: bool) -> None:
    one = frame()
    one.save(tmp_path / "a.exr", half=half)
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        header = dict(file.header())
        read = {name: channel.pixels for name, channel in file.channels().items()}
    names = {
        "color": ["R", "G", "B"],
        "albedo": ["albedo.R", "albedo.G", "albedo.B"],
        "depth": ["depth.Z"],
        "distance": ["distance.Z"],
        "position": ["position.X", "position.Y", "position.Z"],
        "uv": ["uv.U", "uv.V"],
        "coverage": ["coverage.V"],
        "alpha": ["alpha.V"],
        "shadow": ["shadow.R", "shadow.G", "shadow.B"],
        "transmittance": ["transmittance.R", "transmittance.G", "transmittance.B"],
        "error": ["error.V"],
        "roughness": ["roughness.V"],
        "metallic": ["metallic.V"],
        "projector_uv": ["projector_uv.U", "projector_uv.V"],
    }
    names |= {name: [f"{name}.{color}" for color in "RGB"] for name in PASSES}
    vectors = ["normal", "normal_camera", "shading_normal", "shading_normal_camera", "barycentric", "nocs"]
    names |= {name: [f"{name}.{axis}" for axis in "XYZ"] for name in vectors}
    names |= {name: [f"{name}.id"] for name in ("instance", "category", "triangle", "material")}
    assert set(names) == set(CHANNELS)
    assert set(read) == {layer for layers in names.values() for layer in layers}
    for name, layers in names.items():
        stored = np.stack([read[layer] for layer in layers], axis=-1).reshape(one[name].shape)
        if one[name].dtype == np.int32:
            assert stored.dtype == np.uint32
            np.testing.assert_array_equal(stored.view(np.int32), one[name])
        else:
            assert stored.dtype == (np.float16 if half else np.float32)
            np.testing.assert_array_equal(stored, one[name].astype(stored.dtype))
    assert header["raycam.pixelCenter"] == "half"
    np.testing.assert_allclose(np.reshape(header["raycam.K"], (3, 3)), camera().K)
    np.testing.assert_allclose(np.reshape(header["raycam.P"], (4, 4))[:3], camera().P)
    assert header["raycam.region"] == "0 0 7 5"


def test_npz_file_contains_every_channel_and_the_camera(tmp_path: Path) -> None:
    one = frame()
    one.save(tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz", allow_pickle=False) as read:
        for name in CHANNELS:
            assert read[name].dtype == one[name].dtype
            np.testing.assert_array_equal(read[name], one[name])
        for name in "KRCP":
            np.testing.assert_array_equal(read[name], getattr(camera(), name))
        assert tuple(read["size"]) == SIZE
        assert tuple(read["region"]) == (0, 0, *SIZE)
        assert read["pixel_center"] == "half"


@pytest.mark.parametrize("ending", SAVERS)
def test_equal_frames_are_saved_as_equal_bytes(tmp_path: Path, ending: str) -> None:
    for name in ("a", "b"):
        frame().save(tmp_path / f"{name}{ending}")
    assert (tmp_path / f"a{ending}").read_bytes() == (tmp_path / f"b{ending}").read_bytes()
    assert sorted(os.listdir(tmp_path)) == [f"a{ending}", f"b{ending}"]


def test_frames_with_strided_arrays_can_be_saved(tmp_path: Path) -> None:
    one = frame(("color", "depth"))
    mirrored = raycam.Frame({k: v[:, ::-1] for k, v in one.items()}, camera=None, size=SIZE)
    np.testing.assert_array_equal(mirrored.to_srgb8(), one.to_srgb8()[:, ::-1])
    mirrored.save(tmp_path / "a.exr")
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        np.testing.assert_array_equal(file.channels()["depth.Z"].pixels, one["depth"][:, ::-1])


def test_unsupported_files_and_options_are_refused(tmp_path: Path) -> None:
    with raises(
        raycam.FormatError,
        code="unknown_format",
        mentions=["'.jp2'", ".png", ".hdr", ".exr"],
    ):
        frame().save(tmp_path / "a.jp2")
    with raises(raycam.FormatError, code="unknown_format"):
        frame().save(tmp_path / "a")
    with raises(raycam.SettingsError, code="cannot_write", mentions=[".png"]):
        frame(("depth", "uv")).save(tmp_path / "a.png")
    with raises(raycam.SettingsError, code="unknown_key", mentions=["half", ".png"]):
        frame().save(tmp_path / "a.png", half=True)
    with raises(raycam.SettingsError, code="unknown_key", mentions=["bits", ".exr"]):
        frame().save(tmp_path / "a.exr", bits=16)
    with raises(raycam.SettingsError, code="invalid_value", mentions=["bits", "12"]):
        frame().save(tmp_path / "a.png", bits=12)
    with raises(FileNotFoundError, code="file_not_found"):
        frame().save(tmp_path / "nowhere" / "a.png")
    assert os.listdir(tmp_path) == []


def test_check_save_raises_before_rendering(tmp_path: Path) -> None:
    check_save(tmp_path / "a.png", ["color"], SIZE)
    with raises(OSError, code="file_unreadable"):
        check_save(tmp_path / "a.npz", list(CHANNELS), (1 << 30, 1 << 30))
    check_save(tmp_path / "a.png", ["depth"], SIZE)
    with raises(raycam.SettingsError, code="cannot_write", mentions=["a.png"]):
        check_save(tmp_path / "a.png", ["depth", "uv"], SIZE)


@pytest.mark.parametrize("ending", [".png", ".jpg", ".jpeg", ".hdr"])
def test_check_save_refuses_channels_that_the_file_cannot_store(tmp_path: Path, ending: str) -> None:
    for others in (["depth"], ["alpha"], ["instance", "uv"]):
        with raises(raycam.SettingsError, code="cannot_write", mentions=others):
            check_save(tmp_path / f"a{ending}", ["color", *others], SIZE)
        check_save(tmp_path / "a.exr", ["color", *others], SIZE)
    if ending == ".png":
        check_save(tmp_path / "a.png", ["color", "alpha"], SIZE, transparent=True)
        return
    with raises(raycam.SettingsError, code="cannot_write", mentions=[ending]):
        check_save(tmp_path / f"a{ending}", ["color"], SIZE, transparent=True)


@pytest.mark.parametrize("ending", [".jpg", ".hdr"])
def test_opacity_that_a_file_cannot_store_gives_a_notice(tmp_path: Path, ending: str) -> None:
    channels = {"color": np.ones((2, 3, 3), np.float32), "alpha": np.ones((2, 3), np.float32)}
    with warns(raycam.Notice, code="not_written"):
        raycam.Frame(channels, camera=None, size=(3, 2), transparent=True).save(tmp_path / f"a{ending}")
    raycam.Frame(channels, camera=None, size=(3, 2), transparent=True).save(tmp_path / "a.png")
    raycam.Frame(channels, camera=None, size=(3, 2)).save(tmp_path / f"a{ending}")


@pytest.mark.parametrize("value", [65504.0, 65519.0, 65520.0, 1e6, np.inf])
def test_values_beyond_half_precision_are_counted_in_a_notice(tmp_path: Path, value: float) -> None:
    """The count equals the number of values beyond NumPy's float16."""
    depth = np.full((2, 3), 2, np.float32)
    depth[0, :2] = value
    frame = raycam.Frame({"depth": depth}, camera=None, size=(3, 2))
    with np.errstate(over="ignore"):
        count = int((np.isinf(depth.astype(np.float16)) & np.isfinite(depth)).sum())
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        frame.save(tmp_path / "a.exr", half=True)
    notices = [each.message for each in heard]
    assert len(notices) == (count > 0)
    assert not count or has_notice(notices, "values_lost", count, "depth"), notices
    stored = OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True).channels()["depth.Z"].pixels
    assert int(np.isinf(stored).sum()) == count + int(np.isinf(depth).sum())


def test_frames_can_be_pickled() -> None:
    one = frame()
    again = pickle.loads(pickle.dumps(one))
    assert again.camera == one.camera
    for name in one:
        np.testing.assert_array_equal(again[name], one[name])


def part(whole: raycam.Frame, x: int, y: int, width: int, height: int) -> raycam.Frame:
    channels = {name: array[y : y + height, x : x + width] for name, array in whole.items()}
    return raycam.Frame(channels, camera=whole.camera, size=whole.size, region=(x, y, width, height))


def test_merge_joins_regions() -> None:
    whole = frame()
    parts = [part(whole, 0, 0, 3, 2), part(whole, 3, 0, 4, 2), part(whole, 0, 2, 7, 3)]
    merged = raycam.Frame.merge(reversed(parts))
    assert merged.region == (0, 0, 7, 5)
    assert merged.camera == whole.camera
    for name in whole:
        np.testing.assert_array_equal(merged[name], whole[name])


def test_merge_refuses_gaps_overlaps_and_foreign_frames() -> None:
    whole = frame()
    for parts in (
        [part(whole, 0, 0, 3, 5), part(whole, 4, 0, 3, 5)],
        [part(whole, 0, 0, 4, 5), part(whole, 3, 0, 4, 5)],
        [part(whole, 0, 0, 3, 5), part(frame(("color",)), 3, 0, 4, 5)],
        [],
    ):
        with pytest.raises(raycam.SettingsError):
            raycam.Frame.merge(parts)
