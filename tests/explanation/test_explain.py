"""Explanations and their figures.

Values are compared with images and with a calculation from the printed digits.
"""

import base64
import io
import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest
import raycam
from PIL import Image
from raycam import explain, reference
from support.raises import fault, raises

SVG = "{http://www.w3.org/2000/svg}"


def box_world():
    world = raycam.World()
    world.add_object(box={"size": [2, 2, 2]}, name="crate", color=[0.8, 0.1, 0.1])
    world.add_object(plane={"size": [12, 12]}, name="ground", location=[0, 0, -1], color=[0.2, 0.5, 0.3])
    return world


def box_camera(**options):
    return raycam.Camera.look_at([5, -6, 3], [0, 0, 0], size=(80, 60), fov=40, **options)


def random_world(rng):
    world = raycam.World()
    for _ in range(4):
        vertices = rng.normal(size=(12, 3))
        world.add_mesh(vertices, rng.permuted(np.tile(np.arange(12), (8, 1)), axis=1)[:, :3])
    return world


# Numbers


@pytest.mark.parametrize("pixel_center", ["integer", "half"])
def test_explanation_has_the_values_of_the_image(pixel_center):
    rng = np.random.default_rng(1)
    for _ in range(5):
        world = random_world(rng)
        camera = raycam.Camera.look_at(
            rng.normal(size=3) * 4, rng.normal(size=3), size=(32, 24), fov=50, pixel_center=pixel_center
        )
        picture = reference.render(world, camera)
        for column, row in rng.integers((0, 0), camera.size, size=(12, 2)):
            e = explain(world, camera, (column, row))
            seen = {name: values[row, column] for name, values in picture.items()}
            assert e.depth == pytest.approx(seen["depth"], rel=1e-12)
            assert e.distance == pytest.approx(seen["distance"], rel=1e-12)
            ids = (e.winner.instance, e.winner.triangle) if e.winner else (-1, -1)
            assert ids == (seen["instance"], seen["triangle"])
            np.testing.assert_array_equal(np.float32(e.color), seen["color"])
            assert e.without_area + e.parallel + e.behind + e.outside + e.inside == e.triangles == 32


def test_pixel_coordinates_refer_to_the_pixel_centre():
    world = box_world()
    assert explain(world, box_camera(), (40, 30)).x.tolist() == [40, 30, 1]
    assert explain(world, box_camera(pixel_center="half"), (40, 30)).x.tolist() == [40.5, 30.5, 1]


def test_candidates_are_sorted_by_distance_and_contain_hits_and_one_miss():
    e = explain(box_world(), box_camera(), (40, 30))
    t = [c.t for c in e.candidates]
    assert t == sorted(t)
    assert [c.inside for c in e.candidates].count(True) == e.inside == 3
    assert [c.inside for c in e.candidates].count(False) == 1
    assert e.winner is next(c for c in e.candidates if c.inside)
    for c in e.candidates:
        # f(t) lies on the ray and in the plane; f + s u and start + q edge are one point.
        np.testing.assert_allclose(c.f, e.C + c.t * e.r)
        assert c.n @ (c.f - c.a) == pytest.approx(0, abs=1e-12)
        np.testing.assert_allclose(c.g, c.a + (c.a - c.c))
        for start, edge, s, q in zip(c.corners, (c.v1, c.v2, c.v3), c.along_u, c.along_edge, strict=True):
            np.testing.assert_allclose(c.f + s * c.u, start + q * edge, atol=1e-12)
        assert c.crossed.tolist() == [
            0 <= s <= 1 and 0 <= q <= 1 for s, q in zip(c.along_u, c.along_edge, strict=True)
        ]


def test_number_of_pairs_per_block_does_not_change_the_text(monkeypatch):
    world = box_world()
    whole = str(explain(world, box_camera(), (40, 30)))
    monkeypatch.setattr("raycam.reference.procedure.PAIRS_AT_ONCE", 3)
    assert str(explain(world, box_camera(), (40, 30))) == whole


