"""Worlds: loaded from a file or built in Python."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy.typing as npt

from .. import _core
from ..camera import Camera
from ..errors import FormatError, Notice
from ..io import memory_limits
from ..io.atomic_files import write
from ..io.html_form import html_table
from ..io.other_names import no_attribute
from ..notices import warn_all
from ..one_line import counted
from ..robots import Robot
from .building import WorldBuilding
from .culling import cull_faces
from .description import plain
from .gltf_robots import gltf_bytes
from .point_queries import PointQueries
from .ray_queries import RayQueries
from .robot_tables import add_robot_tables, has_robots, split_robots
from .studio import add_ground, add_studio

__all__ = ["World"]


class World(WorldBuilding, RayQueries, PointQueries):
    """Objects (placed meshes), lights and cameras.

    `up` ("z" or "y") affects roll, pitch and yaw, orbits and the sky; vertices are never rotated.

    `add_object`, `add_mesh` and `add_light` open the given files (meshes, textures, skies, IES profiles) in any
    folder. Relative paths start at `folder` (default: the current folder). A file inside `folder` may refer to files
    anywhere inside `folder`; any other file may only refer to files in its own folder, as in `load`.

    Acceleration structures are built on first use, and again after changes; unchanged parts are not rebuilt. Several
    threads may use a world at the same time.

    `texture_memory` limits the memory of textures, in bytes or as "512 MiB". If the textures with their mip maps
    exceed it, all of them are stored in a temporary file (in `TMPDIR`, or else `/var/tmp`) and read tile by tile;
    rendered images do not change.
    """

    __slots__ = ()

    def __init__(
        self,
        up: Literal["z", "y"] = "z",
        *,
        folder: str | os.PathLike[str] | None = None,
        texture_memory: int | str | None = None,
    ) -> None:
        limit = memory_limits.parse_size("texture_memory", texture_memory)
        self._folder = None if folder is None else os.fspath(Path(folder).absolute())
        self._core = _core.World(up, self._folder or "", limit)
        self._bare: World | None = None
        self._stage_variants = ()
        self._robots = {}
        self._is_up_assumed = False

    @classmethod
    def from_dict(
        cls,
        description: Mapping[str, Any],
        *,
        folder: str | os.PathLike[str] = ".",
        texture_memory: int | str | None = None,
    ) -> World:
        """Returns a world from a dict with the keys of a world file.

        The keys are `up`, `camera`, `object`, `robot`, `light`, `video` and so on. Lists of numbers may be
        NumPy arrays. All files must be in `folder`, as for a world file, so that an untrusted description
        cannot read other files. `texture_memory` is as in `World`. Raises the errors of `load`, without file
        and line.
        """
        return cls._described(description, folder, texture_memory)

    @classmethod
    def _described(
        cls,
        description: Mapping[str, Any],
        folder: str | os.PathLike[str],
        texture_memory: int | str | None,
        robot_lines: Sequence[int] = (),
        shared: _core.SharedFiles | None = None,
    ) -> World:
        """`from_dict`; `robot_lines` are the lines of the tables `[[robot]]`, for messages.

        Worlds with the same `shared` read each file of the folder once.
        """
        limit = memory_limits.parse_size("texture_memory", texture_memory)
        robots: list[dict[str, Any]] = []
        video: dict[str, Any] = {}
        if has_robots(description):
            description, robots, video = split_robots(description)
        world = cls._of(_core.world_from_dict(plain(description), os.fspath(folder), limit, shared))
        warn_all(world.notices)
        add_robot_tables(world, robots, folder, robot_lines)
        world._check_sensors()
        if video:
            world.set_video(video)
        return world

    def to_bytes(self) -> bytes:
        """Serialises the world exactly, including its files.

        `World.from_bytes` of the same raycam version reads the result. Equal worlds have equal bytes, independent of
        the folders of their files. Background photos of cameras are not included, only their paths. Robots become plain
        objects at their current joint values; `pickle` preserves robots. Raises `WorldError` if the textures, which are
        included, exceed `texture_memory`.
        """
        return _core.world_to_bytes(self._core)

    @classmethod
    def from_bytes(cls, data: bytes, *, texture_memory: int | str | None = None) -> World:
        """Returns the world whose `to_bytes` returned `data`.

        `texture_memory` is as in `World`. Raises `FormatError` or `WorldError` for invalid bytes.
        """
        if not isinstance(data, bytes | bytearray | memoryview):
            raise FormatError(
                f"data must be bytes returned by World.to_bytes, not {type(data).__name__}", code="wrong_type"
            )
        return cls._of(
            _core.world_from_bytes(
                bytes(data), memory_limits.parse_size("texture_memory", texture_memory), ""
            )
        )

    def to_gltf(self, path: str | os.PathLike[str]) -> list[Notice]:
        """Writes a GLB file (glTF 2.0); returns notices about properties that glTF cannot represent.

        The file contains meshes, materials (with their `KHR_materials_*` extensions), textures, variants, cameras,
        sun, point and spot lights, the node tree and its animations. A robot becomes a tree of its links, and its joint
        keyframes an animation. Positions become float32. A z-up world gets a root node that rotates it to glTF's y-up
        axes. Raises `FormatError` if the file would exceed 4 GiB, and `OSError` if it cannot be written.
        """
        data, notices = gltf_bytes(self)
        write(path, data)
        warn_all(notices)
        return notices

    def __reduce__(self) -> tuple[Callable[..., World], tuple[Any, ...]]:
        """Pickles the world as `to_bytes` does; raises its errors."""
        return _from_pickle, (self.to_bytes(), self._folder, self.texture_memory, self._robots)

    def cull_faces(self, which: str | int, keep: npt.ArrayLike) -> World:
        """Returns a copy in which an object has only the faces where `keep` is True.

        The object is given by name or number. `keep` is bool [n], one for each triangle of the object, as
        `surface_visibility` returns: `world.cull_faces(0, seen.views > 0)`. Texture coordinates, shading normals,
        vertex colours and the material are kept. Raises `WorldError` for a wrong shape, if no face would remain, and
        for an object with several materials.
        """
        return cull_faces(self, which, keep)

    def add_ground(
        self,
        *,
        height: float | None = None,
        size: float | None = None,
        color: npt.ArrayLike | str | None = None,
        name: str = "ground",
        **material: Any,
    ) -> int:
        """Adds a level square below the world, which receives shadows; returns its id.

        `height` is its coordinate along the up axis in metres (default: just below the lowest point), `size` its side
        length (default: 100 diagonals of the world's bounds). `color` (default: a light grey) and `material` are keys
        of `add_object`; a number is appended to a `name` that is already used. Raises `WorldError` for an empty world
        unless `height` and `size` are given.
        """
        return add_ground(self, height=height, size=size, color=color, name=name, **material)

    def add_studio(
        self, camera: Camera | None = None, *, ground: bool = True, key: bool = True, exposure: float = 0.0
    ) -> None:
        """Adds the studio in which worlds without lights and cameras are shown.

        The studio has a soft key light from the upper left of `camera` (default: the default camera), a grey room that
        metals reflect, and, with `ground`, a floor. Floor and background have the linear radiance 0.62 outside shadows.
        The floor is omitted if the camera is below it. `integrator="path"` with `max_depth=6` is recommended.

        `key=False` omits the key light, for worlds with suns or lamps: the room then fills their shadows. `exposure`,
        in stops, is the exposure of the image (`raycam.render`), in which the room keeps its brightness.
        """
        add_studio(self, camera, ground=ground, key=key, exposure=exposure)

    def in_studio(
        self, camera: Camera, *, ground: bool = True, key: bool = True, exposure: float = 0.0
    ) -> World:
        """Returns a copy with the studio added (see `add_studio`).

        The copy's `without_studio` is this world.
        """
        copy = self.copy()
        add_studio(copy, camera, ground=ground, key=key, exposure=exposure)
        copy._bare = self
        return copy

    @property
    def without_studio(self) -> World:
        """The world before `in_studio` added the studio; for any other world, the world itself.

        Ground truth of a world in the studio describes this world, so that the studio's floor counts as background.
        """
        return self if self._bare is None else self._bare

    def _repr_html_(self) -> str:
        """The HTML table of objects shown by notebooks, with lights and cameras below."""
        rows = [(item.id, item.name, item.category or "", item.triangles) for item in self.objects]
        notes = [f"light: {light['type']}" for light in self.lights]
        notes += [f"camera: {name}, {one.size[0]} x {one.size[1]}" for name, one in self.cameras.items()]
        return html_table(repr(self), ("id", "name", "category", "triangles"), rows, notes[:20])

    if not TYPE_CHECKING:  # so that type checkers report missing attributes

        def __getattr__(self, name: str) -> Any:
            """Raises `AttributeError`, with raycam's counterpart for names of other libraries."""
            raise no_attribute(self, name)

    def __repr__(self) -> str:
        """The counts as text."""
        counts = self.counts
        nouns = ("object", "triangle", "light", "camera")
        return f'World(up="{self.up}"): {", ".join(counted(counts[f"{each}s"], each) for each in nouns)}'


def _from_pickle(
    data: bytes, folder: str | None, texture_memory: int | None, robots: dict[str, Robot]
) -> World:
    world = World._of(_core.world_from_bytes(data, texture_memory, folder or ""))
    world._folder, world._robots = folder, robots
    return world
