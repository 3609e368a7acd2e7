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
from ..errors import Notice, WorldError
from ..io.fork_guard import no_fork
from ..notices import warn_all
from ..read_only import ReadOnlyDict, ReadOnlyList, read_only_array
from ..rig import Rig
from ..robots import Robot
from .parts import Animation, Object, Video

__all__ = ["WorldContents"]


class WorldContents:
    """Base of `World` with what a world contains."""

    __slots__ = ("_bare", "_core", "_folder", "_robots", "_stage_variants")

    _core: CoreWorld
    _folder: str | None
    _bare: Self | None
    _stage_variants: tuple[str, ...]
    _robots: dict[str, Robot]

    @classmethod
    def _of(cls, core: CoreWorld, stage_variants: Sequence[str] = ()) -> Self:
        world = cls.__new__(cls)
        world._core, world._folder, world._bare = core, None, None
        world._stage_variants = tuple(stage_variants)
        world._robots = {}
        return world

    # Contents ---------------------------------------------------------------------------------------------

    @property
    def up(self) -> Literal["z", "y"]:
        """The up axis."""
        return self._core.up

    @property
    def objects(self) -> list[Object]:
        """The objects in the order of their ids: records that are read-only. `set_object` changes an object."""
        found = [
            Object(number, name, category, mesh, triangles, _matrix(matrix, name), *flags)
            for number, (name, category, mesh, triangles, matrix, *flags) in enumerate(self._core.objects)
        ]
        return ReadOnlyList(
            found, "objects are read-only: world.add_object, set_object or remove_object changes them"
        )

    @property
    def categories(self) -> dict[int, str]:
        """The names of the objects' categories by id, the value in the channel `category`.

        A category that is a whole number is its own id. Other names get the free ids from 1, in the order of the
        objects.
        """
        return ReadOnlyDict(
            self._core.categories,
            "categories are read-only; world.set_object(name, category=...) changes an object's category",
        )

    @property
    def lights(self) -> list[dict[str, Any]]:
        """The lights as dicts that `add_light` takes: records that are read-only. `set_light` changes a light."""
        lights = self._core.lights
        each = (
            ReadOnlyDict(
                light,
                f"lights are read-only: world.set_light({number}, ...) changes it, dict(light) is a copy",
            )
            for number, light in enumerate(lights)
        )
        return ReadOnlyList(
            each, "lights are read-only: world.add_light, set_light or remove_light changes them"
        )

    @property
    def cameras(self) -> dict[str, Camera]:
        """The cameras by name, the default camera first, in a dict that is read-only."""
        found = {name: Camera._of(camera, self.up) for name, camera in self._core.cameras}
        return ReadOnlyDict(
            found, "cameras are read-only: world.add_camera, set_camera or remove_camera changes them"
        )

    @property
    def rigs(self) -> dict[str, Rig]:
        """The rigs by name; their cameras are among `cameras`, as rig/camera."""
        found = {rig.name: Rig._of(rig, self.up) for rig in _core.world_rigs(self._core)}
        return ReadOnlyDict(found, "rigs are read-only; world.add_rig adds a rig")

    @property
    def robots(self) -> dict[str, Robot]:
        """The robots by name, in a dict that is read-only; `set_joints` moves them."""
        return ReadOnlyDict(
            self._robots, "robots are read-only; world.add_robot adds a robot, world.set_joints moves it"
        )

    @property
    def counts(self) -> dict[str, int]:
        """The numbers of objects, meshes, triangles, mesh_triangles, zero_area_triangles, vertices, materials, ...

        `triangles` count once for each object that shows them. Triangles of zero area are kept and never hit.
        """
        return ReadOnlyDict(
            self._core.counts, "counts are read-only; world.add_object and remove_object change the world"
        )

    @property
    def textures(self) -> list[str]:
        """The names of the image files."""
        return self._core.textures

    @property
    def bounds(self) -> Floats | None:
        """The lower and upper corner [2, 3] of the world's bounding box, metres; None for an empty world."""
        bounds = self._core.bounds
        remedy = "bounds are read-only; world.set_object(name, matrix=...) moves an object"
        return None if bounds is None else read_only_array(bounds, remedy, WorldError)

    @property
    def texture_memory(self) -> int | None:
        """The bound on the memory of images in bytes; None for no bound."""
        return self._core.texture_memory

    @property
    def notices(self) -> list[Notice]:
        """Notices from reading and building: parts that were skipped, repaired or assumed.

        Each is also warned as a `raycam.Notice` when it arises.
        """
        return self._core.notices

    @contextlib.contextmanager
    def _warning(self) -> Iterator[None]:
        """Context of a change, which warns of the notices that it adds."""
        before = len(self._core.notices)
        yield
        warn_all(self._core.notices[before:])

    def _derived(self, core: CoreWorld) -> Self:
        """A world made of this one; warns of the notices that it has in addition."""
        known = set(self._core.notices)
        warn_all(notice for notice in core.notices if notice not in known)
        world = self._of(core)
        world._folder = self._folder
        world._robots = {name: robot._copy() for name, robot in self._robots.items()}
        return world

    @property
    def render_settings(self) -> dict[str, Any]:
        """The settings of `[render]` of the world file: defaults of the arguments of `raycam.render`."""
        return ReadOnlyDict(
            self._core.render_settings,
            "render_settings are read-only; they come from the world file: pass options to raycam.render",
        )

    def camera(self, name: str) -> Camera:
        """The camera of this name; raises `WorldError` with the nearest known name."""
        if not isinstance(name, str):
            raise WorldError(
                f"camera names must be strings, got {name!r}; options: {', '.join(self.cameras) or 'none'}",
                code="wrong_type",
            )
        return Camera._of(self._core.camera(name), self.up)

    # Copies, times and variants ---------------------------------------------------------------------------

    def with_cameras(self, cameras: Mapping[str, Camera]) -> Self:
        """A copy with more cameras, which shares the acceleration structures. Names that are taken get a number."""
        more = [(name, camera._core) for name, camera in cameras.items()]
        return self._derived(_core.world_with_cameras(self._core, more))

    def copy(self) -> Self:
        """A copy, which shares all that is built; changes of one do not reach the other."""
        return self.with_cameras({})

    def __copy__(self) -> Self:
        """A copy, which shares the acceleration structures; changes of one do not reach the other."""
        return self.with_cameras({})

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """A copy, as `copy.copy`: what both share never changes."""
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
        """The world at a time in seconds of its video and of an animation, by name or number (default: the first).

        Parts that do not move are shared with this world; meshes that deform keep their triangles. For a camera with a
        shutter, `time` is the middle of the exposure. Raises `WorldError` for an unknown animation and a time that
        is not finite.
        """
        if isinstance(animation, str):
            animation = self._core.find_animation(animation)
        elif animation is not None:
            animation = whole("animation", animation, 0, len(self.animations) - 1, error=WorldError)
        return self._derived(self._core.at(real("time", time, what="seconds", error=WorldError), animation))

    @property
    def variants(self) -> list[str]:
        """The names of the material variants of glTF; for USD, all variants as "SET=NAME", for `load(variant=)`."""
        return self._core.variants or list(self._stage_variants)

    def with_variant(self, name: str) -> Self:
        """The same world with the material variant of this name; raises `WorldError` with the nearest known name.

        Variants of USD change the geometry as well: `load(path, variant=)` selects them.
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
        """`camera` as the video moves it, at a time in seconds; raises `WorldError` without a video.

        For a camera with an open shutter (`Camera.exposing`), the motion during the exposure is approximated by 32
        linear steps.
        """
        core = check_camera(camera)._core
        return Camera._of(
            self._core.video_camera(core, real("time", time, what="seconds", error=WorldError)), self.up
        )

    def rig_at(self, rig: Rig, time: float) -> Rig:
        """`rig` as the video moves it, at a time in seconds: by the keyframes of its name, or else like the camera."""
        return rig._moved(_core.world_rig_at(self._core, rig._core, float(time)))

    # Plain triangles --------------------------------------------------------------------------------------

    def triangles(self, object: int | None = None) -> Floats:
        """The corners of all visible triangles in the world, float64 [n, 3, 3], in the order of (instance, triangle).

        With `object`, the triangles of the object with this id, visible or not; raises `SettingsError` for an unknown
        id.
        """
        if object is not None:
            object = whole("object", object, 0, self._core.object_count - 1)
        return self._core.triangles(object)

    def triangle_ids(self) -> npt.NDArray[np.int32]:
        """The ids (instance, triangle) of `triangles`, int32 [n, 2]."""
        return self._core.triangle_ids()

    def triangle_colors(self) -> npt.NDArray[np.float32]:
        """One linear base colour for each of `triangles`, float32 [n, 3].

        The product of the material's colour, the face's colour, the mean of the vertex colours, and the texture at the
        triangle's centre.
        """
        return self._core.triangle_colors()

    def prepare(self, *, threads: int | None = None) -> Self:
        """Builds the acceleration structures now instead of at the first picture; returns the world."""
        with no_fork():
            self._core.prepare(thread_count(threads))
        return self


def _matrix(rows: npt.ArrayLike, name: str) -> Floats:
    """The read-only matrix [4, 4] of the object of this name."""
    remedy = f"objects are read-only; world.set_object({name!r}, matrix=...) moves the object; matrix.copy() is a copy"
    return read_only_array(rows, remedy, WorldError)
