"""Worlds from MuJoCo models; only the model's arrays are read, and MuJoCo is imported only to compute the first
state.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arguments import Floats
from ..camera import Camera
from ..errors import Notice, WorldError
from ..notices import warn_all
from ..srgb import linear_from_srgb
from ..world import World
from ..world.capsule import capsule_mesh

__all__ = ["MujocoScene", "from_mujoco"]

PLANE, HFIELD, SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX, MESH, SDF = range(9)
"""Values of `mjtGeom`."""
DIRECTIONAL = 1
"""Value of `mjtLightType`."""
SHOWN_GROUPS = (0, 1, 2)
"""Groups of geoms that MuJoCo's viewer shows by default."""
INFINITE_PLANE = 100.0
"""Half the side length, in metres, of planes of size 0, which MuJoCo extends to the horizon."""
DEFAULT_SIZE = (640, 480)
"""Size of cameras without a resolution."""


class MujocoScene:
    """A MuJoCo model as a world, from `from_mujoco`; `update` moves its objects and cameras."""

    def __init__(self, model: Any, data: Any, groups: tuple[int, ...]) -> None:
        self.model = model
        self.world = World()
        """The world, with one object per visible geom and the model's cameras."""
        self.geoms: list[int] = []
        """The geom's id of each object of the world."""
        self._scales: list[Floats] = []
        self._meshes: dict[tuple[int, int], str] = {}
        notices: list[Notice] = []
        for geom in range(model.ngeom):
            if model.geom_group[geom] in groups and _rgba(model, geom)[3] > 0:
                self._add_geom(geom, notices)
        _add_lights(self.world, model, data, notices)
        for camera in range(model.ncam):
            self.world.add_camera(self._camera(camera, data), _name(model, "cam", camera))
        self.update(data)
        warn_all(notices)
        self.notices = notices
        """Parts of the model that are not shown or approximated."""

    def update(self, data: Any) -> None:
        """Moves objects and cameras to the poses in `data` (`geom_xpos`, `cam_xpos`, ...); no mesh is rebuilt.

        `mujoco.mj_forward` or `mj_step` must have computed the poses. Raises `WorldError` for data of another model.
        """
        if len(data.geom_xpos) != self.model.ngeom or len(data.cam_xpos) != self.model.ncam:
            raise WorldError(
                f"data belongs to another model: it has {len(data.geom_xpos)} geoms and {len(data.cam_xpos)} cameras, "
                f"expected {self.model.ngeom} and {self.model.ncam}"
            )
        for number, geom in enumerate(self.geoms):
            matrix = np.eye(4)
            matrix[:3, :3] = np.asarray(data.geom_xmat[geom]).reshape(3, 3) @ self._scales[number]
            matrix[:3, 3] = data.geom_xpos[geom]
            self.world.set_object(number, matrix=matrix)
        for camera, name in enumerate(self.world.cameras):
            self.world.set_camera(name, self._camera(camera, data))

    def _add_geom(self, geom: int, notices: list[Notice]) -> None:
        model = self.model
        kind, size = int(model.geom_type[geom]), np.asarray(model.geom_size[geom], np.float64)
        name, scale = _name(model, "geom", geom), np.eye(3)
        keys: dict[str, Any] = {"name": name, **_material(model, geom, notices)}
        body = _name(model, "body", int(model.geom_bodyid[geom]))
        keys["category"] = body
        if kind == PLANE:
            sides = [2 * (half if half > 0 else INFINITE_PLANE) for half in size[:2]]
            self.world.add_object(plane={"size": sides}, **keys)
        elif kind in (SPHERE, ELLIPSOID):
            scale = np.diag(size if kind == ELLIPSOID else [size[0]] * 3)
            self.world.add_object(sphere={"radius": 1.0}, **keys)
        elif kind == BOX:
            self.world.add_object(box={"size": (2 * size).tolist()}, **keys)
        elif kind == CYLINDER:
            self.world.add_object(cylinder={"radius": size[0], "height": 2 * size[1]}, **keys)
        elif kind == CAPSULE:
            vertices, faces, normals = capsule_mesh(size[0], 2 * size[1])
            self.world.add_object(vertices=vertices, triangles=faces, normals=normals, **keys)
        elif kind == HFIELD:
            vertices, faces = _height_field(model, int(model.geom_dataid[geom]))
            self.world.add_object(vertices=vertices, triangles=faces, **keys)
        elif kind in (MESH, SDF) and model.geom_dataid[geom] >= 0:
            if kind == SDF:
                notices.append(
                    Notice(
                        f"geom {name!r}: a signed distance field is shown as its mesh", "approximated_value"
                    )
                )
            vertices, faces = _mesh(model, int(model.geom_dataid[geom]))
            self.world.add_object(vertices=vertices, triangles=faces, **keys)
        else:
            notices.append(Notice(f"geom {name!r}: geoms of type {kind} are not shown", "ignored_element"))
            return
        self.geoms.append(geom)
        self._scales.append(scale)

    def _camera(self, camera: int, data: Any) -> Camera:
        """The camera of the model at its pose in `data`."""
        model = self.model
        width, height = (int(side) for side in model.cam_resolution[camera])
        if width < 2 or height < 2:
            width, height = DEFAULT_SIZE
        focal = height / 2 / np.tan(np.radians(float(model.cam_fovy[camera])) / 2)
        k = np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]])
        sensor = np.asarray(model.cam_sensorsize[camera], np.float64)
        if sensor[0] > 0 and sensor[1] > 0:
            per_metre = np.array([width, height]) / sensor
            intrinsic = np.asarray(model.cam_intrinsic[camera], np.float64)
            k[[0, 1], [0, 1]] = intrinsic[:2] * per_metre
            k[:2, 2] = [width / 2, height / 2] + intrinsic[2:4] * per_metre * [-1, 1]
        pose = np.eye(4)
        pose[:3, :3] = np.asarray(data.cam_xmat[camera]).reshape(3, 3)
        pose[:3, 3] = data.cam_xpos[camera]
        return Camera.from_opengl(k, pose, (width, height), pixel_center="half")

    def __repr__(self) -> str:
        """Counts as text."""
        return f"MujocoScene: {len(self.geoms)} of {self.model.ngeom} geoms; {self.world!r}"


