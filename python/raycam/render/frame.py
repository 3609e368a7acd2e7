"""Frames: rendered channels, and the files that they are saved to."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import flag, one_of, whole
from ..camera import Camera
from ..errors import FormatError, Notice, SettingsError, nearest
from ..io import atomic_files
from ..io.npz import npz_bytes
from ..io.other_names import no_attribute
from ..notices import warn_all
from .channel_picture import channel_picture, encode_jpeg
from .options import VIEWS, check_option

__all__ = [
    "CHANNELS",
    "PASSES",
    "VIEWS",
    "Frame",
    "channel_form",
    "check_save",
    "encoded",
    "is_channel",
    "is_pass",
]


CHANNELS = {name: (np.dtype(dtype), components) for name, dtype, components in _core.channels()}
"""The dtype and the number of components of every channel, except those of single lights."""
PASSES = ("emission", "direct", "indirect", "diffuse", "specular", "volume")
"""Parts of the colour, in addition to the channels of single lights."""
LIGHT_PREFIX = "light:"
"""Prefix of the channels that show the light of one source."""


def is_pass(name: str) -> bool:
    """Returns True for a channel that is a part of the colour, such as `direct`."""
    return name in PASSES or _is_light(name)


def is_channel(name: str) -> bool:
    """Returns True for the name of a channel, including `light:NAME`."""
    return name in CHANNELS or _is_light(name)


def channel_form(name: str) -> tuple[np.dtype[Any], int]:
    """Returns the dtype and the number of components of a channel."""
    return CHANNELS["color"] if _is_light(name) else CHANNELS[name]


def _is_light(name: str) -> bool:
    return name.startswith(LIGHT_PREFIX) and len(name) > len(LIGHT_PREFIX)


Channels = dict[str, npt.NDArray[Any]]


class Frame(Mapping[str, npt.NDArray[Any]]):
    """An image with its ground truth: a mapping from channel names to arrays, row 0 at the top.

    ===================== ======= ========= =========================================================== ==========
    channel               dtype   shape                                                                 background
    ===================== ======= ========= =========================================================== ==========
    color                 float32 [h, w, 3] linear Rec. 709 radiance, filtered over the pixel           sky, or 0
    albedo                float32 [h, w, 3] linear base colour of the surface, unlit                    0
    depth                 float32 [h, w]    z along the principal axis, metres                          +inf
    distance              float32 [h, w]    length of the ray, metres                                   +inf
    position              float64 [h, w, 3] the surface point in the world, metres                      NaN
    normal                float32 [h, w, 3] the triangle's unit normal in the world, facing the camera  0
    normal_camera         float32 [h, w, 3] `normal` in camera axes: x right, y down, z forward         0
    shading_normal        float32 [h, w, 3] from the corners' normals, in the world, facing the camera  0
    shading_normal_camera float32 [h, w, 3] `shading_normal` in camera axes                             0
    instance              int32   [h, w]    id of the object                                            -1
    category              int32   [h, w]    id of the category in `World.categories`; -1 for none       -1
    triangle              int32   [h, w]    index of the triangle in its mesh                           -1
    barycentric           float32 [h, w, 3] weights of the triangle's corners                           0
    uv                    float32 [h, w, 2] texture coordinates, v down; NaN if the mesh has none       NaN
    material              int32   [h, w]    index of the material in the world                          -1
    coverage              float32 [h, w]    fraction of samples on the same object as the centre ray
    alpha                 float32 [h, w]    fraction of samples that do not show the sky                0
    shadow                float32 [h, w, 3] light that shadow catchers leave to the background          1
    transmittance         float32 [h, w, 3] light that fog and media let pass to the camera             1, fog: 0
    emission              float32 [h, w, 3] unscattered light: from lamps, emitting surfaces and the sky    sky, or 0
    direct                float32 [h, w, 3] light that was scattered once                                   0, or fog
    indirect              float32 [h, w, 3] light that was scattered more than once                         0, or fog
    diffuse               float32 [h, w, 3] light that the first surface reflects diffusely                 0
    specular              float32 [h, w, 3] light that the first surface scatters in any other way          0
    volume                float32 [h, w, 3] light scattered by fog or media in front of the first surface   0, or fog
    light:NAME            float32 [h, w, 3] light of one source: a light's name, or `surfaces`          its sky, or 0
    roughness             float32 [h, w]    perceptual roughness, 0 to 1                                0
    metallic              float32 [h, w]    metalness, 0 to 1                                           0
    nocs                  float32 [h, w, 3] position in the object's box, scaled to a diagonal of 1         NaN
    projector_uv          float32 [h, w, 2] pixel of the world's first projector, or NaN if unlit           NaN
    error                 float32 [h, w]    estimated standard error of the colour's luminance
    ===================== ======= ========= =========================================================== ==========

    All channels except `color` and its parts, `coverage`, `alpha`, `shadow` and `error` describe the exact ray through
    the pixel's centre and are never filtered. The colour is the sum of `emission`, `direct` and `indirect`; of
    `emission`, `diffuse`, `specular` and `volume`; and of all `light:NAME`, within float32 rounding. `denoise` changes
    only `color`.
    """

    def __init__(
        self,
        channels: Channels,
        *,
        camera: Camera | None,
        size: tuple[int, int],
        region: tuple[int, int, int, int] | None = None,
        exposure: float = 0.0,
        view: str = "standard",
        transparent: bool = False,
        notices: Iterable[Notice] = (),
    ) -> None:
        self._channels = channels
        self.camera = camera
        """The camera; None for a frame merged from several cameras."""
        self.size = size
        """(width, height) of the whole image."""
        self.region = region or (0, 0, *size)
        """(x, y, width, height) of the part that the arrays hold."""
        self.exposure = exposure
        """The exposure of sRGB images in stops, each of which doubles the brightness; the arrays do not change."""
        self.view = view
        """The view transform of sRGB images for values above 1: one of `VIEWS`."""
        self.transparent = transparent
        """True for a transparent background: the colour is premultiplied by `alpha`, and images have an opacity.

        Their opacity combines the opacity of the objects with the mean shadow; EXR files store both separately.
        """
        self.notices = list(notices)
        """Notices about the rendering for the user."""

    @property
    def channels(self) -> tuple[str, ...]:
        """The names of the frame's channels."""
        return tuple(self._channels)

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        """The array of a channel; raises `KeyError` for a channel that the frame lacks."""
        try:
            return self._channels[name]
        except KeyError:
            if name in CHANNELS:
                have = ", ".join(self._channels)
                raise KeyError(
                    f"the frame has no channel {name}, only {have}; render it with channels=[..., {name!r}]"
                ) from None
            raise KeyError(nearest("channel", name, list(CHANNELS))) from None

    def __array__(self, dtype: npt.DTypeLike | None = None, copy: bool | None = None) -> npt.NDArray[Any]:
        """The array for `numpy.asarray(frame)`: the channel `color`, or the only channel.

        Raises `SettingsError` for a frame of several channels without colour.
        """
        if "color" in self._channels or len(self._channels) == 1:
            name = "color" if "color" in self._channels else next(iter(self._channels))
            array = self._channels[name]
            return np.array(array, dtype=dtype) if copy else np.asarray(array, dtype=dtype)
        have = ", ".join(self._channels)
        raise SettingsError(
            f"the frame has several channels ({have}); choose one, as in frame[{next(iter(self._channels), '')!r}]",
            code="missing_value",
        )

    def __iter__(self) -> Iterator[str]:
        """Iterates over the names of the channels."""
        return iter(self._channels)

    def __len__(self) -> int:
        """The number of channels."""
        return len(self._channels)

    def to_srgb8(self, exposure: float | None = None, view: str | None = None) -> npt.NDArray[np.uint8]:
        """Returns the colour as 8-bit sRGB [h, w, 3], as in PNG and video, clamped to 0..255.

        `exposure` (in stops) and `view` replace the frame's own values. The view "standard" shows radiance unchanged,
        with 1 as white (D65); "agx" (T. Sobotka, 2019) and "pbr_neutral" (Khronos, 2024) also show brighter values,
        which they compress.
        """
        return self._srgb(8, exposure, view)

    def to_srgba8(self, exposure: float | None = None, view: str | None = None) -> npt.NDArray[np.uint8]:
        """Returns colour and opacity as 8-bit sRGB [h, w, 4], for compositing.

        The colour is not premultiplied. `exposure` and `view` are as in `to_srgb8`.

        Raises `SettingsError` for a frame that is not `transparent`.
        """
        return self._srgba(8, exposure, view)

    def _srgba(self, bits: int, exposure: float | None, view: str | None) -> npt.NDArray[Any]:
        if not (self.transparent and "alpha" in self._channels):
            raise SettingsError(
                "the frame has no opacity; render it with transparent_background=True and the channels color and alpha",
                code="missing_value",
            )
        alpha = self._channels["alpha"][..., np.newaxis]
        if "shadow" in self._channels:
            light = np.clip(self._channels["shadow"].mean(axis=2, keepdims=True), 0, 1)
            alpha = 1 - (1 - alpha) * light
        color = self._channels["color"] / np.where(alpha > 0, alpha, 1)
        top = (1 << bits) - 1
        srgb = Frame(
            {"color": color}, camera=None, size=self.size, exposure=self.exposure, view=self.view
        )._srgb(bits, exposure, view)
        return np.concatenate([srgb, np.round(alpha * top).astype(srgb.dtype)], axis=2)

    def _srgb(self, bits: int, exposure: float | None, view: str | None) -> npt.NDArray[Any]:
        if "color" not in self._channels:
            raise SettingsError(
                f"the channel color is missing; this frame has {', '.join(self._channels)}",
                code="missing_value",
            )
        stops = self.exposure if exposure is None else check_option("exposure", exposure)
        linear = np.ascontiguousarray(self._channels["color"], dtype=np.float32)
        chosen = self.view if view is None else view
        check_option("view", chosen)
        return _core.srgb_from_linear(linear, 2.0**stops, bits, chosen)

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        bits: int | None = None,
        half: bool | None = None,
        exposure: float | None = None,
        view: str | None = None,
        channel: str | None = None,
        **page: Any,
    ) -> None:
        """Writes the frame to a .png, .jpg, .exr, .hdr, .npz or .html file atomically.

        PNG: the colour in sRGB with `bits` 8 (default) or 16, `exposure` in stops and `view` ("standard",
        "agx" or "pbr_neutral", see `to_srgb8`). JPEG: as PNG, but with 8 bits and without opacity. Instead of
        the colour, PNG and JPEG show the channel named `channel`, or the only channel of the frame, by the
        rules of `raycam.render.channel_picture.channel_picture`. HDR: the colour in linear light, four bytes
        per pixel. EXR: all channels as named layers in linear float32 (`half=True`: float16), ids as uint32,
        with camera and conventions in the header; `position` is rounded to float32. NPZ: all channels
        exactly, with K, R, C, P, size, region, pixel_center. HTML: a page that works offline and shows all
        channels with their values; it accepts the options of `show`.

        Raises `FormatError` for other endings, `SettingsError` for options that the format does not support and if
        the format cannot show the frame's channels, and `OSError` if the file cannot be written.
        """
        target = Path(path)
        options = _options(bits=bits, half=half, exposure=exposure, view=view, channel=channel, **page)
        _check(target, self._channels, options)
        warn_all(_losses(target, self, options))
        atomic_files.write(target, SAVERS[target.suffix.lower()][0](self, **options))

    def show(self, **options: Any) -> Any:
        """Shows all channels with their values: in a notebook's cell, or else in the browser.

        `save` accepts the same options for an .html file. `world` provides the names of objects and categories.
        `explain` is a list of pixels (column, row) whose explanations are included. `compare` is a second frame.
        `arrays` are additional images by name, [h, w] or [h, w, 1 to 4], such as {"flow": flow}. `half=True` rounds
        colours to float16. `exposure`, `view` and `channel` are the initial settings, and `title` is the page's title.
        With `live=True`, the page contains the `world` and raycam itself, and renders new views, channels and
        explanations.

        Returns the page's path if it was opened in a browser.
        """
        from ..viewer.page import show

        return show(self, **options)

    def over(self, background: Any) -> Frame:
        """Returns the frame in front of a background.

        The background is a colour, an image's path, an array [h, w, 3] or a `raycam.Background`.

        The frame must have been rendered with `transparent_background=True`. A photograph of the frame's size
        is used pixel by pixel; the frame's exposure and view do not change the photograph's values, but the
        channel `shadow` darkens the photograph. An image of another size is scaled and cropped to cover the
        frame, with a notice; a `Background` with the camera that took it is warped. Float arrays are linear
        light, uint8 and uint16 are sRGB. The result is opaque: color + (1 - alpha) * shadow * background in
        linear light.

        Raises `SettingsError` for a frame without opacity and for an invalid background, `FormatError` and `OSError`
        for files.
        """
        from .composition import over

        return over(self, background)

    def _html(self, **options: Any) -> bytes:
        from ..viewer.page import page

        return bytes(page(self, **options), "utf-8")

    def to_png(
        self,
        bits: int = 8,
        exposure: float | None = None,
        view: str | None = None,
        channel: str | None = None,
    ) -> bytes:
        """Returns the colour as a PNG file in sRGB.

        The file has 8 or 16 `bits` per channel, and opacity if the frame is `transparent`. `exposure` and
        `view` are as in `to_srgb8`.

        `channel` selects another channel, which is shown by the rules of `raycam.render.channel_picture` with 8 bits.
        """
        shown = self._shown(channel)
        if shown != "color":
            if bits != 8:
                raise SettingsError(
                    f"bits is {bits}; images of channel {shown} support only 8; save exact values as .exr or .npz",
                    code="invalid_value",
                )
            return _core.encode_png(channel_picture(shown, self._channels[shown]))
        if bits not in (8, 16):
            raise SettingsError(f"bits is {bits}; a PNG supports 8 or 16", code="invalid_value")
        pixels = self._srgba if self.transparent else self._srgb
        return _core.encode_png(pixels(bits, exposure, view))

    def _shown(self, channel: str | None) -> str:
        """The channel that an image shows: the requested channel, the colour, or the only channel."""
        if channel is not None:
            return one_of("channel", channel, list(self._channels))
        return "color" if "color" in self._channels else next(iter(self._channels))

    def to_jpeg(
        self, exposure: float | None = None, view: str | None = None, channel: str | None = None
    ) -> bytes:
        """Returns the image of `to_png` as a baseline JPEG file with quality 92.

        The arguments are as in `to_png`. The file has 8 bits per channel and no opacity.
        """
        shown = self._shown(channel)
        if shown == "color":
            return encode_jpeg(self.to_srgb8(exposure, view))
        return encode_jpeg(channel_picture(shown, self._channels[shown]))

    def _hdr(self) -> bytes:
        return _core.encode_hdr(np.ascontiguousarray(self._channels["color"], dtype=np.float32))

    def _exr(self, half: bool = False) -> bytes:
        half = flag("half", half)
        planes = dict(self._channels)
        if (
            self.transparent and "color" in planes and "alpha" in planes
        ):  # R, G, B, A, premultiplied as in EXR
            planes["color"] = np.concatenate([planes["color"], planes.pop("alpha")[..., np.newaxis]], axis=2)
        layers = [(name, np.ascontiguousarray(array)) for name, array in planes.items()]
        notes = [
            ("raycam.region", " ".join(map(str, self.region))),
            ("raycam.size", "{} {}".format(*self.size)),
        ]
        if self.camera is not None:
            notes.append(("raycam.camera", json.dumps(self.camera.to_dict())))
        return _core.encode_exr(layers, half, self.camera._core if self.camera else None, notes)

    def _npz(self) -> bytes:
        arrays: dict[str, Any] = dict(self._channels)
        if self.camera is not None:
            camera = self.camera
            arrays |= {"K": camera.K, "R": camera.R, "C": camera.location, "P": camera.P}
            arrays["camera"] = np.array(json.dumps(camera.to_dict()))
            arrays["pixel_center"] = np.array(camera.pixel_center)
            if camera.distortion is not None:
                arrays |= {"distortion": camera.distortion, "lens": np.array(camera.model)}
        arrays = {"size": np.array(self.size, np.int64), "region": np.array(self.region, np.int64), **arrays}
        return npz_bytes(arrays, compressed=True)

    def _repr_png_(self) -> bytes | None:
        """The PNG that a notebook shows: the colour or the only channel; None for several channels without colour."""
        is_clear = "color" in self._channels or len(self._channels) == 1
        return self.to_png() if is_clear else None

    def reprojection_error(self) -> float:
        """The largest reprojection error in pixels.

        The error is the distance between a pixel's centre and the image of the surface point in that pixel. The point
        is the channel `position`, or else the point at `distance` along the pixel's ray, in float32. Returns 0 for an
        empty image, and +inf if the camera has no image of a point. A rotating camera with a rolling shutter may show a
        point twice; the first image counts.

        Raises `SettingsError` if the frame has neither of these channels, or no camera.
        """
        if self.camera is None:
            raise SettingsError(
                "this frame has no camera, because it was merged from frames of several cameras",
                code="missing_value",
            )
        x, y, width, height = self.region
        centers = self.camera._centers()[y : y + height, x : x + width]
        if "position" in self._channels:
            points = self._channels["position"]
        elif "distance" in self._channels:
            origins, directions = self.camera.rays(centers.reshape(-1, 2))
            distance = self._channels["distance"].astype(np.float64).reshape(-1, 1)
            points = np.where(np.isfinite(distance), origins + distance * directions, np.nan)
            points = points.reshape(height, width, 3)
        else:
            have = ", ".join(self._channels)
            raise SettingsError(
                f"the frame has no positions, only {have}; render it with channels=[..., 'position']",
                code="missing_value",
            )
        seen = np.isfinite(points).all(axis=-1)
        if not seen.any():
            return 0.0
        pixels, visible = self.camera.project(points[seen])
        off = np.linalg.norm(pixels - centers[seen], axis=-1)
        return float(np.where(visible & np.isfinite(off), off, np.inf).max())

    @staticmethod
    def merge(frames: Iterable[Frame]) -> Frame:
        """Merges disjoint parts of one image that fill a rectangle.

        The result is identical, bit for bit, to an image that was rendered at once.

        Raises `SettingsError` if parts overlap, leave a gap, or differ in size or channels.
        """
        parts = list(frames)
        taken = [
            (part.size, part.region, {name: np.ascontiguousarray(array) for name, array in part.items()})
            for part in parts
        ]
        channels, region, _ = _core.merge(taken)
        first = parts[0]
        same = all(part.camera == first.camera for part in parts)
        notices = dict.fromkeys(notice for part in parts for notice in part.notices)
        return Frame(
            channels,
            camera=first.camera if same else None,
            size=first.size,
            region=region,
            exposure=first.exposure,
            view=first.view,
            transparent=first.transparent,
            notices=notices,
        )

    if not TYPE_CHECKING:  # so that type checkers report missing attributes

        def __getattr__(self, name: str) -> Any:
            """Raises `AttributeError`, with raycam's counterpart for names of other libraries."""
            raise no_attribute(self, name, f'frame["{name}"]' if name in CHANNELS else None)

    def __repr__(self) -> str:
        """Size and channels as text."""
        _, _, width, height = self.region
        part = "" if (width, height) == self.size else " of {} x {}".format(*self.size)
        return f"Frame {width} x {height}{part}: {', '.join(self._channels)}"