@pytest.mark.parametrize(("scale", "offset"), [(1e-5, 0.0), (1e5, 0.0), (1.0, 1e6)])
def test_worlds_of_any_scale_and_distance_keep_their_digits(scale, offset):
    world = raycam.World()
    shift = np.full(3, offset)
    world.add_object(box={"size": [2 * scale] * 3}, location=shift.tolist())
    camera = raycam.Camera.look_at(
        np.array([5, -6, 3]) * scale + shift, shift, size=(80, 60), focal=100, pixel_center="half"
    )
    plain = raycam.World()
    plain.add_object(box={"size": [2, 2, 2]})
    near = explain(plain, raycam.Camera.look_at([5, -6, 3], [0, 0, 0], size=(80, 60), focal=100), (40, 30))
    there = explain(world, camera, (40, 30))
    assert near.winner.triangle == there.winner.triangle
    assert (near.units.scale, near.units.origin.tolist()) == (1.0, [0.0, 0.0, 0.0])
    assert there.units.scale != 1.0 or there.units.origin.any()
    assert len(str(there)) > len(str(near))  # only the text of `there` describes other units
    assert 0 < there.depth / scale < 10
    np.testing.assert_allclose(there.units.origin + there.units.scale * there.C, camera.C, rtol=1e-12)


@pytest.mark.parametrize(
    ("pixel", "message"),
    [
        (
            (80, 0),
            fault("out_of_range", "80", "80 x 60", "79", "59"),
        ),
        ((0, -1), fault("out_of_range", "-1")),
        ((1.5, 2), fault("wrong_shape", "1.5")),
        ((1, 2, 3), fault("wrong_shape")),
        (7, fault("wrong_shape")),
    ],
)
def test_pixels_outside_the_image_raise(pixel, message):
    with raises(raycam.SettingsError, **message):
        explain(box_world(), box_camera(), pixel)


# Text


def printed(text, label):
    """The numbers after a label, in order of appearance."""
    lines = [line.split(label, 1)[1] for line in text.splitlines() if line.strip().startswith(label)]
    return [
        [float(x) for x in re.findall(r"-?\d+\.?\d*(?:e[-+]\d+)?", line.split(", the")[0])] for line in lines
    ]


def test_printed_digits_reproduce_the_calculation():
    text = str(explain(box_world(), box_camera(), (40, 30)))
    [C], [r] = (
        printed(text, "C, where P (C, 1) = 0"),
        printed(text, "Positive, X' is in front:     r = X' - C ="),
    )
    P = np.array(
        [[float(x) for x in line.strip(" []").split()] for line in text.splitlines() if "[ " in line]
    )
    np.testing.assert_allclose(P @ [*C, 1], 0, atol=1e-2)
    seen = P @ [*(np.array(C) + np.array(r)), 1]
    np.testing.assert_allclose(seen[:2] / seen[2], [40, 30], atol=1e-3)
    quantities = (
        "a  ",
        "b  ",
        "c  ",
        "n = (c-a) x (b-a)",
        "t = n·(a-C) / n·r",
        "f(t) = C + t r ",
        "g = a + v3",
    )
    rows = list(zip(*(printed(text, label) for label in quantities), strict=True))
    assert len(rows) == 4
    for a, b, c, n, [t], f, g in rows:
        a, b, c = np.array(a), np.array(b), np.array(c)
        normal = np.cross(c - a, b - a)
        np.testing.assert_allclose(normal, n, atol=1e-4)
        np.testing.assert_allclose(normal @ (a - C) / (normal @ r), t, rtol=1e-4)
        np.testing.assert_allclose(np.array(C) + t * np.array(r), f, atol=1e-4)
        np.testing.assert_allclose(a + a - c, g, atol=1e-4)
    assert re.search(r"inside, and the closest: it colours the pixel", text)
    assert "1 crossing, odd: f(t) is inside." in text
    assert re.search(r"(0|2) crossings, even: f\(t\) is outside\.", text)
    assert 'of object 0 "crate"' in text


