"""The layout of the live view in Chromium.

Tree, properties, axes, palette, phones, and transferred bytes are checked.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import pytest
import raycam
from raycam.viewer.session import Session
from raycam.viewer.viewer import Viewer
from support.chromium import Tab
from support.patience import until
from support.session_messages import receive
from support.viewer_page import place_of

SAMPLES = 4


def model() -> raycam.World:
    world = raycam.World()
    world.add_object(box={"size": 1}, color="#c83c28", name="box")
    world.add_object(sphere={"radius": 0.4}, location=[0.9, -0.6, -0.1], name="ball")
    return world


@pytest.fixture
def viewer() -> Iterator[Viewer]:
    with Viewer(model(), port=0, integrator="direct", samples=SAMPLES) as made:
        yield made


def session_of(viewer: Viewer, tab: Tab) -> Session:
    assert viewer._server is not None
    tab.evaluate("sessionStorage.clear()") if tab.evaluate("location.protocol") == "http:" else None
    tab.open(viewer.url)
    (session,) = viewer._server.sessions.values()
    return session


def choose_light(tab: Tab, session: Session, light: str) -> None:
    tab.evaluate(
        f"(() => {{ const field = document.getElementById('look-light'); field.value = '{light}';"
        " field.dispatchEvent(new Event('change')); })()"
    )
    until(lambda: session.view.look.light == light)


def mean_of(session: Session) -> float:
    """The mean brightness of the shown world's first object."""
    view = session.view
    frame = raycam.render(
        view.lit,
        view.camera.resized((60, 40)),
        channels=["color", "instance"],
        integrator="direct",
        samples=16,
    )
    return float(frame["color"][frame["instance"] == 0].mean())


BOXES_OVER_IMAGE = """(() => {
  const stage = document.getElementById("stage").getBoundingClientRect();
  return [...document.querySelectorAll("#tools, #sides, #up-axis")].map((each) => each.getBoundingClientRect())
    .filter(({ width }) => width).map(({ left, top, right, bottom }) =>
      [left - stage.left, top - stage.top, right - stage.left, bottom - stage.top].map(Math.round));
})()"""


def space_of(tab: Tab) -> tuple[int, int]:
    """The size of the space for the image, CSS pixels."""
    width, height = tab.evaluate(
        "(({width, height}) => [width, height])(document.getElementById('picture').getBoundingClientRect())"
    )
    return round(width), round(height)


def click(tab: Tab, selector: str) -> None:
    """Clicks an element once it is enabled."""
    tab.wait(f"!document.querySelector({selector!r}).disabled")
    tab.evaluate(f"document.querySelector({selector!r}).click()")


def test_image_fills_the_stage_in_device_pixels(tab: Tab, viewer: Viewer) -> None:
    tab.call("Emulation.setDeviceMetricsOverride", width=700, height=500, deviceScaleFactor=2, mobile=False)
    try:
        session = session_of(viewer, tab)
        box = tab.evaluate(
            "(({width, height}) => [width, height])(document.getElementById('picture').getBoundingClientRect())"
        )
        until(lambda: session.view.size == (round(2 * box[0]), round(2 * box[1])))
        width, height = session.view.size
        tab.wait(f"document.getElementById('status-picture').textContent === '{width} x {height}'")
        assert session.view.look.light == "studio"
    finally:
        tab.show(1280, 800)


