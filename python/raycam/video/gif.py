"""GIF files without PyAV: one palette by median cut, ordered dithering, LZW.

Sources: CompuServe, GIF89a specification, 1990; P. Heckbert, Color image quantization for frame buffer display, 1982.
"""

from __future__ import annotations

import struct
import zlib

import numpy as np
import numpy.typing as npt

__all__ = ["GifWriter"]

Picture = npt.NDArray[np.uint8]
COLORS = 256
LEVELS = 32
"""Number of levels of red, green and blue in the histogram of colours."""
BAYER = np.array([[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]]) / 16 - 0.46875
"""Thresholds of ordered dithering, around 0."""
DITHER = 10.0
"""The range of the values that dithering adds to 8-bit colours (0 to 255)."""


class GifWriter:
    """Collects images [height, width, 3] and encodes a GIF file that repeats forever."""

    def __init__(self, size: tuple[int, int], fps: float) -> None:
        self._size, self._fps = size, fps
        self._waiting: list[bytes] = []
        self._counts = np.zeros(LEVELS**3, np.int64)

    def add(self, _: int, picture: Picture) -> None:
        """Adds an image to the end; the palette is computed after the last image."""
        self._counts += np.bincount(_cells(picture).ravel(), minlength=LEVELS**3)
        self._waiting.append(zlib.compress(picture.tobytes(), 1))

    def finish(self) -> bytes:
        """The bytes of the file."""
        width, height = self._size
        palette = _palette(self._counts)
        nearest = _nearest(palette)
        parts = [b"GIF89a", struct.pack("<HHBBB", width, height, 0xF7, 0, 0), palette.tobytes()]
        parts.append(b"\x21\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00")
        tile = np.tile(BAYER, (height // 4 + 1, width // 4 + 1))[:height, :width, None] * DITHER
        for number, data in enumerate(self._waiting):
            picture = np.frombuffer(zlib.decompress(data), np.uint8).reshape(height, width, 3)
            dithered = np.clip(np.round(picture + tile), 0, 255).astype(np.uint8)
            # Hundredths of a second, so that rounding errors do not accumulate.
            delay = round((number + 1) * 100 / self._fps) - round(number * 100 / self._fps)
            parts.append(struct.pack("<BBBBHBB", 0x21, 0xF9, 4, 0, delay, 0, 0))
            parts.append(struct.pack("<BHHHHBB", 0x2C, 0, 0, width, height, 0, 8))
            packed = _lzw(nearest[_cells(dithered)].tobytes())
            blocks = (packed[start : start + 255] for start in range(0, len(packed), 255))
            parts += [bytes([len(block)]) + block for block in blocks]
            parts.append(b"\x00")
        return b"".join([*parts, b"\x3b"])


def _cells(picture: Picture) -> npt.NDArray[np.int64]:
    """The histogram cell of each pixel."""
    red, green, blue = np.moveaxis(picture[..., :3].astype(np.int64) * LEVELS // 256, -1, 0)
    found: npt.NDArray[np.int64] = (red * LEVELS + green) * LEVELS + blue
    return found


def _palette(counts: npt.NDArray[np.int64]) -> Picture:
    """Returns the palette [256, 3] by median cut.

    The box with the largest product of pixels and extent is halved repeatedly.
    """
    used = np.flatnonzero(counts)
    colors = _centers(used)
    weights = counts[used]
    boxes = [np.arange(len(used))]
    while len(boxes) < COLORS:
        sizes = [
            float(weights[box].sum()) * float(np.ptp(colors[box], axis=0).max()) if len(box) > 1 else 0.0
            for box in boxes
        ]
        largest = int(np.argmax(sizes))
        if sizes[largest] == 0.0:
            break
        box = boxes.pop(largest)
        axis = int(np.ptp(colors[box], axis=0).argmax())
        box = box[np.argsort(colors[box, axis], kind="stable")]
        sums = np.cumsum(weights[box])
        cut = min(max(int(np.searchsorted(sums, sums[-1] / 2)), 1), len(box) - 1)
        boxes += [box[:cut], box[cut:]]
    found = np.zeros((COLORS, 3), np.uint8)
    for number, box in enumerate(boxes):
        mean = (colors[box] * weights[box, None]).sum(axis=0) / weights[box].sum()
        found[number] = np.round(mean)
    return found


def _nearest(palette: Picture) -> npt.NDArray[np.uint8]:
    """The index of the nearest palette colour for each cell of the histogram."""
    centers = _centers(np.arange(LEVELS**3))
    found = np.empty(LEVELS**3, np.uint8)
    for start in range(0, LEVELS**3, 4096):
        part = centers[start : start + 4096, None] - palette[None].astype(float)
        found[start : start + 4096] = (part**2).sum(axis=2).argmin(axis=1)
    return found


def _centers(cells: npt.NDArray[np.int64]) -> npt.NDArray[np.float64]:
    """The 8-bit colours at the centres of cells."""
    parts = np.stack([cells // LEVELS**2, cells // LEVELS % LEVELS, cells % LEVELS], axis=1)
    found: npt.NDArray[np.float64] = (parts + 0.5) * 256 / LEVELS - 0.5
    return found


def _lzw(pixels: bytes) -> bytes:
    """Encodes pixels as LZW codes of 9 to 12 bits (GIF89a, appendix F)."""
    clear, end = 256, 257
    codes: dict[tuple[int, int], int] = {}
    out = bytearray()
    buffer, filled, width, following = clear, 9, 9, 258
    prefix = pixels[0]
    for pixel in pixels[1:]:
        code = codes.get((prefix, pixel))
        if code is not None:
            prefix = code
            continue
        buffer |= prefix << filled
        filled += width
        if following < 4096:
            codes[prefix, pixel] = following
            if following == 1 << width and width < 12:
                width += 1
            following += 1
        else:
            buffer |= clear << filled
            filled += width
            codes, width, following = {}, 9, 258
        while filled >= 8:
            out.append(buffer & 0xFF)
            buffer >>= 8
            filled -= 8
        prefix = pixel
    buffer |= prefix << filled
    filled += width
    if following == 1 << width and width < 12:
        width += 1
    buffer |= end << filled
    filled += width
    while filled > 0:
        out.append(buffer & 0xFF)
        buffer >>= 8
        filled -= 8
    return bytes(out)
