"""The report page of a texture from photographs."""

from __future__ import annotations

import base64
import html
from typing import Protocol

import numpy as np
import numpy.typing as npt

from .. import _core
from ..render import render
from ..world import World
from .coverage import coverage_colors, viridis
from .photo_set import PhotoSet
from .photograph_fit import PhotographFit
from .survey import ViewedPhotograph

__all__ = ["report_page"]

Bytes = npt.NDArray[np.uint8]

MAX_MAP_SIDE = 768
"""Pixels along a side of a map on the page."""
MAX_PHOTO_SIDE = 900
"""Pixels along the longer side of a photograph on the page."""
FULL_DISAGREEMENT = 0.2
"""Disagreement that is shown in the brightest colour."""
JPEG_QUALITY = 88
STYLE = """
body{font:16px/1.45 system-ui,sans-serif;margin:2rem auto;max-width:70rem;padding:0 1rem;color:#222;background:#fff}
table{border-collapse:collapse}td,th{padding:.2rem .8rem;text-align:right;border-bottom:1px solid #ddd}
td:first-child,th:first-child{text-align:left}img{max-width:100%;display:block}
.maps{display:grid;grid-template-columns:repeat(auto-fit,minmax(18rem,1fr));gap:1rem}figure{margin:0}
.pair{position:relative;max-width:56rem}.pair img{width:100%}.pair img+img{position:absolute;inset:0}
input{width:100%;max-width:56rem}
"""
SCRIPT = """
for (const pair of document.querySelectorAll('.pair')) {
  const slider = pair.parentElement.querySelector('input'), top = pair.lastElementChild;
  const move = () => { top.style.clipPath = `inset(0 0 0 ${slider.value}%)`; };
  slider.addEventListener('input', move);
  move();
}
"""


class TextureMaps(Protocol):
    """The data of a texture on the page; see `PhotoTexture`."""

    @property
    def world(self) -> World: ...
    @property
    def texture(self) -> Bytes: ...
    @property
    def seen(self) -> npt.NDArray[np.bool_]: ...
    @property
    def covered(self) -> npt.NDArray[np.bool_]: ...
    @property
    def views(self) -> npt.NDArray[np.int32]: ...
    @property
    def disagreement(self) -> npt.NDArray[np.float32]: ...
    @property
    def photographs(self) -> tuple[PhotographFit, ...]: ...


def report_page(result: TextureMaps, photos: PhotoSet, number: int) -> str:
    """The page's HTML: shares, maps, fits of photographs, and comparisons with the model.

    Three photographs are shown next to the textured model.
    """
    covered = result.covered
    share = 100 * result.seen.sum() / max(1, covered.sum())
    several = 100 * (result.views[covered] > 1).mean()
    parts = [
        f"<h1>Texture of {len(result.photographs)} photographs</h1>",
        f"<p>{share:.1f} % of the texels are visible to a photograph, {several:.1f} % to several. "
        f"The texture has {result.texture.shape[1]} x {result.texture.shape[0]} texels.</p>",
        '<div class="maps">',
        *_maps(result),
        "</div>",
        "<h2>Photographs</h2>",
        _table(result.photographs),
        "<h2>Photographs and the textured model</h2>",
        "<p>Move the slider: the photograph is on the left, the textured model on the right.</p>",
    ]
    for fit in chosen_photographs(result.photographs):
        parts.append(_comparison(result, photos, number, fit))
    body = "\n".join(parts)
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; img-src data:; '
        "style-src 'unsafe-inline'; script-src 'unsafe-inline'\">"
        f"<title>Texture report</title><style>{STYLE}</style></head>"
        f"<body>{body}<script>{SCRIPT}</script></body></html>"
    )


