"""Figures that explain the light of a pixel, and the search in the tree of boxes."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.cli import main
from raycam.explanation.scene_figure import light_lines
from support.raises import raises

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def world() -> raycam.World:
    made = raycam.World()
    made.add_object(box={"size": 1}, name="a <box> & more")
    made.add_object(plane={"size": [8, 8]}, location=[0, 0, -0.5])
    made.add_light({"type": "sun", "direction": [-1, 1, -2], "irradiance": 3})
    made.add_light({"type": "point", "position": [-2, 2, 1], "power": 50})
    return made


@pytest.mark.parametrize("of", ["light", "tree"])
@pytest.mark.parametrize("model", ["pinhole", "fisheye"])
@pytest.mark.parametrize("pixel", [(24, 16), (10, 25), (0, 0)])
def test_figure_lines_stay_in_their_panels(
    world: raycam.World, of: str, model: str, pixel: tuple[int, int]
) -> None:
    lens = {} if model == "pinhole" else {"distortion": [0.1, 0, 0, 0], "model": "fisheye"}
    camera = raycam.Camera.look_at([4, -3, 2], [0, 0, 0], size=(48, 32), fov=50, **lens)
    root = ET.fromstring(raycam.explain(world, camera, pixel).svg(of))
    images = [
        (float(e.get("x")), float(e.get("x")) + float(e.get("width"))) for e in root.iter(f"{SVG}image")
    ]
    assert len(images) == 2
    for line in root.iter(f"{SVG}line"):
        ends = [float(line.get("x1")), float(line.get("x2"))]
        assert any(low - 0.1 <= min(ends) and max(ends) <= high + 0.1 for low, high in images)


def test_shadow_rays_end_at_the_light_or_at_the_blocker(world: raycam.World) -> None:
    camera = raycam.Camera.look_at([4, -3, 2], [0, 0, 0], size=(48, 32), fov=50)
    explanation = raycam.explain(world, camera, (28, 23))
    lighting = explanation.lighting()
    lines = light_lines(world, lighting, explanation.light_path())
    bulb = next(line for line in lines if line.name.startswith("point 1"))
    assert lighting.terms[1].blocker == "a <box> & more"
    way, full = bulb.points[1] - bulb.points[0], np.array([-2, 2, 1]) - bulb.points[0]
    assert np.allclose(np.cross(way, full), 0, atol=1e-6)
    assert 0 < np.linalg.norm(way) < np.linalg.norm(full)


def test_unknown_figure_subject_is_refused(world: raycam.World) -> None:
    camera = raycam.Camera.look_at([4, -3, 2], [0, 0, 0], size=(48, 32), fov=50)
    with raises(raycam.SettingsError, code="invalid_value", mentions=["'boxes'"]):
        raycam.explain(world, camera, (1, 1)).svg("boxes")


def test_of_option_prints_and_draws_the_subject(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("room.toml").write_text(
        '[camera]\nsize = [24, 16]\nfov = 50\nlocation = [-4, 0, 1]\n[[object]]\nbox = { size = 1 }\nname = "crate"\n'
        '[[light]]\ntype = "sun"\ndirection = [1, 0.2, -1]\nirradiance = [3, 3, 3]\n'
    )
    command = ["explain", "room.toml", "--pixel", "12", "11"]
    assert main([*command, "--of", "light", "--figure", "light.svg"]) == 0
    said = capsys.readouterr().out
    assert "SUN 0" in said
    assert "ONE PATH OF LIGHT" in said
    assert "The light of pixel (12, 11)" in Path("light.svg").read_text(encoding="utf-8")
    assert main([*command, "--of", "tree"]) == 0
    assert "THE TREE" in capsys.readouterr().out
    assert main([*command, "--of", "shadow"]) != 0
    assert "expected ray, light, tree" in capsys.readouterr().err
