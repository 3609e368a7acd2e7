"""Pictures into a video file: MP4, GIF, or a folder of PNG pictures.

One context manager each, one row each in `FORMATS`: it gives a function that takes the pictures in order, and
the file has its final name when the block ends without an exception. The same pictures give the same bytes:
encoders run with a fixed number of threads and write no dates or versions.
"""

from __future__ import annotations

import errno
import zlib
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from . import _core, files
from .errors import SettingsError

if TYPE_CHECKING:
    from av import VideoFrame

Picture = npt.NDArray[np.uint8]
Add = Callable[[int, Picture], None]
"""Takes the number of a frame and its picture, [height, width, 3] in 8-bit sRGB."""

# ITU-T H.273: the primaries of BT.709 (sRGB's too), the curve of sRGB, the matrix of BT.709, levels from 16
# to 235.
BT709, SRGB_CURVE, LIMITED_RANGE = 1, 13, 1
ENCODER_THREADS = 4
GIF_MAX_FPS = 50
REPRODUCIBLE = {"fflags": "+bitexact"}


def open_video(
    path: Path, size: tuple[int, int], fps: float, *, lossless: bool = False
) -> AbstractContextManager[Add]:
    """The video file of a path by its ending: .mp4, .gif, or none for a folder of PNG pictures.

    `lossless` keeps every bit of the pictures, in an MP4; a folder does anyway.

    Raises SettingsError for other endings. Entering it raises SettingsError where the size or the rate does
    not suit, and OSError where nothing can be written there: before anything is rendered.
    """
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        raise SettingsError(
            f"{path.name}: the ending {suffix!r} is none of a video; expected "
            f"{' or '.join(filter(None, FORMATS))}, or no ending for a folder of PNG pictures"
        )
    if lossless and suffix == ".mp4":
        return lossless_mp4(path, size, fps)
    if lossless and suffix:
        raise SettingsError(
            f"{path.name}: a {suffix} file is never lossless; take .mp4, or a folder of PNG pictures"
        )
    return FORMATS[suffix](path, size, fps)


@contextmanager
def mp4(path: Path, size: tuple[int, int], fps: float) -> Iterator[Add]:
    """H.264 in an MP4 that plays everywhere: yuv420p, the index in front, the colours tagged.

    sRGB becomes limited-range Y'CbCr by the matrix of BT.709 (ITU-R BT.709-6), and the file says so (ITU-T
    H.273).
    """
    import av

    if any(side % 2 for side in size):
        nearest = " x ".join(str(side + side % 2) for side in size)
        raise SettingsError(
            f"an MP4 (yuv420p) needs an even width and height, not {size[0]} x {size[1]}: take {nearest}"
        )
    rate = as_rate(fps)
    with (
        files.atomic_path(path) as temporary,
        av.open(
            str(temporary), "w", format="mp4", container_options=REPRODUCIBLE | {"movflags": "+faststart"}
        ) as file,
    ):
        stream = file.add_stream("libx264", rate=rate)
        stream.width, stream.height = size
        stream.pix_fmt = "yuv420p"
        # x264's macroblock tree is not reproducible: the same pictures give other bytes now and then.
        stream.options = {"crf": "17", "preset": "medium", "flags": "+bitexact", "x264-params": "mbtree=0"}
        codec = stream.codec_context
        codec.time_base = 1 / rate
        codec.thread_count = ENCODER_THREADS
        codec.color_primaries, codec.color_trc, codec.colorspace = BT709, SRGB_CURVE, BT709
        codec.color_range = LIMITED_RANGE
        scale = "out_color_matrix=bt709:out_range=limited:flags=area+accurate_rnd+full_chroma_int+bitexact"
        convert = Filters(rate, [("rgb24", size)], [("scale", scale), ("format", "yuv420p")])

        def add(_: int, picture: Picture) -> None:
            for frame in convert.push(picture):
                frame.color_primaries, frame.color_trc = BT709, SRGB_CURVE
                file.mux(stream.encode(frame))

        yield add
        file.mux(stream.encode(None))


@contextmanager
def lossless_mp4(path: Path, size: tuple[int, int], fps: float) -> Iterator[Add]:
    """H.264 in an MP4 that keeps every bit: RGB without loss (High 4:4:4 Predictive profile).

    FFmpeg, VLC and mpv play it, most browsers and hardware do not.
    """
    import av

    rate = as_rate(fps)
    with (
        files.atomic_path(path) as temporary,
        av.open(
            str(temporary), "w", format="mp4", container_options=REPRODUCIBLE | {"movflags": "+faststart"}
        ) as file,
    ):
        stream = file.add_stream("libx264rgb", rate=rate)
        stream.width, stream.height = size
        stream.pix_fmt = "rgb24"
        stream.options = {"qp": "0", "preset": "medium", "flags": "+bitexact", "x264-params": "mbtree=0"}
        codec = stream.codec_context
        codec.time_base = 1 / rate
        codec.thread_count = ENCODER_THREADS
        codec.color_primaries, codec.color_trc = BT709, SRGB_CURVE
        same = Filters(rate, [("rgb24", size)], [("null", "")])

        def add(_: int, picture: Picture) -> None:
            for frame in same.push(picture):
                file.mux(stream.encode(frame))

        yield add
        file.mux(stream.encode(None))