def test_x_prime_behind_the_camera_and_at_infinity_is_explained():
    world = box_world()
    behind = str(explain(world, raycam.Camera.look_at([-5, 0, 0], [-9, 0, 0.5], size=(9, 9), fov=40), (4, 4)))
    facing = str(explain(world, raycam.Camera.look_at([-5, 0, 0], [0, 0, 0.5], size=(9, 9), fov=40), (4, 4)))
    assert ("Negative, X' is behind" in behind) != ("Negative, X' is behind" in facing)
    text = str(explain(world, raycam.Camera.look_at([0, 0, 0], [1, 0, 0], size=(9, 9), fov=40), (4, 4)))
    assert "X' is at infinity" in text
    assert "inside, and the closest" in text


def test_camera_matrix_with_a_negative_factor_has_the_same_ray():
    P = box_camera().P
    e, negative = (
        explain(box_world(), raycam.Camera.from_matrix(sign * P, (80, 60)), (40, 30)) for sign in (1, -3)
    )
    np.testing.assert_allclose(e.forward, negative.forward)
    assert e.winner.triangle == negative.winner.triangle


def test_hits_on_an_edge_and_parallel_rays_are_explained():
    world = raycam.World()
    world.add_mesh([[-1, -1, 2], [1, -1, 2], [1, 1, 2]], [[0, 1, 2]])
    # The view along +z hits the middle of the hypotenuse v3. g is on the same line, so u is parallel to v3.
    camera = raycam.Camera(np.diag([4.0, 4, 1]), np.eye(3), [0, 0, 0], (1, 1))
    text = str(explain(world, camera, (0, 0)))
    assert "but f(t) lies on v3, and points on an edge count as inside." in text
    assert re.search(r"c \+ q v3 +parallel to u, not crossed", text)


def test_misses_are_explained():
    world, camera = box_world(), box_camera()
    missed = explain(world, camera, (0, 0))
    assert len(missed.candidates) == 2
    assert missed.winner is None
    assert not any(each.inside for each in missed.candidates)
    ground = raycam.World()
    ground.add_object(plane={"size": [2, 2]})
    away = raycam.Camera.look_at([0, 0, 1], [5, 0, 2], size=(9, 9), fov=10)
    e = explain(ground, away, (4, 4))
    assert (e.behind, e.inside, e.candidates, e.winner) == (2, 0, (), None)
    assert e.depth == np.inf
    empty = explain(raycam.World(), camera, (0, 0))
    assert (empty.triangles, empty.winner, empty.candidates) == (0, None, ())
    # Each of the three cases has its own text.
    assert len({str(each).splitlines()[-1] for each in (missed, e, empty)}) == 3


# Figure


def figures():
    ground = raycam.World()
    ground.add_mesh(
        [[-60, -60, 0], [60, -60, 0], [0, 80, 0]], [[0, 1, 2]], name="a <ground> & its very long name"
    )
    low = raycam.Camera.look_at([0.2, 0.3, 0.5], [5, 6, 0], size=(64, 36), fov=60)
    straight_down = raycam.Camera.look_at([0, 0, 5.5], [0, 0, 0], [0, 1, 0], size=(64, 36), fov=60)
    inside = raycam.Camera.look_at([0.2, 0.3, 0.5], [-5, 0.1, 0], size=(64, 48), fov=60)
    rng = np.random.default_rng(2)
    needles = raycam.World()
    needles.add_mesh(rng.normal(size=(300, 3)) * [1, 1, 1e-3], np.arange(300).reshape(-1, 3))
    far = raycam.World()
    far.add_object(torus={"radius": 1e-6, "tube": 4e-7, "segments": 12}, location=[1e3, 0, 0])
    at_far = raycam.Camera.look_at([1e3, -4e-6, 1e-6], [1e3, 0, 0], size=(20, 30), fov=40)
    return {
        "hit": (box_world(), box_camera(), (40, 30)),
        "miss": (box_world(), box_camera(), (0, 0)),
        "corner": (box_world(), box_camera(), (79, 59)),
        "grazing": (ground, low, (32, 18)),
        "sky": (ground, low, (32, 0)),
        "facing": (ground, straight_down, (32, 18)),
        "inside": (box_world(), inside, (32, 20)),
        "needles": (needles, raycam.Camera.look_at([0, -5, 2], [0, 0, 0], size=(32, 24), fov=40), (16, 12)),
        "far": (far, at_far, (10, 15)),
        "empty": (raycam.World(), box_camera(), (3, 4)),
    }


