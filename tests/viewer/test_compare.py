"""The client's metrics for comparing images, compared with NumPy and SciPy."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.viewer.page import page
from scipy.ndimage import correlate1d
from support.chromium import Tab
from support.node_core import needs_node, run_module

pytestmark = needs_node
WIDTH, HEIGHT = 32, 20


def images() -> tuple[Any, Any]:
    """Two images [h, w, 4] of sRGB bytes that are similar."""
    generator = np.random.default_rng(3)
    smooth = 127 + 100 * np.sin(np.linspace(0, 9, WIDTH * HEIGHT * 3)).reshape(HEIGHT, WIDTH, 3)
    pair = [np.full((HEIGHT, WIDTH, 4), 255, np.uint8) for _ in range(2)]
    for number, image in enumerate(pair):
        image[..., :3] = np.clip(smooth + number * generator.normal(0, 12, smooth.shape), 0, 255)
    return pair[0], pair[1]


def test_psnr_and_ssim_equal_their_formulas() -> None:
    a, b = images()
    found = run_module(
        "image/similarity.js",
        f"const [a, b] = {json.dumps([a.ravel().tolist(), b.ravel().tolist()])}"
        ".map((each) => Uint8ClampedArray.from(each));"
        f"return [psnrOf(a, b), ssimOf(a, b, {WIDTH}), String(psnrOf(a, a)), ssimOf(a, a, {WIDTH})];",
    )
    x, y = (each[..., :3].astype(float) for each in (a, b))
    assert found[0] == pytest.approx(10 * np.log10(255**2 / ((x - y) ** 2).mean()))
    weights = np.exp(-(np.arange(-5, 6) ** 2) / (2 * 1.5**2))

    def mean(values: Any) -> Any:
        both = correlate1d(correlate1d(values, weights / weights.sum(), 0), weights / weights.sum(), 1)
        return both[5:-5, 5:-5]

    p, q = (each @ [0.299, 0.587, 0.114] for each in (x, y))
    variances = mean(p * p) - mean(p) ** 2, mean(q * q) - mean(q) ** 2
    covariance = mean(p * q) - mean(p) * mean(q)
    c1, c2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2
    ssim = (2 * mean(p) * mean(q) + c1) * (2 * covariance + c2)
    ssim /= (mean(p) ** 2 + mean(q) ** 2 + c1) * (sum(variances) + c2)
    assert found[1] == pytest.approx(ssim.mean(), rel=1e-9)
    assert found[2:] == ["Infinity", pytest.approx(1)]


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        ("absolute", [1.0, 3.0, 0.0, 2.0]),
        ("signed", [1.0, -3.0, 0.0, 2.0]),
        ("relative", [0.5, 0.75, 0.0, None]),
    ],
)
def test_differences_are_absolute_signed_or_relative(kind: str, expected: list[float | None]) -> None:
    found = run_module(
        "image/compare.js",
        "const plane = (...values) => ({ name: 'depth', dtype: 'float32', width: 4, height: 1, components: 1,"
        " values: Float32Array.from(values) });"
        f"const made = differenceOf(plane(3, 1, 5, 2), plane(2, 4, 5, 0), '{kind}');"
        "return [[...made.plane.values], made.most, made.rms];",
    )
    assert found[0] == expected  # infinity, the relative difference from zero, is null in JSON
    assert found[1] == 3
    assert found[2] == pytest.approx(np.sqrt((1 + 9 + 0 + 4) / 4))


def test_flip_equals_nvidias_evaluator() -> None:
    import flip_evaluator

    a, b = images()
    found = run_module(
        "image/flip.js",
        f"const [a, b] = {json.dumps([a.ravel().tolist(), b.ravel().tolist()])}"
        ".map((each) => Uint8ClampedArray.from(each));"
        f"return [[...flipOf(a, b, {WIDTH})], [...flipOf(a, a, {WIDTH})]];",
    )
    pair = [np.ascontiguousarray(each[..., :3], np.float32) / 255 for each in (a, b)]
    expected, mean, _ = flip_evaluator.evaluate(*pair, "LDR", inputsRGB=True, applyMagma=False)
    shown = np.reshape(found[0], (HEIGHT, WIDTH))
    np.testing.assert_allclose(shown, np.asarray(expected).reshape(HEIGHT, WIDTH), atol=2e-3)
    assert np.mean(found[0]) == pytest.approx(mean, abs=1e-3)
    assert not np.any(found[1])


@pytest.mark.proof
def test_page_compares_by_every_kind_of_difference_in_a_range_that_is_entered(
    tab: Tab, small_world: raycam.World, tmp_path: Path
) -> None:
    import flip_evaluator

    camera = small_world.camera("front")
    a, b = (raycam.render(small_world, camera, channels="color", samples=4, seed=seed) for seed in (0, 1))
    path = tmp_path / "compared.html"
    path.write_text(page(a, title="first.npz", compare=b, compare_title="second.npz"), encoding="utf-8")
    tab.open(path.as_uri())
    assert "first.npz" in tab.evaluate("document.getElementById('compare-text').textContent")
    assert "second.npz" in tab.evaluate("document.getElementById('compare-text').textContent")

    def choose(mode: str) -> dict[str, str]:
        enter("compare-mode", mode)
        rows = "[...document.querySelectorAll('#difference dt')].map((t) => [t.textContent, t.nextSibling.textContent])"
        return dict(tab.evaluate(rows))

    def enter(name: str, value: str) -> None:
        tab.evaluate(
            f"(() => {{ const field = document.getElementById('{name}'); field.value = '{value}';"
            " field.dispatchEvent(new Event('change')); })()"
        )

    x, y = (each["color"].astype(float) for each in (a, b))
    for mode in ("difference", "signed", "relative"):
        assert float(choose(mode)["largest difference"]) == pytest.approx(np.abs(x - y).max(), rel=1e-4)
    bytes_ = [each.to_srgb8(0, "standard") for each in (a, b)]
    error = ((bytes_[0].astype(float) - bytes_[1]) ** 2).mean()
    shown = choose("difference")
    assert float(shown["PSNR, as displayed"].split()[0]) == pytest.approx(
        10 * np.log10(255**2 / error), abs=0.1
    )
    assert 0 < float(shown["SSIM, as displayed"]) < 1
    pair = [np.ascontiguousarray(each, np.float32) / 255 for each in bytes_]
    expected = flip_evaluator.evaluate(*pair, "LDR", inputsRGB=True, applyMagma=False)[1]
    assert float(choose("perceptual")["mean FLIP error"]) == pytest.approx(expected, abs=0.01)
    choose("signed")
    automatic = tab.evaluate("document.getElementById('difference-most').value")
    ends = "document.getElementById('legend').textContent"
    before = tab.evaluate(ends)
    enter("difference-most", "7.5")
    assert "7.5" in tab.evaluate(ends)
    assert "-7.5" in tab.evaluate(ends)
    tab.evaluate("document.getElementById('difference-auto').click()")
    assert tab.evaluate("document.getElementById('difference-most').value") == automatic
    assert tab.evaluate(ends) == before
