"""A tone, its WAV file, and the sound of a video."""

from __future__ import annotations

import wave
from pathlib import Path

import av
import numpy as np
from raycam.video.audio import RATE


def write_wave(path: Path, samples: np.ndarray, rate: int = RATE) -> Path:
    """A file of 16-bit samples [n, channels]."""
    with wave.open(str(path), "wb") as file:
        file.setnchannels(samples.shape[1])
        file.setsampwidth(2)
        file.setframerate(rate)
        file.writeframes(samples.astype("<i2").tobytes())
    return path


def tone(seconds: float, channels: int = 2, rate: int = RATE) -> np.ndarray:
    t = np.arange(round(seconds * rate))[:, None] / rate
    return np.round(9000 * np.sin(2 * np.pi * t * [440, 660][:channels]))


def heard(path: Path) -> np.ndarray:
    """The samples of a file's sound [n, channels], from -1 to 1."""
    with av.open(str(path)) as file:
        stream = file.streams.audio[0]
        assert stream.rate == RATE
        channels = stream.codec_context.layout.nb_channels
        parts = []
        for frame in file.decode(stream):
            part = frame.to_ndarray()
            parts.append(part.T if frame.format.is_planar else part.reshape(-1, channels))
        whole = np.concatenate(parts)
        return whole / 32768 if whole.dtype == np.int16 else whole
