"""The demo: its commands work as printed."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest
from raycam import cli
from raycam.demo import commands, demo
from support.raises import raises


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """Runs the commands with few samples and small images; returns the requested commands."""
    asked: list[list[str]] = []
    real = cli.main

    def main(words: list[str]) -> int:
        asked.append(words)
        less = {
            "render": ["--size", "96x60", "--samples", "1"],
            "video": ["--frames", "0:2", "--samples", "1"],
        }
        small_words = list(words)
        if "--pixel" in words:
            small_words += ["--size", "960x600"]
        return real(small_words + less.get(words[0], []))

    monkeypatch.setattr(cli, "main", main)
    return asked


def test_demo_writes_its_files_and_prints_its_commands(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    small: list[list[str]],
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    folder = Path("my demo")
    demo(folder, cli.main)
    out = capsys.readouterr().out
    for name in ("flat.png", "lit.png", "truth.exr", "explain.svg", "orbit.mp4", "spot.toml", "CREDITS.md"):
        assert (folder / name).stat().st_size > 0
        if name != "CREDITS.md":
            assert str(folder / name) in out
    assert [shlex.split(line[2:])[1:] for line in out.splitlines() if line.startswith("$ ")] == small
    (folder / "spot.toml").write_text("broken =")
    with raises(Exception, code="failed_command", mentions=["'my demo/spot.toml'"]):
        demo(folder, cli.main)
    assert (folder / "spot.toml").read_text() == "broken ="


def test_demo_world_file_is_used_by_its_commands(tmp_path: Path) -> None:
    for command in commands(tmp_path):
        assert command.startswith("raycam ")
        assert shlex.quote(str(tmp_path / "spot.toml")) in command
