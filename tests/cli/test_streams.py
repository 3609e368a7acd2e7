"""Standard streams: images to a pipe, closed streams, short help, pixels with a comma."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import raycam
from PIL import Image
from raycam.cli import main

RENDER = f"{sys.executable} -m raycam render box.toml --samples 2"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "box.toml").write_text(
        "[camera]\nsize = [32, 24]\nfov = 40\nlocation = [3, -4, 2]\ntarget = [0, 0, 0]\n[[object]]\nbox = {}\n"
        '[[light]]\ntype = "sky"\nradiance = 0.5\n'
    )
    monkeypatch.chdir(tmp_path)
    return tmp_path


def shell(command: str) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(command, shell=True, capture_output=True, check=False, env=os.environ)


@pytest.mark.parametrize(("name", "format"), [("-", "PNG"), ("-.png", "PNG"), ("-.jpg", "JPEG")])
def test_image_is_written_to_the_standard_output(folder: Path, name: str, format: str) -> None:
    done = shell(f"{RENDER} -o {name}")
    assert done.returncode == 0, done.stderr
    with Image.open(io.BytesIO(done.stdout)) as image:
        assert (image.format, image.size) == (format, (32, 24))
        if format == "PNG":
            expected = raycam.render("box.toml", samples=2).to_srgb8()
            assert np.array_equal(np.asarray(image), expected)
    assert sorted(os.listdir()) == ["box.toml"]


def test_npz_arrays_are_written_to_the_standard_output(folder: Path) -> None:
    done = shell(f"{RENDER} -o -.npz --channels depth")
    assert done.returncode == 0, done.stderr
    with np.load(io.BytesIO(done.stdout)) as arrays:
        assert np.array_equal(arrays["depth"], raycam.render("box.toml", samples=2)["depth"])


@pytest.mark.skipif(os.name == "nt", reason="requires a POSIX shell")
@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-", "<&-", "<&- >&- 2>&-"])
def test_closed_standard_streams_do_not_prevent_rendering(folder: Path, closed: str) -> None:
    done = shell(f"{RENDER} -o a.png {closed}")
    assert done.returncode == 0, done.stderr
    assert b"Traceback" not in done.stderr
    with Image.open("a.png") as image:
        assert np.array_equal(np.asarray(image), raycam.render("box.toml", samples=2).to_srgb8())
    wrong = shell(f"{sys.executable} -m raycam render nothing.toml -o b.png {closed}")
    assert wrong.returncode == 1
    assert not Path("b.png").exists()


@pytest.mark.parametrize("pixel", ["--pixel 16 12", "--pixel 16,12", "--pixel=16,12"])
def test_pixel_is_accepted_with_or_without_a_comma(
    folder: Path, pixel: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["explain", *pixel.split(), "box.toml"]) == 0
    assert "(16, 12)" in capsys.readouterr().out


def test_command_without_arguments_prints_a_short_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert len(said.out.splitlines()) < 10
    assert "raycam render" in said.out


def test_reference_integrator_accepts_only_one_sample(folder: Path) -> None:
    assert main(["render", "box.toml", "--integrator", "reference", "--samples", "1", "--size", "8x6"]) == 0
    assert main(["render", "box.toml", "--integrator", "reference", "--samples", "2", "--size", "8x6"]) == 2
