"""KITTI data sets, read back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.dataset import write
from raycam.render.camera_seed import camera_seed
from support.box_table import SIZE, picture, ring, table, truth
from support.raises import raises


def test_kitti_data_set_equals_the_ground_truth(tmp_path: Path) -> None:
    level = [
        raycam.Camera.look_at([3 * np.cos(a), 3 * np.sin(a), 0.4], [0, 0, 0.4], size=SIZE, fov=40)
        for a in (0.1, 0.2)
    ]
    write(table(), tmp_path, "kitti", cameras=level, times=[0.0, 0.5], baseline=0.2, flow=True)
    base = tmp_path / "object" / "training"
    world = table()
    for number, camera in enumerate(level):
        name = f"{number:06d}"
        now = world.at(0.5 * number)
        depth = picture(base / "depth_2" / f"{name}.png")
        expected = truth(camera, "depth", now)
        seen = np.isfinite(expected)
        assert np.abs(depth[seen] / 256 - expected[seen]).max() <= 0.5 / 256 + 1e-6
        rows = (base / "calib" / f"{name}.txt").read_text().split("\n")
        calib = {row.split(":")[0]: np.array(row.split(":")[1].split(), float) for row in rows if row}
        P2 = calib["P2"].reshape(3, 4)
        np.testing.assert_allclose(P2[:, :3], camera.K)
        lines = [row.split() for row in (base / "label_2" / f"{name}.txt").read_text().splitlines()]
        instance = truth(camera, world=now)
        assert len(lines) == len(set(np.unique(instance)) - {-1, 0})
        for row in lines:
            assert row[0] in ("box", "ball", "9")
            truncated, occluded, alpha, left, top, right, bottom, h, w, length, x, y, z, ry = map(
                float, row[1:]
            )
            assert 0 <= truncated <= 1
            assert occluded in (0, 1, 2)
            assert alpha == pytest.approx((ry - np.arctan2(x, z) + np.pi) % (2 * np.pi) - np.pi, abs=1e-5)
            # The box as in KITTI's development kit, computeBox3D.m.
            turn = np.array([[np.cos(ry), 0, np.sin(ry)], [0, 1, 0], [-np.sin(ry), 0, np.cos(ry)]])
            corners = np.array([[i, j, k] for i in (-0.5, 0.5) for j in (-1, 0) for k in (-0.5, 0.5)]) * [
                length,
                h,
                w,
            ]
            pixels = (corners @ turn.T + [x, y, z]) @ P2[:, :3].T
            pixels = pixels[:, :2] / pixels[:, 2:]
            assert pixels[:, 0].min() <= left + 0.5
            assert pixels[:, 0].max() >= right - 0.5
            assert pixels[:, 1].min() <= top + 0.5
            assert pixels[:, 1].max() >= bottom - 0.5
            if row[0] == "box":
                np.testing.assert_allclose(sorted([h, w, length]), [0.4, 0.5, 0.6], atol=1e-5)
                assert length == pytest.approx(0.6, abs=1e-5)
    base = tmp_path / "scene_flow" / "training"
    found = raycam.flow(world.at(0), level[0], world.at(0.5), level[1])
    for kind, wanted in (("occ", True), ("noc", ~found["occluded"] & ~found["outside"])):
        stored = picture(base / f"flow_{kind}" / "000000_10.png")[..., ::-1].astype(float)
        valid = stored[..., 2] > 0
        np.testing.assert_array_equal(valid, np.isfinite(found["flow"][..., 0]) & wanted)
        assert np.abs((stored[valid, :2] - 2**15) / 64 - found["flow"][valid]).max() <= 0.5 / 64 + 1e-5
    depth = truth(level[0], "depth", world.at(0))
    disparity = picture(base / "disp_occ_0" / "000000_10.png") / 256
    seen = np.isfinite(depth)
    assert np.abs(disparity[seen] - level[0].K[0, 0] * 0.2 / depth[seen]).max() < 0.5 / 256 + 1e-4
    assert (picture(base / "disp_noc_0" / "000000_10.png") > 0).sum() < (disparity > 0).sum()
    assert (base / "image_2" / "000000_11.png").exists()
    assert not (base / "image_2" / "000001_11.png").exists()
    poses = np.loadtxt(tmp_path / "poses.txt").reshape(-1, 3, 4)
    np.testing.assert_allclose(poses[1][:, 3], level[1].C)


def test_kitti_right_camera_must_be_a_translated_left_camera(tmp_path: Path) -> None:
    (camera,) = ring(1)
    dark = camera.with_vignetting(polynomial=[-3.0])
    write(table(), tmp_path, "kitti", cameras=[dark], baseline=0.2, samples=4)
    right = dark.at_pose(dark.R, dark.C + 0.2 * dark.R[0])
    expected = raycam.render(table(), right, samples=4, frame=0, seed=camera_seed(0, 1)).to_png()
    assert (tmp_path / "object" / "training" / "image_3" / "000000.png").read_bytes() == expected
    with raises(raycam.CameraError, code="unsupported_camera"):
        write(table(), tmp_path / "no", "kitti", cameras=[camera.exposing(0.01)], baseline=0.2)
    assert not (tmp_path / "no").exists()
