"""Data sets of randomised worlds, in every format."""

from __future__ import annotations

import json
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pycolmap
import pytest
import raycam
import raycam.cli
import raycam.dataset
from pycocotools.coco import COCO
from raycam.dataset import FORMATS, write
from support.box_table import SIZE, picture, ring, table, truth
from support.raises import raises

RECIPE: dict[str, Any] = {
    "object": [
        {"name": "table", "plane": {"size": 3}},
        {
            "one_of": [
                {"name": "can", "cylinder": {"radius": 0.1, "height": 0.3}, "category": "can"},
                {
                    "name": "ball",
                    "sphere": {"radius": 0.2, "level": 2},
                    "category": {"choice": ["ball", "egg"]},
                },
            ],
            "count": {"integer": [2, 4]},
            "on": "table",
        },
    ],
    "camera": [{"count": 2, "size": SIZE, "fov": 40, "see": {"visible": 0.6, "coverage": [0.02, 0.5]}}],
}


NEEDS = {"hdf5": "h5py", "mcap": "mcap"}
HERE = [
    name
    for name in FORMATS
    if name not in ("photos", "semantickitti", "nuscenes") and (name not in NEEDS or find_spec(NEEDS[name]))
]


@pytest.mark.parametrize("name", HERE)
def test_data_sets_of_randomised_worlds_are_deterministic(tmp_path: Path, name: str) -> None:
    options: dict[str, Any] = {"integrator": "flat", "samples": 1, "format": name, "seed": 5}
    found = write(raycam.Recipe(RECIPE), tmp_path / "a", count=3, **options)
    assert found.frames == 6
    more = write(raycam.Recipe(RECIPE), tmp_path / "b", count=5, workers=2, **options)
    assert more.frames == 10
    for path in (tmp_path / "a").rglob("*.png"):
        other = tmp_path / "b" / path.relative_to(tmp_path / "a")
        assert path.read_bytes() == other.read_bytes()
    if name == "coco":
        check_coco_of_recipe(tmp_path / "a")
    if name == "bop":
        check_scenes_of_recipe(tmp_path / "a")
    if not FORMATS[name].many_worlds:
        folders = {path.name for path in (tmp_path / "a").iterdir() if path.is_dir() and path.name[0] != "."}
        assert folders == {"000000", "000001", "000002"}
        check_world_of_recipe(tmp_path / "a" / "000001", name)


def check_world_of_recipe(folder: Path, name: str) -> None:
    """Checks that world 1 alone equals world 1 of the series."""
    world = raycam.Recipe(RECIPE).world(1)
    first = next(iter(world.cameras.values()))
    if name == "colmap":
        model = pycolmap.Reconstruction(str(folder / "sparse" / "0"))
        assert model.num_images() == 2
        assert model.num_points3D() > 100
        np.testing.assert_allclose(model.images[1].cam_from_world().translation, first.t, atol=1e-12)
    elif name == "nerf":
        rows = json.loads((folder / "transforms.json").read_text())["frames"]
        assert len(rows) == 2
        np.testing.assert_allclose(np.array(rows[0]["transform_matrix"])[:3, 3], first.C, atol=1e-12)
    elif name == "tum":
        pose = (folder / "groundtruth.txt").read_text().splitlines()[1].split()
        np.testing.assert_allclose(np.array(pose[1:4], dtype=float), first.C, atol=1e-12)
    elif name == "scannet":
        label = picture(folder / "label" / "0.png")
        shown = truth(first, world=world)
        recipe = raycam.Recipe(RECIPE)
        assert recipe.categories.keys() >= set(np.unique(label)) - {0}
        for item in world.objects:
            if item.category is not None and (shown == item.id).any():
                assert (label[shown == item.id] == next(
                    number for number, kind in recipe.categories.items() if kind == item.category
                )).all()  # fmt: skip


