"""The controls of the look in Chromium: light, ground, background, framing, and reset buttons of fields."""

from __future__ import annotations

import math
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
import raycam
from PIL import Image
from raycam.viewer.session import Session
from raycam.viewer.viewer import Viewer
from support.chromium import Tab
from support.patience import until

SKY = Path(raycam.__file__).parent / "assets" / "sky.hdr"


@pytest.fixture
def viewer() -> Iterator[Viewer]:
    world = raycam.World()
    world.add_object(box={"size": 1}, color="#c83c28", name="box")
    with Viewer(world, port=0, integrator="direct", samples=4) as made:
        yield made


@pytest.fixture
def session(viewer: Viewer, tab: Tab) -> Session:
    tab.show(1280, 800)
    tab.open(viewer.url)
    assert viewer._server is not None
    (found,) = viewer._server.sessions.values()
    return found


def choose(tab: Tab, field: str, value: object) -> None:
    """Enters a value into a field, as a user does."""
    tab.evaluate(
        f"(() => {{ const field = document.getElementById('{field}'); field.value = '{value}';"
        " for (const type of ['input', 'change']) field.dispatchEvent(new Event(type, { bubbles: true })); })()"
    )


def is_shown(tab: Tab, selector: str) -> bool:
    return bool(tab.evaluate(f'document.querySelector("{selector}")?.offsetParent != null'))


def test_colored_floor_and_background_have_fields_and_reset_restores_the_look(
    tab: Tab, session: Session
) -> None:
    first = session.view.look
    assert not is_shown(tab, "#look-ground-color")
    assert not is_shown(tab, "#look-background")
    assert not is_shown(tab, "#look-reset")
    steps = {"look-ground": "color", "look-ground-color": "#208040"}
    steps |= {"look-backdrop": "color", "look-background": "#336699"}
    for field, value in steps.items():
        before = session.view.look
        choose(tab, field, value)
        until(lambda before=before: session.view.look is not before)
        tab.wait(f"document.getElementById('{field}').value === '{value}'")
    until(lambda: (session.view.look.ground, session.view.look.background) == ("#208040", "#336699"))
    assert is_shown(tab, "#look-ground-color")
    tab.wait("!document.getElementById('look-reset').hidden")
    tab.evaluate("document.getElementById('look-reset').click()")
    until(lambda: session.view.look.equals(first))
    tab.wait("document.getElementById('look-reset').hidden")
    assert tab.evaluate("document.getElementById('look-ground').value") == "auto"


def test_dropped_environment_image_lights_the_world(tab: Tab, session: Session, tmp_path: Path) -> None:
    shutil.copy(SKY, tmp_path / "evening.hdr")
    tab.drop(500, 400, [tmp_path / "evening.hdr"])
    until(lambda: session.view.look.light == "sky")
    tab.wait("document.getElementById('look-image-name').textContent === 'evening.hdr'")
    assert tab.evaluate("document.getElementById('look-light').value") == "sky"


def test_chosen_background_image_is_named_and_undo_removes_it(
    tab: Tab, session: Session, tmp_path: Path
) -> None:
    Image.new("RGB", (40, 30), (20, 60, 220)).save(tmp_path / "blue.png")
    tab.call("DOM.enable")
    root = tab.call("DOM.getDocument")["root"]["nodeId"]
    selector = "[aria-label='Image file of the background']"
    (node,) = tab.call("DOM.querySelectorAll", nodeId=root, selector=selector)["nodeIds"]
    tab.call("DOM.setFileInputFiles", nodeId=node, files=[str(tmp_path / "blue.png")])
    until(lambda: session.view.look.has_background_image)
    tab.wait("document.getElementById('look-background-name').textContent === 'blue.png'")
    tab.evaluate("document.getElementById('undo').click()")
    until(lambda: not session.view.look.has_background_image)


def test_field_of_view_and_zoom_frame_the_world(tab: Tab, session: Session) -> None:
    choose(tab, "framing-fov", 20)
    until(
        lambda: math.isclose(
            session.view.camera.K[1, 1], session.view.camera.size[1] / 2 / math.tan(math.radians(10))
        )
    )
    before = session.view.camera
    choose(tab, "framing-zoom", 0.5)
    until(lambda: session.view.camera != before)
    middle = session.view.bounds.mean(axis=0)
    distances = [math.dist(camera.location, middle) for camera in (before, session.view.camera)]
    assert distances[1] == pytest.approx(2 * distances[0], rel=0.2)


def test_changed_field_of_an_object_has_a_reset_button(tab: Tab, session: Session) -> None:
    tab.wait("document.getElementById('object-roughness')?.offsetParent != null")
    first = float(tab.evaluate("document.getElementById('object-roughness').value"))
    button = "#object-roughness ~ .undo-field, label:has(#object-roughness) .undo-field"
    assert not is_shown(tab, button)
    choose(tab, "object-roughness", 0.25)
    tab.wait(f'document.querySelector("{button}")?.offsetParent != null')
    tab.evaluate(f'document.querySelector("{button}").click()')
    tab.wait(f"Number(document.getElementById('object-roughness').value) === {first}")
    tab.wait(f'document.querySelector("{button}")?.offsetParent == null')


@pytest.mark.parametrize("width", [390, 768, 1024, 1280])
def test_hint_stays_within_the_image_area(tab: Tab, session: Session, width: int) -> None:
    tab.show(width, 800)
    tab.wait(
        "document.getElementById('hint')?.offsetParent != null || document.getElementById('hint')?.hidden"
    )
    inside = (
        "(() => { const [hint, stage] = ['hint', 'stage'].map((id) => document.getElementById(id)"
        ".getBoundingClientRect()); return !hint.width || (hint.left >= stage.left && hint.right <= stage.right); })()"
    )
    tab.wait(inside)
