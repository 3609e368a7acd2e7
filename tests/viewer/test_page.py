"""Frames as pages: one file that contains every value and loads nothing."""

from __future__ import annotations

import base64
import hashlib
import json
import os
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.viewer import page as pages
from raycam.viewer.page import Page, page
from raycam.viewer.saved_frames import load_frame
from raycam.viewer.wire import data_url, unpack
from support.raises import Fault, fault, raises, warns

EVIL = "</script><img src=x onerror=alert(1)><!--"


class Elements(HTMLParser):
    """The elements of a page with their attributes and the text in them."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None], list[str]]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs), []))

    def handle_endtag(self, tag: str) -> None:
        self.found.append((f"/{tag}", {}, []))

    def handle_data(self, data: str) -> None:
        if self.found:
            self.found[-1][2].append(data)

    def text(self, tag: str, **attributes: str) -> str:
        """The text of the one element that has these attributes."""
        (found,) = [
            text
            for name, has, text in self.found
            if name == tag and all(has.get(key) == value for key, value in attributes.items())
        ]
        return "".join(found)


@pytest.fixture(scope="module")
def world() -> raycam.World:
    world = raycam.World()
    world.add_object(box={"size": 1}, color="#c83c28", name=EVIL, category="crate")
    world.add_object(plane={"size": [8, 8]}, location=[0, 0, -0.5], name="floor")
    return world


@pytest.fixture(scope="module")
def camera() -> raycam.Camera:
    return raycam.Camera.look_at([4, -3, 2], [0, 0, 0], size=(48, 32), fov=60)


@pytest.fixture(scope="module")
def frame(world: raycam.World, camera: raycam.Camera) -> raycam.Frame:
    return raycam.render(world, camera, channels="all", samples=4)


def document(text: str) -> dict:
    return json.loads(Elements(text).text("script", id="document"))


def planes(text: str) -> dict[str, np.ndarray]:
    elements = Elements(text)
    return {
        header["key"]: unpack(header, base64.b64decode(elements.text("script", id=f"plane-{number}")))
        for number, header in enumerate(document(text)["planes"])
    }


def test_page_contains_every_channel_bit_for_bit(frame: raycam.Frame) -> None:
    found = planes(page(frame))
    assert set(found) == {f"a-{name}" for name in frame}
    for name, array in frame.items():
        assert found[f"a-{name}"].dtype == array.dtype
        assert found[f"a-{name}"].tobytes() == array.tobytes()


def test_page_loads_nothing_and_its_policy_lists_the_script(frame: raycam.Frame) -> None:
    elements = Elements(page(frame))
    (policy,) = [has["content"] for tag, has, _ in elements.found if has.get("http-equiv")]
    hashes = dict(re.findall(r"(script|style)-src 'sha256-([^']+)'", policy or ""))
    scripts = [text for tag, has, text in elements.found if tag == "script" and "type" not in has]
    styles = [text for tag, _, text in elements.found if tag == "style"]
    for kind, (only,) in {"script": scripts, "style": styles}.items():
        digest = hashlib.sha256("".join(only).encode()).digest()
        assert hashes[kind] == base64.b64encode(digest).decode()
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    for tag, has, _ in elements.found:
        assert not any(name.startswith("on") or name in ("style", "action") for name in has), tag
        assert (has.get("src") or "data:image/jpeg;base64,").startswith("data:image/jpeg;base64,"), tag
        assert has.get("href", "data:,") == "data:,"


def test_names_of_a_world_are_escaped(frame: raycam.Frame, world: raycam.World) -> None:
    text = page(frame, world=world, title=EVIL)
    assert EVIL not in text
    assert document(text)["names"]["instance"] == {"0": EVIL, "1": "floor"}
    assert document(text)["names"]["category"] == {"1": "crate"}
    assert Elements(text).text("h1").strip() == EVIL


def test_color_is_the_first_channel(frame: raycam.Frame) -> None:
    shown = document(page(frame))["channels"]
    assert shown[0] == {"name": "color"}
    assert len(shown) == len(frame)


def test_compared_frame_is_stored_next_to_the_first(
    world: raycam.World, camera: raycam.Camera, frame: raycam.Frame
) -> None:
    other = raycam.render(world, camera, samples=1, seed=1)
    found = planes(page(frame, compare=other))
    assert {name for name in found if name.startswith("b-")} == {f"b-{name}" for name in other}
    assert found["b-color"].tobytes() == other["color"].tobytes()


def test_half_option_rounds_only_the_color_with_a_notice(frame: raycam.Frame) -> None:
    text = page(frame, half=True)
    found = planes(text)
    assert found["a-color"].tobytes() == frame["color"].astype(np.float16).tobytes()
    assert found["a-depth"].tobytes() == frame["depth"].tobytes()
    assert len(document(text)["notices"]) == len(frame.notices) + 1


def test_additional_arrays_are_shown_as_planes(frame: raycam.Frame) -> None:
    flow = np.zeros((32, 48, 2), np.float32)
    assert planes(page(frame, arrays={"flow": flow}))["a-flow"].shape == (32, 48, 2)


def test_region_pixels_have_coordinates_of_the_full_image(world: raycam.World, camera: raycam.Camera) -> None:
    part = raycam.render(world, camera, samples=1, region=(8, 4, 16, 16))
    made = document(page(part, world=world, explain=[(10, 6)]))
    assert made["origin"] == [8, 4]
    assert [(each["column"], each["row"]) for each in made["explanations"]] == [(2, 2)]


def test_explanations_contain_text_and_figure(frame: raycam.Frame, world: raycam.World) -> None:
    (made,) = document(page(frame, world=world, explain=[(24, 16)]))["explanations"]
    assert made["text"] == str(raycam.explain(world, frame.camera, (24, 16)))
    assert len(made["figure"]["triangle"]) == 9


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({"explain": [(1, 1)]}, fault("missing_value", "explain")),
        ({"exposure": float("nan")}, fault("invalid_settings", "exposure")),
        ({"view": "filmic"}, fault("unknown_name", "'filmic'")),
        ({"arrays": {"depth": np.zeros((32, 48), np.float32)}}, fault("duplicate_name", "arrays['depth']")),
        (
            {"arrays": {"my flow": np.zeros((32, 48), np.float32)}},
            fault("invalid_value", "arrays['my flow']"),
        ),
        ({"arrays": {"flow": np.zeros((48, 32), np.float32)}}, fault("wrong_shape", "arrays['flow']")),
        ({"arrays": {"flow": np.zeros((32, 48), np.int64)}}, fault("wrong_type", "arrays['flow']")),
        ({"arrays": {"flow": "a"}}, fault("wrong_type", "arrays['flow']")),
        ({"arrays": {5: np.zeros((32, 48), np.float32)}}, fault("invalid_value", "arrays[5]")),
        ({"arrays": [1]}, fault("wrong_type", "arrays")),
        ({"compare": "other.npz"}, fault("wrong_type", "compare")),
        ({"world": 5}, fault("wrong_type", "world")),
        ({"title": 5}, fault("wrong_type", "title")),
        ({"half": "yes"}, fault("wrong_type", "half")),
        ({"live": "yes"}, fault("wrong_type", "live")),
        ({"channel": "dept"}, fault("unknown_name", "'depth'")),
        ({"explain": 5}, fault("wrong_type", "explain")),
    ],
)
def test_mismatched_page_arguments_are_refused(frame: raycam.Frame, options: dict, expected: Fault) -> None:
    with raises(raycam.SettingsError, **expected):
        page(frame, **options)


def test_frames_that_cannot_be_compared_are_refused(
    world: raycam.World, camera: raycam.Camera, frame: raycam.Frame
) -> None:
    with raises(raycam.SettingsError, code="wrong_shape", mentions=["24 x 16"]):
        page(frame, compare=raycam.render(world, camera.resized((24, 16)), samples=1))
    depth, color = (raycam.render(world, camera, samples=1, channels=name) for name in ("depth", "color"))
    with raises(raycam.SettingsError, code="conflicting_values"):
        page(depth, compare=color)


def test_channels_missing_in_a_compared_frame_give_a_notice(
    world: raycam.World, camera: raycam.Camera, frame: raycam.Frame
) -> None:
    part, other = (
        raycam.render(world, camera, samples=1, region=(x, 0, 8, 8), channels=channels)
        for x, channels in ((0, ["color"]), (4, ["color", "depth"]))
    )
    with warns(raycam.Notice, code="differing_frames", mentions=["depth"]) as told:
        text = page(part, compare=other)
    assert document(text)["notices"][-2:] == [str(each.message) for each in told]
    with warns(raycam.Notice, code="differing_frames"):
        page(frame, world=raycam.World())


def test_file_and_channel_names_are_escaped(tmp_path: Path) -> None:
    depth = np.zeros((2, 3), np.float32)
    for number, name in enumerate(('x"></script><img src=a>', "a&amp;b", "a b")):
        path = tmp_path / f"{number}.exr"
        path.write_bytes(raycam._core.encode_exr([(name, depth)], False, None, []))
        text = page(load_frame(path), title=os.fsdecode(b"\xff.exr"))
        assert list(planes(text)) == [f"a-{name}.V"]
        assert not [tag for tag, has, _ in Elements(text).found if tag == "img" and has.get("src") == "a"]
        assert text.encode()
        assert Elements(text).text("title") == "?.exr"


def test_channel_argument_selects_the_first_channel(frame: raycam.Frame) -> None:
    assert document(page(frame))["channel"] == "color"
    assert document(page(frame, channel="depth"))["channel"] == "depth"


def test_lists_are_shown_as_planes(frame: raycam.Frame) -> None:
    made = planes(page(frame, arrays={"flow": np.full((32, 48, 2), 0.5).tolist()}))["a-flow"]
    assert (made.dtype, made.shape, made.min()) == (np.float64, (32, 48, 2), 0.5)


def test_explained_pixels_outside_of_the_region_are_refused(
    world: raycam.World, camera: raycam.Camera
) -> None:
    part = raycam.render(world, camera, samples=1, region=(8, 4, 16, 16))
    with raises(raycam.SettingsError, code="out_of_range"):
        page(part, world=world, explain=[(0, 0)])


def test_frames_are_saved_as_pages(frame: raycam.Frame, tmp_path: Path) -> None:
    frame.save(tmp_path / "x.html", title="a title")
    assert (tmp_path / "x.html").read_text(encoding="utf-8") == page(frame, title="a title")
    with raises(raycam.SettingsError, code="unknown_key", mentions=[".png"]):
        frame.save(tmp_path / "x.png", title="a title")
    with raises(raycam.SettingsError, code="unknown_key", mentions=[".html"]):
        frame.save(tmp_path / "x.html", bits=8)


def test_show_opens_the_browser(frame: raycam.Frame, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    path = frame.show(title="here")
    assert opened == [path.as_uri()]
    assert path.read_text(encoding="utf-8") == page(frame, title="here")
    path.unlink()


def test_show_displays_the_page_in_a_notebook_cell(
    frame: raycam.Frame, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Shell:
        kernel = None

    class IPython:
        get_ipython = staticmethod(Shell)

    class Display:
        shown: list[Page] = []  # noqa: RUF012
        display = staticmethod(shown.append)

    monkeypatch.setitem(pages.sys.modules, "IPython", IPython)
    monkeypatch.setitem(pages.sys.modules, "IPython.display", Display)
    assert frame.show() is None
    (shown,) = Display.shown
    elements = {tag: has for tag, has, _ in Elements(shown._repr_html_()).found}
    assert elements["iframe"]["sandbox"] == "allow-scripts allow-downloads"
    assert elements["iframe"]["srcdoc"] == str(shown)
    # The content of an untrusted notebook, which omits the frame.
    assert elements["img"]["src"] == data_url("image/jpeg", frame.to_jpeg())
