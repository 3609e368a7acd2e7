"""Bundled data, and the quick starts that use it, run as printed in an empty folder."""

from __future__ import annotations

import re
import shlex
import warnings
from pathlib import Path

import pytest
import raycam
from raycam import cli
from support.raises import raises

ROOT = Path(__file__).resolve().parents[2]
QUICK = ("--samples", "1", "--size", "48x30")
EXTRA = {"render": QUICK, "video": (*QUICK, "--frames", "0:2"), "dataset": QUICK[:2]}
COMMANDS = [
    line
    for page in ("README.md", "docs/guide.md")
    for block in re.findall(r"^```sh\n(.*?)^```$", (ROOT / page).read_text(encoding="utf-8"), re.M | re.S)
    for line in block.splitlines()
    if re.match(r"raycam \w+ spot", line) and not line.startswith(("raycam view", "raycam dataset"))
]


def test_data_functions_return_worlds_cameras_and_files() -> None:
    assert len(COMMANDS) >= 6


@pytest.mark.parametrize("command", COMMANDS)
def test_quick_starts_run_in_an_empty_folder(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    words = shlex.split(command, comments=True)[1:]
    extra = [word for word in EXTRA.get(words[0], ()) if word not in words]
    if "--size" in words and "--size" in EXTRA.get(words[0], ()):
        extra = [word for word in extra if word not in ("--size", "48x30")]
    if "--camera" in words:  # the bundled camera has the aspect ratio 4:3
        extra = ["48x36" if word == "48x30" else word for word in extra]
    if "--samples" in words:
        words[words.index("--samples") + 1] = "1"
        extra = [word for word in extra if word not in ("--samples", "1")]
    assert cli.main([*words, *extra]) == 0
    assert "raycam's own file" in capsys.readouterr().err


def test_files_of_the_user_take_precedence_over_bundled_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("spot.toml").write_text("[[object]]\nbox = {}\n")
    assert cli.main(["info", "spot.toml"]) == 0
    said = capsys.readouterr()
    assert "comes with" not in said.err
    assert "12 triangles" in said.out or "triangles  12" in said.out


def test_bundled_cameras_and_sky_can_be_rendered() -> None:
    world = raycam.data.spot()
    for camera, model in ((raycam.data.camera(), "opencv"), (raycam.data.fisheye(), "fisheye")):
        assert (camera.model, camera.size) == (model, (640, 480))
        seen = raycam.render(world, camera.resized((64, 48)), integrator="flat", samples=1)["instance"]
        assert (seen == 0).mean() > 0.05, "Spot is in the picture"
    lit = raycam.load(raycam.data.path("spot.glb"))
    lit.add_light("environment", image=raycam.data.sky())
    assert raycam.render(lit, lit.default_camera((16, 12)), samples=1)["color"].max() > 0.1


def test_bundled_worlds_and_files_exist_and_stay_below_2_mb(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    world = raycam.data.spot()
    assert world.counts["triangles"] > 5000
    for name in raycam.data.NAMES:
        assert raycam.data.path(name).is_file()
    assert sum(raycam.data.path(name).stat().st_size for name in raycam.data.NAMES) < 2_000_000
    assert "Keenan Crane" in raycam.data.path("CREDITS.md").read_text()
    with raises(raycam.SettingsError, code="unknown_name", mentions=["'spot.toml'"]):
        raycam.data.path("spot.tml")
    world.add_object("box")
    assert len(raycam.data.spot().objects) == len(world.objects) - 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert raycam.render(world, samples=1).size == raycam.data.spot().default_camera().size
