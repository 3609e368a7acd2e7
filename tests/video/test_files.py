"""Video files and their options, and PNG images, read back by Pillow."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
import raycam
from PIL import Image
from raycam.video.files import ENDINGS, check_video, open_video, read_picture
from support.raises import fault, raises


def test_video_extensions_are_checked_with_their_options(tmp_path: Path) -> None:
    assert ENDINGS == [".mp4", ".mov", ".mkv", ".webm", ".gif"]
    for name in ("a.MP4", "a.mov", "a.mkv", "a.webm", "a.gif", "a"):
        check_video(tmp_path / name)
    for name, options, message in (
        (
            "a.avi",
            {},
            fault("unknown_format", "'.avi'", ".mp4", ".mov", ".mkv", ".webm", ".gif"),
        ),
        ("a.gif", {"lossless": True}, fault("cannot_write", ".gif", ".mov")),
        ("a.gif", {"alpha": True}, fault("cannot_write", ".gif")),
        ("a.mp4", {"alpha": True}, fault("cannot_write", ".mp4")),
    ):
        with raises(raycam.SettingsError, **message):
            check_video(tmp_path / name, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("components", [3, 4])
def test_folder_contains_the_images_as_png_files(tmp_path: Path, components: int) -> None:
    picture = np.random.default_rng(1).integers(0, 256, (12, 16, components), np.uint8)
    with open_video(tmp_path / "frames", (16, 12), 10, alpha=components == 4) as add:
        add(7, picture)
    path = tmp_path / "frames/frame_0007.png"
    with Image.open(path) as image:
        np.testing.assert_array_equal(np.asarray(image), picture)
    np.testing.assert_array_equal(read_picture(path.read_bytes()), picture)


@pytest.mark.parametrize("version", ["16.1.0", "14.0.1", None])
def test_pyav_is_checked_before_the_first_frame(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, version: str | None
) -> None:
    if version is None:
        monkeypatch.setitem(sys.modules, "av", None)
    else:
        monkeypatch.setattr("av.__version__", version)
    world = raycam.World()
    world.add_object(box={})
    rendered: list[int] = []
    with raises(raycam.SettingsError, code="missing_dependency", mentions=["PyAV", version or "av"]):
        raycam.video.write_video(
            world, tmp_path / "x.mp4", progress=lambda done, total: rendered.append(done), samples=1
        )
    assert rendered == []
    raycam.video.write_video(world, tmp_path / "folder", frames=(0, 1), samples=1)
    assert len(list((tmp_path / "folder").iterdir())) == 1
