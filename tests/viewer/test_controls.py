"""Controls of a script in the live view, driven by client messages."""

from __future__ import annotations

import asyncio
import gc
import json
import threading
import weakref
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.viewer.controls import Control, Controls
from raycam.viewer.session import Session
from raycam.viewer.viewer import Viewer
from support.patience import until
from support.raises import raises
from support.session_messages import receive


@pytest.fixture
def viewer(small_world: raycam.World) -> Any:
    with Viewer(small_world, small_world.camera("front"), port=0) as made:
        yield made


def test_control_values_of_clients_call_the_callbacks(viewer: Viewer) -> None:
    slider = viewer.add_slider("speed", min=1, max=5, value=2)
    box = viewer.add_checkbox("on")
    button = viewer.add_button("go")
    text = viewer.add_text("name", "a")
    called: list[tuple[str, Any]] = []
    for control in (slider, box, button, text):
        control.on_change(lambda each: called.append((each.label, each.value)))
    session = viewer._session()
    for control, value in ((slider, 3.5), (box, True), (button, True), (text, "b")):
        receive(session, {"type": "control", "id": control.number, "value": value})
    until(lambda: len(called) == 4)
    assert called == [("speed", 3.5), ("on", True), ("go", 1), ("name", "b")]
    assert [each["value"] for each in session.controls.message()["controls"]] == [3.5, True, 1, "b"]


def test_numpy_scalars_are_accepted_as_python_values(viewer: Viewer) -> None:
    slider = viewer.add_slider("speed", min=np.float32(1), max=5, value=np.int64(2))
    box = viewer.add_checkbox("on", np.bool_(True))
    assert (type(slider.value), type(box.value)) == (int, bool)
    slider.value = np.float32(2.5)
    json.dumps(viewer.controls.message())
    assert slider.value == 2.5


@pytest.mark.parametrize("value", [0.5, 6, True, "x"])
def test_values_out_of_range_are_refused(viewer: Viewer, value: Any) -> None:
    slider = viewer.add_slider("speed", min=1, max=5, value=2)
    with raises(raycam.SettingsError, mentions=["speed"]):
        receive(viewer._session(), {"type": "control", "id": slider.number, "value": value})
    assert slider.value == 2


def test_removed_and_fixed_controls_are_refused(viewer: Viewer) -> None:
    text = viewer.add_text("state", "a", editable=False)
    with raises(raycam.SettingsError, code="conflicting_values"):
        receive(viewer._session(), {"type": "control", "id": text.number, "value": "b"})
    text.value = "c"
    text.remove()
    with raises(raycam.SettingsError, code="unknown_name"):
        receive(viewer._session(), {"type": "control", "id": text.number, "value": "b"})
    assert viewer.controls.message()["controls"] == []


def test_error_of_a_callback_is_shown_and_the_next_callback_called(
    viewer: Viewer, capsys: pytest.CaptureFixture[str]
) -> None:
    button = viewer.add_button("go")

    @button.on_click
    def fail(control: Control) -> None:
        raise ValueError("broken")

    session = viewer._session()
    told: list[dict[str, Any]] = []
    session.connection.open(lambda message, buffers: told.append(message))
    for _ in range(2):
        receive(session, {"type": "control", "id": button.number, "value": True})
    until(lambda: sum(each["type"] == "error" for each in told) == 2)
    assert "broken" in next(each["text"] for each in told if each["type"] == "error")
    assert "broken" in capsys.readouterr().err


def test_error_of_a_pick_callback_is_shown(viewer: Viewer, capsys: pytest.CaptureFixture[str]) -> None:
    @viewer.on_pick
    def fail(picked: dict[str, Any]) -> None:
        raise ValueError("broken")

    session = viewer._session()
    told: list[dict[str, Any]] = []
    session.connection.open(lambda message, buffers: told.append(message))
    image = session.images.sent.add(session.view, session.images.version)
    receive(session, {"type": "pick", "image": image, "u": 1, "v": 1})
    until(lambda: any(each["type"] == "error" and "broken" in each["text"] for each in told))
    assert "broken" in capsys.readouterr().err


def test_world_changed_in_place_is_shown_when_it_is_set_again(small_world: raycam.World) -> None:
    world = small_world.copy()
    with Viewer(world, small_world.camera("front"), port=0) as viewer:
        session = viewer._session()
        before = session.view.world.to_bytes()
        world.set_object("box", visible=False)
        assert session.view.world.to_bytes() == before
        viewer.world = world
        assert not session.view.world.objects[0].visible
        viewer.world.set_object("box", visible=True)  # the property is a copy
        assert not session.view.world.objects[0].visible
        receive(session, {"type": "undo"})
        assert session.view.world.objects[0].visible


