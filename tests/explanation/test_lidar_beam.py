"""The explanation of one pulse of a lidar."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.cli import main
from support.raises import raises

STREET = """
[[object]]
name = "wall"
box = { size = [0.2, 60, 20] }
location = [20.1, 0, 0]
color = [0.5, 0.5, 0.5]

[[object]]
name = "post"
box = { size = [0.2, 2, 20] }
location = [10.1, 1, 0]
color = [0.8, 0.8, 0.8]

[[lidar]]
name = "top"
device = "vlp16"
beam_divergence = 0.003
beam_samples = 37
range_10 = 40
returns = "dual"
noise = false
"""


@pytest.fixture
def street(tmp_path: Path) -> Path:
    path = tmp_path / "street.toml"
    path.write_text(STREET, encoding="utf-8")
    return path


def edge_pulse(world: raycam.World) -> tuple[raycam.Scan, int]:
    """A scan, and a pulse that meets both the post and the wall."""
    scan = raycam.scan(world, "top")
    both = np.flatnonzero((scan["returns"] == 2) & (scan["time"] < 0.01))
    return scan, int(scan["pulse"][both[0]])


def test_explained_pulse_has_the_points_of_the_scan(street: Path) -> None:
    world = raycam.load(street)
    scan, pulse = edge_pulse(world)
    explained = raycam.explain_beam(world, "top", pulse)
    rows = scan["pulse"] == pulse
    np.testing.assert_allclose(explained.echo_length, scan["distance"][rows], rtol=1e-12)
    np.testing.assert_allclose(explained.purity, scan["purity"][rows])
    assert explained.time == scan["time"][rows][0]
    assert set(explained.names) == {"post", "wall"}
    assert explained.lost == ["kept", "kept"]
    np.testing.assert_allclose(explained.echo_energy.sum(), explained.energy.sum(), rtol=1e-12)
    # The energy of a white target at normal incidence at 1 m is 1, and range_10 defines the threshold.
    np.testing.assert_allclose(explained.signal, 5 * explained.echo_energy / explained.threshold, rtol=1e-12)
    assert explained.threshold == pytest.approx(0.1 / 40**2)


def test_waveform_of_a_pulse_is_the_sum_of_its_gaussians(street: Path) -> None:
    world = raycam.load(street)
    explained = raycam.explain_beam(world, "top", edge_pulse(world)[1])
    at = np.linspace(9, 22, 50)
    sigma = 4e-9 * 299792458 / 2 / 2.3548200450309493
    expected = sum(
        energy * np.exp(-((at - length) ** 2) / (2 * sigma**2))
        for energy, length in zip(explained.energy, explained.length, strict=True)
    )
    np.testing.assert_allclose(explained.waveform(at), expected, rtol=1e-6, atol=1e-12)


def test_sub_rays_lie_within_the_divergence(street: Path) -> None:
    world = raycam.load(street)
    explained = raycam.explain_beam(world, "top", edge_pulse(world)[1])
    assert np.abs(explained.offset[explained.ray == 0]).max() < 1e-9
    assert 0.001 < np.abs(explained.offset).max() < 0.003 * 20


def test_figure_contains_sub_rays_echoes_and_threshold(street: Path, tmp_path: Path) -> None:
    world = raycam.load(street)
    explained = raycam.explain_beam(world, "top", edge_pulse(world)[1])
    explained.save_figure(tmp_path / "beam.svg")
    root = ET.fromstring((tmp_path / "beam.svg").read_text(encoding="utf-8"))
    texts = [node.text or "" for node in root.iter("{http://www.w3.org/2000/svg}text")]
    assert any("threshold" in text for text in texts)
    assert {"post", "wall"} <= set(texts)
    for length in explained.echo_length:
        assert any(text.startswith(f"{length:.5g} m") for text in texts)
    dots = list(root.iter("{http://www.w3.org/2000/svg}circle"))
    # There is a dot for each sub-ray, each echo, the two objects and the sensor.
    assert len(dots) == len(explained.ray) + len(explained.echo_length) + 2 + 1
    with raises(raycam.SettingsError, code="unknown_format", mentions=["beam.png", ".svg"]):
        explained.save_figure(tmp_path / "beam.png")


def test_pulse_into_the_sky_and_lost_echoes_are_explained(street: Path) -> None:
    world = raycam.load(street)
    nothing = raycam.explain_beam(world, raycam.Lidar("vlp16").placed([0, 0, 0], yaw=180), 0)
    assert len(nothing.ray) == 0
    assert str(nothing)
    assert nothing.svg()
    weak = raycam.explain_beam(world, world.sensors["top"].replace(range_10=1), edge_pulse(world)[1])
    assert set(weak.lost) == {"too weak"}
    last = raycam.explain_beam(world, world.sensors["top"].replace(returns="last"), edge_pulse(world)[1])
    assert last.lost[1] == "kept"
    assert "last" in last.lost[0]
    with raises(raycam.SettingsError, code="out_of_range"):
        raycam.explain_beam(world, "top", 10**9)
    with raises(raycam.LidarError, code="unknown_name", mentions=["tap", "top"]):
        raycam.explain_beam(world, "tap", 0)


def test_command_explains_and_draws_a_pulse(
    street: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    figure = tmp_path / "beam.svg"
    command = ["explain", str(street), "--lidar", "top", "--firing", "5"]
    assert main([*command, "--figure", str(figure)]) == 0
    assert f"{figure}: figure" in capsys.readouterr().out
    assert figure.read_text(encoding="utf-8").startswith("<svg")
    assert (
        main(["explain", str(street), "--lidar", "vlp16", "--firing", "5", "--location", "0", "0", "1"]) == 0
    )
    assert "VLP-16" in capsys.readouterr().out
    for wrong, fact in (
        (["explain", str(street)], "--pixel"),
        (["explain", str(street), "--lidar", "top"], "--firing"),
        (["explain", str(street), "--firing", "3"], "--lidar"),
        ([*command, "--pixel", "1", "2"], "--pixel"),
        ([*command, "--figure", "a.html"], ".svg"),
    ):
        assert main(wrong) == 2
        assert fact in capsys.readouterr().err
