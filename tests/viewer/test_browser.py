"""The client in a browser: its numbers, colours and controls.

Requires Chromium: `make proof`.
"""

from __future__ import annotations

import base64
import itertools
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.render.frame import VIEWS
from raycam.viewer import bundle as bundling
from raycam.viewer.saved_frames import load_frame
from raycam.viewer.server import Server
from raycam.viewer.wire import DTYPES, FILTERS, pack
from support.chromium import Tab
from support.viewer_page import drag, held, place_of, readout, text_of

pytestmark = pytest.mark.proof
EVIL = "</script><img src=x onerror=document.title='evil'>"
SCHEMES_AND_WIDTHS = [(scheme, width) for scheme in ("light", "dark") for width in (1280, 360)]


@pytest.fixture
def client(tab: Tab) -> Tab:
    """A blank tab with the client's functions as `client`."""
    tab.call("Page.navigate", url="about:blank")
    bodies = [bundling.client_file(name) for name in bundling.modules() if name != "main.js"]
    text = "\n".join(bundling.EXPORT.sub("", bundling.IMPORT.sub("", body)) for body in bodies)
    names = (
        "shortest, sixDigits, unpackPlane, bytesOfBase64, toneMap, differenceOf, percentiles, mapTable, idColor, "
        "mapIndex, styleOf, isMiss"
    )
    tab.evaluate(f"globalThis.client = (() => {{ {text}\n return {{ {names} }}; }})(), null")
    return tab


@pytest.fixture(scope="module")
def frame(small_world: raycam.World) -> raycam.Frame:
    return raycam.render(small_world, small_world.camera("front"), channels="all", samples=4)


def base64_of(array: np.ndarray[Any, Any]) -> str:
    return base64.b64encode(array.tobytes()).decode()


# Functions ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("odd", "low", "high"), [(0.5, 0.0, 0.5), (0.0, 0.0, 1e-12)])
def test_color_range_covers_a_single_outlier(client: Tab, odd: float, low: float, high: float) -> None:
    plane = (
        f"{{ components: 1, values: Float32Array.from({{ length: 1000 }}, (_, i) => (i === 7 ? {odd} : 0)) }}"
    )
    found = client.evaluate(f"client.percentiles({plane}, 0)")
    assert (found["low"], found["high"]) == (low, pytest.approx(high))


@pytest.mark.parametrize("filter", FILTERS)
@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("level", [0, 6])
def test_planes_are_unpacked_bit_for_bit(client: Tab, filter: str, dtype: str, level: int) -> None:
    random = np.random.default_rng(5)
    bits = random.integers(0, 256, (7, 5, 3 * np.dtype(dtype).itemsize), np.uint8)
    values = bits.view(dtype)
    if dtype == "float16":
        values = np.nan_to_num(values)  # a NaN widened to float32 has other bits
    header, data = pack("x", values, level=level, filter=filter)
    found = client.evaluate(
        f"client.unpackPlane({json.dumps(header)}, client.bytesOfBase64('{base64.b64encode(data).decode()}'))"
        ".then((plane) => Array.from(new Uint8Array(plane.values.buffer)))"
    )
    expected = values.astype(np.float32) if dtype == "float16" else values
    assert bytes(found) == expected.tobytes()