def test_tree_selects_hides_isolates_and_searches(tab: Tab, viewer: Viewer) -> None:
    session = session_of(viewer, tab)
    tab.wait("document.querySelectorAll('#tree-list li').length === 2")
    click(tab, "#tree-list li:nth-child(2) .row-name")
    until(lambda: session.selection.number == 1 and session.selection.tool == "outline")
    tab.wait("document.querySelector('#tree-list li[aria-current] .row-name').textContent === 'ball'")
    click(tab, "#tree-list li:nth-child(1) .row-eye")
    until(lambda: [each.visible for each in session.view.base.objects] == [False, True])
    tab.wait("document.querySelector('#tree-list li.off')")
    click(tab, "#undo")
    until(lambda: all(each.visible for each in session.view.base.objects))
    tab.wait("!document.querySelector('#tree-list li.off')")
    click(tab, "#tree-list li:nth-child(1) .row-only")
    until(lambda: [each.visible for each in session.view.base.objects] == [True, False])
    tab.wait("document.querySelector('#tree-list li:nth-child(1) .row-only').textContent === 'all'")
    click(tab, "#tree-list li:nth-child(2) .row-only")
    until(lambda: [each.visible for each in session.view.base.objects] == [False, True])
    tab.wait("document.querySelector('#tree-list li:nth-child(2) .row-only').textContent === 'all'")
    click(tab, "#tree-list li:nth-child(2) .row-only")
    until(lambda: [each.visible for each in session.view.base.objects] == [True, True])
    tab.evaluate(
        "(() => { const field = document.getElementById('tree-search'); field.value = 'BAL';"
        " field.dispatchEvent(new Event('input')); })()"
    )
    assert tab.evaluate("document.querySelectorAll('#tree-list li').length") == 1
    assert tab.said == []
    assert tab.evaluate("document.getElementById('message').hidden")


def test_buttons_over_the_image_do_not_cover_the_model(tab: Tab, viewer: Viewer) -> None:
    wide = raycam.World()
    wide.add_object(box={"size": [4, 3, 0.2]})
    session = session_of(viewer, tab)
    try:
        for width, height in ((1280, 800), (900, 760), (390, 844)):
            tab.show(width, height)
            until(lambda: session.view.space == space_of(tab))
            for world in (wide, model()):
                viewer.world = world
                receive(session, {"type": "home", "seq": 1})
                view = session.view
                hits = raycam.render(view.world, view.still_camera, channels=["instance"])["instance"] >= 0
                for left, top, right, bottom in tab.evaluate(BOXES_OVER_IMAGE):
                    assert not hits[max(0, top) : bottom, max(0, left) : right].any()
    finally:
        tab.show(1280, 800)


def test_long_names_use_the_space_of_hidden_buttons(tab: Tab, viewer: Viewer) -> None:
    session_of(viewer, tab)
    tab.wait("document.querySelectorAll('#tree-list li').length === 2")
    width = "document.querySelector('#tree-list li:nth-child(2) .row-name').getBoundingClientRect().width"
    assert tab.evaluate(width) > 0.75 * tab.evaluate("document.getElementById('tree').clientWidth")


