"""Audio of videos: the track of another file, cut or padded to the video's length."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..errors import FormatError

if TYPE_CHECKING:
    from av.container import OutputContainer

__all__ = ["RATE", "AudioTrack", "check_audio"]

RATE = 48_000
"""Samples per second in every file; all codecs here support this rate."""
CHUNK = 1024  # samples per packet, for codecs without a frame size

Samples = npt.NDArray[Any]
"""An array [channels, samples]."""


def check_audio(path: Path) -> int:
    """Reads the beginning of a file's audio, before long work; returns the number of channels.

    Raises `FormatError` if FFmpeg finds no audio, and `OSError` if the file cannot be read.
    """
    import av

    try:
        with av.open(str(path)) as file:
            if not file.streams.audio:
                raise FormatError(f"{path}: the file has no audio track", code="missing_value")
            for frame in file.decode(file.streams.audio[0]):
                return int(frame.layout.nb_channels)
    except av.InvalidDataError as fault:
        raise FormatError(
            f"{path}: FFmpeg cannot read the audio: {fault.strerror}", code="damaged_data"
        ) from None
    raise FormatError(
        f"{path}: the audio track is empty; use a file with sound, or omit audio", code="missing_value"
    )


class AudioTrack:
    """The first audio track of the file `path`, encoded into the video `file`.

    One or two channels are kept, more are mixed down to two; the rate becomes `RATE`. Raises the errors of
    `check_audio`.
    """

    def __init__(self, path: Path, file: OutputContainer, encoder: str) -> None:
        import av

        layout = "mono" if check_audio(path) == 1 else "stereo"
        stream = file.add_stream(encoder, rate=RATE, layout=layout)
        if not isinstance(stream, av.AudioStream):  # for mypy: the table contains only audio codecs
            raise TypeError(encoder)
        self._file, self._stream = file, stream
        self._stream.options = {"flags": "+bitexact"}
        self._layout = layout
        known = [one.name for one in self._stream.codec_context.codec.audio_formats or []]
        # 16-bit integers are kept if the codec supports them.
        self._format = next(name for name in ("s16", "fltp") if name in known)
        self._stream.format = av.AudioFormat(self._format)
        planar = "s16p" if self._format == "s16" else "fltp"
        self._source = _decoded(path, av.AudioResampler(format=planar, layout=layout, rate=RATE))
        self._rest: Samples = np.zeros(
            (1 if layout == "mono" else 2, 0), np.int16 if planar == "s16p" else np.float32
        )
        self._waiting = self._rest
        self._given = 0
        self._encoded = 0

    def reach(self, time: Fraction) -> None:
        """Encodes audio up to a time in seconds from the beginning."""
        wanted = round(time * RATE) - self._given
        while self._rest.shape[1] < wanted:
            more = next(self._source, None)
            if more is None:  # pad with silence
                more = np.zeros((len(self._rest), wanted - self._rest.shape[1]), self._rest.dtype)
            self._rest = np.concatenate([self._rest, more], axis=1)
        self._given += wanted
        self._waiting = np.concatenate([self._waiting, self._rest[:, :wanted]], axis=1)
        self._rest = self._rest[:, wanted:]
        each = self._stream.codec_context.frame_size or CHUNK
        while self._waiting.shape[1] >= each:
            self._encode(each)

    def close(self) -> None:
        """Encodes the remaining samples."""
        if self._waiting.shape[1]:
            self._encode(self._waiting.shape[1])
        self._file.mux(self._stream.encode(None))

    def _encode(self, count: int) -> None:
        import av

        samples, self._waiting = self._waiting[:, :count], self._waiting[:, count:]
        packed = samples.T.reshape(1, -1) if self._format == "s16" else samples
        frame = av.AudioFrame.from_ndarray(np.ascontiguousarray(packed), self._format, self._layout)
        frame.sample_rate, frame.time_base, frame.pts = RATE, Fraction(1, RATE), self._encoded
        self._encoded += count
        self._file.mux(self._stream.encode(frame))


def _decoded(path: Path, resampler: Any) -> Iterator[Samples]:
    """Iterates over the resampled audio of the first track."""
    import av

    with av.open(str(path)) as file:
        try:
            for frame in file.decode(file.streams.audio[0]):
                yield from (one.to_ndarray() for one in resampler.resample(frame))
        except av.InvalidDataError as fault:
            raise FormatError(
                f"{path}: the audio track is damaged: {fault.strerror}", code="damaged_data"
            ) from None
        yield from (one.to_ndarray() for one in resampler.resample(None))