@pytest.mark.parametrize("dtype", ["float16", "float32", "float64"])
def test_decimals_parse_to_the_same_number_and_are_as_short_as_numpys(client: Tab, dtype: str) -> None:
    random = np.random.default_rng(6)
    bits = random.integers(0, 2 ** (8 * np.dtype(dtype).itemsize), 20000, f"u{np.dtype(dtype).itemsize}")
    more = [0.1, -0.0, 1 / 3, *([65504, 6e-8, 6e-5] if dtype == "float16" else [1e-45, 3.4e38, 5e-324])]
    values = np.concatenate([bits.view(dtype), np.array(more, dtype)])
    values = values[np.isfinite(values)]
    given = values.astype(np.float32) if dtype == "float16" else values  # unpacked planes are float32 too
    texts = client.evaluate(
        f"Array.from(new {given.dtype.name.title()}Array(client.bytesOfBase64('{base64_of(given)}').buffer), "
        f"(v) => client.shortest(v, '{dtype}'))"
    )
    assert np.array(texts, dtype=dtype).tobytes() == values.tobytes()
    digits = [sum(c.isdigit() for c in text.split("e")[0].strip("-0.").replace(".", "")) for text in texts]
    shortest = [
        sum(c.isdigit() for c in np.format_float_scientific(v).split("e")[0].strip("-0.")) for v in values
    ]
    assert all(
        mine <= numpys
        for mine, numpys, v in zip(digits, shortest, values, strict=True)
        if 1e-5 < abs(float(v)) < 1e15
    )


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("exposure", [-2.5, 0.0, 3.0])
def test_client_colors_equal_to_srgb8(client: Tab, view: str, exposure: float) -> None:
    random = np.random.default_rng(7)
    linear = (10 ** random.uniform(-4, 2, (32, 64, 3))).astype(np.float32)
    linear[0] = np.linspace(-0.1, 1.2, 192, dtype=np.float32).reshape(64, 3)
    linear[1] = random.choice([np.nan, np.inf, -np.inf, 0, 1, 1e38], (64, 3))
    frame = raycam.Frame({"color": linear}, camera=None, size=(64, 32))
    rgba = client.evaluate(
        f"(() => {{ const out = new Uint8ClampedArray({4 * 64 * 32});"
        f"const linear = new Float32Array(client.bytesOfBase64('{base64_of(linear)}').buffer);"
        f"client.toneMap(linear, {exposure}, '{view}', out);"
        "return Array.from(out); })()"
    )
    found = np.array(rgba, np.uint8).reshape(32, 64, 4)
    assert (found[..., 3] == 255).all()
    assert np.abs(found[..., :3].astype(int) - frame.to_srgb8(exposure, view)).max() <= 1


def test_numbers_with_six_digits_have_at_most_nine_characters(client: Tab) -> None:
    values = [0.1, -0.0583998, 123456.789, -1e-9, 1.5e30, 0, -12345678.9, 70972]
    texts = client.evaluate(f"{values}.map((v) => client.sixDigits(Math.fround(v), 'float32'))")
    assert max(map(len, texts)) <= 9
    for text, value in zip(texts, values, strict=True):
        assert float(text) == pytest.approx(value, rel=1e-2)


def test_display_style_of_a_plane_depends_on_its_content(client: Tab) -> None:
    kinds = {
        ("color", "float32", 3): "light",
        ("color", "int32", 1): "ids",
        ("albedo", "float64", 1): "scalar",
        ("instance", "float64", 3): "place",
        ("instance", "int32", 1): "ids",
        ("normal", "float32", 2): "flow",
        ("flow", "float64", 1): "scalar",
        ("labels", "int32", 3): "place",
        ("beauty.RGB", "float32", 3): "light",
    }
    for (name, dtype, components), kind in kinds.items():
        plane = {"name": name, "dtype": dtype, "components": components}
        assert client.evaluate(f"client.styleOf({json.dumps(plane)}).kind") == kind, plane
    plane = "{ name: 'flow', dtype: 'float64', components: 2, values: [1, NaN, 0, 0] }"
    misses = f"(() => {{ const p = {plane}; return [0, 1].map((i) => client.isMiss(p, client.styleOf(p), i)); }})()"
    assert client.evaluate(misses) == [True, False]


def test_ranges_beyond_float64_are_colored(client: Tab) -> None:
    places = client.evaluate(
        "[-1e308, 0, 1e308].map((value) => client.mapIndex(value, { low: -1e308, high: 1e308, log: false }))"
    )
    assert places == [0, 512, 1023]


# The page -------------------------------------------------------------------------------------------------


def test_page_shows_the_exact_numbers_of_the_frame(tab: Tab, frame: raycam.Frame, tmp_path: Path) -> None:
    frame.save(tmp_path / "x.html")
    tab.said.clear()
    tab.requests.clear()
    tab.open((tmp_path / "x.html").as_uri())
    random = np.random.default_rng(8)
    tab.mouse("mouseMoved", *place_of(tab, 1, 1, frame.size))
    tab.wait(f"document.querySelectorAll('#values tr').length === {len(frame)}")
    for column, row in random.integers(0, frame.size, (20, 2)).tolist():
        tab.mouse("mouseMoved", *place_of(tab, column, row, frame.size))
        tab.wait(
            f"document.getElementById('pixel-place').textContent.startsWith('column {column}, row {row}')"
        )
        for name, numbers in readout(tab).items():
            value = np.atleast_1d(frame[name][row, column])
            assert np.array(numbers, value.dtype).tobytes() == value.tobytes(), (name, column, row)
    assert tab.said == []
    assert [url for url in tab.requests if not url.startswith(("file:", "data:", "blob:"))] == []