@pytest.mark.parametrize("name", figures())
def test_figure_lies_within_its_page(name):
    world, camera, pixel = figures()[name]
    e = explain(world, camera, pixel)
    svg = e.svg()
    assert svg == e.svg()
    root = ET.fromstring(svg)
    width, height = float(root.get("width")), float(root.get("height"))
    for element in root.iter():
        for key, limit in (
            ("x", width),
            ("x1", width),
            ("x2", width),
            ("cx", width),
            ("y", height),
            ("cy", height),
        ):
            if key in element.attrib:
                assert 0 <= float(element.get(key)) <= limit
        for x, y in (corner.split(",") for corner in element.get("points", "").split()):
            assert 0 <= float(x) <= width
            assert 0 <= float(y) <= height
    texts = [element.text for element in root.iter(f"{SVG}text")]
    for label in ("f(t)", "g", "u", "a", "b", "c", "n", "r", "v"):
        assert (label in texts) == (name not in ("sky", "empty")), label
    # The page embeds the image.
    [image] = root.iter(f"{SVG}image")
    data = image.get("{http://www.w3.org/1999/xlink}href").removeprefix("data:image/png;base64,")
    pixels = np.asarray(Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB"))
    frame = raycam.render(world, camera, integrator="flat", samples=1)
    np.testing.assert_array_equal(pixels, frame.to_srgb8())


def test_failed_figure_leaves_no_file(tmp_path):
    e = explain(box_world(), box_camera(), (40, 30))
    e.save_figure(tmp_path / "explain.svg")
    assert (tmp_path / "explain.svg").read_text(encoding="utf-8") == e.svg()
    with raises(raycam.SettingsError, code="unknown_format", mentions=["explain.gif", ".svg"]):
        e.save_figure(tmp_path / "explain.gif")
    with pytest.raises(FileNotFoundError):
        e.save_figure(tmp_path / "nowhere" / "explain.svg")
    assert [path.name for path in tmp_path.iterdir()] == ["explain.svg"]


def test_letters_are_drawn_over_their_outline() -> None:
    """Some programs ignore paint-order, so their white strokes would hide the letters.

    They draw the fill first.
    """
    import xml.etree.ElementTree as tree

    world = raycam.World()
    world.add_object(box={})
    camera = raycam.Camera.look_at([3, -4, 2], [0, 0, 0], [0, 0, 1], size=(64, 48), fov=40)
    texts = [
        e for e in tree.fromstring(raycam.explain(world, camera, (32, 24)).svg()) if e.tag.endswith("text")
    ]
    assert len(texts) > 30
    shown = [e for e in texts if e.get("stroke") is None]
    assert all(e.get("fill") not in (None, "#ffffff", "#fff") for e in shown)
    halos = [e for e in texts if e.get("stroke") is not None]
    assert halos
    for halo in halos:
        after = texts[texts.index(halo) + 1]
        assert (after.text, after.get("x"), after.get("y")) == (halo.text, halo.get("x"), halo.get("y"))
        assert after in shown
