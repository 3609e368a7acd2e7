"""Frames read back from .npz and .exr files; EXR files are compared with OpenEXR."""

from __future__ import annotations

import re
import warnings
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
import raycam
from raycam.cli import main
from raycam.viewer.page import page
from raycam.viewer.saved_frames import load_frame
from support.raises import has_notice, notice_codes, raises


def test_npz_frames_are_restored(small_world: raycam.World, tmp_path: Path) -> None:
    frame = raycam.render(small_world, samples=1, channels="all", region=(4, 2, 20, 10))
    frame.save(tmp_path / "x.npz")
    back = load_frame(tmp_path / "x.npz")
    assert {name: array.tobytes() for name, array in back.items()} == {
        name: array.tobytes() for name, array in frame.items()
    }
    assert (back.size, back.region, back.camera) == (frame.size, frame.region, frame.camera)


def test_npz_files_without_a_valid_frame_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.npz"
    for text in (b"", b"PK\x03\x04 no", b"\x93NUMPY"):
        path.write_bytes(text)
        with pytest.raises(raycam.FormatError):
            load_frame(path)
    np.savez(path, other=np.zeros(3))
    with raises(raycam.FormatError, code="wrong_format", mentions=["x.npz"]):
        load_frame(path)
    np.savez(path, depth=np.zeros((3, 4), np.float32), size=[4, 4], region=[0, 0, 4, 4])
    with raises(raycam.FormatError, code="wrong_shape", mentions=["float32"]):
        load_frame(path)
    np.savez(path, depth=np.array([[None]]), size=[1, 1], region=[0, 0, 1, 1])
    with pytest.raises(raycam.FormatError):
        load_frame(path)
    assert zipfile.is_zipfile(path)