def test_controls_change_while_clients_connect(viewer: Viewer) -> None:
    slider = viewer.add_slider("speed", max=1000)
    errors: list[Exception] = []

    def drive() -> None:
        try:
            for value in range(300):
                slider.value = value
        except RuntimeError as error:
            errors.append(error)

    threads = [threading.Thread(target=drive) for _ in range(2)]
    for each in threads:
        each.start()
    sessions = [viewer._session() for _ in range(30)]
    for each in threads:
        each.join()
    assert errors == []
    assert [each["value"] for each in sessions[-1].controls.message()["controls"]] == [299]


def test_coroutines_run_in_the_loop_that_registered_them(viewer: Viewer) -> None:
    button = viewer.add_button("go")
    session = viewer._session()

    async def main() -> int:
        called = asyncio.Event()
        threads: list[int] = []

        @button.on_click
        async def click(control: Control) -> None:
            threads.append(threading.get_ident())
            called.set()

        receive(session, {"type": "control", "id": button.number, "value": True})
        await asyncio.wait_for(called.wait(), 20)
        return threads[0]

    assert asyncio.run(main()) == threading.get_ident()


def test_controls_message_contains_folders_images_and_plots(viewer: Viewer) -> None:
    folder = viewer.add_folder("plots")
    plot = folder.add_plot("error", [0, 1, 2], [3, 4, 5])
    folder.add_image("photo", np.zeros((4, 6, 3), np.uint8))
    plot.update(x=[0, 1], y=[1, 1])
    described = viewer.controls.message()["controls"]
    assert [(each["kind"], each["folder"]) for each in described] == [("plot", "plots"), ("image", "plots")]
    assert described[0]["y"] == [1, 1]
    assert described[1]["image"].startswith("data:image/jpeg;base64,")
    for wrong in (np.zeros((4, 6)), np.zeros((4, 6, 3))):
        with raises(raycam.SettingsError, code="wrong_shape", mentions=["image"]):
            viewer.add_image("photo", wrong)
    with raises(raycam.SettingsError, code="wrong_shape", mentions=["plot"]):
        viewer.add_plot("error", [0, np.nan], [1, 2])


def test_labels_and_lines_are_drawn_at_their_pixels(small_world: raycam.World) -> None:
    controls = Controls()
    camera = small_world.camera("front")
    session = Session(small_world, camera, controls=controls)
    controls.add_label("here", [0.5, 0.5, 0.5], color="#ff0000")
    controls.add_lines([[0, 0, 0.5], [0.5, 0, 0.5]])
    label, line = session.overlay(session.view)
    pixels, _ = session.view.still_camera.project(np.array([[0.5, 0.5, 0.5], [0.5, 0, 0.5]]))
    corner = session.view.still_camera.corner
    assert (label["name"], label["color"]) == ("here", "#ff0000")
    assert np.allclose(label["lines"][0][0], pixels[0] - corner, atol=0.06)
    assert np.allclose(line["lines"][-1][-1], pixels[1] - corner, atol=0.06)
    with raises(raycam.SettingsError, code="invalid_value", mentions=["color"]):
        controls.add_lines([[0, 0, 0], [1, 0, 0]], color="red; }")


def test_script_sets_the_camera_and_takes_screenshots(viewer: Viewer, small_world: raycam.World) -> None:
    viewer.camera = small_world.camera("side")
    assert viewer.camera == small_world.camera("side")
    frame = viewer.screenshot((24, 16), samples=2)
    expected = raycam.render(small_world, small_world.camera("side").resized((24, 16)), samples=2)
    assert np.array_equal(frame["color"], expected["color"])


def test_view_in_a_cell_is_released_with_its_output(small_world: raycam.World) -> None:
    pytest.importorskip("anywidget")
    viewer = raycam.view(small_world, cell=True)
    viewer._repr_mimebundle_()
    found, views = weakref.ref(viewer), viewer._widget.views
    hello = '{"type": "hello", "width": 64, "height": 48, "ratio": 1, "session": ""}'
    views.hear({"view": "a", "said": hello})
    assert views.scheduler is not None
    del viewer
    gc.collect()
    assert found() is not None  # the viewer is kept, because its output still exists
    views.hear({"view": "a", "said": None})
    assert views.scheduler is None
    gc.collect()
    assert found() is None