PICTURES = (".png", ".jpg", ".jpeg")
"""Endings of files for display, which store 8-bit or 16-bit sRGB."""
OPAQUE = (".jpg", ".jpeg", ".hdr")
"""Endings of files without opacity."""

# File formats by ending: the encoder and its options.
SAVERS: dict[str, tuple[Callable[..., bytes], set[str]]] = {
    ".png": (Frame.to_png, {"bits", "exposure", "view", "channel"}),
    ".jpg": (Frame.to_jpeg, {"exposure", "view", "channel"}),
    ".jpeg": (Frame.to_jpeg, {"exposure", "view", "channel"}),
    ".hdr": (Frame._hdr, set()),
    ".exr": (Frame._exr, {"half"}),
    ".npz": (Frame._npz, set()),
    ".html": (
        Frame._html,
        {"world", "explain", "compare", "arrays", "half", "exposure", "view", "title", "live", "channel"},
    ),
}


def encoded(frame: Frame, name: str | os.PathLike[str], **options: Any) -> bytes:
    """Returns the bytes that `Frame.save` writes to a file of this name; raises its errors."""
    target, given = Path(name), _options(**options)
    _check(target, frame.channels, given)
    warn_all(_losses(target, frame, given))
    return SAVERS[target.suffix.lower()][0](frame, **given)


