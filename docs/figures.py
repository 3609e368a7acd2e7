"""Renders the lecture's figures with raycam.

There is one function for each figure, with the name of the figure's file.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import raycam
from raycam import _core
from raycam.io import atomic_files

Image = np.ndarray  # [height, width, 3] sRGB bytes
ASSETS = Path(raycam.__file__).parent / "assets"
MESHES = Path(__file__).parent / "meshes"
Z = (0, 0, 1)
SKY = {"type": "sky", "radiance": [0.75, 0.82, 0.95]}
SUN = {"type": "sun", "direction": [-0.6, 1, -1.2], "irradiance": [2.2, 2.0, 1.7]}
STAND = {"roll": 90, "location": [0, 0, 0.74]}  # places the y-up cow on the floor of a z-up world


def row(*images: Image, gap: int = 8) -> Image:
    """Returns images of equal height next to each other, separated by white gaps."""
    height = images[0].shape[0]
    space = np.full((height, gap, 3), 255, np.uint8)
    parts = [part for image in images for part in (image, space)]
    return np.concatenate(parts[:-1], axis=1)


def look(
    eye: tuple[float, ...], target: tuple[float, ...], size: tuple[int, int], fov: float
) -> raycam.Camera:
    """Returns a camera of a z-up world that points at `target`."""
    return raycam.Camera.look_at(eye, target, Z, size=size, fov=fov)


def flat(world: raycam.World, camera: raycam.Camera) -> Image:
    """Returns a flat image, computed as in the lecture, as sRGB bytes."""
    return raycam.render(world, camera, integrator="flat").to_srgb8()


def lit(world: raycam.World, camera: raycam.Camera, samples: int = 16, **settings: object) -> Image:
    """Returns an image with the world's lights, as sRGB bytes."""
    return raycam.render(world, camera, samples=samples, **settings).to_srgb8()


