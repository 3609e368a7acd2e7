"""The lecture's page in a browser: figures, exercises, code cells, phone, keyboard.

Requires Chromium: `make proof`.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import combinations

import pytest
from raycam.viewer.web.live_page import lecture_page
from support.chromium import Tab, chromium
from support.node_core import needs_core

pytestmark = [pytest.mark.proof, needs_core]
READY = "document.documentElement.dataset.picture"
COLORS = (
    "new Set(new Uint32Array(canvas.getContext('2d')"
    ".getImageData(0, 0, canvas.width, canvas.height).data.buffer)).size"
)
SOLUTIONS = {
    "pointForward": "function pointForward(X, C, v) { const d = sub(X, C); return dot(v, d) > 0 ? d : sub(C, X); }",
    "normal": "function normal(a, b, c) { return cross(sub(c, a), sub(b, a)); }",
    "planeT": "function planeT(n, a, C, r) { return dot(n, sub(a, C)) / dot(n, r); }",
    "isInside": """function isInside(a, b, c, n, f) {
  const g = add(a, sub(a, c)), u = sub(g, f), left = cross(n, u), corners = [a, b, c];
  let crossings = 0;
  for (let i = 0; i < 3; i++) {
    const start = sub(corners[i], f), end = sub(corners[(i + 1) % 3], f);
    const p = dot(left, start), q = dot(left, end);
    if ((p > 0) === (q > 0)) continue;
    const s = dot(add(start, scale(p / (p - q), sub(end, start))), u) / dot(u, u);
    if (s >= 0 && s <= 1) crossings++;
  }
  return crossings % 2 === 1;
}""",
    "closest": """function closest(triangles, C, r) {
  let best = -1, bestT = Infinity;
  for (let i = 0; i < triangles.length; i++) {
    const [a, b, c] = triangles[i], n = normal(a, b, c), t = planeT(n, a, C, r);
    if (t >= 0 && t < bestT && isInside(a, b, c, n, add(C, scale(t, r)))) [best, bestT] = [i, t];
  }
  return best;
}""",
}


@pytest.fixture(scope="module")
def tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    path = tmp_path_factory.mktemp("page") / "lecture.html"
    path.write_text(lecture_page(), encoding="utf-8")
    assert path.stat().st_size < 6e6
    with chromium(tmp_path_factory.mktemp("browser")) as made:
        made.show(1280, 900)
        made.call("Page.navigate", url=path.as_uri())
        made.wait(READY)
        made.evaluate("document.documentElement.style.scrollBehavior = 'auto'")
        yield made
        complaints = [line for line in made.said if "Canvas2D" not in line]
        assert complaints == []
        assert all(each.startswith(("file:", "blob:", "data:")) for each in made.requests), made.requests


def figures(tab: Tab) -> list[str]:
    """The names of all figures."""
    found: list[str] = tab.evaluate(
        "[...document.querySelectorAll('[data-figure]')].map((each) => each.dataset.figure)"
    )
    return found


def show(tab: Tab, name: str) -> str:
    """Scrolls to a figure and waits until it is drawn; returns its selector."""
    selector = f"[data-figure={json.dumps(name)}]"
    tab.evaluate(f"document.querySelector('{selector}').scrollIntoView({{ block: 'center' }})")
    tab.wait(f"document.querySelector('{selector}').dataset.live === 'true'")
    return selector


def answer(tab: Tab, exercise: str, values: list[object]) -> list[str]:
    """The kind and the text of the verdict on an answer."""
    found: list[str] = tab.evaluate(
        f"""((host, values) => {{
          host.querySelectorAll('input').forEach((field, i) => (field.value = values[i]));
          host.querySelector('button').click();
          const verdict = host.querySelector('.verdict');
          return [verdict.className.split(' ').pop(), verdict.textContent];
        }})(document.querySelector('[data-exercise={exercise}]'), {json.dumps([str(each) for each in values])})"""
    )
    return found


def run_cell(tab: Tab, cell: str, code: str) -> list[str]:
    """The kind and the text of the verdict on a code cell."""
    tab.evaluate(
        f"""((host) => {{
          const editor = host.querySelector('textarea');
          editor.value = {json.dumps(code)};
          editor.dispatchEvent(new Event('input'));
          host.querySelector('button').click();
        }})(document.querySelector('[data-code={cell}]'))"""
    )
    tab.wait(
        f"!['', 'Running …'].includes(document.querySelector('[data-code={cell}] .verdict').textContent)"
    )
    found: list[str] = tab.evaluate(
        "((v) => [v.className.split(' ').pop(), v.textContent])"
        f"(document.querySelector('[data-code={cell}] .verdict'))"
    )
    return found


def test_every_figure_is_drawn_without_overlapping_labels(tab: Tab) -> None:
    names = figures(tab)
    assert len(names) >= 32
    for name in names:
        selector = show(tab, name)
        tab.wait(f"[...document.querySelectorAll('{selector} canvas')].every((canvas) => {COLORS} > 4)")
        canvases = tab.evaluate(
            f"[...document.querySelectorAll('{selector} canvas')].map((canvas) => canvas.dataset.labels)"
        )
        assert canvases, name
        for labels in canvases:
            for a, b in combinations(json.loads(labels), 2):
                apart_x = a["x"] >= b["x"] + b["width"] or b["x"] >= a["x"] + a["width"]
                assert apart_x or a["y"] >= b["y"] + b["height"] or b["y"] >= a["y"] + a["height"], name


def test_sliders_change_their_figures(tab: Tab) -> None:
    for name in figures(tab):
        selector = show(tab, name)
        count = tab.evaluate(f"document.querySelectorAll('{selector} input[type=range]').length")
        for i in range(min(count, 3)):
            changed = tab.evaluate(
                f"""(async () => {{
                  const host = document.querySelector('{selector}');
                  const next = (done) => requestAnimationFrame(() => requestAnimationFrame(done));
                  const frame = () => new Promise(next);
                  const canvases = [...host.querySelectorAll('canvas')];
                  const look = () => canvases.map((each) => each.toDataURL()).join() + host.textContent;
                  const input = host.querySelectorAll('input[type=range]')[{i}];
                  const before = look(), value = input.value;
                  input.value = 2 * input.value > Number(input.min) + Number(input.max) ? input.min : input.max;
                  input.dispatchEvent(new Event('input'));
                  await frame();
                  const after = look();
                  input.value = value;
                  input.dispatchEvent(new Event('input'));
                  await frame();
                  return before !== after;
                }})()"""
            )
            assert changed, (name, i)
    tab.evaluate("document.getElementById('reset').click()")


def test_arrow_keys_move_the_pixel(tab: Tab) -> None:
    selector = show(tab, "back-project")
    tab.evaluate(f"document.querySelectorAll('{selector} canvas')[1].focus()")
    tab.press("ArrowRight")
    tab.wait(f"document.querySelector('{selector} .readout').textContent.includes('(171, 165, 1)')")
    tab.press("ArrowLeft")
    tab.wait(f"document.querySelector('{selector} .readout').textContent.includes('(170, 165, 1)')")


def test_enter_selects_a_point_that_arrow_keys_move(tab: Tab) -> None:
    selector = show(tab, "project")
    canvas = f"document.querySelectorAll('{selector} canvas')[0]"
    tab.evaluate(f"{canvas}.focus()")
    tab.press("Enter")
    assert "Arrow keys move X" in tab.evaluate(f"{canvas}.getAttribute('aria-label')")
    before = tab.evaluate(f"document.querySelector('{selector} .readout').textContent")
    tab.press("ArrowUp")
    tab.wait(f"document.querySelector('{selector} .readout').textContent !== {json.dumps(before)}")
    tab.press("Enter")
    tab.evaluate("document.getElementById('reset').click()")


def drag(tab: Tab, canvas: str, start: list[float], end: list[float]) -> None:
    """Drags the mouse between two places of a canvas, given as shares of its width and height."""
    left, top, width, height = tab.evaluate(
        f"(({{ left, top, width, height }}) => [left, top, width, height])({canvas}.getBoundingClientRect())"
    )
    first, last = ([left + x * width, top + y * height] for x, y in (start, end))
    tab.mouse("mousePressed", *first, button="left", clickCount=1)
    tab.mouse("mouseMoved", *last, button="left", buttons=1)
    tab.mouse("mouseReleased", *last, button="left", clickCount=1)


def test_dragging_the_image_turns_and_moves_the_camera(tab: Tab) -> None:
    tab.evaluate("document.getElementById('reset').click()")
    selector = show(tab, "matrix")
    canvas = f"document.querySelectorAll('{selector} canvas')[1]"
    output = f"[...document.querySelectorAll('{selector} output')].map((each) => each.textContent)"
    mode = f"document.querySelectorAll('{selector} .modes button')"
    cases = [
        (1, [0.3, 0.2], [0.4, 0.2], {7}, "yaw"),
        (1, [0.97, 0.3], [0.97, 0.5], {5}, "roll"),
        (2, [0.3, 0.2], [0.4, 0.2], {8, 9}, "x and y"),
        (2, [0.96, 0.5], [0.96, 0.3], {8, 9, 10}, "forward"),
    ]
    for button, start, end, least, name in cases:
        tab.evaluate(f"{mode}[{button}].click()")
        before = tab.evaluate(output)
        drag(tab, canvas, start, end)
        tab.wait(
            f"JSON.stringify({output}) !== {json.dumps(json.dumps(before, ensure_ascii=False, separators=(',', ':')))}"
        )
        after = tab.evaluate(output)
        changed = {i for i in range(len(after)) if before[i] != after[i]}
        assert least <= changed <= ({5, 6, 7} if button == 1 else {8, 9, 10}), (name, changed)
    tab.evaluate(f"{mode}[0].click()")
    tab.evaluate("document.getElementById('reset').click()")


def test_sun_behind_the_camera_is_dragged_in_the_image(tab: Tab) -> None:
    selector = show(tab, "lights")
    canvas = f"document.querySelectorAll('{selector} canvas')[1]"
    before = tab.evaluate(f"document.querySelector('{selector} output').textContent")
    start = [243.9 / 320, 20 / 240]  # the marker's position; see test_lecture_figures.py
    drag(tab, canvas, start, [start[0] - 0.1, start[1] + 0.05])
    tab.wait(f"document.querySelector('{selector} output').textContent !== {json.dumps(before)}")
    tab.evaluate("document.getElementById('reset').click()")


def test_table_of_contents_opens_lists_all_chapters_and_closes(tab: Tab) -> None:
    tab.evaluate("document.querySelector('summary').click()")
    count = "document.querySelectorAll('.contents a').length"
    assert tab.evaluate(count) == tab.evaluate("document.querySelectorAll('main > section').length")
    assert tab.evaluate("document.getElementById('menu').open")
    tab.evaluate("document.querySelector('.contents a[href=\"#tree\"]').click()")
    tab.wait("!document.getElementById('menu').open && location.hash === '#tree'")
    tab.evaluate("document.querySelector('summary').click(); document.querySelector('summary').focus()")
    tab.press("Escape")
    tab.wait("!document.getElementById('menu').open")


def test_every_control_is_reached_by_the_keyboard(tab: Tab) -> None:
    assert tab.evaluate(
        "[...document.querySelectorAll('canvas.draggable, button, input, textarea, a')]"
        ".every((each) => each.tabIndex === 0)"
    )
    assert tab.evaluate("document.querySelectorAll('canvas.draggable').length") >= 25


def test_reduced_motion_jumps_to_the_end(tab: Tab) -> None:
    tab.show(1280, 900, motion="reduce")
    selector = show(tab, "plane")
    tab.evaluate(f"[...document.querySelectorAll('{selector} button')][0].click()")
    found = tab.evaluate(
        f"""(async () => {{
          const host = document.querySelector('{selector}');
          const play = [...host.querySelectorAll('button')].find((each) => each.textContent === 'Play');
          play.click();
          await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
          return [play.textContent, host.querySelector('input').value];
        }})()"""
    )
    assert found == ["Play", "600"]
    tab.show(1280, 900)
    tab.evaluate(
        f"[...document.querySelectorAll('{selector} button')].find((each) => each.textContent === 'Back').click()"
    )
    tab.wait(f"Number(document.querySelector('{selector} input').value) < 600")


def test_pointing_at_an_arrow_highlights_all_occurrences_of_its_symbol(tab: Tab) -> None:
    selector = show(tab, "project")
    x, y = tab.evaluate(
        f"""(() => {{
          const canvas = document.querySelector('{selector} canvas'), {{ left, top }} = canvas.getBoundingClientRect();
          const label = JSON.parse(canvas.dataset.labels).find(({{ text }}) => text === 'X');
          return [left + label.x + label.width / 2, top + label.y + label.height / 2];
        }})()"""
    )
    tab.mouse("mouseMoved", x, y)
    tab.wait("[...document.querySelectorAll('.lit')].some((each) => each.tagName === 'VAR')")
    assert tab.evaluate("[...document.querySelectorAll('.lit')].every((each) => each.dataset.symbol === 'X')")
    assert tab.evaluate(f"Boolean(document.querySelector('{selector} .readout .lit'))")
    tab.mouse("mouseMoved", 2, 450)
    tab.wait("document.querySelectorAll('.lit').length === 0")


def test_pointing_at_a_symbol_highlights_all_its_occurrences(tab: Tab) -> None:
    show(tab, "matrix")
    tab.evaluate(
        "document.querySelector('var[data-symbol=K]').dispatchEvent(new Event('pointerover', { bubbles: true }))"
    )
    kinds = tab.evaluate(
        "[...document.querySelectorAll('.lit')].map((each) => each.tagName + each.dataset.symbol)"
    )
    assert {"VARK", "TABLEK"} <= set(kinds)
    assert all(each.endswith("K") for each in kinds)


def test_answers_are_checked_and_mistakes_get_hints(tab: Tab) -> None:
    assert answer(tab, "edges", [3, 1, 0])[0] == "right"
    kind, text = answer(tab, "edges", [-3, -1, 0])
    assert (kind, "from b to a" in text) == ("wrong", True)
    assert answer(tab, "refined", [1280])[0] == "right"
    assert "multiplies" in answer(tab, "refined", [240])[1]
    assert "decimal point" in answer(tab, "edges", ["1,3", 0.8, 0])[1]
    distance = "document.querySelector('[data-exercise=distance] pre').textContent"
    assert "your answer from the chapter" in tab.evaluate(distance)
    assert answer(tab, "normal", [-2, 6, -2])[0] == "right"
    assert "order" in answer(tab, "normal", [2, -6, 2])[1]
    tab.wait(f"{distance}.includes('n = (-2, 6, -2)')")
    stored = tab.evaluate("JSON.parse(localStorage.getItem('raycam-lecture'))")
    assert [stored["edges"], stored["normal"]] == [True, True]


def test_image_of_the_ray_tracer_from_the_code_cells_equals_raycams_in_every_byte(tab: Tab) -> None:
    kind, text = run_cell(tab, "pointForward", "function pointForward(X, C, v) { return sub(X, C); }")
    assert (kind, "backward" in text) == ("wrong", True)
    kind, text = run_cell(tab, "normal", "function normal(a, b, c) { return cross(sub(b, a), sub(c, a)); }")
    assert (kind, "order" in text) == ("wrong", True)
    kind, text = run_cell(tab, "normal", "function normal(a, b, c) {\n  return oops;\n}")
    assert (kind, "oops" in text) == ("wrong", True)
    for cell, code in SOLUTIONS.items():
        kind, text = run_cell(tab, cell, code)
        if cell == "closest":
            tab.wait(
                "document.querySelector('[data-code=closest] .verdict').textContent.match(/bytes|Case|line/)"
            )
            kind, text = tab.evaluate(
                "((v) => [v.className.split(' ').pop(), v.textContent])"
                "(document.querySelector('[data-code=closest] .verdict'))"
            )
        assert kind == "right", (cell, text)
    assert "230400" in text


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_page_fits_a_phone(tab: Tab, scheme: str) -> None:
    tab.show(390, 800, scheme)
    for name in figures(tab):
        show(tab, name)
        assert tab.evaluate("document.documentElement.scrollWidth <= document.documentElement.clientWidth"), (
            name
        )
    tab.show(1280, 900)