def check_scenes_of_recipe(folder: Path) -> None:
    """Checks that each world is a scene of one data set, and each shape one model in all scenes."""
    import trimesh

    scenes = sorted(path.name for path in (folder / "train_pbr").iterdir())
    assert scenes == ["000000", "000001", "000002"]
    information = json.loads((folder / "models" / "models_info.json").read_text())
    # One model for all cans and one for all balls, although their numbers and places vary.
    assert set(information) == {"1", "2"}
    meshes = [trimesh.load(folder / "models" / f"obj_{i:06d}.ply", process=False) for i in (1, 2)]
    shown: set[int] = set()
    for number, name in enumerate(scenes):
        scene = folder / "train_pbr" / name
        gt = json.loads((scene / "scene_gt.json").read_text())
        coco = json.loads((scene / "scene_gt_coco.json").read_text())
        assert len(gt) == len(coco["images"]) == len(list((scene / "rgb").iterdir())) == 2
        assert [one["id"] for one in coco["categories"]] == [1, 2]
        world = raycam.Recipe(RECIPE).world(number)
        labelled = [item.id for item in world.objects if item.category is not None]
        for view, camera in enumerate(world.cameras.values()):
            labels = raycam.label(world, camera, objects=labelled)
            poses = gt[str(view)]
            assert len(poses) == len(labels)
            for pose, item in zip(poses, labels, strict=True):
                vertices = meshes[pose["obj_id"] - 1].vertices @ np.reshape(pose["cam_R_m2c"], (3, 3)).T
                there = np.unique(world.triangles(item.object).reshape(-1, 3), axis=0)
                expected = 1000 * (there @ camera.R.T + camera.t)
                order = lambda points: points[np.lexsort(points.round(2).T)]  # noqa: E731
                found = order(vertices + pose["cam_t_m2c"])
                np.testing.assert_allclose(found, order(expected), atol=0.01)
            drawn = [pose["obj_id"] for pose, item in zip(poses, labels, strict=True) if item.visible_pixels]
            own = [one["category_id"] for one in coco["annotations"] if one["image_id"] == view]
            assert own == drawn
            shown.update(drawn)
    assert shown == {1, 2}


def check_coco_of_recipe(folder: Path) -> None:
    coco = COCO(str(folder / "annotations" / "instances.json"))
    names = {c["id"]: c["name"] for c in coco.loadCats(coco.getCatIds())}
    assert sorted(names.values()) == ["ball", "can", "egg"]
    recipe = raycam.Recipe(RECIPE)
    for number in range(6):
        world = recipe.world(number // 2)
        camera = list(world.cameras.values())[number % 2]
        instance = truth(camera, world=world)
        objects = {item.name: item for item in world.objects}
        annotations = coco.loadAnns(coco.getAnnIds(imgIds=number + 1))
        assert annotations
        for one in annotations:
            item = objects[one["object"]]
            assert names[one["category_id"]] == item.category
            assert one["area"] == (instance == item.id).sum()


def test_invalid_recipe_arguments_are_refused(tmp_path: Path) -> None:
    with raises(raycam.SettingsError, code="conflicting_values", mentions=["count"]):
        write(table(), tmp_path, count=2)
    changed = {**RECIPE, "camera": [{**RECIPE["camera"][0], "count": {"integer": [1, 2]}}]}
    with raises(raycam.WorldError, code="conflicting_values"):
        write(raycam.Recipe(changed), tmp_path, count=2)


def test_dataset_command_writes_randomised_worlds_as_a_job(tmp_path: Path, capsys: Any) -> None:
    (tmp_path / "t.obj").write_text(
        "v 0 0 0\nv .4 0 0\nv 0 .4 0\nv 0 0 .4\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
    )
    (tmp_path / "r.toml").write_text(
        '[[object]]\nname = "floor"\nplane = { size = 3 }\n'
        '[[object]]\nmesh = { choice = ["t.obj"] }\ncategory = "corner"\ncount = 2\non = "floor"\n'
    )
    raycam.save_cameras(tmp_path / "c.yaml", ring(1, distortion=[-0.1, 0.0, 0.0, 0.0, 0.0])[0], "opencv")
    folder = tmp_path / "out"
    words = ["dataset", str(tmp_path / "r.toml"), "--sample", "2", "--cameras", str(tmp_path / "c.yaml")]
    words += ["-o", str(folder), "--integrator", "flat", "--samples", "1"]
    assert raycam.cli.main(words) == 0
    assert "2 views, coco" in capsys.readouterr().out
    assert raycam.cli.main(["status", str(folder)]) == 0
    assert "2 of 2 finished" in capsys.readouterr().out
    assert raycam.cli.main(["verify", str(folder)]) == 0
    (folder / "images" / "000001.png").write_bytes(b"damaged")
    assert raycam.cli.main(words) == 0
    assert raycam.cli.main(["verify", str(folder)]) == 0
    index = folder / "annotations" / "instances.json"
    index.write_bytes(index.read_bytes().replace(b"corner", b"korner"))
    assert raycam.cli.main(["verify", str(folder)]) == 1
    assert f"{index}: the result was created with" in capsys.readouterr().out
    assert raycam.cli.main(words) == 0
    assert raycam.cli.main(["verify", str(folder)]) == 0
    capsys.readouterr()
    # If another mesh has the same name, the result is another data set.
    (tmp_path / "t.obj").write_text((tmp_path / "t.obj").read_text().replace(".4", ".5"))
    assert raycam.cli.main(words) == 1
    assert "settings.files" in capsys.readouterr().err
