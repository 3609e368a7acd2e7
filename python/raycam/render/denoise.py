"""Denoising with Open Image Denoise: the `raycam[denoise]` extra.

A neural network estimates a smooth image, which is biased. The network's guides, the base colour and normal of the
pixel-centre ray, are free of noise. The guides are still filtered first, because their edges are not anti-aliased.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ..errors import SettingsError

__all__ = ["GUIDES", "denoise", "denoise_premultiplied"]

GUIDES = ("albedo", "shading_normal")
"""The channels that guide the network."""

Image = npt.NDArray[np.float32]


def load() -> Any:
    """Imports Open Image Denoise; raises `SettingsError` if the library is not installed."""
    try:
        import pyoidn
    except ImportError as error:
        raise SettingsError(
            f"denoising requires Open Image Denoise ({error}); pip install 'raycam[denoise]', or omit denoise",
            code="missing_dependency",
        ) from None
    return pyoidn


def denoise(color: Image, albedo: Image, normal: Image) -> Image:
    """Returns denoised linear radiance, float32 [h, w, 3].

    All arguments have this shape and type. `albedo` is the base colour; `normal` has unit length or is 0. Raises
    `SettingsError` if the library is missing or fails.
    """
    oidn = load()
    device = oidn.Device()
    device.commit()

    def run(hdr: bool, **images: Image) -> Image:
        output = np.zeros_like(color)
        with oidn.Filter(device, "RT") as run_filter:
            for name, image in images.items():
                run_filter.set_image(name, np.ascontiguousarray(image, np.float32), oidn.OIDN_FORMAT_FLOAT3)
            run_filter.set_image("output", output, oidn.OIDN_FORMAT_FLOAT3)
            run_filter.set_bool("hdr", hdr)
            run_filter.set_bool("cleanAux", len(images) > 1)
            run_filter.commit()
            run_filter.execute()
        if message := device.get_error():
            raise SettingsError(f"Open Image Denoise: {message}", code="failed_denoising")
        return output

    with device:
        guides = {"albedo": run(False, albedo=albedo), "normal": run(False, normal=normal)}
        return run(True, color=color, **guides)


def denoise_premultiplied(color: Image, alpha: Image, albedo: Image, normal: Image) -> Image:
    """Returns denoised linear radiance, premultiplied by `alpha`, float32 [h, w, 3].

    `alpha` is [h, w]; the result is 0 where alpha is 0. The network receives unpremultiplied colour, so that it does
    not treat edges as noise. Transparent pixels get the mean colour of the image, because black next to an edge would
    darken the edge. `denoise` describes the other arguments and the errors.
    """
    there = (alpha > 0)[..., np.newaxis]
    opacity = alpha[..., np.newaxis]
    plain = np.where(there, color / np.where(there, opacity, 1), 0).astype(np.float32)
    if there.any():
        plain = np.where(there, plain, plain[alpha > 0].mean(axis=0)).astype(np.float32)
    return np.asarray(np.where(there, denoise(plain, albedo, normal) * opacity, 0), dtype=np.float32)