def test_displayed_image_equals_to_srgb8(tab: Tab, frame: raycam.Frame, tmp_path: Path) -> None:
    frame.save(tmp_path / "x.html", exposure=1.0, view="agx")
    tab.open((tmp_path / "x.html").as_uri())
    tab.evaluate("document.getElementById('one-to-one').click()")
    tab.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    data = tab.evaluate(
        "(() => { const c = document.getElementById('picture');"
        "return [c.width, ...c.getContext('2d').getImageData(0, 0, c.width, c.height).data]; })()"
    )
    width, pixels = data[0], np.array(data[1:], np.uint8)
    screen = pixels.reshape(-1, width, 4)[..., :3].astype(int)
    expected = frame.to_srgb8(1.0, "agx").astype(int)
    # The centre of the screen, within one pixel because of rounding.
    left, top = (width - 48) // 2, (len(screen) - 32) // 2
    places = itertools.product(range(top - 2, top + 3), range(left - 2, left + 3))
    assert min(np.abs(screen[y : y + 32, x : x + 48] - expected).max() for y, x in places) <= 1


def test_names_and_titles_are_shown_as_text_not_html(
    tab: Tab, small_world: raycam.World, tmp_path: Path
) -> None:
    world = raycam.World()
    world.add_object(box={"size": 1}, name=EVIL)
    raycam.render(world, channels=["color", "instance"], samples=1).save(
        tmp_path / "x.html", world=world, title=EVIL
    )
    tab.open((tmp_path / "x.html").as_uri())
    tab.press("6")
    tab.wait("document.querySelector('.ids') !== null")
    assert EVIL in tab.evaluate("document.querySelector('.ids').textContent")
    assert tab.evaluate("document.title") == EVIL
    assert tab.evaluate("document.querySelectorAll('img').length") == 0


def test_channel_names_of_files_are_shown_as_text_not_html(tab: Tab, tmp_path: Path) -> None:
    depth = np.arange(6, dtype=np.float32).reshape(2, 3)
    name = 'x"></script><img src=a>&amp;'
    (tmp_path / "x.exr").write_bytes(raycam._core.encode_exr([(name, depth)], False, None, []))
    tab.said.clear()
    load_frame(tmp_path / "x.exr").save(tmp_path / "x.html")
    tab.open((tmp_path / "x.html").as_uri())
    tab.mouse("mouseMoved", *place_of(tab, 1, 1, (3, 2)))
    tab.wait("document.querySelectorAll('#values tr').length === 1")
    assert readout(tab) == {f"{name}.V": ["4"]}
    assert tab.said == []


def test_compared_frames_show_digits_of_their_dtype(tab: Tab, frame: raycam.Frame, tmp_path: Path) -> None:
    single = raycam.Frame(
        {"position": frame["position"].astype(np.float32)}, camera=frame.camera, size=frame.size
    )
    double = raycam.Frame({"position": frame["position"]}, camera=frame.camera, size=frame.size)
    column, row = 24, 16
    for a, b in ((single, double), (double, single)):
        a.save(tmp_path / "x.html", compare=b)
        tab.open((tmp_path / "x.html").as_uri())
        tab.mouse("mouseMoved", *place_of(tab, column, row, frame.size))
        tab.wait("document.querySelectorAll('#values tr').length === 2")
        rows = tab.evaluate(
            "[...document.querySelectorAll('#values tr')].map((row) => "
            "[...row.querySelectorAll('.number')].map((each) => each.title))"
        )
        for numbers, told in zip(rows, (a, b), strict=True):
            value = told["position"][row, column]
            assert np.array(numbers, value.dtype).tobytes() == value.tobytes()
            assert numbers == [str(number) for number in value]


def test_pixels_of_a_region_have_coordinates_of_the_whole_image(
    tab: Tab, small_world: raycam.World, tmp_path: Path
) -> None:
    part = raycam.render(small_world, small_world.camera("front"), samples=1, region=(16, 8, 16, 16))
    part.save(tmp_path / "x.html", world=small_world, explain=[(25, 16)], exposure=12)
    tab.open((tmp_path / "x.html").as_uri())
    assert text_of(tab, "exposure-text") == "+12 stops"
    tab.evaluate("document.querySelector('#explanation-list button').click()")
    tab.wait("document.getElementById('explained').open")
    assert text_of(tab, "explained-title") == "Pixel 25, 16 explained"


