"""Textures that show one photograph on each face.

Sharpness, seams, and texels that are not visible to any camera are checked.
"""

from __future__ import annotations

from functools import cache

import cv2
import numpy as np
import pytest
import raycam
from raycam.photos.composite import smooth
from support.raises import raises
from support.textured_panel import inner, noise, panel, pattern, psnr, ring_of_places, shots


def sharpness(texture: np.ndarray) -> float:
    """The mean absolute difference of neighbouring texels."""
    grey = inner(texture).astype(float).mean(axis=2)
    return float(np.abs(np.diff(grey, axis=0)).mean() + np.abs(np.diff(grey, axis=1)).mean())


@cache
def wrong_poses() -> dict[str, raycam.photos.PhotoTexture]:
    """A panel from photographs that are off by one pixel, with each method."""
    random = np.random.default_rng(0)
    world = panel(noise(128), cells=8)
    cameras, photos = shots(world, ring_of_places(5, radius=0.9), size=(150, 150))
    for name, camera in cameras.items():
        matrix, angle = camera.K.copy(), random.uniform(0, 2 * np.pi)
        matrix[:2, 2] += [np.cos(angle), np.sin(angle)]
        cameras[name] = camera.replace(K=matrix)
    return {
        method: raycam.texture_from_photos(world, cameras, photos, size=128, method=method)
        for method in ("blend", "best", "detail")
    }


def test_best_and_detail_are_sharper_than_blend_where_poses_are_wrong() -> None:
    found = {method: sharpness(result.texture) for method, result in wrong_poses().items()}
    assert found["best"] > 1.1 * found["blend"]
    assert found["detail"] > 1.1 * found["blend"]


def test_detail_has_the_low_frequencies_of_blend() -> None:
    low = {
        method: cv2.GaussianBlur(result.texture.astype(np.float64), (0, 0), 16)[24:-24, 24:-24]
        for method, result in wrong_poses().items()
    }
    best, detail = (np.abs(low[method] - low["blend"]).mean() for method in ("best", "detail"))
    assert detail < 0.7 * best


def test_each_face_shows_one_photograph() -> None:
    result = wrong_poses()["best"]
    view = result.view.reshape(8, 16, 8, 16).swapaxes(1, 2)
    y, x = np.mgrid[:16, :16]
    for half in (y > x, y < x):  # the texels of each of the two faces of a square
        own = view[:, :, half]
        assert (own == own[..., :1]).all()
    assert set(np.unique(result.view)) == set(range(5))
    assert (wrong_poses()["blend"].view == -1).all()


def test_seams_between_photographs_of_different_exposure_are_levelled() -> None:
    world = panel(np.full((64, 64, 3), 150, np.uint8), cells=8)
    cameras, photos = shots(world, ring_of_places(3, radius=1.0), size=(150, 150), samples=4)
    dimmed = {
        name: (photo * factor).astype(np.uint8)
        for (name, photo), factor in zip(photos.items(), (1, 0.97, 0.94), strict=True)
    }
    result = raycam.texture_from_photos(world, cameras, dimmed, size=64, method="best", exposure="off")
    assert len(np.unique(result.view)) > 1
    seam = result.view[:, 1:] != result.view[:, :-1]
    step = np.abs(np.diff(result.texture.astype(int), axis=1)).max(axis=2)
    assert seam[3:-3].any()
    assert step[3:-3, 3:-3].max() <= 2  # without levelling, the steps are 4 to 9


@pytest.mark.parametrize("method", ["best", "detail"])
def test_texture_from_rendered_photographs_reaches_40_decibels(method: str) -> None:
    world = panel(cells=4)
    cameras, photos = shots(world, [[0.3, 0.2, 2.4], [-0.5, 0.1, 2.4]])
    result = raycam.texture_from_photos(world, cameras, photos, size=64, method=method)
    assert psnr(inner(result.texture), inner(pattern())) > 40


@pytest.mark.parametrize("method", ["best", "detail"])
def test_visible_texels_equal_those_of_blend_behind_an_occluder(method: str) -> None:
    world = panel()  # there are two large faces, and each photograph shows only a part of each
    world.add_object(box={"size": [0.5, 0.5, 0.6]}, location=[0.2, 0, 0.35], color="red", type="unlit")
    cameras, photos = shots(world, [[2, 0.1, 1.5], [-1.5, 0.3, 2]], size=(200, 200))
    blend, found = (
        raycam.texture_from_photos(world, cameras, photos, size=48, show_unseen=True, method=each)
        for each in ("blend", method)
    )
    np.testing.assert_array_equal(found.seen, blend.seen)
    assert not found.seen.all()
    assert (found.texture[~found.seen] == [255, 0, 255]).all()
    assert (found.view[~found.seen] == -1).all()
    # Texels that the face's photograph does not show are blended, and not red.
    assert (found.view[found.seen] == -1).any()
    assert psnr(found.texture[found.seen], blend.texture[found.seen]) > 25


def test_composite_does_not_depend_on_photograph_order_or_threads() -> None:
    world = panel(cells=4)
    cameras, photos = shots(world, ring_of_places(3), size=(100, 100), samples=4)
    one = raycam.texture_from_photos(world, cameras, photos, size=32, threads=1, method="detail")
    turned = dict(reversed(cameras.items()))
    two = raycam.texture_from_photos(world, turned, photos, size=32, threads=2, method="detail", memory=1)
    np.testing.assert_array_equal(one.texture, two.texture)
    np.testing.assert_array_equal(one.view, two.view)


def test_averages_equal_opencvs_box_filter() -> None:
    image = np.random.default_rng(0).random((30, 40, 2))
    expected = image
    for _ in range(3):
        expected = cv2.blur(expected, (7, 7), borderType=cv2.BORDER_CONSTANT)
    np.testing.assert_allclose(smooth(image, 8), expected, atol=1e-9)


def test_unknown_method_is_refused() -> None:
    world = panel()
    cameras, photos = shots(world, ring_of_places(1), size=(20, 20), samples=1)
    with raises(raycam.SettingsError, mentions=["method"]):
        raycam.texture_from_photos(world, cameras, photos, method="graph_cut")
