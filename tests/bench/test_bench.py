"""`raycam bench`: its scenes, rays and report."""

from __future__ import annotations

import json
import shlex
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
import raycam
import trimesh
from raycam import bench
from raycam.bench.measure import count_mismatches
from raycam.bench.scenes import SCENES, generate
from raycam.cli import main

SMALL: dict[str, Any] = {"triangles": 5000, "size": (48, 40), "repeat": 1}


@pytest.mark.parametrize("name", list(SCENES))
def test_scenes_have_the_requested_size_and_vary_by_seed(name: str) -> None:
    for triangles in (20, 5_000, 40_000):
        scene = generate(name, triangles)
        # A rock has 20 * 4^n triangles.
        assert 0.5 <= len(scene.faces) / triangles <= 2.0 or triangles == 20
        assert scene.faces.min() == 0
        assert scene.faces.max() == len(scene.vertices) - 1
        assert np.isfinite(scene.vertices).all()
    np.testing.assert_array_equal(generate(name, 5000, 1).vertices, generate(name, 5000, 1).vertices)
    assert not np.array_equal(generate(name, 5000, 1).vertices, generate(name, 5000, 2).vertices)


def test_rock_mesh_is_closed_and_faces_outwards() -> None:
    scene = generate("rock", 20 * 4**4)
    mesh = trimesh.Trimesh(scene.vertices, scene.faces, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.euler_number == 2
    assert mesh.volume == pytest.approx(4.2, rel=0.2)


def test_rays_of_every_scene_agree_with_embree() -> None:
    done: list[tuple[int, int]] = []
    report = bench.bench(**SMALL, threads=2, progress=lambda *step: done.append(step))
    assert [(row.scene, row.kind) for row in report.rows] == [(s, k) for s in SCENES for k in bench.KINDS]
    assert done == [(i + 1, 20) for i in range(20)]
    for row in report.rows:
        assert row.raycam > 0
        assert row.raycam_one_thread > 0
        assert row.embree is not None
        assert row.embree > 0
        if row.kind == "build":
            assert row.differ is None
            assert 2500 <= row.count <= 10_000
        elif row.kind == "primary":
            assert row.count == 48 * 40
        else:
            assert 50 < row.count <= 48 * 40
        # Embree is not watertight, so hits of rays through edges may differ.
        assert (row.differ or 0) <= 0.005 * row.count


def test_tiles_contain_every_pixel_once() -> None:
    pixels = bench.tile_order(19, 10)
    assert sorted(map(tuple, pixels.tolist())) == [(u, v) for u in range(19) for v in range(10)]
    assert np.ptp(pixels[:64], 0).tolist() == [7, 7]


def test_count_mismatches_counts_differing_hits() -> None:
    t = np.array([1.0, 2.0, np.inf, np.inf, 5.0])
    assert count_mismatches(t, t) == 0
    assert count_mismatches(t, np.array([1.00001, 2.1, np.inf, 1.0, np.inf])) == 3
    assert count_mismatches(np.array([True, False]), np.array([True, True])) == 1


def test_report_without_embree_names_the_package_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("raycam.bench.measure._embree_version", lambda: None)
    report = bench.bench(["rock"], **SMALL)
    assert all(row.embree is None and row.differ is None for row in report.rows)
    assert report.embree is None
    assert "pip install embreex" in str(report)
    assert "ratio" not in str(report)


def test_bench_command_prints_a_table_and_json(capsys: pytest.CaptureFixture[str]) -> None:
    words = shlex.split("bench hair --triangles 2000 --size 32x24 --repeat 1 --threads 1 --seed 7")
    assert main(words) == 0
    table = capsys.readouterr().out
    for part in (raycam.__version__, "hair", "primary", "bounce", "Embree", "single rays in one thread"):
        assert part in table
    assert main([*words, "--json"]) == 0
    read = json.loads(capsys.readouterr().out)
    assert read["seed"] == 7
    assert read["size"] == [32, 24]
    assert read["threads"] == 1
    assert [row["kind"] for row in read["rows"]] == bench.KINDS
    assert main(["bench", "teapot"]) == 2
    assert "teapot" in capsys.readouterr().err
    assert main(["bench", "rock", "--triangles", "0"]) == 2
    assert "triangles is 0, expected 1 to" in capsys.readouterr().err


def test_importing_the_command_line_does_not_import_the_benchmark() -> None:
    code = "import sys, raycam.cli; sys.exit('raycam.bench' in sys.modules or 'embreex' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