def test_every_channel_has_an_image_and_a_legend(tab: Tab, frame: raycam.Frame, tmp_path: Path) -> None:
    frame.save(tmp_path / "x.html")
    tab.said.clear()
    tab.open((tmp_path / "x.html").as_uri())
    for _ in frame:
        tab.press("]")
        tab.evaluate("new Promise((done) => setTimeout(done, 60))")
        assert tab.evaluate("document.getElementById('legend').textContent.length") > 20
    assert tab.evaluate("document.getElementById('channel').value") == "color"
    assert tab.said == []


def test_keyboard_compares_two_frames(
    tab: Tab, frame: raycam.Frame, small_world: raycam.World, tmp_path: Path
) -> None:
    other = raycam.render(small_world, small_world.camera("front"), samples=4, seed=1)
    frame.save(tmp_path / "x.html", compare=other)
    tab.open((tmp_path / "x.html").as_uri())
    modes = []
    for _ in range(8):
        tab.press("x")
        modes.append(tab.evaluate("document.getElementById('compare-mode').value"))
    assert modes == ["slider", "flip", "blink", "difference", "signed", "relative", "perceptual", "off"]
    differs = np.abs(frame["color"].astype(float) - other["color"]).max(axis=2)
    figures = tab.evaluate("[...document.querySelectorAll('#difference dd')].map((each) => each.textContent)")
    assert figures[0] == f"{np.count_nonzero(differs):,} of {differs.size:,}"
    assert float(figures[1]) == pytest.approx(differs.max(), rel=1e-4)
    assert float(figures[3]) == pytest.approx(np.sqrt((differs**2).mean()), rel=1e-4)


def test_keyboard_selects_moves_and_explains_a_pixel(
    tab: Tab, frame: raycam.Frame, small_world: raycam.World, tmp_path: Path
) -> None:
    frame.save(tmp_path / "x.html", world=small_world, explain=[(25, 16)])
    tab.open((tmp_path / "x.html").as_uri())
    tab.evaluate("document.getElementById('picture').focus()")
    tab.mouse("mouseMoved", 1, 1)
    tab.press("p")
    tab.wait("document.getElementById('pixel-place').textContent.endsWith('(held)')")
    column, row = held(tab)
    for key, steps in (
        ("ArrowRight", 25 - column),
        ("ArrowLeft", column - 25),
        ("ArrowDown", 16 - row),
        ("ArrowUp", row - 16),
    ):
        for _ in range(steps):
            tab.press(key)
    tab.wait("document.getElementById('pixel-place').textContent === 'column 25, row 16 (held)'")
    # The value appears after the page has unpacked its plane.
    tab.wait("document.getElementById('held').textContent.includes('depth')")
    tab.press("Enter")
    tab.wait("document.getElementById('explained').open")
    text = tab.evaluate("document.getElementById('explained-text').textContent")
    assert text == str(raycam.explain(small_world, frame.camera, (25, 16)))
    tab.wait("document.querySelectorAll('#explained-drawing canvas').length === 2")
    tab.wait(
        "[...document.querySelectorAll('#explained-drawing canvas')].every((each) => each.dataset.labels)"
    )


