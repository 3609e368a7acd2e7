"""Failed allocations raise a MemoryError with the requested size, and the process continues."""

from __future__ import annotations

import subprocess
import sys

import pytest

resource = pytest.importorskip("resource")

SETUP = """
import resource, sys, threading
import numpy as np
import raycam
world = raycam.World()
world.add_object(box={"size": 1})
world.add_light(type="sun", direction=[-1, 1, -2], irradiance=2)
def camera(size):
    return raycam.Camera.look_at([3, -4, 2], [0, 0, 0], [0, 0, 1], size=size, fov=40)
raycam.render(world, camera((8, 8)), channels="all")
raycam.flow(world, camera((8, 8)))
large = {NEEDS}
used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + (64 << 20), used + (64 << 20)))
try:
    {CALL}
    print("nothing was raised")
except MemoryError as error:
    print("MemoryError", error)
frame = raycam.render(world, camera((8, 8)))
print("goes on", frame["color"].shape)
"""

CALLS = {
    "picture": (
        "None",
        "raycam.render(world, camera((6000, 4000)), channels=['depth', 'position'])",
        "672000000",
    ),
    "series": (
        "None",
        "raycam.render_many(world, camera((600, 400)), poses={0: np.tile(np.eye(4), (400, 1, 1))})",
        "",
    ),
    "rays": ("np.zeros((900_000, 3))", "world.cast_rays(large, np.ones(3))", "86400000"),
    "flow": ("None", "raycam.flow(world, camera((3000, 2000)))", "156000000"),
    "mesh": (
        "(np.random.default_rng(1).random((300_000, 3)), np.tile(np.arange(300_000), 6).reshape(-1, 3))",
        "world.add_mesh(*large)",
        "",
    ),
    "texture": (
        "np.zeros((1500, 1500, 3))",
        "world.add_object(box={'size': 1}, texture=raycam.Texture(large))",
        "108000000",
    ),
    # 72 bytes per triangle and 24 bytes per vertex
    "triangles": (
        "raycam.World(); large.add_mesh(np.random.default_rng(1).random((600_000, 3)), "
        "np.tile(np.arange(600_000), 5)[:2_550_000].reshape(-1, 3))",
        "large.triangles()",
        "75600000",
    ),
    "exr": ("raycam.render(world, camera((1200, 800)), channels=['position', 'normal'])", "large._exr()", ""),
}


def run_limited(needs: str, call: str) -> list[str]:
    """The output of a process that may allocate 64 MiB more for a call."""
    code = SETUP.replace("{NEEDS}", needs).replace("{CALL}", call)
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout.splitlines()


@pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="the address space can be limited on Linux only"
)
@pytest.mark.parametrize("name", CALLS)
def test_failed_allocation_raises_memory_error_with_the_size(name: str) -> None:
    needs, call, asked = CALLS[name]
    raised, after = run_limited(needs, call)
    assert raised.startswith("MemoryError"), raised
    assert asked in raised
    assert any(c.isdigit() for c in raised), raised
    assert after == "goes on (8, 8, 3)"


@pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="the address space can be limited on Linux only"
)
@pytest.mark.parametrize(
    "array", ["np.zeros((2048, 2048, 3), np.uint8)", "np.zeros((2048, 2048), np.uint8).T"]
)
def test_byte_texture_allocates_one_byte_per_value(array: str) -> None:
    """16 MiB of RGBA fit into the limit of 64 MiB; floats would need four times as much."""
    call = "world.add_object(box={'size': 1}, texture=large)"
    assert run_limited(array, call) == ["nothing was raised", "goes on (8, 8, 3)"]
