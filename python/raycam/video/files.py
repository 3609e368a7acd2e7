"""Writers of videos: .mp4, .mov, .mkv, .webm, .gif, or a folder of PNG images.

Each writer is a context manager that yields a function for adding images in order. The file gets its final name when
the block ends without an exception. Equal images give equal bytes.
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
from ..errors import SettingsError, with_code
from ..io import atomic_files
from .audio import check_audio
from .codecs import CODECS, REPRODUCIBLE, codec_of, open_encoder
from .filters import Filters, Picture, as_rate
from .gif import GifWriter
from .png import decode_png

__all__ = ["ENDINGS", "check_video", "open_video", "picture_name", "read_picture"]

Add = Callable[[int, Picture], None]
"""Adds an image: `add(frame number, image)`."""

GIF_MAX_FPS = 50
OLDEST_AV = 17
"""The oldest major version of PyAV that encodes all codecs of the table."""
ENDINGS = [*dict.fromkeys(ending for ending, _, _ in CODECS), ".gif"]
"""Endings of video files; a path without an ending is a folder of PNG images."""


def check_video(
    path: Path, *, lossless: bool = False, alpha: bool = False, audio: Path | None = None
) -> None:
    """Checks the options of a video file before any work.

    Raises `SettingsError` for unknown endings and for options that the format does not support; `FormatError` and
    `OSError` for `audio` without sound.
    """
    suffix = path.suffix.lower()
    if suffix and suffix not in ENDINGS:
        raise SettingsError(
            f"{path.name}: the ending {path.suffix!r} is not a video format; expected {', '.join(ENDINGS[:-1])} or "
            f"{ENDINGS[-1]}, or no ending for a folder of PNG images",
            code="unknown_format",
        )
    if suffix == ".gif" and (lossless or alpha):
        what = "lossless" if lossless else "transparent"
        raise SettingsError(
            f"{path.name}: a .gif file cannot be {what}; use .mov, .mkv or a folder of PNG images",
            code="cannot_write",
        )
    if suffix and suffix != ".gif":
        require_av(path.name)
    if suffix and suffix != ".gif":
        codec_of(suffix, lossless=lossless, alpha=alpha)
    if audio is not None:
        if suffix in ("", ".gif"):
            raise SettingsError(
                f"{path.name}: {suffix or 'a folder'} cannot contain audio; use {', '.join(ENDINGS[:-1])}",
                code="cannot_write",
            )
        check_audio(audio)


def has_av() -> bool:
    """Returns True if PyAV is installed, in a version that encodes all codecs."""
    try:
        require_av("")
    except SettingsError:
        return False
    return True


def require_av(name: str) -> None:
    """Raises `SettingsError` if PyAV, which encodes video files, is missing or too old.

    This function is called before anything is rendered.
    """
    try:
        import av
    except ImportError as error:
        raise SettingsError(
            f"{name}: video files require PyAV ({error}); pip install 'raycam[video]', or write a .gif file "
            "or a folder of"
            " PNG images",
            code="missing_dependency",
        ) from None
    major = str(av.__version__).partition(".")[0]
    if not major.isdecimal() or int(major) < OLDEST_AV:
        raise SettingsError(
            f"{name}: video files require PyAV {OLDEST_AV} or newer, installed: {av.__version__}; pip install"
            f" 'raycam[video]', or write a .gif file or a folder of PNG images",
            code="missing_dependency",
        )


def open_video(
    path: Path,
    size: tuple[int, int],
    fps: float,
    *,
    lossless: bool = False,
    alpha: bool = False,
    audio: Path | None = None,
) -> AbstractContextManager[Add]:
    """Returns the writer of a video file, which depends on its ending.

    The ending is one of `ENDINGS`, or empty for a folder of PNG images. `lossless` keeps every bit of the images; a
    folder and .mkv always do. With `alpha`, images have a fourth component, opacity, and colours are not premultiplied.
    `audio` is a file whose first audio track is added.

    Raises the errors of `check_video`. Entering the context raises `SettingsError` for an unsupported size or rate, and
    `OSError` if the path cannot be written.
    """
    check_video(path, lossless=lossless, alpha=alpha, audio=audio)
    suffix = path.suffix.lower()
    if suffix == ".gif":
        return _gif(path, size, fps)
    if not suffix:
        return _png_folder(path, size, fps)
    return open_encoder(path, size, fps, codec_of(suffix, lossless=lossless, alpha=alpha), audio=audio)


def read_picture(png: bytes) -> Picture:
    """Decodes an 8-bit PNG file to sRGB [height, width, 3 or 4]."""
    if not has_av():
        return decode_png(png)
    import av

    codec = av.CodecContext.create("png", "r")
    if not isinstance(codec, av.VideoCodecContext):  # for mypy: PNG is a video codec
        raise TypeError("png")
    [frame] = [*codec.decode(av.Packet(png)), *codec.decode(None)]
    kind = "rgba" if frame.format.name == "rgba" else "rgb24"
    return np.asarray(frame.to_ndarray(format=kind), dtype=np.uint8)


@contextmanager
def _gif(path: Path, size: tuple[int, int], fps: float) -> Iterator[Add]:
    """Writes a GIF that repeats forever, with one palette of 256 colours for all frames.

    Uses FFmpeg, or the simpler `GifWriter` without PyAV.
    """
    if fps > GIF_MAX_FPS:
        raise SettingsError(
            f"a GIF shows at most {GIF_MAX_FPS} frames per second, not {fps:g}", code="out_of_range"
        )
    if not has_av():
        with atomic_files.atomic_path(path) as temporary:
            writer = GifWriter(size, fps)
            yield writer.add
            temporary.write_bytes(writer.finish())
        return
    import av

    rate = as_rate(fps)
    with atomic_files.atomic_path(path) as temporary:
        # The palette depends on all images, so images are kept compressed until the last image.
        waiting: list[bytes] = []
        palette_maker = Filters(rate, [("rgb24", size)], [("palettegen", "stats_mode=full")])

        def add(_: int, picture: Picture) -> None:
            palette_maker.push(picture)
            waiting.append(zlib.compress(picture.tobytes(), 1))

        yield add
        [palette] = palette_maker.finish()
        # Sierra's error diffusion hides the steps between colours. Unchanged rectangles are not drawn again.
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
    """Yields a function that writes frame_0000.png and so on, by frame number, to a folder.

    The folder is created if missing.
    """
    if path.exists() and not path.is_dir():
        raise with_code(
            NotADirectoryError(errno.ENOTDIR, "this is a file; expected a folder for PNG images", str(path))
        )
    if not path.exists():
        atomic_files.check_writable(path)
        path.mkdir()
    atomic_files.check_writable(path / picture_name(0))

    def add(number: int, picture: Picture) -> None:
        atomic_files.write(os.path.join(path, picture_name(number)), _core.encode_png(picture))

    yield add


def picture_name(number: int) -> str:
    """The file name of a frame's image."""
    return f"frame_{number:04}.png"
