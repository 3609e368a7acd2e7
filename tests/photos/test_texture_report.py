"""The report page: its contents and its safety, checked without a browser."""

from __future__ import annotations

import base64
import re
from html.parser import HTMLParser
from pathlib import Path

import cv2
import numpy as np
import raycam
from raycam.cli import main
from raycam.photos.texture_report import chosen_photographs, compare_photograph
from support.textured_panel import panel, psnr, ring_of_places, shots


class Elements(HTMLParser):
    """The elements of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[tuple[str, dict]] = []

    def handle_starttag(self, tag: str, attrs: list) -> None:
        self.found.append((tag, dict(attrs)))


def test_report_shows_maps_photographs_and_sliders_and_loads_nothing(tmp_path: Path) -> None:
    world = panel()
    cameras, photos = shots(world, ring_of_places(4), size=(120, 90), samples=4)
    renamed = {f"<b>{name}": camera for name, camera in cameras.items()}
    photos = {f"<b>{name}": photo for name, photo in photos.items()}
    result = raycam.texture_from_photos(world, renamed, photos, size=64)
    result.save_report(tmp_path / "report.html")
    text = (tmp_path / "report.html").read_text()
    page = Elements()
    page.feed(text)
    tags = [tag for tag, _ in page.found]
    assert tags.count("input") == 3
    assert tags.count("img") == 3 + 2 * 3
    assert "b" not in tags  # names are escaped
    assert all(each.get("alt") for tag, each in page.found if tag == "img")
    assert not re.search(r"https?://", text)
    sources = [each["src"] for tag, each in page.found if tag == "img"]
    pictures = [
        cv2.imdecode(np.frombuffer(base64.b64decode(src.partition(",")[2]), np.uint8), cv2.IMREAD_COLOR)
        for src in sources
    ]
    assert [picture.shape for picture in pictures[:3]] == [(64, 64, 3)] * 3
    assert {picture.shape for picture in pictures[3:]} == {(90, 120, 3)}
    # Photograph and model look the same.
    assert psnr(pictures[3], pictures[4]) > 30
    assert len(re.findall(r"PSNR \d+\.\d dB", text)) == 3


def test_comparison_uses_the_photographs_exposure_and_hides_other_objects() -> None:
    world = panel()
    world.add_object(box={"size": [0.5, 0.5, 0.6]}, location=[0.2, 0, 0.35], color="red", type="unlit")
    cameras, photos = shots(world, ring_of_places(3), size=(120, 90), samples=4)
    photos["01.png"] = (photos["01.png"] * 0.8).astype(np.uint8)
    result = raycam.texture_from_photos(world, cameras, photos, size=64)
    fit = result.photographs[1]
    photo, model, shown = compare_photograph(result, result._photos, 0, fit)
    np.testing.assert_allclose(photo, photos["01.png"], atol=1)
    np.testing.assert_array_equal(model[~shown], photo[~shown])
    inside = cv2.erode(shown.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    assert 0.1 < inside.mean() < 0.6
    assert np.abs(model[inside].astype(int) - photo[inside]).mean() < 2


def test_report_contains_the_worst_the_median_and_the_best_photograph() -> None:
    fits = tuple(
        raycam.photos.PhotographFit(str(i), 9, (1, 1, 1), 0.1, d)
        for i, d in enumerate([0.03, 0.01, 0.05, 0.02, 0.04])
    )
    assert [fit.name for fit in chosen_photographs(fits)] == ["2", "0", "1"]
    assert chosen_photographs(fits[:1]) == [fits[0]]
    assert chosen_photographs(()) == []


def test_command_writes_a_report_and_an_atlas(tmp_path: Path) -> None:
    world = panel(up="y")
    cameras, photos = shots(world, ring_of_places(2), size=(80, 60), samples=4)
    for name, pixels in photos.items():
        cv2.imwrite(str(tmp_path / name), pixels[..., ::-1])
    bare = raycam.World("y")
    bare.add_mesh([[-1, 1, 0], [-1, -1, 0], [1, -1, 0], [1, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    bare.to_gltf(tmp_path / "bare.glb")
    raycam.save_cameras(tmp_path / "sparse", cameras, "colmap", images={name: name for name in cameras})
    common = [
        "texture",
        str(tmp_path / "bare.glb"),
        "--cameras",
        str(tmp_path / "sparse"),
        "--photos",
        str(tmp_path),
    ]
    output = ["-o", str(tmp_path / "out.glb"), "--texture-size", "64", "--method", "best"]
    assert main([*common, *output, "--atlas", "cells", "--report", str(tmp_path / "report.html")]) == 0
    assert (tmp_path / "report.html").stat().st_size > 5000
    made = raycam.load(tmp_path / "out.glb")
    frame = raycam.render(made, cameras["00.png"], samples=16).to_srgb8()
    middle = np.s_[15:45, 20:60]
    assert psnr(frame[middle], photos["00.png"][middle]) > 28
