"""A small world, and a server that shows it to clients."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import raycam
from raycam.viewer.server import Server
from raycam.viewer.session import Session
from support.chromium import Tab, chromium
from support.time_limit import time_limit
from support.viewer_client import Client
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin, Subprotocol


@pytest.fixture(autouse=True)
def limited_time() -> Iterator[None]:
    with time_limit():
        yield


@pytest.fixture(scope="session")
def small_world() -> raycam.World:
    world = raycam.World()
    world.add_object(box={"size": 1}, color="#c83c28", name="box", category="crate")
    world.add_object(plane={"size": [8, 8]}, location=[0, 0, -0.5], name="floor")
    world.add_light({"type": "sun", "direction": [-1, 1, -2], "irradiance": [3, 3, 3]})
    for name, eye in {"front": [4, -3, 2], "side": [-4, -3, 2]}.items():
        world.add_camera(raycam.Camera.look_at(eye, [0, 0, 0], size=(48, 32), fov=40), name)
    return world


@pytest.fixture(scope="module")
def tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    """A browser tab of 1280 x 800 pixels."""
    with chromium(tmp_path_factory.mktemp("browser")) as made:
        made.show(1280, 800)
        yield made


@pytest.fixture
def server(small_world: raycam.World) -> Iterator[Server]:
    camera = small_world.camera("front")
    made = Server(lambda: Session(small_world, camera, samples=16, title="small"), port=0)
    yield made
    made.close()


@pytest.fixture
def open_socket(server: Server) -> Iterator[Callable[..., ClientConnection]]:
    """Opens a WebSocket as the page does; arguments replace parts of the request."""
    opened = contextlib.ExitStack()

    def open(**changed: Any) -> ClientConnection:
        host, port = server.address
        parts = {
            "uri": f"ws://{host}:{port}/socket",
            "origin": Origin(f"http://{host}:{port}"),
            "subprotocols": [Subprotocol("raycam.view.1"), Subprotocol(f"token.{server.token}")],
            "compression": None,
            "max_size": None,
            "proxy": None,
            **changed,
        }
        return opened.enter_context(connect(**parts))

    with opened:
        yield open


@pytest.fixture
def client(open_socket: Callable[..., ClientConnection]) -> Client:
    return Client(open_socket())