def check_save(
    path: str | os.PathLike[str],
    channels: Iterable[str],
    size: tuple[int, int],
    *,
    bits: int | None = None,
    half: bool | None = None,
    transparent: bool = False,
) -> None:
    """Checks, before rendering, that a file at `path` can store a frame.

    `channels` and `size` describe the frame. Raises the errors of `Frame.save`, and `SettingsError` if the file would
    lose channels or the opacity of a `transparent` frame.
    """
    target = Path(path)
    names = list(channels)
    _check(target, names, _options(bits=bits, half=half))
    ending = target.suffix.lower()
    if ending in (*PICTURES, ".hdr") and "color" in names:
        held = ("color", "alpha") if transparent and ending == ".png" else ("color",)
        others = [name for name in names if name not in held]
        if others:
            raise SettingsError(
                f"{target}: a {ending} file stores only the channel color; {', '.join(others)} would be "
                "lost; save as .exr or .npz",
                code="cannot_write",
            )
    if transparent and ending in OPAQUE:
        raise SettingsError(
            f"{target}: a {ending} file cannot store opacity; use .png or .exr", code="cannot_write"
        )
    if target.suffix.lower() in (*PICTURES, ".hdr"):
        names = ["color"] if "color" in names else names[:1]
    each = sum(dtype.itemsize * components for dtype, components in map(channel_form, names))
    atomic_files.check_writable(target, each * size[0] * size[1])


