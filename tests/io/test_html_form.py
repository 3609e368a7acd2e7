"""HTML representations of objects in notebooks."""

from __future__ import annotations

import re

import raycam
from raycam.io.html_form import html_table


def test_html_table_escapes_text_and_limits_rows() -> None:
    made = html_table("<a>", ("x", "y"), [(i, "<b>") for i in range(25)], ["& more"])
    assert "<b>&lt;a&gt;</b>" in made
    assert made.count(">&lt;b&gt;</td>") == 20
    assert "... and 5 more" in made
    assert "&amp; more" in made
    assert "<table>" not in html_table("nothing", ("x",), [])


def test_table_cells_have_padding_between_columns() -> None:
    made = html_table("objects", ("id", "name"), [(0, "crate")])
    cells = re.findall(r"<t[hd][^>]*>", made)
    assert len(cells) == 4
    assert all("padding" in each for each in cells)  # marimo's own style sheet has no space between cells


def test_notebook_objects_have_an_html_representation() -> None:
    world = raycam.World()
    world.add_object(box={}, name="<crate>", category="crate")
    world.add_light("sky", radiance=1)
    camera = raycam.data.camera()
    small = camera.resized((32, 24))
    recipe = raycam.Recipe({"object": [{"name": "crate", "box": {}, "count": 3}]})
    cameras = raycam.load_cameras(raycam.data.path("camera.yaml"))
    rig = raycam.Rig.stereo(camera.pinhole(), baseline=0.1)
    frames = raycam.render_many(world, [small] * 9, channels=["depth"])
    said = [
        (world, ["&lt;crate&gt;", ">12</td>", "light: sky"]),
        (camera, ["640 x 480", "812.3", "opencv"]),
        (recipe, ["crate", ">3</td>"]),
        (cameras, ["camera", "640 x 480", "opencv"]),
        (rig, ["left", "right", "640 x 480"]),
        (frames, ["9 Frames"]),
    ]
    for item, words in said:
        made = item._repr_html_()  # type: ignore[attr-defined]
        for word in words:
            assert word in made
        assert re.match(r"<div>.*</div>|<div>.*>$", made, re.S)
    assert frames._repr_html_().count("data:image/png;base64,") == 8
    assert raycam.explain(world, small.pinhole(), (16, 12))._repr_svg_().startswith("<svg")
    assert repr(cameras).startswith("Cameras of ")
    assert "1 (camera 640 x 480 opencv)" in repr(cameras)
