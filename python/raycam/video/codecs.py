"""The codecs of video files, and the encoding of videos.

A codec is chosen by the file's ending, by loss and by opacity.

Equal images give equal bytes, because encoders use a fixed number of threads and write no dates or versions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

from ..errors import SettingsError
from ..io import atomic_files
from .audio import AudioTrack
from .filters import Filters, Picture, as_rate

__all__ = ["CODECS", "Codec", "codec_of", "open_encoder"]

# Codes of ITU-T H.273 for the primaries and matrix of BT.709, the curve of sRGB, the matrix of RGB, and the ranges 16
# to 235 and 0 to 255. sRGB has the primaries of BT.709.
BT709, SRGB_CURVE, RGB, LIMITED_RANGE, FULL_RANGE = 1, 13, 0, 1, 2
ENCODER_THREADS = 4
REPRODUCIBLE = {"fflags": "+bitexact"}


class Codec(NamedTuple):
    """A codec with its container and options."""

    container: str
    """FFmpeg's name of the container."""
    encoder: str
    """FFmpeg's name of the encoder."""
    pixels: str
    """FFmpeg's name of the pixel format: Y'CbCr with the BT.709 matrix in limited range, or RGB."""
    options: dict[str, str]
    """Options of the encoder."""
    sound: str
    """FFmpeg's name of the audio encoder."""
    container_options: Mapping[str, str] = MappingProxyType({})

    @property
    def halved(self) -> bool:
        """True if two pixels share a chroma sample, so that width and height must be even."""
        return "420" in self.pixels

    @property
    def is_rgb(self) -> bool:
        """True if pixels are stored as RGB."""
        return "yuv" not in self.pixels


# x264's macroblock tree is off, because it is not reproducible.
X264 = {"preset": "medium", "x264-params": "mbtree=0"}
VP9 = {"b": "0", "deadline": "good", "cpu-used": "2", "row-mt": "0", "tile-columns": "0"}
FASTSTART = {"movflags": "+faststart"}  # puts the index first, for players that start while downloading

CODECS: dict[tuple[str, bool, bool], Codec] = {
    # the codec for each (ending, lossless, alpha)
    (".mp4", False, False): Codec("mp4", "libx264", "yuv420p", X264 | {"crf": "17"}, "aac", FASTSTART),
    (".mp4", True, False): Codec("mp4", "libx264rgb", "rgb24", X264 | {"qp": "0"}, "aac", FASTSTART),
    (".mov", False, False): Codec(
        "mov", "prores_ks", "yuv444p10le", {"profile": "4444"}, "pcm_s16le", FASTSTART
    ),
    (".mov", False, True): Codec(
        "mov", "prores_ks", "yuva444p10le", {"profile": "4444", "alpha_bits": "16"}, "pcm_s16le", FASTSTART
    ),
    (".mov", True, False): Codec("mov", "png", "rgb24", {}, "pcm_s16le", FASTSTART),
    (".mov", True, True): Codec("mov", "png", "rgba", {}, "pcm_s16le", FASTSTART),
    (".mkv", True, False): Codec("matroska", "ffv1", "bgr0", {"level": "3", "slicecrc": "1"}, "flac"),
    (".mkv", True, True): Codec("matroska", "ffv1", "bgra", {"level": "3", "slicecrc": "1"}, "flac"),
    (".webm", False, False): Codec("webm", "libvpx-vp9", "yuv420p", VP9 | {"crf": "20"}, "libopus"),
    (".webm", False, True): Codec("webm", "libvpx-vp9", "yuva420p", VP9 | {"crf": "20"}, "libopus"),
    (".webm", True, False): Codec("webm", "libvpx-vp9", "gbrp", VP9 | {"lossless": "1"}, "libopus"),
}
"""H.264 plays everywhere; its lossless profile (High 4:4:4 Predictive) plays in FFmpeg, VLC and mpv. ProRes 4444 and
QuickTime PNG are for editing. FFV1 (RFC 9043) is for archives, and always lossless. VP9 plays in browsers, also with
opacity."""


def codec_of(ending: str, *, lossless: bool, alpha: bool) -> Codec:
    """Returns the codec for an ending and options.

    Raises `SettingsError` if no codec supports them.
    """
    codec = CODECS.get((ending, lossless, alpha))
    if codec is None and not lossless:  # .mkv is always lossless
        codec = CODECS.get((ending, True, alpha))
    if codec is not None:
        return codec
    what = " and ".join(word for word, asked in (("lossless", lossless), ("transparent", alpha)) if asked)
    able = dict.fromkeys(end for end, kept, clear in CODECS if clear == alpha and (kept or not lossless))
    raise SettingsError(
        f"a {ending} file cannot be {what}; use {', '.join(able)} or a folder of PNG images",
        code="cannot_write",
    )


@contextmanager
def open_encoder(
    path: Path, size: tuple[int, int], fps: float, codec: Codec, *, audio: Path | None = None
) -> Iterator[Callable[[int, Picture], None]]:
    """Opens a video file of a codec; yields a function that adds images in order.

    For a Y'CbCr codec, sRGB is converted with the BT.709 matrix (ITU-R BT.709-6) to limited range, and the file is
    tagged accordingly (ITU-T H.273). `audio` is a file whose first audio track is added, cut or padded with silence.
    """
    import av

    if codec.halved and any(side % 2 for side in size):
        nearest = " x ".join(str(side + side % 2) for side in size)
        name = {"mp4": "an MP4", "webm": "a WebM"}[codec.container]
        raise SettingsError(
            f"{name} ({codec.pixels}) requires an even width and height, got {size[0]} x {size[1]}; use {nearest}",
            code="out_of_range",
        )
    rate = as_rate(fps)
    alpha = "a" in codec.pixels
    with (
        atomic_files.atomic_path(path) as temporary,
        av.open(
            str(temporary),
            "w",
            format=codec.container,
            container_options=REPRODUCIBLE | dict(codec.container_options),
        ) as file,
    ):
        stream = file.add_stream(codec.encoder, rate=rate)
        if not isinstance(stream, av.VideoStream):  # for mypy: the table contains only video codecs
            raise TypeError(codec.encoder)
        stream.width, stream.height = size
        stream.pix_fmt = codec.pixels
        stream.options = {**codec.options, "flags": "+bitexact"}
        context = stream.codec_context
        context.time_base = 1 / rate
        context.thread_count = ENCODER_THREADS
        context.color_primaries, context.color_trc = BT709, SRGB_CURVE
        context.colorspace = RGB if codec.is_rgb else BT709
        context.color_range = FULL_RANGE if codec.is_rgb else LIMITED_RANGE
        scale = "flags=area+accurate_rnd+full_chroma_int+bitexact"
        if not codec.is_rgb:
            scale = "out_color_matrix=bt709:out_range=limited:" + scale
        chain = [("scale", scale), ("format", codec.pixels)]
        convert = Filters(rate, [("rgba" if alpha else "rgb24", size)], chain)
        sound = None if audio is None else AudioTrack(audio, file, codec.sound)
        shown = 0

        def add(_: int, picture: Picture) -> None:
            nonlocal shown
            for frame in convert.push(picture):
                frame.color_primaries, frame.color_trc = BT709, SRGB_CURVE
                file.mux(stream.encode(frame))
            shown += 1
            if sound is not None:
                sound.reach(Fraction(shown) / rate)

        yield add
        file.mux(stream.encode(None))
        if sound is not None:
            sound.close()