def colored_box(world: raycam.World, **placement: object) -> int:
    """Adds the lecture's box (two triangles per side, twelve colours) and returns its id."""
    corners = [[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
    sides = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
    sides += [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    palette = ["d7263d", "f46036", "2364aa", "73a9de", "1b998b", "58d0bd"]
    palette += ["7d3c98", "b57bd0", "2e294e", "5b4b8a", "e2c044", "f5e08a"]
    colors = np.array([list(bytes.fromhex(color)) for color in palette], np.uint8)
    return world.add_mesh(corners, sides, face_colors=colors, name="box", **placement)


def still_life() -> raycam.World:
    """Returns the world of the lecture's figures: a few solids on a floor."""
    world = raycam.World()
    world.add_object(plane={"size": [7, 7]}, color="#d9d4c7", name="floor")
    colored_box(world, location=[-0.9, 0.5, 0.5], yaw=25)
    world.add_object(sphere={"radius": 0.5, "level": 5}, location=[0.5, 0.2, 0.5], color="#2e86c1")
    world.add_object(cone={"radius": 0.45, "height": 1.1}, location=[1.5, 1.1, 0.55], color="#e0a526")
    world.add_object(torus={"radius": 0.4, "tube": 0.14}, location=[0.4, -1.0, 0.14], color="#b03a2e")
    return world


def box() -> Image:
    """Figure: a box of twelve triangles in twelve colours, from two sides."""
    world = raycam.World()
    colored_box(world)
    world.add_light({"type": "sky", "radiance": [1, 1, 1]})
    eyes = ((1.9, -2.5, 1.5), (-1.9, 2.5, -1.5))
    return row(*(flat(world, look(eye, (0, 0, 0), (380, 300), 32)) for eye in eyes))


def wireframe(world: raycam.World, camera: raycam.Camera) -> Image:
    """Returns a lit image with dark lines at the edges of triangles.

    Edges are pixels where a barycentric coordinate is close to zero. The image is reduced to half its size.
    """
    frame = raycam.render(world, camera, samples=4, channels=["color", "barycentric", "instance"])
    near = frame["barycentric"].min(axis=2)
    step = np.hypot(*np.gradient(near)) + 1e-6
    line = np.clip(1.6 - near / step, 0, 1) * (frame["instance"] >= 0)
    return halved(frame.to_srgb8() * (1 - 0.75 * line[..., None]))


def halved(image: np.ndarray) -> Image:
    """Returns the image at half its width and height: each pixel is the mean of four."""
    height, width, _ = image.shape
    return image.reshape(height // 2, 2, width // 2, 2, 3).mean(axis=(1, 3)).round().astype(np.uint8)


def refine() -> Image:
    """Figure: Loop subdivision of a coarse cow."""
    images = []
    for levels in range(4):
        world = raycam.World(folder=MESHES)
        world.add_object(mesh="spot_control_mesh.obj", refine=levels, color="#e8b796", roll=90)
        world.add_light(SUN)
        world.add_light(SKY)
        images.append(wireframe(world, look((3.2, 3.8, 1.4), (-0.05, 0, 0.02), (440, 440), 22)))
    return row(*images)


def colors() -> Image:
    """Figure: one colour per object, per triangle, per vertex, and a texture."""
    corners = raycam.load(ASSETS / "spot" / "cow.obj").triangles()
    vertices, faces = corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)
    span = (vertices - vertices.min(0)) / np.ptp(vertices, axis=0)
    hues = np.random.default_rng(5).uniform(0.1, 0.9, (len(faces), 3))
    ways = (
        {"vertices": vertices, "triangles": faces, "color": "#c9704e"},
        {"vertices": vertices, "triangles": faces, "face_colors": hues},
        {"vertices": vertices, "triangles": faces, "vertex_colors": span},
        {"mesh": "spot/cow.obj"},
    )
    images = []
    for way in ways:
        world = raycam.World(folder=ASSETS)
        world.add_object(**way, **STAND)
        world.add_light({"type": "sky", "radiance": [1, 1, 1]})
        images.append(flat(world, look((-3.0, 3.4, 2.0), (0, 0, 0.8), (220, 260), 27)))
    return row(*images)


def pose() -> Image:
    """Figure: a level camera, and the camera after yaw, pitch and roll."""
    world = still_life()
    world.add_light(SKY)
    turns = ({}, {"yaw": 15}, {"pitch": 10}, {"roll": 20})
    images = []
    for turn in turns:
        angles = {"roll": 0, "pitch": 15, "yaw": 90}
        angles |= {name: angles[name] + by for name, by in turn.items()}
        camera = raycam.Camera.from_pose([0.2, -5.5, 2.0], **angles, size=(240, 180), focal=230)
        images.append(flat(world, camera))
    return row(*images)


def rod(world: raycam.World, start: np.ndarray, end: np.ndarray, radius: float, color: str) -> None:
    """Adds a thin rod with twelve sides from `start` to `end`."""
    along = (end - start) / np.linalg.norm(end - start)
    across = np.cross(along, np.eye(3)[np.abs(along).argmin()])
    across /= np.linalg.norm(across)
    angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)[:, None]
    ring = radius * (np.cos(angle) * across + np.sin(angle) * np.cross(along, across))
    k, after = np.arange(12), (np.arange(12) + 1) % 12
    sides = np.concatenate([np.stack([k, after, k + 12], 1), np.stack([after, after + 12, k + 12], 1)])
    world.add_mesh(np.concatenate([start + ring, end + ring]), sides, color=color)


def outside() -> Image:
    """Figure: a camera, its image plane and one of its rays, viewed by another camera."""
    camera = look((2.6, -4.2, 2.6), (0.1, 0.2, 0.35), (40, 30), 38)
    pixel = np.array([12.0, 14.0])
    world = still_life()
    world.add_light(SKY)
    seen = raycam.render(world, camera, integrator="flat", channels=["color", "position"])

    def on_plane(u: float, v: float) -> np.ndarray:
        origins, directions = camera.rays([[u, v]])
        return origins[0] + 1.5 * directions[0] / (directions[0] @ camera.R[2])

    # The image plane consists of two triangles for each pixel, which have the pixel's colour.
    width, height = camera.size
    grid = np.array([[on_plane(u - 0.5, v - 0.5) for u in range(width + 1)] for v in range(height + 1)])
    index = np.arange((width + 1) * (height + 1)).reshape(height + 1, width + 1)
    a, b, c, d = (
        index[:-1, :-1].ravel(),
        index[:-1, 1:].ravel(),
        index[1:, 1:].ravel(),
        index[1:, :-1].ravel(),
    )
    faces = np.stack([a, c, b, a, d, c], axis=1).reshape(-1, 3)
    shades = np.repeat(seen["color"].clip(0, 1).reshape(-1, 3), 2, axis=0)
    world.add_mesh(grid.reshape(-1, 3), faces, face_colors=shades, material={"type": "unlit"})

    frame = [grid[0, 0], grid[0, -1], grid[-1, -1], grid[-1, 0]]
    for k, corner in enumerate(frame):
        rod(world, camera.C, corner, 0.008, "#333333")
        rod(world, corner, frame[(k + 1) % 4], 0.012, "#333333")
    hit = seen["position"][int(pixel[1]), int(pixel[0])]
    rod(world, camera.C, hit, 0.018, "#e02020")
    for place, radius, color in (
        (camera.C, 0.09, "#222222"),
        (hit, 0.06, "#e02020"),
        (on_plane(*pixel), 0.04, "#e02020"),
    ):
        world.add_object(sphere={"radius": radius}, location=place, color=color)
    world.add_light(SUN)
    observer = look((7.0, -4.4, 4.0), (1.2, -1.7, 1.1), (760, 430), 36)
    return lit(world, observer, ambient_occlusion=True)


def channels() -> Image:
    """Figure: colour and ground truth of one frame."""
    world = still_life()
    world.add_light(SUN)
    world.add_light(SKY)
    camera = look((2.6, -4.2, 2.6), (0.1, 0.2, 0.35), (240, 180), 38)
    names = ["color", "depth", "instance", "triangle", "normal"]
    frame = raycam.render(world, camera, channels=names)
    met = frame["instance"] >= 0
    near, far = frame["depth"][met].min(), frame["depth"][met].max()
    depth = np.where(met, 1 - 0.9 * (np.where(met, frame["depth"], far) - near) / (far - near), 0)
    palette = np.random.default_rng(2).uniform(0.25, 1.0, (4096, 3))
    palette[-1] = 0  # the background's id is -1
    planes = (
        np.repeat(depth[..., None], 3, axis=2),
        palette[frame["instance"]],
        palette[np.where(met, (frame["triangle"] * 7 + frame["instance"] * 131) % 4095, -1)],
        (frame["normal"] + 1) / 2 * met[..., None],
    )
    return row(frame.to_srgb8(), *((plane * 255).round().astype(np.uint8) for plane in planes))


def lights() -> Image:
    """Figure: a sun, a point bulb, a round bulb and a sky."""
    dim = {"type": "sky", "radiance": [0.05, 0.06, 0.08]}
    bulb = {"type": "point", "position": [-0.6, -1.6, 2.4], "power": [150, 130, 105]}
    ways = (
        ([SUN | {"irradiance": [3.4, 3.2, 2.9]}, dim], {}),
        ([bulb, dim], {}),
        ([bulb | {"radius": 0.4}, dim], {}),
        ([SKY], {"ambient_occlusion": True}),
    )
    images = []
    for given, settings in ways:
        world = still_life()
        for light in given:
            world.add_light(light)
        images.append(lit(world, look((0.4, -5.6, 3.4), (0.2, 0.1, 0.3), (260, 200), 34), **settings))
    return row(*images)


def reflectance() -> Image:
    """Figure: spheres; specular increases downwards, shininess to the right."""
    world = raycam.World()
    for down, specular in enumerate((0.0, 0.2, 0.5, 0.8)):
        for across, shininess in enumerate((5, 20, 80, 320)):
            ball = {
                "sphere": {"radius": 0.45, "level": 6},
                "location": [across, 0, -down],
                "color": "#d3543c",
            }
            world.add_object(ball | {"diffuse": 1 - specular, "specular": specular, "shininess": shininess})
    world.add_light({"type": "sun", "direction": [0.7, 1, -0.9], "irradiance": [3, 3, 3]})
    world.add_light({"type": "sky", "radiance": [0.12, 0.13, 0.15]})
    camera = raycam.Camera.look_at([1.5, -12, -1.5], [1.5, 0, -1.5], Z, size=(480, 480), fov=19)
    return lit(world, camera)


def orbit() -> Image:
    """Figure: six frames around a cow."""
    world = raycam.World(folder=ASSETS)
    world.add_object(mesh="spot/cow.obj", **STAND)
    world.add_object(plane={"size": [9, 9]}, color="#cfd8dc")
    world.add_light(SUN)
    world.add_light(SKY)
    images = []
    for turn in np.radians(np.arange(0, 360, 60) - 125):
        eye = (4.2 * np.cos(turn), 4.2 * np.sin(turn), 2.0)
        images.append(lit(world, look(eye, (0, 0, 0.75), (150, 150), 28)))
    return row(*images, gap=4)


FIGURES: list[Callable[[], Image]] = [
    box,
    refine,
    colors,
    pose,
    outside,
    channels,
    lights,
    reflectance,
    orbit,
]


def write(folder: Path) -> None:
    """Writes all figures, and the explanation of one pixel as text and as a figure."""
    explained = raycam.explain(
        still_life(), look((2.6, -4.2, 2.6), (0.1, 0.2, 0.35), (320, 240), 38), (100, 112)
    )
    explained.save_figure(folder / "explain.svg")
    (folder / "explain.txt").write_text(str(explained), encoding="utf-8")
    for figure in FIGURES:
        atomic_files.write(folder / f"{figure.__name__}.png", _core.encode_png(figure()))
