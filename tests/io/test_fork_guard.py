"""A fork waits while another thread builds a world, and the child process can render."""

from __future__ import annotations

import os
import signal
import threading
import time

import numpy as np
import pytest
import raycam
from raycam.io.fork_guard import no_fork

pytestmark = [
    pytest.mark.skipif(not hasattr(os, "fork"), reason="this system cannot fork processes"),
    pytest.mark.filterwarnings("ignore:.*multi-threaded.*:DeprecationWarning"),
]
CAMERA = raycam.Camera.look_at([0, 0, 3], [0, 0, 0], [0, 1, 0], size=(16, 12), fov=40)


def ended_well(child: int) -> bool:
    """True if the child exits with 0; the child kills itself after a timeout."""
    _, status = os.waitpid(child, 0)
    return os.waitstatus_to_exitcode(status) == 0


@pytest.mark.parametrize("pause", [0.0, 0.02, 0.1])
def test_process_forked_while_building_a_world_renders(pause: float) -> None:
    rng = np.random.default_rng(4)
    corners = rng.uniform(-1, 1, (150_000, 3))
    world = raycam.World()
    world.add_mesh(corners, rng.integers(0, len(corners), (300_000, 3)))
    builder = threading.Thread(target=world.prepare)
    builder.start()
    time.sleep(pause)
    child = os.fork()
    if child == 0:
        signal.alarm(300)
        ok = raycam.render(world, CAMERA, samples=1, integrator="flat")["color"].any()
        os._exit(0 if ok else 1)
    builder.join()
    assert ended_well(child)


def test_thread_that_holds_the_guard_may_fork() -> None:
    with no_fork():
        child = os.fork()
        if child == 0:
            os._exit(0)
    assert ended_well(child)


def test_fork_waits_for_other_threads() -> None:
    entered, left = threading.Event(), threading.Event()
    order: list[str] = []

    def build() -> None:
        with no_fork():
            entered.set()
            left.wait(0.3)
            order.append("built")

    builder = threading.Thread(target=build)
    builder.start()
    entered.wait()
    child = os.fork()
    if child == 0:
        with no_fork():  # the child's guard is not held by any thread
            os._exit(0)
    order.append("forked")
    builder.join()
    assert ended_well(child)
    assert order == ["built", "forked"]