@pytest.mark.parametrize("half", [False, True])
@pytest.mark.parametrize("transparent", [False, True])
def test_exr_frames_are_restored(
    small_world: raycam.World, tmp_path: Path, half: bool, transparent: bool
) -> None:
    frame = raycam.render(
        small_world, samples=2, channels="all", region=(4, 2, 20, 10), transparent_background=transparent
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", raycam.Notice)  # half precision cannot store large values
        frame.save(tmp_path / "x.exr", half=half)
    back = load_frame(tmp_path / "x.exr")
    assert set(back) == set(frame)
    assert (back.size, back.region, back.camera) == (frame.size, frame.region, frame.camera)
    for name, array in frame.items():
        expected = array
        if array.dtype.kind == "f":
            with np.errstate(over="ignore"):
                expected = array.astype(np.float16 if half else np.float32).astype(np.float32)
        assert back[name].dtype == expected.dtype
        np.testing.assert_array_equal(back[name], expected, err_msg=name)
    assert has_notice(back.notices, "rounded_values", "position")
    assert next(iter(back)) == "color"


COMPRESSIONS = ["NO", "RLE", "ZIPS", "ZIP", "PIZ", "PXR24", "B44", "B44A", "DWAA", "DWAB"]


@pytest.mark.parametrize("compression", COMPRESSIONS)
@pytest.mark.parametrize("tiled", [False, True])
@pytest.mark.parametrize("dtype", [np.float16, np.float32])
def test_exr_layers_of_other_programs_keep_their_names(
    tmp_path: Path, compression: str, tiled: bool, dtype: Any
) -> None:
    random = np.random.default_rng(3)
    floats = [f"{layer}{letter}" for layer in ("", "beauty.", "light.key.") for letter in "RGBA"]
    floats += ["Z", "ViewLayer.UV.U", "ViewLayer.UV.V", "N.X", "N.Y", "N.Z", "crypto00.r", "depth.Z"]
    channels: dict[str, Any] = {
        name: np.cumsum(random.random((24, 40)), axis=1).astype(dtype) for name in floats
    }
    channels["ids.id"] = random.integers(0, 2**32, (24, 40)).astype(np.uint32)
    channels["small"] = random.integers(0, 9, (24, 40)).astype(np.uint32)
    channels["large"] = random.integers(2**31, 2**32, (24, 40)).astype(np.uint32)
    header: dict[str, Any] = {"compression": getattr(OpenEXR, f"{compression}_COMPRESSION")}
    header["type"] = OpenEXR.tiledimage if tiled else OpenEXR.scanlineimage
    if tiled:
        header["tiles"] = OpenEXR.TileDescription()
    path = tmp_path / "x.exr"
    OpenEXR.File(header, channels).write(str(path))
    with OpenEXR.File(str(path), separate_channels=True) as file:
        stored = {name: channel.pixels for name, channel in file.channels().items()}
    frame = load_frame(path)
    assert (frame.size, frame.region, frame.camera, frame.notices) == ((40, 24), (0, 0, 40, 24), None, [])
    parts = {
        "color": ["R", "G", "B"],
        "alpha": ["A"],
        "beauty.RGB": ["beauty.R", "beauty.G", "beauty.B"],
        "beauty.A": ["beauty.A"],
        "light.key.RGB": ["light.key.R", "light.key.G", "light.key.B"],
        "light.key.A": ["light.key.A"],
        "Z": ["Z"],
        "ViewLayer.UV.UV": ["ViewLayer.UV.U", "ViewLayer.UV.V"],
        "N.XYZ": ["N.X", "N.Y", "N.Z"],
        "crypto00.r": ["crypto00.r"],
        "depth": ["depth.Z"],
        "ids.id": ["ids.id"],
        "small": ["small"],
        "large": ["large"],
    }
    assert set(frame) == set(parts)
    near = 0 if compression in ("NO", "RLE", "ZIPS", "ZIP", "PIZ") or dtype == np.float32 else 2e-3
    for name, names in parts.items():
        expected = np.stack([stored[each] for each in names], axis=2)
        found = frame[name].reshape(24, 40, -1)
        if name == "ids.id":
            np.testing.assert_array_equal(found.view(np.uint32), expected)
        elif (
            compression.startswith("DWA") and expected.dtype.kind == "f"
        ):  # lossy decoders differ in the last digits
            np.testing.assert_allclose(found, expected.astype(np.float32), rtol=0.02, atol=0.02, err_msg=name)
        else:
            np.testing.assert_allclose(found, expected.astype(found.dtype), rtol=near, err_msg=name)
    assert (frame["small"].dtype, frame["large"].dtype) == (np.int32, np.float64)
    shown = page(frame, compare=frame)
    assert "beauty.RGB" in shown


def test_exr_data_windows_are_read_as_regions(tmp_path: Path) -> None:
    path, plane = tmp_path / "x.exr", np.ones((3, 5), np.float32)

    def written(data: list[tuple[int, int]], display: list[tuple[int, int]]) -> raycam.Frame:
        windows = {
            name: tuple(np.array(each, np.int32) for each in corners)
            for name, corners in (("dataWindow", data), ("displayWindow", display))
        }
        OpenEXR.File({**windows, "compression": OpenEXR.ZIP_COMPRESSION}, {"Y": plane}).write(str(path))
        return load_frame(path)

    inside = written([(12, 23), (16, 25)], [(10, 20), (29, 39)])
    assert (inside.size, inside.region, inside.notices) == ((20, 20), (2, 3, 5, 3), [])
    beyond = written([(-1, 0), (3, 2)], [(0, 0), (29, 39)])
    assert (beyond.size, beyond.region) == ((5, 3), (0, 0, 5, 3))
    assert notice_codes(beyond.notices) == ["ignored_feature"]


def test_unsupported_exr_files_are_refused(tmp_path: Path) -> None:
    path, plane = tmp_path / "x.exr", np.ones((8, 8), np.float32)
    parts = [OpenEXR.Part({}, {"Z": plane}, name) for name in ("one", "two")]
    OpenEXR.File(parts).write(str(path))
    with raises(raycam.FormatError, code="unsupported_feature", mentions=["x.exr"]):
        load_frame(path)
    deep = np.empty((8, 8), object)
    for at in np.ndindex(8, 8):
        deep[at] = np.ones(2, np.float32)
    OpenEXR.File({"type": OpenEXR.deepscanline, "compression": OpenEXR.ZIPS_COMPRESSION}, {"Z": deep}).write(
        str(path)
    )
    with raises(raycam.FormatError, code="unsupported_feature", mentions=["x.exr"]):
        load_frame(path)
    OpenEXR.File({"compression": OpenEXR.NO_COMPRESSION}, {"RY": plane}).write(str(path))
    data = bytearray(path.read_bytes())
    # The subsampling follows the channel's name, type and linear flag; 2, 2 is one sample per 2 x 2 pixels.
    at = data.index(b"RY\0") + 3 + 8
    data[at : at + 8] = np.array([2, 2], "<i4").tobytes()
    path.write_bytes(data)
    with raises(raycam.FormatError, code="unsupported_feature", mentions=["x.exr"]):
        load_frame(path)
    path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 5\n")
    with raises(raycam.FormatError, code="placeholder_file", mentions=["LFS"]):
        load_frame(path)
    with pytest.raises(FileNotFoundError):
        load_frame(tmp_path / "none.exr")
    with raises(raycam.FormatError, code="unknown_format", mentions=[".npz", ".exr"]):
        load_frame(tmp_path / "x.png")


def test_damaged_exr_files_are_refused(small_world: raycam.World, tmp_path: Path) -> None:
    path = tmp_path / "x.exr"
    raycam.render(small_world, samples=1, channels="all", region=(0, 0, 6, 4)).save(path)
    whole = path.read_bytes()
    random = np.random.default_rng(5)
    refused = []
    for _ in range(300):
        data = bytearray(whole)
        for at in random.integers(0, len(data), random.integers(1, 4)):
            data[at] = random.integers(256)
        cut = random.integers(1, len(data)) if random.random() < 0.3 else len(data)
        path.write_bytes(data[:cut])
        try:
            load_frame(path)
        except raycam.FormatError as error:
            refused.append(str(error))
    assert len(refused) > 50
    assert all("x.exr" in each for each in refused)
    for note, wrong, code in (
        (b"raycam.camera", b'{"K"', "invalid_camera"),
        (b"0 0 6 4", b"0 0 7 4", "wrong_shape"),
        (b"0 0 6 4", b"a b c d", "wrong_shape"),
    ):
        at = whole.index(note)
        found = at if note != b"raycam.camera" else whole.index(b'{"', at)
        path.write_bytes(whole[:found] + wrong + whole[found + len(wrong) :])
        with raises(raycam.FormatError, code=code, mentions=["x.exr"]):
            load_frame(path)


def test_huge_exr_file_is_refused_before_allocation(tmp_path: Path) -> None:
    path = tmp_path / "x.exr"
    OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION}, {"Z": np.zeros((64, 64), np.float32)}).write(
        str(path)
    )
    data = bytearray(path.read_bytes())
    for name in (b"dataWindow\0box2i\0", b"displayWindow\0box2i\0"):
        at = data.index(name) + len(name) + 4
        data[at + 8 : at + 16] = np.array([99_999, 99_999], "<i4").tobytes()
    path.write_bytes(data)
    with raises(raycam.FormatError, code="budget_exceeded", mentions=["10000000000"]):
        load_frame(path)


