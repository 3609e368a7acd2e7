"""Sound of videos, read back by FFmpeg.

The sound is as long as the images, and lossless codecs do not change it.
"""

from __future__ import annotations

from pathlib import Path

import av
import numpy as np
import pytest
from raycam.errors import FormatError, SettingsError
from raycam.video.audio import RATE, check_audio
from raycam.video.files import open_video
from support.raises import raises
from support.sound import heard, tone, write_wave


def film(path: Path, audio: Path, frames: int = 10, fps: float = 10) -> Path:
    with open_video(path, (16, 16), fps, audio=audio) as add:
        for number in range(frames):
            add(number, np.full((16, 16, 3), 2 * number, np.uint8))
    return path


@pytest.mark.parametrize("ending", [".mov", ".mkv"])
@pytest.mark.parametrize("seconds", [0.35, 1.0, 2.7])
@pytest.mark.parametrize("channels", [1, 2])
def test_lossless_sound_is_cut_or_padded_to_the_exact_length(
    tmp_path: Path, ending: str, seconds: float, channels: int
) -> None:
    samples = tone(seconds, channels)
    path = film(tmp_path / f"a{ending}", write_wave(tmp_path / "a.wav", samples))
    expected = np.zeros((RATE, channels))
    expected[: len(samples)] = samples[:RATE]
    np.testing.assert_array_equal(heard(path) * 32768, expected)


@pytest.mark.parametrize("ending", [".mp4", ".webm"])
def test_compressed_sound_keeps_pitch_and_length(tmp_path: Path, ending: str) -> None:
    for rate in (RATE, 44_100):
        source = write_wave(tmp_path / "a.wav", tone(3, rate=rate), rate)
        path = film(tmp_path / f"{rate}{ending}", source, frames=20)
        back = heard(path)
        assert 2.0 <= len(back) / RATE < 2.0 + 2 * 1024 / RATE
        spectrum = np.abs(np.fft.rfft(back[4096 : 4096 + RATE], axis=0))
        assert spectrum.argmax(axis=0).tolist() == [440, 660]
        again = film(tmp_path / f"again{ending}", source, frames=20)
        assert again.read_bytes() == path.read_bytes()


def test_sound_and_images_are_interleaved(tmp_path: Path) -> None:
    path = film(tmp_path / "a.mkv", write_wave(tmp_path / "a.wav", tone(9)), frames=80)
    with av.open(str(path)) as file:
        times = [(float(p.dts * p.time_base), p.stream.type) for p in file.demux() if p.dts is not None]
    latest = {"video": 0.0, "audio": 0.0}
    for time, kind in times:
        latest[kind] = time
        assert abs(latest["video"] - latest["audio"]) < 0.5


def test_files_without_sound_are_refused_before_rendering(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        check_audio(tmp_path / "none.wav")
    (tmp_path / "text.wav").write_text("not at all a sound")
    with raises(FormatError, code="damaged_data", mentions=["text.wav", "FFmpeg"]):
        film(tmp_path / "a.mp4", tmp_path / "text.wav")
    with open_video(tmp_path / "mute.mp4", (16, 16), 10) as add:
        add(0, np.zeros((16, 16, 3), np.uint8))
    with raises(FormatError, code="missing_value", mentions=["mute.mp4"]):
        film(tmp_path / "a.mp4", tmp_path / "mute.mp4")
    with raises(FormatError, code="missing_value", mentions=["empty.wav"]):
        film(tmp_path / "a.mp4", write_wave(tmp_path / "empty.wav", np.zeros((0, 1))))
    sound = write_wave(tmp_path / "a.wav", tone(1))
    for name in ("a.gif", "folder"):
        with raises(SettingsError, code="cannot_write", mentions=[".mp4"]):
            film(tmp_path / name, sound)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.wav", "empty.wav", "mute.mp4", "text.wav"]