def from_mujoco(model: Any, data: Any = None, *, groups: tuple[int, ...] = SHOWN_GROUPS) -> MujocoScene:
    """Creates a world from a `mujoco.MjModel`; returns a scene with `world` and `update(data)`.

    `data` is the `mujoco.MjData` whose poses are shown (default: the initial state). Geoms of `groups` (default: 0, 1
    and 2, as in MuJoCo's viewer) that are not fully transparent become objects, named as in the model, with their
    body's name as category. Round shapes are triangle meshes. Colours are sRGB, as MuJoCo shows them. A texture is
    replaced by its mean colour, and lights without direction and the headlight by uniform light from the sky, both
    with notices. Skins, flexes, sites and tendons are omitted, with notices.

    Raises `WorldError` for objects that are not a model, and `ImportError` without MuJoCo if `data` is not given.
    """
    if not hasattr(model, "geom_type") or not hasattr(model, "mesh_vert"):
        raise WorldError(f"expected a mujoco.MjModel, not {type(model).__name__}")
    if data is None:
        import mujoco

        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
    return MujocoScene(model, data, tuple(groups))


def _name(model: Any, kind: str, number: int) -> str:
    """The name of an element, or its kind and number."""
    start = int(getattr(model, f"name_{kind}adr")[number])
    names = bytes(model.names)
    return names[start : names.index(b"\0", start)].decode("utf-8", "replace") or f"{kind}{number}"


def _rgba(model: Any, geom: int) -> Floats:
    """The colour of a geom: its material's, unless the geom has one of its own (as in MuJoCo's visualizer)."""
    own = np.asarray(model.geom_rgba[geom], np.float64)
    material = int(model.geom_matid[geom])
    if material >= 0 and (own == 0.5).sum() == 3 and own[3] == 1:
        return np.asarray(model.mat_rgba[material], np.float64)
    return own