def chosen_photographs(fits: tuple[PhotographFit, ...]) -> list[PhotographFit]:
    """The photographs with the largest, the median and the smallest disagreement."""
    shown = [fit for fit in fits if fit.texels]
    order = sorted(shown, key=lambda fit: -fit.disagreement if np.isfinite(fit.disagreement) else 0.0)
    places = sorted({0, len(order) // 2, len(order) - 1})
    return [order[place] for place in places if order]


def _maps(result: TextureMaps) -> list[str]:
    """Figures of the texture, the number of views and the disagreement."""
    step = max(1, -(-max(result.covered.shape) // MAX_MAP_SIDE))
    covered = result.covered[::step, ::step]
    white = np.full((*covered.shape, 3), 255, np.uint8)
    views = coverage_colors(result.views[::step, ::step].ravel()).reshape(*covered.shape, 3)
    heat = viridis(np.clip(result.disagreement[::step, ::step] / FULL_DISAGREEMENT, 0, 1))
    most = int(result.views.max(initial=0))
    figures = [
        (result.texture[::step, ::step], "texture"),
        (
            np.where(covered[..., None], views, white),
            f"photographs per texel: dark = 1, yellow = {most}, magenta = none",
        ),
        (
            np.where(covered[..., None], heat, white),
            f"luminance difference between photographs: dark = 0, yellow = {100 * FULL_DISAGREEMENT:.0f} % or more; "
            "high where poses are wrong",
        ),
    ]
    return [
        f"<figure>{_image(pixels, caption)}<figcaption>{html.escape(caption)}</figcaption></figure>"
        for pixels, caption in figures
    ]


def _table(fits: tuple[PhotographFit, ...]) -> str:
    """The photographs' fits, the worst first."""
    head = "<tr><th>photograph</th><th>texels</th><th>red gain</th><th>green gain</th><th>blue gain</th>"
    rows = [head + "<th>shift (pixels)</th><th>disagreement</th></tr>"]
    for fit in sorted(fits, key=lambda fit: -np.nan_to_num(fit.shift_px, nan=-1.0)):
        known = np.isfinite(fit.shift_px)
        cells = [
            html.escape(fit.name),
            str(fit.texels),
            *(f"{gain:.3f}" for gain in fit.gain),
            f"{fit.shift_px:.2f}" if known else "no overlap",
            f"{100 * fit.disagreement:.1f} %" if known else "no overlap",
        ]
        rows.append("<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
    return "<table>" + "".join(rows) + "</table>"


def _comparison(result: TextureMaps, photos: PhotoSet, number: int, fit: PhotographFit) -> str:
    """Returns HTML with a slider between a photograph and the textured model, and their PSNR.

    The model is shown with the photograph's exposure.
    """
    photo, model, shown = compare_photograph(result, photos, number, fit)
    title = html.escape(fit.name)
    error = ((photo[shown].astype(np.float64) - model[shown]) ** 2).mean() if shown.any() else np.nan
    quality = f"{10 * np.log10(255**2 / error):.1f} dB" if error > 0 else "no difference"
    return (
        f"<h3>{title}: PSNR {quality}</h3><div>"
        f'<div class="pair">{_image(photo, fit.name)}{_image(model, f"textured model as in {fit.name}")}</div>'
        f'<input type="range" min="0" max="100" value="50" aria-label="photograph and model of {title}"></div>'
    )


def compare_photograph(
    result: TextureMaps, photos: PhotoSet, number: int, fit: PhotographFit
) -> tuple[Bytes, Bytes, npt.NDArray[np.bool_]]:
    """The photograph and the rendered model as sRGB [h, w, 3], and the mask of the object.

    The mask [h, w] is True for pixels in which the object is visible. Other pixels of the model's image contain the
    photograph.
    """
    camera = photos.cameras[fit.name]
    scale = min(1.0, MAX_PHOTO_SIDE / max(camera.size))
    small = camera.resized((max(1, round(camera.size[0] * scale)), max(1, round(camera.size[1] * scale))))
    width, height = small.size
    u, v = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    places = np.stack([u.ravel() * camera.size[0], v.ravel() * camera.size[1]], axis=1)
    taken = ViewedPhotograph(photos.world, camera, photos.source, fit.name, photos.threads).pyramid()
    areas = np.tile(np.eye(2) / scale, (len(places), 1, 1))
    linear = taken.mean_colors(places, areas, photos.threads)[:, :3].reshape(height, width, 3)
    seen = render(photos.world, small, samples=1, channels=["instance"])["instance"] == number
    frame = render(result.world, small, samples=4, channels=["color"])["color"][..., :3]
    model = np.where(seen[..., None], frame * np.array(fit.gain, np.float32), linear)
    photo, shown = (
        _core.srgb_from_linear(np.ascontiguousarray(image, np.float32), 1.0, 8, "standard")
        for image in (linear, model)
    )
    return photo, shown, seen


def _image(pixels: npt.NDArray[np.generic], caption: str) -> str:
    """An image element that contains its pixels."""
    data = _core.encode_jpeg(np.ascontiguousarray(pixels, np.uint8), JPEG_QUALITY)
    text = base64.b64encode(bytes(data)).decode()
    return f'<img alt="{html.escape(caption)}" src="data:image/jpeg;base64,{text}">'
