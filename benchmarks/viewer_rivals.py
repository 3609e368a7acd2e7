"""Shows the triangles of a PLY file in other viewers, for `bench_viewer.py`.

Runs in an interpreter with viser, f3d or open3d. Prints `open URL`, `first` after the first image, and the
seconds per image.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

SIZE = (640, 480)
SMALL = (160, 120)
"""The size of viser's images. The browser draws WebGL in software, where an image of 640 x 480 pixels takes 20 s."""
ROUNDS = 20
LONGEST = 15.0  # seconds, the maximum length of a measurement
TARGET = np.array([0.0, 0.0, 0.7])


def say(text: str) -> None:
    print(text, flush=True)


def eye(number: int) -> np.ndarray:
    """Returns the camera position of image `number`, on a circle around the world."""
    angle = 0.05 * number - 2.0
    return TARGET + np.array([6.5 * np.cos(angle), 6.5 * np.sin(angle), 2.4])


def timed(picture: Callable[[int], object]) -> list[float]:
    """Returns the seconds of each image of a moving camera.

    Prints "first" after the first image.
    """
    picture(0)
    say("first")
    times: list[float] = []
    while len(times) < ROUNDS and sum(times) < LONGEST:
        before = time.perf_counter()
        picture(len(times) + 1)
        times.append(time.perf_counter() - before)
    return times


def triangles(path: str) -> tuple[np.ndarray, np.ndarray]:
    """Returns the vertices and faces of the binary PLY file that `bench_viewer.py` writes."""
    head, _, body = Path(path).read_bytes().partition(b"end_header\n")
    count = int(head.split(b"element vertex ")[1].split()[0])
    vertices = np.frombuffer(body, "<f4", 3 * count).reshape(-1, 3)
    return vertices, np.arange(count).reshape(-1, 3)


def viser(path: str) -> None:
    import viser
    import viser.transforms

    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    vertices, faces = triangles(path)
    server.scene.set_up_direction("+z")
    server.scene.add_mesh_simple("/world", vertices, faces, color=(200, 120, 60))
    say(f"open http://127.0.0.1:{server.get_port()}/")
    while not server.get_clients():
        time.sleep(0.005)
    (client,) = server.get_clients().values()

    def picture(number: int) -> np.ndarray:
        forward = TARGET - eye(number)
        z = forward / np.linalg.norm(forward)
        x = np.cross(z, [0, 0, 1])
        x /= np.linalg.norm(x)
        rotation = viser.transforms.SO3.from_matrix(np.stack([x, np.cross(z, x), z], axis=1))
        while True:
            found = client.get_render(
                SMALL[1], SMALL[0], wxyz=rotation.wxyz, position=eye(number), fov=0.8, transport_format="jpeg"
            )
            if found[..., :3].std() > 2:  # otherwise, the browser has not received the mesh yet
                return found

    picture(-1)  # the first two images are slow, because the browser compiles its shaders
    say(json.dumps({"an image of a given camera, rendered by the browser, 160 x 120": timed(picture)}))
    client.camera.position, client.camera.look_at = eye(0), TARGET
    time.sleep(1)
    say("drag")
    time.sleep(120)


def f3d(path: str) -> None:
    import f3d

    f3d.Engine.autoload_plugins()
    engine = f3d.Engine.create(True)
    engine.scene.add(path)
    engine.window.size = SIZE
    camera = engine.window.camera
    camera.focal_point, camera.view_up = tuple(TARGET), (0, 0, 1)

    def picture(number: int) -> object:
        camera.position = tuple(eye(number))
        return engine.window.render_to_image()

    say(json.dumps({"an image of a given camera, rendered without a browser, 640 x 480": timed(picture)}))


def open3d(path: str) -> None:
    import open3d

    renderer = open3d.visualization.rendering.OffscreenRenderer(*SIZE)
    vertices, faces = triangles(path)
    mesh = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(vertices), open3d.utility.Vector3iVector(faces)
    )
    mesh.compute_vertex_normals()
    material = open3d.visualization.rendering.MaterialRecord()
    material.shader = "defaultLit"
    renderer.scene.add_geometry("world", mesh, material)

    def picture(number: int) -> np.ndarray:
        renderer.setup_camera(45.0, TARGET, eye(number), [0.0, 0.0, 1.0])
        return np.asarray(renderer.render_to_image())

    say(json.dumps({"an image of a given camera, rendered without a browser, 640 x 480": timed(picture)}))


if __name__ == "__main__":
    {"viser": viser, "f3d": f3d, "open3d": open3d}[sys.argv[1]](sys.argv[2])
