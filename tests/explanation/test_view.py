"""View transforms, compared with the published equations in NumPy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import raycam
from PIL import Image
from raycam.render.frame import VIEWS
from support.raises import raises

Floats = npt.NDArray[np.float64]

COLORS = np.concatenate(
    [
        np.repeat([[0.0], [1e-4], [0.02], [0.18], [0.5], [0.8], [1.0], [2.0], [16.3], [1e4]], 3, axis=1),
        np.random.default_rng(3).uniform(0, 1, [200, 3]) ** 2,
        np.random.default_rng(4).uniform(0, 1, [200, 3]) ** 4 * 30,
    ]
)


def frame(colors: Floats) -> raycam.Frame:
    return raycam.Frame({"color": colors.astype(np.float32)[None]}, camera=None, size=(len(colors), 1))


def srgb(linear: Floats) -> Floats:
    linear = linear.clip(0, 1)
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055)


def pbr_neutral(rgb: Floats) -> Floats:
    """The GLSL of https://modelviewer.dev/examples/tone-mapping, line by line."""
    start, desaturation = 0.8 - 0.04, 0.15
    out = []
    for color in rgb:
        x = color.min()
        c = color - (x - 6.25 * x * x if x < 0.08 else 0.04)
        peak = c.max()
        if peak >= start:
            d = 1.0 - start
            new_peak = 1.0 - d * d / (peak + d - start)
            c = c * new_peak / peak
            g = 1.0 - 1.0 / (desaturation * (peak - new_peak) + 1.0)
            c = c * (1 - g) + new_peak * g
        out.append(c)
    return np.array(out)


def agx(rgb: Floats) -> Floats:
    """B. Wrensch, "Minimal AgX Implementation".

    https://iolite-engine.com/blog_posts/minimal_agx_implementation.
    """
    inset = np.array(
        [
            [0.842479062253094, 0.0784335999999992, 0.0792237451477643],
            [0.0423282422610123, 0.878468636469772, 0.0791661274605434],
            [0.0423756549057051, 0.0784336, 0.879142973793104],
        ]
    )
    x = (np.log2((rgb @ inset.T).clip(2.0**-12.47393, 2.0**4.026069)) + 12.47393) / 16.5
    x = 15.5 * x**6 - 40.14 * x**5 + 31.96 * x**4 - 6.868 * x**3 + 0.4298 * x**2 + 0.1191 * x - 0.00232
    return (x @ np.linalg.inv(inset).T).clip(0, 1) ** 2.2


@pytest.mark.parametrize(("name", "view"), [("pbr_neutral", pbr_neutral), ("agx", agx)])
@pytest.mark.parametrize("stops", [0.0, -1.5, 2.0])
def test_view_transforms_equal_the_published_equations(name: str, view: object, stops: float) -> None:
    assert callable(view)
    expected = srgb(view(COLORS.astype(np.float32).astype(np.float64) * 2.0**stops))
    eight = frame(COLORS).to_srgb8(exposure=stops, view=name)[0]
    assert np.abs(eight - expected * 255).max() <= 0.51


def test_view_transforms_keep_grey_neutral() -> None:
    for name in VIEWS:
        greys = frame(COLORS[:10]).to_srgb8(view=name)[0].astype(int)
        assert np.ptp(greys, axis=1).max() <= 1, name
        assert (np.diff(greys[:, 1]) >= 0).all(), name
    # Middle grey 0.18 by the published curves: 0.4967 before an exponent of 2.2, and 0.14 after subtracting 0.04.
    assert frame(np.full([1, 3], 0.18)).to_srgb8(view="agx")[0, 0, 0] == round(
        srgb(np.array(0.4967**2.2)) * 255
    )
    assert frame(np.full([1, 3], 0.18)).to_srgb8(view="pbr_neutral")[0, 0, 0] == round(
        float(srgb(np.array(0.14)) * 255)
    )


def test_standard_view_restores_8_bit_colors() -> None:
    every = np.stack([np.arange(256), np.roll(np.arange(256), 85), np.arange(255, -1, -1)], axis=1)
    linear = np.where(every <= 10.31475, every / 255 / 12.92, ((every / 255 + 0.055) / 1.055) ** 2.4)
    assert (frame(linear).to_srgb8()[0] == every).all()
    assert (frame(linear).to_srgb8(view="agx")[0] != every).any()


def test_view_is_set_by_the_world_the_call_or_the_output_file(tmp_path: Path) -> None:
    world = raycam.World.from_dict(
        {
            "camera": {"size": [4, 3], "focal": 4, "location": [0, 0, 3], "pitch": 90},
            "object": {"plane": {"size": [9, 9]}, "type": "unlit", "color": [0.9, 0.5, 0.1]},
            "render": {"integrator": "flat", "samples": 1, "view": "agx"},
        }
    )
    assert world.render_settings["view"] == "agx"
    seen = raycam.render(world)
    assert seen.view == "agx"
    seen.save(tmp_path / "a.png")
    seen.save(tmp_path / "b.png", view="standard")
    raycam.render(world, view="standard").save(tmp_path / "c.png")
    a, b, c = [np.asarray(Image.open(tmp_path / f"{name}.png")) for name in "abc"]
    assert (b == c).all()
    assert (a != b).any()
    with raises(raycam.SettingsError, code="invalid_settings", mentions=['"agxx"']):
        seen.save(tmp_path / "d.png", view="agxx")
    with raises(raycam.SettingsError, code="unknown_key", mentions=[".exr"]):
        seen.save(tmp_path / "d.exr", view="agx")


def test_hdr_files_are_written_without_a_view_transform(tmp_path: Path) -> None:
    import cv2

    colors = COLORS[COLORS.max(axis=1) > 1e-3]
    frame(colors).save(tmp_path / "a.hdr")
    read = cv2.imread(str(tmp_path / "a.hdr"), cv2.IMREAD_UNCHANGED)
    assert read is not None
    error = np.abs(read[0, :, ::-1] - colors) / colors.max(axis=1, keepdims=True)
    assert error.max() < 1 / 128


def test_infinite_values_are_shown_as_the_largest_value_and_nan_as_black() -> None:
    inf, nan = np.inf, np.nan
    odd = np.array([[inf, 1, 1], [1, inf, 0], [inf, inf, inf], [-inf, nan, 0]])
    finite = np.array([[3e38, 1, 1], [1, 3e38, 0], [3e38, 3e38, 3e38], [0, 0, 0]])
    for name in VIEWS:
        found, expected = (frame(colors).to_srgb8(view=name).astype(int) for colors in (odd, finite))
        assert np.abs(found - expected).max() <= 1, name
