"""The contents of a world, and the world at other times."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal, Self

import numpy as np
import numpy.typing as npt

from .. import _core
from .._core import World as CoreWorld
from ..arguments import Floats, one_of, real, thread_count, whole
from ..camera import Camera, check_camera
from ..errors import Error, Notice, WorldError
from ..io.fork_guard import no_fork
from ..notices import collected, warn_all
from ..read_only import ReadOnlyDict, ReadOnlyList, read_only_array
from ..rig import Rig
from ..robots import Robot
from ..sensors import Sensor
from ..sensors.sensor import read_mounted_sensors
from .parts import Animation, Object, Video
from .sensors import sensors_of

__all__ = ["WorldContents"]


class WorldContents:
    """Base class of `World` with the properties that list a world's contents."""

    __slots__ = ("_bare", "_core", "_folder", "_is_up_assumed", "_robots", "_stage_variants")

    _core: CoreWorld
    _folder: str | None
    _bare: Self | None
    _stage_variants: tuple[str, ...]
    _robots: dict[str, Robot]
    _is_up_assumed: bool
    """True for the world of a file that does not specify its up axis, if the caller did not choose an axis either."""

    @classmethod
    def _of(cls, core: CoreWorld, stage_variants: Sequence[str] = ()) -> Self:
        world = cls.__new__(cls)
        world._core, world._folder, world._bare = core, None, None
        world._stage_variants = tuple(stage_variants)
        world._robots = {}
        world._is_up_assumed = False
        return world

    # Contents ---------------------------------------------------------------------------------------------

    @property
    def up(self) -> Literal["z", "y"]:
        """The up axis: "z" or "y"."""
        return self._core.up

    @property
    def objects(self) -> list[Object]:
        """The objects in the order of their ids, as read-only records.

        `set_object` changes an object.
        """
        found = [
            Object(
                number,
                name,
                category,
                mesh,
                triangles,
                _matrix(matrix, name),
                visible,
                catcher,
                tuple(materials),
            )
            for number, (
                name,
                category,
                mesh,
                triangles,
                matrix,
                visible,
                catcher,
                materials,
            ) in enumerate(self._core.objects)
        ]
        return ReadOnlyList(
            found, "objects are read-only; world.add_object, set_object or remove_object changes them"
        )

    @property
    def categories(self) -> dict[int, str]:
        """The names of the objects' categories by id; the id is the value in the channel `category`.

        A category whose name is an integer has that id. Other categories get the unused ids from 1, in the order of
        the objects.
        """
        return ReadOnlyDict(
            self._core.categories,
            "categories are read-only; world.set_object(name, category=...) changes an object's category",
        )

    @property
    def lights(self) -> list[dict[str, Any]]:
        """The lights as read-only dicts with the keys of `add_light`; `set_light` changes a light."""
        lights = self._core.lights
        each = (
            ReadOnlyDict(
                light,
                f"lights are read-only; world.set_light({number}, ...) changes the light, dict(light) is a copy",
            )
            for number, light in enumerate(lights)
        )
        return ReadOnlyList(
            each, "lights are read-only; world.add_light, set_light or remove_light changes them"
        )

    @property
    def fog(self) -> dict[str, Any] | None:
        """The fog as a read-only dict with the keys of `set_fog`, or None.

        A `visibility` is given as `extinction`.
        """
        fog = self._core.fog
        return (
            None if fog is None else ReadOnlyDict(fog, "the fog is read-only; world.set_fog(...) changes it")
        )

    @property
    def cameras(self) -> dict[str, Camera]:
        """The cameras by name, as a read-only dict; `default_camera` returns the first camera."""
        found = {name: Camera._of(camera, self.up) for name, camera in self._core.cameras}
        return ReadOnlyDict(
            found, "cameras are read-only; world.add_camera, set_camera or remove_camera changes them"
        )

    @property
    def _first_camera(self) -> str | None:
        """The name of the default camera; None if the default camera frames the world.

        It is the first camera. Cameras that a robot's file has on links are omitted, because they often show
        the robot's surroundings instead of the robot; cameras on the root link, such as MuJoCo's world, are
        included.
        """
        inner = {name for robot in self._robots.values() for name in robot._inner_cameras}
        return next((name for name, _ in self._core.cameras if name not in inner), None)

    @property
    def rigs(self) -> dict[str, Rig]:
        """The rigs by name; their cameras are among `cameras`, as rig/camera."""
        found = {
            rig.name: Rig._of(rig, self.up, read_mounted_sensors(rig.sensors(), "z"))
            for rig in _core.world_rigs(self._core)
        }
        return ReadOnlyDict(found, "rigs are read-only; world.add_rig adds a rig")

    @property
    def sensors(self) -> dict[str, Sensor]:
        """The sensors that are not cameras, in world coordinates, by name.

        A rig's sensors are called rig/name. In a world at a time (`world.at(t)`), the video and the sensors'
        trajectories determine their poses, and lidars move during their frame. A sensor whose class has not been
        imported is omitted with a notice. Raises `LidarError` for invalid settings of a lidar.
        """
        found = self._sensors_at(self._core.time)
        return ReadOnlyDict(found, "sensors are read-only; world.add_sensor and add_rig add sensors")

    def _sensors_at(self, time: float | None) -> dict[str, Sensor]:
        """The sensors at a time of the world's motion; None if the world is at rest."""
        rig_at = None if self.video is None else self.rig_at
        return sensors_of(self._core, self.rigs.values(), rig_at, time)

    def _check_sensors(self, path: str = "") -> None:
        """Raises the error of an invalid lidar, with the path of the world file."""
        if not self.has_sensors:
            return
        try:
            with collected():
                self._sensors_at(None)
        except Error as error:
            raise type(error)(f"{path}: {error}" if path else str(error), code=error.code) from None

    @property
    def has_sensors(self) -> bool:
        """True if the world has sensors that are not cameras (`sensors`)."""
        rigs = _core.world_rigs(self._core)
        return bool(_core.world_sensors(self._core)) or any(rig.sensors() for rig in rigs)

    @property
    def robots(self) -> dict[str, Robot]:
        """The robots by name, as a read-only dict; `set_joints` moves a robot."""
        return ReadOnlyDict(
            self._robots, "robots are read-only; world.add_robot adds a robot, world.set_joints moves it"
        )

    @property
    def counts(self) -> dict[str, int]:
        """The numbers of objects, meshes, triangles, vertices, materials and other contents.

        The names also include mesh_triangles and zero_area_triangles. In `triangles`, a mesh that several objects share
        counts once per object; in `mesh_triangles`, it counts once. Triangles of zero area stay in the mesh, but no ray
        hits them.
        """
        return ReadOnlyDict(
            self._core.counts, "counts are read-only; world.add_object and remove_object change the world"
        )

    @property
    def textures(self) -> list[str]:
        """The names of the textures' image files."""
        return self._core.textures

    @property
    def bounds(self) -> Floats | None:
        """The lower and upper corner [2, 3] of the world's bounding box, in metres.

        None for an empty world.
        """
        bounds = self._core.bounds
        remedy = "bounds are read-only; world.set_object(name, matrix=...) moves an object"
        return None if bounds is None else read_only_array(bounds, remedy, WorldError)

    @property
    def texture_memory(self) -> int | None:
        """The limit of the textures' memory in bytes; None for no limit."""
        return self._core.texture_memory

    @property
    def notices(self) -> list[Notice]:
        """Notices about parts that were omitted, repaired or assumed when the world was built.

        Each notice is also issued as a warning, a `raycam.Notice`, when it arises.
        """
        return self._core.notices

    @contextlib.contextmanager
    def _warning(self) -> Iterator[None]:
        """Context manager for a change; issues the notices that the change adds."""
        before = len(self._core.notices)
        yield
        warn_all(self._core.notices[before:])

    def _derived(self, core: CoreWorld) -> Self:
        """Returns a world derived from this world; warns of its additional notices."""
        known = set(self._core.notices)
        warn_all(notice for notice in core.notices if notice not in known)
        world = self._of(core)
        world._folder = self._folder
        world._robots = {name: robot._copy() for name, robot in self._robots.items()}
        world._is_up_assumed = self._is_up_assumed
        return world

    @property
    def render_settings(self) -> dict[str, Any]:
        """The `[render]` section of the world file.

        Its values are defaults for the arguments of `raycam.render`.
        """
        return ReadOnlyDict(
            self._core.render_settings,
            "render_settings are read-only; they come from the world file: pass options to raycam.render",
        )

    def camera(self, name: str) -> Camera:
        """Returns the camera of this name.

        Raises `WorldError`, with the nearest name, for an unknown name.
        """
        if not isinstance(name, str):
            raise WorldError(
                f"camera names must be strings, got {name!r}; options: {', '.join(self.cameras) or 'none'}",
                code="wrong_type",
            )
        return Camera._of(self._core.camera(name), self.up)

    # Copies, times and variants ---------------------------------------------------------------------------

    def with_cameras(self, cameras: Mapping[str, Camera]) -> Self:
        """Returns a copy with more cameras, which shares the acceleration structures.

        `cameras` maps names to cameras. A number is appended to names that are already used.
        """
        more = [(name, camera._core) for name, camera in cameras.items()]
        return self._derived(_core.world_with_cameras(self._core, more))

    def copy(self) -> Self:
        """Returns a copy that shares the acceleration structures.

        Later changes affect only one of the two worlds.
        """
        return self.with_cameras({})

    def __copy__(self) -> Self:
        """Returns a copy that shares the acceleration structures, for `copy.copy`.

        Later changes affect only one of the two worlds.
        """
        return self.with_cameras({})

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Returns a copy as `copy.copy` does, because the shared parts never change."""
        return self.with_cameras({})

    @property
    def video(self) -> Video | None:
        """The world's video, or None."""
        video = self._core.video
        return None if video is None else Video(*video)

    @property
    def animations(self) -> list[Animation]:
        """The animations of the world's glTF file."""
        return [Animation(*animation) for animation in self._core.animations]

    def at(self, time: float, animation: str | int | None = None) -> Self:
        """Returns the world at a time of its video and of an animation.

        `time` is in seconds, `animation` is a name or number (default: the animation of an earlier call of `at`, or the
        first). Parts that do not move are shared with this world; meshes that deform keep their triangle ids. For a
        camera with a shutter, `time` is the middle of the exposure. Raises `WorldError` for an unknown animation and a
        time that is not finite.
        """
        if isinstance(animation, str):
            animation = self._core.find_animation(animation)
        elif animation is not None:
            animation = whole("animation", animation, 0, len(self.animations) - 1, error=WorldError)
        time = real("time", time, what="a time in seconds", error=WorldError)
        moment = self._derived(self._core.at(time, animation))
        for robot in moment._robots.values():
            robot._values = robot._values_at(time)
        return moment

    @property
    def variants(self) -> list[str]:
        """The names of glTF material variants, or all variants of a USD file.

        Variants of a USD file are given as "SET=NAME", the form that `load` accepts.
        """
        return self._core.variants or list(self._stage_variants)

    def with_variant(self, name: str) -> Self:
        """Returns the world with the glTF material variant `name`.

        Raises `WorldError` for an unknown name, with the nearest name. USD variants also change the geometry; select
        them with `load(path, variant=...)`.
        """
        if self._stage_variants:
            raise WorldError(
                f"variants of USD are selected when the file is loaded: load(path, variant={name!r})",
                code="conflicting_values",
            )
        return self._derived(
            self._core.with_variant(one_of("variant", name, self.variants, error=WorldError))
        )

    def camera_at(self, camera: Camera, time: float) -> Camera:
        """Returns `camera` as the video moves it, at `time` in seconds.

        Raises `WorldError` without a video.

        Some cameras of the world have their own keyframes, for example on a robot's link. If `camera` has the pose of
        such a camera, it moves with that camera. Otherwise, it moves by the orbit or by the keyframes without a name.

        For a camera with an open shutter (`Camera.exposing`), the motion during the exposure is approximated by 32
        linear steps.
        """
        core = check_camera(camera)._core
        return Camera._of(
            self._core.video_camera(core, real("time", time, what="a time in seconds", error=WorldError)),
            self.up,
        )

    def rig_at(self, rig: Rig, time: float) -> Rig:
        """Returns `rig` as the video moves it, at `time` in seconds.

        The keyframes with the rig's name move the rig. Without such keyframes, it moves like the camera.
        """
        return rig._moved(_core.world_rig_at(self._core, rig._core, float(time)))

    # Plain triangles --------------------------------------------------------------------------------------

    def triangles(self, object: int | None = None) -> Floats:
        """Returns the corners of all visible triangles in the world, float64 [n, 3, 3].

        The triangles are ordered by (instance, triangle).

        With `object`, returns only the triangles of the object with this id, visible or not; raises `SettingsError`
        for an unknown id.
        """
        if object is not None:
            object = whole("object", object, 0, self._core.object_count - 1)
        return self._core.triangles(object)

    def triangle_ids(self) -> npt.NDArray[np.int32]:
        """The ids (instance, triangle) of `triangles`, int32 [n, 2]."""
        return self._core.triangle_ids()

    def triangle_colors(self) -> npt.NDArray[np.float32]:
        """Returns one linear base colour for each triangle of `triangles`, float32 [n, 3].

        It is the product of the material's colour, the face colour, the mean of the vertex colours, and the texture's
        value at the triangle's centre.
        """
        return self._core.triangle_colors()

    def prepare(self, *, threads: int | None = None) -> Self:
        """Builds the acceleration structures now; returns the same world.

        Otherwise, they are built for the first image. `threads` is the number of threads (default: all).
        """
        with no_fork():
            self._core.prepare(thread_count(threads))
        return self


def _matrix(rows: npt.ArrayLike, name: str) -> Floats:
    """The read-only matrix [4, 4] of the object with this name."""
    remedy = f"objects are read-only; world.set_object({name!r}, matrix=...) moves the object; matrix.copy() is a copy"
    return read_only_array(rows, remedy, WorldError)