def test_group_bar_leads_to_every_group_in_low_windows(tab: Tab, viewer: Viewer) -> None:
    tab.show(1280, 480)
    try:
        session = session_of(viewer, tab)
        until(lambda: session.view.space == space_of(tab))
        size = session.view.size
        tab.wait(f"document.getElementById('status-picture').textContent === '{size[0]} x {size[1]}'")
        hold(tab, size[0] // 2, size[1] // 2, size)
        for name, id in (
            ("Save", "save"),
            ("Light", "look"),
            ("Compare", "compare"),
            ("Pixel", "pixel-title"),
        ):
            tab.evaluate(
                "[...document.querySelectorAll('#groups button')].find((each) => "
                f"each.textContent === '{name}').click()"
            )
            tab.wait(f"document.querySelector('#groups [aria-current]').textContent === '{name}'")
            top, bar, bottom, is_open = tab.evaluate(
                f"(() => {{ const group = document.getElementById('{id}').closest('details'); return ["
                "group.getBoundingClientRect().top, document.getElementById('groups').getBoundingClientRect().bottom,"
                " document.getElementById('panel').getBoundingClientRect().bottom, group.open]; })()"
            )
            assert is_open
            assert bar - 1 <= top < bottom
    finally:
        tab.show(1280, 800)


def test_selection_stays_when_a_camera_is_added(tab: Tab, viewer: Viewer) -> None:
    session = session_of(viewer, tab)
    tab.wait("document.querySelectorAll('#tree-list li').length === 2")
    click(tab, "#tree-list li:nth-child(2) .row-name")
    until(lambda: session.selection.tool == "outline")
    click(tab, "#camera-add")
    tab.wait("document.querySelectorAll('#tree-list li').length === 3")
    tab.wait("document.querySelector('#tree-list li[aria-current] .row-name')?.textContent === 'ball'")
    assert (session.selection.number, session.selection.tool) == (1, "outline")


def test_several_cameras_replace_the_rate_in_the_status_line(tab: Tab, viewer: Viewer) -> None:
    session_of(viewer, tab)
    for count in (1, 2):
        click(tab, "#camera-add")
        tab.wait(f"document.querySelectorAll('#tree-list li').length === {2 + count}")
    click(tab, "#panes-button")
    tab.wait("document.getElementById('status').textContent === '2 cameras'")
    assert tab.evaluate("document.getElementById('status-rate').textContent") == ""
    click(tab, "#panes-button")


def test_saved_files_are_reported(tab: Tab, viewer: Viewer) -> None:
    session_of(viewer, tab)
    click(tab, "#snapshot-glb")
    tab.wait("document.getElementById('message').textContent.includes('.glb')")


def color_of(tab: Tab, selector: str, name: str) -> str:
    return str(tab.evaluate(f"getComputedStyle(document.querySelector({selector!r})).{name}"))


def test_hidden_objects_have_a_visible_button_that_shows_them(tab: Tab, viewer: Viewer) -> None:
    session_of(viewer, tab)
    tab.wait("document.querySelectorAll('#tree-list li').length === 2")
    click(tab, "#tree-list li:nth-child(1) .row-eye")
    tab.wait("document.querySelector('#tree-list li.off')")
    eye, tree = "#tree-list li.off .row-eye", color_of(tab, "#tree", "backgroundColor")
    assert color_of(tab, eye, "color") != tree
    assert color_of(tab, eye, "backgroundColor") == "rgba(0, 0, 0, 0)"


def test_new_light_is_selected_in_tree_and_panel_after_other_edits(tab: Tab, viewer: Viewer) -> None:
    session = session_of(viewer, tab)
    tab.wait("document.querySelectorAll('#tree-list li').length === 2")
    tab.evaluate(
        "(() => { document.querySelector('#tree-list .row-eye').click();"
        " for (const value of ['point', 'spot']) { const field = document.getElementById('light-type');"
        " field.value = value; field.dispatchEvent(new Event('change')); } })()"
    )
    until(lambda: len(session.view.base.lights) == 2)
    tab.wait("document.querySelector('#tree-list li[aria-current] .row-name')?.textContent === 'spot 1'")
    assert tab.evaluate("document.getElementById('light').value") == "1"
    click(tab, "#tree-list li .row-name")
    tab.wait("document.querySelector('#tree-list li[aria-current] .row-name').textContent === 'box'")


def test_depth_has_a_scale_over_the_image_and_color_has_none(tab: Tab, viewer: Viewer) -> None:
    session_of(viewer, tab)
    tab.wait("document.getElementById('scale').hidden")
    for channel, hidden in (("depth", "false"), ("color", "true")):
        tab.evaluate(
            f"(() => {{ const field = document.getElementById('channel'); field.value = '{channel}';"
            " field.dispatchEvent(new Event('change')); })()"
        )
        tab.wait(f"document.getElementById('scale').hidden === {hidden}")
        if channel == "depth":
            tab.wait("document.getElementById('status').textContent.startsWith('ground truth, ')")
            ticks = tab.evaluate(
                "[...document.querySelectorAll('#scale .ticks span')].map((e) => +e.textContent)"
            )
            assert len(ticks) == 5
            assert ticks == sorted(ticks)


def test_presets_axes_and_palette_change_the_view(tab: Tab, viewer: Viewer) -> None:
    session = session_of(viewer, tab)
    click(tab, "#sides button")
    until(lambda: abs(session.view.camera.R[2] @ [0, 1, 0] - 1) < 1e-6)
    tab.evaluate(
        "[...document.querySelectorAll('#axes .end')].find((each) => each.textContent.includes('+z'))"
        ".dispatchEvent(new Event('click'))"
    )
    until(lambda: abs(session.view.camera.R[2] @ [0, 0, -1] - 1) < 1e-6)
    click(tab, "#palette-button")
    tab.wait("document.getElementById('palette').open")
    tab.call("Input.insertText", text="front view")
    for kind in ("keyDown", "keyUp"):
        tab.call("Input.dispatchKeyEvent", type=kind, key="Enter", code="Enter")
    until(lambda: abs(session.view.camera.R[2] @ [0, 1, 0] - 1) < 1e-6)
    assert not tab.evaluate("document.getElementById('palette').open")


def test_look_controls_change_the_light_and_reset_restores_it(tab: Tab, viewer: Viewer) -> None:
    session = session_of(viewer, tab)
    choose_light(tab, session, "sun")
    assert not tab.evaluate("document.getElementById('look-elevation-row').hidden")
    click(tab, "#look-reset")
    until(lambda: session.view.look.light == "studio")
    assert tab.evaluate("document.getElementById('look').open")


def hold(tab: Tab, column: int, row: int, size: tuple[int, int]) -> None:
    """Clicks a pixel, and waits until its values are shown."""
    tab.click(*place_of(tab, column, row, size))
    place = f"column {column}, row {row} (held)"
    tab.wait(f"document.getElementById('pixel-place').textContent === '{place}'")


def test_distance_between_two_pixels_is_measured(tab: Tab, viewer: Viewer) -> None:
    session = session_of(viewer, tab)
    box = "(({width, height}) => [width, height])(document.getElementById('picture').getBoundingClientRect())"
    until(lambda: list(session.view.size) == [round(side) for side in tab.evaluate(box)])
    size = session.view.size
    tab.wait(f"document.getElementById('status-picture').textContent === '{size[0]} x {size[1]}'")
    truth = raycam.render(session.view.world, session.view.still_camera, channels=["position", "instance"])
    rows, columns = (truth["instance"] >= 0).nonzero()
    held, first, second = (
        (int(columns[i * len(rows) // 4]), int(rows[i * len(rows) // 4])) for i in (1, 2, 3)
    )
    hold(tab, *held, size)
    click(tab, "#measure")
    hold(tab, *first, size)  # the pixel that was held before is not a point of the measurement
    tab.wait("document.getElementById('message').textContent.includes('second')")
    hold(tab, *second, size)
    tab.wait("!document.getElementById('distance').hidden")
    a, b = (truth["position"][v, u] for u, v in (first, second))
    shown = float(tab.evaluate("document.getElementById('distance').textContent").split(": ")[1].split()[0])
    assert shown == pytest.approx(float(((a - b) ** 2).sum() ** 0.5), rel=1e-4)


@pytest.mark.parametrize("width", [770, 830, 1010, 1100])
def test_medium_windows_keep_a_large_image_and_all_buttons(tab: Tab, viewer: Viewer, width: int) -> None:
    tab.show(width, 700)
    try:
        session_of(viewer, tab)
        assert tab.evaluate("picture.getBoundingClientRect().width") > 0.4 * width
        assert tab.evaluate("document.documentElement.scrollWidth") <= width
        right = "document.getElementById('save-button').getBoundingClientRect().right"
        assert tab.evaluate(right) <= width
        assert tab.evaluate("document.querySelector('header').getBoundingClientRect().height") < 60
        assert "Wheel" in tab.evaluate("document.getElementById('hint').innerText")
    finally:
        tab.show(1280, 800)


def test_phones_show_the_image_first_and_panels_as_sheets(tab: Tab, viewer: Viewer) -> None:
    tab.show(390, 780)
    try:
        session_of(viewer, tab)
        height = "document.getElementById('picture').getBoundingClientRect().height"
        assert tab.evaluate(height) > 0.75 * 780
        assert tab.evaluate("getComputedStyle(document.getElementById('panel')).display") == "none"
        click(tab, "#panel-button")
        assert tab.evaluate("document.getElementById('panel').getBoundingClientRect().height") < 0.6 * 780
        assert tab.evaluate(height) > 0.75 * 780
        assert tab.evaluate("document.documentElement.scrollWidth") <= 390
    finally:
        tab.show(1280, 800)


def test_panels_return_when_a_narrow_window_is_widened(tab: Tab, viewer: Viewer) -> None:
    def shown() -> list[bool]:
        widths = (
            "['tree', 'panel'].map((id) => document.getElementById(id).getBoundingClientRect().width > 0)"
        )
        return list(tab.evaluate(widths))

    try:
        tab.show(390, 780)
        session_of(viewer, tab)
        until(lambda: shown() == [False, False])
        for width, expected in ((900, [False, True]), (1280, [True, True]), (600, [False, False])):
            tab.show(width, 780)
            until(lambda expected=expected: shown() == expected, f"{width} pixels: {shown()}")
        tab.show(1280, 780)
        until(lambda: shown() == [True, True])
        click(tab, "#panel-button")  # a panel that the user has closed stays closed
        tab.show(600, 780)
        until(lambda: shown() == [False, False])
        tab.show(1280, 780)
        until(lambda: shown() == [True, False])
        assert (
            tab.evaluate("document.getElementById('panel-button').getAttribute('aria-expanded')") == "false"
        )
    finally:
        tab.show(1280, 800)


def test_light_that_is_added_to_the_worlds_lights_lowers_the_exposure(tab: Tab) -> None:
    world = model()
    world.add_light(type="sun", direction=[-1, 1, -2], irradiance=2.6)
    world.add_light(type="sky", radiance=0.4)
    with Viewer(world, port=0, integrator="direct", samples=SAMPLES) as lit:
        session = session_of(lit, tab)
        tab.wait("document.querySelectorAll('#tree-list li').length === 4")

        def choose(light: str) -> float:
            """Chooses a light; returns the mean of the displayed radiance."""
            choose_light(tab, session, light)
            shown = (
                f"{session.view.exposure:+.4g}"
                if session.view.exposure > 0
                else f"{session.view.exposure:.4g}"
            )
            tab.wait(f"document.getElementById('exposure-text').textContent === '{shown} stops'")
            return mean_of(session) * 2**session.view.exposure

        before = choose("own")
        assert choose("sun") == pytest.approx(before, rel=0.3)
        assert session.view.exposure < -0.7
        click(tab, "#undo")
        until(lambda: session.view.look.light == "own")
        assert session.view.exposure == 0
        tab.wait("document.getElementById('exposure-text').textContent === '0 stops'")
        choose("sky")
        choose("own")
        assert session.view.exposure == 0


def test_colors_are_sent_as_images_until_numbers_are_read(tab: Tab, viewer: Viewer) -> None:
    session = session_of(viewer, tab)
    tab.wait(f"document.getElementById('status').textContent.includes('{SAMPLES} samples')")
    assert not session.connection.wants_planes
    click(tab, "#take-b")
    until(lambda: session.connection.wants_planes)
    tab.wait("!document.getElementById('compare-mode').disabled")
    tab.wait("!document.getElementById('difference').hidden")
    # Numbers of an earlier image are hidden at the first image that is not exact.
    tab.evaluate(
        "new MutationObserver((all, observer) => { globalThis.wasHidden = true; }).observe("
        "document.getElementById('difference'), { attributes: true, attributeFilter: ['hidden'] })"
    )
    tab.evaluate(
        "[...document.querySelectorAll('button')].find((each) => each.textContent === 'Top').click()"
    )
    tab.wait("globalThis.wasHidden")


def test_controls_of_a_script_are_shown_and_used(tab: Tab, viewer: Viewer) -> None:
    session_of(viewer, tab)
    assert tab.evaluate("document.getElementById('script').hidden")
    slider = viewer.add_slider("speed", min=0, max=10, value=3)
    viewer.add_folder("more").add_plot("error", [0, 1, 2], [1, 4, 2])
    tab.wait("document.querySelector('#script-controls .plot polyline')")
    assert tab.evaluate("document.querySelector('#script-controls input').value") == "3"
    tab.evaluate(
        "(() => { const field = document.querySelector('#script-controls input'); field.value = '7';"
        " field.dispatchEvent(new Event('input')); })()"
    )
    until(lambda: slider.value == 7)
    slider.value = 2
    tab.wait("document.querySelector('#script-controls output').textContent === '2'")


def test_slider_shows_a_value_that_is_between_two_steps(tab: Tab, viewer: Viewer) -> None:
    session_of(viewer, tab)
    viewer.add_slider("angle", min=-math.pi, max=math.pi, step=0.001, value=0)
    tab.wait("document.querySelector('#script-controls output')?.textContent")
    assert tab.evaluate("document.querySelector('#script-controls output').textContent") == "0"


CONTROLS = """(() => {
  const all = [...document.querySelectorAll("button, select, input, summary, [tabindex='0']")].filter((each) =>
    !each.disabled && each.tabIndex >= 0 && each.checkVisibility() && !each.closest("dialog:not([open])"));
  all.forEach((each, i) => (each.dataset.order = i));
  document.activeElement.blur();
  return all.map((each) => each.id || each.getAttribute("aria-label") || each.textContent);
})()"""


@pytest.mark.proof
def test_tab_key_reaches_every_control(tab: Tab, viewer: Viewer) -> None:
    session_of(viewer, tab)
    tab.wait("document.querySelectorAll('#tree-list li').length === 2")
    names = tab.evaluate(CONTROLS)
    reached = set()
    for _ in range(len(names) + 5):
        for kind in ("keyDown", "keyUp"):
            tab.call("Input.dispatchKeyEvent", type=kind, key="Tab", code="Tab", windowsVirtualKeyCode=9)
        order = tab.evaluate("document.activeElement?.dataset.order ?? null")
        reached.add(None if order is None else int(order))
    assert len(names) > 60
    assert [name for i, name in enumerate(names) if i not in reached] == []


def test_edits_keep_the_light_until_the_list_of_lights_changes_it(tab: Tab, viewer: Viewer) -> None:
    session = session_of(viewer, tab)
    tab.wait("document.querySelectorAll('#tree-list li').length === 2")
    before, studio = mean_of(session), session.view.look
    tab.evaluate(
        "(() => { const field = document.getElementById('object-emission'); field.value = '0.001';"
        " field.dispatchEvent(new Event('change')); })()"
    )
    until(lambda: session.view.opened.edits.about()["undo"] == 1)
    assert session.view.look is studio
    assert mean_of(session) == pytest.approx(before, rel=0.05)
    world = model()
    world.add_light(type="point", position=[2, -3, 4], power=300)
    world.add_camera(world.default_camera(), "camera")
    with Viewer(world, port=0, integrator="direct", samples=SAMPLES) as lit:
        session = session_of(lit, tab)
        tab.wait("document.querySelectorAll('#tree-list li').length === 4")
        assert mean_of(session) > 0.01
        click(tab, "#light-remove")
        until(lambda: not session.view.base.lights)
        until(lambda: mean_of(session) == 0)  # dark, without the renderer's default lights
        assert (
            tab.evaluate("document.getElementById('look-light').selectedOptions[0].textContent")
            == "as in the file"
        )
        choose_light(tab, session, "default")
        assert mean_of(session) > 0.01