def _material(model: Any, geom: int, notices: list[Notice]) -> dict[str, Any]:
    rgba, material = _rgba(model, geom), int(model.geom_matid[geom])
    srgb = np.clip(rgba[:3], 0, 1)
    if material >= 0:
        for texture in np.asarray(model.mat_texid[material]).ravel():
            if texture >= 0:
                start, channels = int(model.tex_adr[texture]), int(model.tex_nchannel[texture])
                count = int(model.tex_height[texture]) * int(model.tex_width[texture]) * channels
                pixels = np.asarray(model.tex_data[start : start + count]).reshape(-1, channels)
                srgb = srgb * (pixels[:, :3].mean(axis=0) / 255 if channels >= 3 else pixels.mean() / 255)
                notices.append(
                    Notice(
                        f"material {_name(model, 'mat', material)!r}: its texture is replaced by its mean colour",
                        "approximated_value",
                    )
                )
                break
    keys: dict[str, Any] = {"color": linear_from_srgb(srgb)}
    if rgba[3] < 1:
        keys["opacity"] = float(rgba[3])
    if material >= 0 and float(model.mat_emission[material]) > 0:
        keys["emission"] = float(model.mat_emission[material]) * keys["color"]
    return keys


def _mesh(model: Any, mesh: int) -> tuple[Floats, Any]:
    first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    start, faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    vertices = np.asarray(model.mesh_vert[first : first + count], np.float64)
    return vertices, np.asarray(model.mesh_face[start : start + faces], np.int64)


def _height_field(model: Any, field: int) -> tuple[Floats, Any]:
    """A height field as a closed solid: the surface, split as in `mj_ray`, and walls down to its base."""
    rows, columns = int(model.hfield_nrow[field]), int(model.hfield_ncol[field])
    start = int(model.hfield_adr[field])
    x_size, y_size, height, base = np.asarray(model.hfield_size[field], np.float64)
    heights = np.asarray(model.hfield_data[start : start + rows * columns], np.float64) * height
    y, x = np.meshgrid(
        np.linspace(-y_size, y_size, rows), np.linspace(-x_size, x_size, columns), indexing="ij"
    )
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    first = np.stack([corner, corner + 1, corner + columns + 1], axis=1)
    second = np.stack([corner, corner + columns + 1, corner + columns], axis=1)
    top = np.stack([x.ravel(), y.ravel(), heights], axis=1)
    grid = np.arange(rows * columns).reshape(rows, columns)
    border = np.concatenate([grid[0, :-1], grid[:-1, -1], grid[-1, :0:-1], grid[:0:-1, 0]])
    bottom = top[border] * [1, 1, 0] - [0, 0, base]
    lower = len(top) + np.arange(len(border))
    after, lower_after = np.roll(border, -1), np.roll(lower, -1)
    walls = [np.stack([lower, lower_after, after], axis=1), np.stack([lower, after, border], axis=1)]
    middle = np.full(len(border), len(top) + len(border))
    floor = np.stack([lower_after, lower, middle], axis=1)
    vertices = np.concatenate([top, bottom, [[0.0, 0.0, -base]]])
    return vertices, np.concatenate([first, second, *walls, floor])


def _add_lights(world: World, model: Any, data: Any, notices: list[Notice]) -> None:
    """Adds directional lights as suns, and other light as a uniform sky that gives albedo 1 the radiance `diffuse`."""
    ambient = np.zeros(3)
    if model.vis.headlight.active:
        ambient += np.asarray(model.vis.headlight.ambient) + np.asarray(model.vis.headlight.diffuse)
    for light in range(model.nlight):
        if not model.light_active[light]:
            continue
        diffuse = np.asarray(model.light_diffuse[light], np.float64)
        ambient += np.asarray(model.light_ambient[light])
        if int(model.light_type[light]) == DIRECTIONAL:
            direction = np.asarray(data.light_xdir[light], np.float64).tolist()
            world.add_light("sun", direction=direction, irradiance=(np.pi * diffuse).tolist())
        else:
            ambient += diffuse / 2
            notices.append(
                Notice(
                    f"light {_name(model, 'light', light)!r}: replaced by uniform light from the sky",
                    "approximated_value",
                )
            )
    if ambient.any():
        world.add_light("sky", radiance=ambient.tolist())
    for count, what in (
        (model.nskin, "skins"),
        (model.nflex, "flexes"),
        (model.nsite, "sites"),
        (model.ntendon, "tendons"),
    ):
        if count:
            notices.append(Notice(f"{count} {what} are not shown", "ignored_element"))