def _losses(target: Path, frame: Frame, options: Mapping[str, Any]) -> Iterator[Notice]:
    """Yields the parts of a frame's channels that its file cannot store."""
    ending = target.suffix.lower()
    shows_color = frame._shown(options.get("channel")) == "color" and "color" in frame.channels
    if frame.transparent and ending in OPAQUE and shows_color:
        message = f"{target}: a {ending} file cannot store opacity and shows the colour over black; use .png or .exr"
        yield Notice(message, "not_written")
    if ending == ".exr" and flag("half", options.get("half", False)):
        lost = {}
        for name, values in frame.items():
            if np.issubdtype(values.dtype, np.floating):
                with np.errstate(over="ignore"):
                    lost[name] = int(
                        np.count_nonzero(np.isfinite(values) & np.isinf(values.astype(np.float16)))
                    )
        counts = ", ".join(f"{count} of {name}" for name, count in lost.items() if count)
        if counts:
            message = (
                f"{target}: values beyond 65504, the largest float16, are written as infinite: {counts};"
                " use half=False to keep them"
            )
            yield Notice(message, "values_lost")


def _options(**options: Any) -> dict[str, Any]:
    """The options that are not None."""
    return {name: value for name, value in options.items() if value is not None}


def _check(target: Path, channels: Iterable[str], options: Mapping[str, Any]) -> None:
    """Raises an error if the file format does not support these channels and options.

    The format is determined by `target`'s ending.
    """
    ending = target.suffix.lower()
    if ending not in SAVERS:
        if target.parent == Path("/dev"):
            raise FormatError(
                f"{target}: a device has no file format; write frame.to_png() to sys.stdout.buffer, or use -o - on the "
                "command line",
                code="unknown_format",
            )
        guess = f"unknown extension {target.suffix!r}" if ending else "extension missing"
        raise FormatError(
            f"{target}: {guess}; images can be saved as {', '.join(SAVERS)}", code="unknown_format"
        )
    names = list(channels)
    if ending in PICTURES and "color" not in names and options.get("channel") is None and len(names) > 1:
        raise SettingsError(
            f"{target}: a {ending} file shows one channel, but the frame has {', '.join(names)}; choose one, or save "
            "as .exr"
            " or .npz",
            code="cannot_write",
        )
    if ending == ".hdr" and "color" not in names:
        raise SettingsError(
            f"{target}: {ending} files require the channel color, but the frame has {', '.join(names)}; save as .exr "
            "or .npz",
            code="cannot_write",
        )
    for name in options:
        if name not in SAVERS[ending][1]:
            raise SettingsError(f"{name} is not an option of {ending} files", code="unknown_key")
    if whole("bits", options.get("bits", 8), 0, 64) not in (8, 16):
        raise SettingsError(f"bits is {options['bits']}; a PNG supports 8 or 16", code="invalid_value")
