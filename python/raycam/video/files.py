"""Pictures into a video file: .mp4, .mov, .mkv, .webm, .gif, or a folder of PNG pictures.

One context manager each: it gives a function that takes the pictures in order, and the file has its final name when the
block ends without an exception. The same pictures give the same bytes.
"""

from __future__ import annotations

import errno
import os
import zlib
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

import numpy as np

from .. import _core
from ..errors import SettingsError
from ..io import atomic_files
from .audio import check_audio
from .codecs import CODECS, REPRODUCIBLE, codec_of, open_encoder
from .filters import Filters, Picture, as_rate

__all__ = ["ENDINGS", "check_video", "open_video", "picture_name", "read_picture"]

Add = Callable[[int, Picture], None]
"""Takes the number of a frame and its picture."""

GIF_MAX_FPS = 50
ENDINGS = [*dict.fromkeys(ending for ending, _, _ in CODECS), ".gif"]
"""Of files; a path without one is a folder of PNG pictures."""


def check_video(
    path: Path, *, lossless: bool = False, alpha: bool = False, audio: Path | None = None
) -> None:
    """Whether there is such a video file: asked before anything else.

    Raises `SettingsError` for endings that are none of a video, and for those that do not have what is asked for;
    `FormatError` and `OSError` where `audio` has no sound.
    """
    suffix = path.suffix.lower()
    if suffix and suffix not in ENDINGS:
        raise SettingsError(
            f"{path.name}: the ending {path.suffix!r} is none of a video; expected {', '.join(ENDINGS[:-1])} or "
            f"{ENDINGS[-1]}, or no ending for a folder of PNG pictures"
        )
    if suffix == ".gif" and (lossless or alpha):
        what = "lossless" if lossless else "transparent"
        raise SettingsError(
            f"{path.name}: a .gif file is never {what}; take .mov, .mkv or a folder of PNG pictures"
        )
    if suffix and suffix != ".gif":
        codec_of(suffix, lossless=lossless, alpha=alpha)
    if audio is not None:
        if suffix in ("", ".gif"):
            raise SettingsError(
                f"{path.name}: {suffix or 'a folder'} has no sound; take {', '.join(ENDINGS[:-1])}"
            )
        check_audio(audio)


def open_video(
    path: Path,
    size: tuple[int, int],
    fps: float,
    *,
    lossless: bool = False,
    alpha: bool = False,
    audio: Path | None = None,
) -> AbstractContextManager[Add]:
    """The video file of a path by its ending: one of `ENDINGS`, or none for a folder of PNG pictures.

    `lossless` keeps every bit of the pictures; a folder and .mkv do anyway. With `alpha` the pictures have four
    components, the last one opacity, which the others are not multiplied by. `audio` is a file whose first track of
    sound goes along.

    Raises what `check_video` raises. Entering it raises `SettingsError` where the size or the rate does not suit, and
    `OSError` where nothing can be written there: before anything is rendered.
    """
    check_video(path, lossless=lossless, alpha=alpha, audio=audio)
    suffix = path.suffix.lower()
    if suffix == ".gif":
        return _gif(path, size, fps)
    if not suffix:
        return _png_folder(path, size, fps)
    return open_encoder(path, size, fps, codec_of(suffix, lossless=lossless, alpha=alpha), audio=audio)


def read_picture(png: bytes) -> Picture:
    """The picture in a PNG file of 8 bits, [height, width, 3 or 4] in sRGB."""
    import av

    codec = av.CodecContext.create("png", "r")
    if not isinstance(codec, av.VideoCodecContext):  # PNG is one
        raise TypeError("png")
    [frame] = [*codec.decode(av.Packet(png)), *codec.decode(None)]
    kind = "rgba" if frame.format.name == "rgba" else "rgb24"
    return np.asarray(frame.to_ndarray(format=kind), dtype=np.uint8)


@contextmanager
def _gif(path: Path, size: tuple[int, int], fps: float) -> Iterator[Add]:
    """A GIF that repeats for ever, with one palette of 256 colours made for all its frames."""
    import av

    if fps > GIF_MAX_FPS:
        raise SettingsError(f"a GIF shows at most {GIF_MAX_FPS} frames a second, not {fps:g}")
    rate = as_rate(fps)
    with atomic_files.atomic_path(path) as temporary:
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
def _png_folder(path: Path, size: tuple[int, int], fps: float) -> Iterator[Add]:
    """frame_0000.png and so on by the number of the frame, in a folder that is made if it is not there."""
    if path.exists() and not path.is_dir():
        raise NotADirectoryError(
            errno.ENOTDIR, "this is a file, expected a folder for PNG pictures", str(path)
        )
    if not path.exists():
        atomic_files.check_writable(path)
        path.mkdir()
    atomic_files.check_writable(path / picture_name(0))

    def add(number: int, picture: Picture) -> None:
        atomic_files.write(os.path.join(path, picture_name(number)), _core.encode_png(picture))

    yield add


def picture_name(number: int) -> str:
    """The name of the picture of a frame."""
    return f"frame_{number:04}.png"