@pytest.mark.parametrize(("scheme", "width"), SCHEMES_AND_WIDTHS)
def test_page_fits_the_window(tab: Tab, frame: raycam.Frame, scheme: str, width: int, tmp_path: Path) -> None:
    named = raycam.World()
    for name in ("a name that is so long that it has to be broken somewhere", "floor"):
        named.add_object(box={"size": 1}, name=name)
    frame.save(tmp_path / "x.html", world=named)
    tab.show(width, 800, scheme)
    tab.open((tmp_path / "x.html").as_uri())
    tab.click(*place_of(tab, 24, 16, frame.size))
    tab.wait("document.querySelector('#values .name')")
    assert tab.evaluate("document.documentElement.scrollWidth") <= width
    if width > 760:  # in wide windows, only the panel scrolls
        tab.wait("document.getElementById('held').textContent")
        tab.show(width, 400, scheme)
        assert tab.evaluate("document.documentElement.scrollHeight") <= 400
        tab.show(width, 800, scheme)
    broken = tab.evaluate(
        "[...document.querySelectorAll('#values th')].filter((each) => { const range = document.createRange();"
        "range.selectNodeContents(each); return range.getBoundingClientRect().height > 30; })"
        ".map((each) => each.textContent)"
    )
    assert all("_" in name for name in broken), broken
    small = tab.evaluate(
        "[...document.querySelectorAll('button, select, input:not([type=checkbox])')].filter((each) => "
        "each.offsetParent && each.getBoundingClientRect().height < 16).map((each) => each.id)"
    )
    assert small == []
    unnamed = tab.evaluate(
        "[...document.querySelectorAll('button, select, input')].filter((each) => "
        "!each.textContent.trim() && !each.labels?.length && !each.getAttribute('aria-label')).map((each) => each.id)"
    )
    assert unnamed == []
    tab.show(1280, 800)


def test_pixel_figure_fits_a_narrow_cell(tab: Tab, small_world: raycam.World, tmp_path: Path) -> None:
    svg = raycam.explain(small_world, small_world.camera("front"), (25, 16))._repr_svg_()
    (tmp_path / "cell.html").write_text(
        f"<!doctype html><div style='width: 500px'>{svg}</div>", encoding="utf-8"
    )
    tab.call("Page.navigate", url=(tmp_path / "cell.html").as_uri())
    tab.wait("document.querySelector('svg')")
    width, height = tab.evaluate(
        "(({ width, height }) => [width, height])(document.querySelector('svg').getBoundingClientRect())"
    )
    whole = tab.evaluate(
        "(({ width, height }) => width / height)(document.querySelector('svg').viewBox.baseVal)"
    )
    assert width == pytest.approx(500)
    assert height == pytest.approx(500 / whole, rel=1e-3)


# The live view --------------------------------------------------------------------------------------------


def test_live_view_moves_probes_and_explains(tab: Tab, server: Server) -> None:
    tab.said.clear()
    tab.requests.clear()
    tab.open(server.url)
    assert server.token not in tab.evaluate("location.href")
    tab.wait("document.getElementById('status').textContent.includes('16 samples')")
    (session,) = server.sessions.values()
    before = session.view.camera
    x, y = place_of(tab, 24, 16, (48, 32))
    drag(tab, (x, y), (x + 40, y))
    tab.wait("document.getElementById('status').textContent.includes('16 samples')")
    assert session.view.camera != before
    tab.click(x, y)
    tab.wait("document.querySelectorAll('#values tr').length >= 17")
    seen = raycam.render(session.view.world, session.view.still_camera, channels="all", samples=1)
    column, row = held(tab)
    for name in ("depth", "position", "triangle", "barycentric"):
        value = np.atleast_1d(seen[name][row, column])
        assert np.array(readout(tab)[name], value.dtype).tobytes() == value.tobytes()
    tab.press("Enter")
    tab.wait("document.getElementById('explained').open")
    tab.evaluate("document.getElementById('explained').close()")
    drag(tab, (x, y), (x - 40, y))
    tab.wait("!document.getElementById('pixel-place').textContent.includes('held')")
    assert tab.said == []
    host, port = server.address
    own = (f"http://{host}:{port}/", f"ws://{host}:{port}/", "data:", "blob:")
    assert [url for url in tab.requests if not url.startswith(own)] == []


def test_page_without_the_token_shows_a_message(tab: Tab, server: Server) -> None:
    address = server.url.split("#")[0]
    tab.call("Page.navigate", url=address)
    tab.wait("document.readyState === 'complete' && location.protocol === 'http:'")
    tab.evaluate("sessionStorage.clear()")  # an earlier test may have stored this port's token
    tab.call("Page.navigate", url=address)
    tab.wait("document.getElementById('message')?.textContent.includes('token')")
    assert not server.sessions


def test_page_reports_the_end_of_the_server_and_keeps_the_image(tab: Tab, server: Server) -> None:
    tab.open(server.url)
    tab.wait("document.getElementById('status').textContent.includes('16 samples')")
    server.close()
    tab.wait("document.getElementById('message').textContent.includes('stopped')")
    assert tab.evaluate("document.getElementById('status-picture').textContent")
