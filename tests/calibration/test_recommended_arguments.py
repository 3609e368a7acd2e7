"""Messages about calibrations recommend only arguments of `load_cameras` and options of the command line."""

from __future__ import annotations

import argparse
import inspect
import re
from pathlib import Path

import numpy as np
import pytest
import raycam
import yaml
from raycam.cli import COMMANDS
from support.raises import raises

SOURCES = Path(__file__).parents[2] / "crates" / "calibration" / "src"
WITHOUT_CALIBRATIONS = (
    "bake",
    "bench",
    "completion",
    "demo",
    "doctor",
    "learn",
    "lidars",
    "scan",
    "status",
    "verify",
)
"""Commands that read no calibration."""
RIG_OPTIONS = {"--rig", "--poses"}
"""Options that messages recommend together with the name of the command `raycam dataset`."""
OTHER_WORDS = {"version", "type_id", "lmer", "fov", "encoding", "id", "header"}
"""Words before an equals sign that are not arguments: XML attributes, and arguments of `Camera` and NumPy."""


def texts() -> dict[str, str]:
    """The string literals of each Rust source, with joined lines."""
    found = {}
    for path in SOURCES.rglob("*.rs"):
        source = re.sub(r"^\s*//.*$", "", path.read_text(), flags=re.MULTILINE).split("#[cfg(test)]")[0]
        literals = re.findall(r'"((?:[^"\\]|\\.)*)"', re.sub(r"'\"'", "", source), flags=re.DOTALL)
        found[path.name] = "\n".join(re.sub(r"\\\n\s*", "", text) for text in literals)
    return found


def options(command: str) -> set[str]:
    parser = argparse.ArgumentParser()
    COMMANDS[command][0](parser)
    return set(parser._option_string_actions)


def test_every_recommended_option_exists_in_every_command_that_reads_calibrations() -> None:
    recommended = {word for text in texts().values() for word in re.findall(r"--[a-z][a-z-]*", text)}
    assert {"--direction", "--axes", "--camera-format", "--intrinsics", "--lens", "--size"} <= recommended
    assert recommended & RIG_OPTIONS <= options("dataset")
    for command in set(COMMANDS) - set(WITHOUT_CALIBRATIONS):
        assert recommended - RIG_OPTIONS <= options(command), command


def test_every_recommended_argument_exists() -> None:
    parameters = set(inspect.signature(raycam.load_cameras).parameters)
    known = parameters | OTHER_WORDS | set(inspect.signature(raycam.Camera).parameters)
    for name, text in texts().items():
        words = set(re.findall(r'(?<![\w.{<])([a-z][a-z_]+)=(?=[\\"( ),;]|$)', text, flags=re.MULTILINE))
        assert words <= known, (name, words - known)


def test_calibration_outside_the_folder_is_refused_with_a_remedy_that_exists(tmp_path: Path) -> None:
    (tmp_path / "inner").mkdir()
    for name in ("cam0.yaml", "inner/cam0.yaml"):
        camera = {
            "model_type": "PINHOLE",
            "image_width": 640,
            "image_height": 480,
            "distortion_parameters": {"k1": 0.0, "k2": 0.0, "p1": 0.0, "p2": 0.0},
            "projection_parameters": {"fx": 500.0, "fy": 501.0, "cx": 320.0, "cy": 240.0},
        }
        (tmp_path / name).write_text(yaml.safe_dump(camera))
    settings = tmp_path / "inner" / "vins.yaml"
    settings.write_text(yaml.safe_dump({"num_of_cam": 1, "cam0_calib": "../cam0.yaml"}))
    with raises(raycam.FormatError, mentions=["cam0.yaml", "copy it into this folder"]) as caught:
        raycam.load_cameras(settings)
    assert "folder=" not in str(caught.value)
    assert "--folder" not in str(caught.value)
    settings.write_text(yaml.safe_dump({"num_of_cam": 1, "cam0_calib": "cam0.yaml"}))
    with pytest.warns(raycam.Notice):
        cameras = raycam.load_cameras(settings)
    np.testing.assert_allclose(np.diag(cameras["cam0"].K), [500, 501, 1])
