"""Examples of scripted views run, and have the effects described in their docstrings.

A client of the view observes the effects.
"""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from support.patience import PATIENCE, until
from support.viewer_client import Client
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

FOLDER = Path(__file__).resolve().parents[2] / "examples" / "view"
EXAMPLES = {path.stem: path for path in sorted(FOLDER.glob("*.py"))}


class Talk:
    """A client of an example, the view's controls by label, and the example's folder."""

    def __init__(self, client: Client, folder: Path) -> None:
        self.client, self.folder = client, folder
        self.controls: dict[str, dict[str, Any]] = {}
        self.refresh()

    def refresh(self) -> None:
        found = self.client.hear("controls")[0]["controls"]
        self.controls = {each["label"]: each for each in found}

    def set(self, label: str, value: Any) -> None:
        while label not in self.controls:  # the script is still adding its controls
            self.refresh()
        self.client.say("control", id=self.controls[label]["id"], value=value)

    def wait(self, label: str, condition: Callable[[dict[str, Any]], bool]) -> None:
        while label not in self.controls or not condition(self.controls[label]):
            self.refresh()


def turn(talk: Talk) -> None:
    talk.client.hear("picture", moving=False)
    talk.set("angle", 45)
    talk.client.hear("selected")


def count(talk: Talk) -> None:
    for _ in range(3):
        talk.set("click", 0)
    talk.wait("clicks", lambda each: each["value"] == "3")


def hide(talk: Talk) -> None:
    talk.set("show the ball", False)
    while [each["visible"] for each in talk.client.hear("contents")[0]["objects"]] != [True, False]:
        pass


def pick(talk: Talk) -> None:
    if not talk.client.image:
        talk.client.hear("picture")
    talk.client.say("pick", u=24, v=16)
    talk.wait("picked", lambda each: each["value"].startswith(("box, ", "floor, ")))


def plot(talk: Talk) -> None:
    talk.set("measure", 0)
    talk.wait(
        "error over log2(samples)", lambda each: len(each["y"]) == 6 and each["y"][0] > each["y"][5] > 0
    )


def update(talk: Talk) -> None:
    before = talk.controls["depth"]["image"]
    talk.set("update", 0)
    talk.wait("depth", lambda each: each["image"] != before)


def lengthen(talk: Talk) -> None:
    talk.set("turns", 5)
    while "start" not in {each["name"] for each in talk.client.hear("overlay")[0]["overlay"]}:
        pass


def tour(talk: Talk) -> None:
    talk.set("top", 0)
    while abs(talk.client.hear("camera")[0]["R"][8] + 1) > 1e-6:  # waits until the camera looks down
        pass


def finish(talk: Talk) -> None:
    talk.set("measure", 0)
    talk.wait("state", lambda each: each["value"] == "finished")


def save(talk: Talk) -> None:
    talk.set("save the page", 0)
    talk.wait("saved", lambda each: each["value"] == "shot.html")
    assert "ball" in (talk.folder / "shot.html").read_text(encoding="utf-8")


def record(talk: Talk) -> None:
    talk.set("record", True)
    talk.wait("record", lambda each: each["value"] is True)
    talk.set("record", False)
    talk.wait("saved", lambda each: each["value"] == "tour.html")
    assert 'id="image-0"' in (talk.folder / "tour.html").read_text(encoding="utf-8")


DEEDS = {
    "01_slider": turn,
    "02_button": count,
    "03_checkbox": hide,
    "04_pick": pick,
    "05_plot": plot,
    "06_image": update,
    "07_labels_and_lines": lengthen,
    "08_camera_tour": tour,
    "09_asyncio": finish,
    "10_save_a_page": save,
    "11_recording": record,
}


@pytest.fixture(scope="module")
def running(
    tmp_path_factory: pytest.TempPathFactory,
) -> Iterator[dict[str, tuple[subprocess.Popen[str], Path]]]:
    """All examples, started together: most of their time is the start of Python."""
    started = {}
    for name, path in EXAMPLES.items():
        folder = tmp_path_factory.mktemp(name)
        process = subprocess.Popen(
            [sys.executable, "-W", "error", str(path)],
            cwd=folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        started[name] = (process, folder)
    yield started
    for process, _ in started.values():
        process.kill()
        process.communicate()


@pytest.mark.parametrize("name", DEEDS)
def test_view_example_has_the_effects_in_its_docstring(
    running: dict[str, tuple[subprocess.Popen[str], Path]], name: str
) -> None:
    process, folder = running[name]
    assert process.stderr is not None
    line = process.stderr.readline()
    assert "http" in line, line + process.communicate()[1]
    address = urlsplit(line.split()[-1])
    token = address.fragment.removeprefix("t=")
    with connect(
        f"ws://{address.netloc}/socket",
        origin=Origin(f"http://{address.netloc}"),
        subprotocols=[Subprotocol("raycam.view.1"), Subprotocol(f"token.{token}")],
        compression=None,
        max_size=None,
        proxy=None,
    ) as socket:
        DEEDS[name](Talk(Client(socket), folder))
    until(lambda: process.poll() is not None, "the example ends after its last viewer")
    _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, errors
    assert errors == ""


def test_every_view_example_is_short_and_has_a_check() -> None:
    assert DEEDS.keys() == EXAMPLES.keys()
    for path in EXAMPLES.values():
        text = path.read_text(encoding="utf-8")
        assert text.count("\n") < 40
        assert ast.get_docstring(ast.parse(text))