def test_damaged_camera_in_an_npz_file_is_refused(small_world: raycam.World, tmp_path: Path) -> None:
    raycam.render(small_world, samples=1).save(tmp_path / "x.npz")
    with np.load(tmp_path / "x.npz") as saved:
        arrays = dict(saved)
    for text in ("{", '{"K": 3}', "[]", "3"):
        np.savez(tmp_path / "x.npz", **{**arrays, "camera": np.array(text)})
        with raises(raycam.FormatError, code="invalid_camera", mentions=["x.npz"]):
            load_frame(tmp_path / "x.npz")


def test_view_shows_saved_frames(
    small_world: raycam.World, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    frame = raycam.render(small_world, samples=1, channels=["color", "depth"])
    shown = []
    monkeypatch.setattr(raycam.Frame, "show", lambda self, **options: shown.append((self, options)))
    for ending in ("npz", "exr"):
        frame.save(tmp_path / f"x.{ending}")
        raycam.view(tmp_path / f"x.{ending}", compare=frame)
        back, options = shown.pop()
        assert set(back) == {"color", "depth"}
        assert options == {"title": f"x.{ending}", "compare": frame}


@pytest.mark.parametrize("names", ["a.exr", "a.npz", "a.exr b.npz", "a.npz b.EXR"])
def test_view_command_writes_the_page_of_saved_frames(
    small_world: raycam.World, tmp_path: Path, capsys: pytest.CaptureFixture[str], names: str
) -> None:
    frame = raycam.render(small_world, samples=1, channels=["color", "depth", "instance"])
    paths = [tmp_path / name for name in names.split()]
    for path in paths:
        frame.save(path)
    assert main(["view", *map(str, paths), "--no-browser"]) == 0
    made = Path(capsys.readouterr().out.strip())
    planes = set(re.findall(r'"key": "([\w-]+)"', made.read_text(encoding="utf-8")))
    made.unlink()
    assert planes == {f"{side}-{name}" for side in "ab"[: len(paths)] for name in frame}


def test_view_command_applies_frame_options_and_refuses_world_options(
    small_world: raycam.World, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.npz"
    raycam.render(small_world, samples=1, channels=["color", "depth"]).save(path)
    shown = ["--channel", "depth", "--exposure", "1.5", "--view", "agx"]
    assert main(["view", str(path), "--no-browser", *shown]) == 0
    made = Path(capsys.readouterr().out.strip())
    text = made.read_text(encoding="utf-8")
    made.unlink()
    assert '"channel": "depth"' in text
    assert '"exposure": 1.5, "view": "agx"' in text
    assert main(["view", str(path), "--no-browser", "--at", "1", "--variant", "red", "--no-edit"]) != 0
    assert "--at, --variant, --no-edit:" in capsys.readouterr().err


def test_world_options_are_refused_for_a_frame(small_world: raycam.World) -> None:
    frame = raycam.render(small_world, samples=1, channels=["color"])
    with raises(raycam.SettingsError, code="conflicting_values"):
        raycam.view(frame, size=(64, 48))
    with raises(raycam.SettingsError, code="wrong_type"):
        raycam.view(None)


def test_view_command_refuses_a_world_with_a_frame_and_damaged_frames(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["view", "room.toml", "a.exr", "--no-browser"]) != 0
    assert "saved as .npz or .exr" in capsys.readouterr().err
    (tmp_path / "a.exr").write_bytes(b"\x76\x2f\x31\x01")
    assert main(["view", str(tmp_path / "a.exr"), "--no-browser"]) != 0
    assert "a.exr" in capsys.readouterr().err