def read_picture(png: bytes) -> Picture:
    """The picture in a PNG file, [height, width, 3] in 8-bit sRGB."""
    import av

    codec = av.CodecContext.create("png", "r")
    if not isinstance(codec, av.VideoCodecContext):  # PNG is one
        raise TypeError("png")
    [frame] = [*codec.decode(av.Packet(png)), *codec.decode(None)]
    return np.asarray(frame.to_ndarray(format="rgb24"), dtype=np.uint8)


@contextmanager
def gif(path: Path, size: tuple[int, int], fps: float) -> Iterator[Add]:
    """A GIF that repeats for ever, with one palette of 256 colours made for all its frames."""
    import av

    if fps > GIF_MAX_FPS:
        raise SettingsError(f"a GIF shows at most {GIF_MAX_FPS} frames a second, not {fps:g}")
    rate = as_rate(fps)
    with files.atomic_path(path) as temporary:
        # The palette is known after the last picture: until then they wait, compressed.
        waiting: list[bytes] = []
        palette_maker = Filters(rate, [("rgb24", size)], [("palettegen", "stats_mode=full")])

        def add(_: int, picture: Picture) -> None:
            palette_maker.push(picture)
            waiting.append(zlib.compress(picture.tobytes(), 1))

        yield add
        [palette] = palette_maker.finish()
        # Sierra's error diffusion hides the steps between colours; where nothing moves, nothing is drawn
        # again.
        dithering = [("paletteuse", "dither=sierra2_4a:diff_mode=rectangle")]
        painter = Filters(
            rate, [("rgb24", size), (palette.format.name, (palette.width, palette.height))], dithering
        )
        painter.set_second(palette)
        with av.open(
            str(temporary), "w", format="gif", container_options=REPRODUCIBLE | {"loop": "0"}
        ) as file:
            stream = file.add_stream("gif", rate=rate)
            stream.width, stream.height = size
            stream.pix_fmt = "pal8"
            stream.codec_context.time_base = 1 / rate
            for data in waiting:
                picture = np.frombuffer(zlib.decompress(data), np.uint8).reshape(size[1], size[0], 3)
                for frame in painter.push(picture):
                    file.mux(stream.encode(frame))
            for frame in painter.finish():
                file.mux(stream.encode(frame))
            file.mux(stream.encode(None))


@contextmanager
def png_folder(path: Path, size: tuple[int, int], fps: float) -> Iterator[Add]:
    """frame_0000.png and so on by the number of the frame, in a folder that is made if it is not there."""
    if path.exists() and not path.is_dir():
        raise NotADirectoryError(
            errno.ENOTDIR, "this is a file, expected a folder for PNG pictures", str(path)
        )
    if not path.exists():
        files.check_writable(path)
        path.mkdir()
    files.check_writable(path / "frame")

    def add(number: int, picture: Picture) -> None:
        files.write(path / picture_name(number), _core.encode_png(picture))

    yield add


def picture_name(number: int) -> str:
    """The name of the picture of a frame."""
    return f"frame_{number:04}.png"


FORMATS: dict[str, Callable[[Path, tuple[int, int], float], AbstractContextManager[Add]]] = {
    ".mp4": mp4,
    ".gif": gif,
    "": png_folder,
}


def as_rate(fps: float) -> Fraction:
    """Frames per second as the ratio that files store."""
    return Fraction(fps).limit_denominator(10_000)


class Filters:
    """A chain of FFmpeg's filters: pictures in, frames out.

    `inputs` are pixel formats and sizes, all of them of the first filter; `chain` are filters and their
    options.
    """

    def __init__(
        self, rate: Fraction, inputs: list[tuple[str, tuple[int, int]]], chain: list[tuple[str, str]]
    ) -> None:
        """Builds the chain."""
        import av.filter

        graph = av.filter.Graph()
        self._rate = rate
        self._inputs = [
            graph.add_buffer(width=width, height=height, format=av.VideoFormat(name), time_base=1 / rate)
            for name, (width, height) in inputs
        ]
        links = [graph.add(name, options) for name, options in chain] + [graph.add("buffersink")]
        for number, start in enumerate(self._inputs):
            start.link_to(links[0], 0, number)
        for one, next_one in pairwise(links):
            one.link_to(next_one)
        self._out = links[-1]
        graph.configure()
        self._graph = graph
        self._count = 0

    def push(self, picture: Picture) -> list[VideoFrame]:
        """Takes a picture, gives the frames that are ready."""
        from av import VideoFrame

        frame = VideoFrame.from_ndarray(picture, format="rgb24")
        frame.pts, frame.time_base = self._count, 1 / self._rate
        self._count += 1
        self._inputs[0].push(frame)
        return self._ready()

    def set_second(self, frame: VideoFrame) -> None:
        """Gives the second input its only frame."""
        frame.pts, frame.time_base = 0, 1 / self._rate
        self._inputs[1].push(frame)
        self._inputs[1].push(None)

    def finish(self) -> list[VideoFrame]:
        """Ends the input, gives the frames that are left."""
        self._inputs[0].push(None)
        return self._ready()

    def _ready(self) -> list[VideoFrame]:
        import av

        frames: list[VideoFrame] = []
        while True:
            try:
                frame = self._out.pull()
            except (av.BlockingIOError, av.EOFError):
                return frames
            if not isinstance(frame, av.VideoFrame):  # filters of pictures give pictures
                raise TypeError(f"{frame!r} is no picture")
            frames.append(frame)
