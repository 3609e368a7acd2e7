"""Worlds: loaded from a file, or built by hand."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Unpack

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import Floats, floats, one_of, real, size_of, thread_count, whole
from ..camera import Camera
from ..camera.asked import only_camera
from ..errors import FormatError, Notice, WorldError
from ..io import memory_limits
from ..io.atomic_files import write
from ..io.fork_guard import no_fork
from ..io.html_form import html_table
from ..io.other_names import no_attribute
from ..notices import warn_all
from ..rig import Rig
from .chosen import one_object
from .description import corner_values, indices, plain
from .edit import changed_light, changed_object
from .framing import framing_camera
from .keys import LightKeys, ObjectChanges, ObjectKeys, light_keys, object_keys
from .parts import Animation, Object, Video
from .point_queries import PointQueries, Topology
from .ray_queries import RayQueries
from .read_only import ReadOnlyDict, ReadOnlyList, matrix_of
from .studio import add_ground, add_studio, studio_world
from .targets import aimed
from .usd_files import add_usd_object, is_usd, usd_named

__all__ = ["Animation", "Object", "Topology", "Video", "World"]


class World(RayQueries, PointQueries):
    """Objects (placed meshes), lights and cameras.

    `up` ("z" or "y") affects roll, pitch and yaw, orbits and the sky; vertices are never rotated.

    `add_object`, `add_mesh` and `add_light` open the given files (meshes, textures, skies, IES profiles) in any folder.
    Relative names start from `folder` (default: the current folder). Files named in a file inside `folder` are read
    from anywhere inside `folder`, those of another file only from the folder of that file, as in `load`.

    A world is prepared for tracing on first use, and again after changes; unchanged parts are not rebuilt. Several
    threads may use a world at the same time.

    `texture_memory` bounds the memory of images, in bytes or as "512 MiB". If the images with their mip maps exceed it,
    all of them are kept in a temporary file (in `TMPDIR`, else `/var/tmp`) and read tile by tile; pictures stay the
    same.
    """

    __slots__ = ("_bare", "_core", "_folder")

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

    @classmethod
    def _of(cls, core: _core.World) -> World:
        world = cls.__new__(cls)
        world._core, world._folder, world._bare = core, None, None
        return world

    @classmethod
    def from_dict(
        cls,
        description: Mapping[str, Any],
        *,
        folder: str | os.PathLike[str] = ".",
        texture_memory: int | str | None = None,
    ) -> World:
        """A world from a dict with the keys of a world file: `up`, `camera`, `object`, `light`, `render`, `video`.

        Lists of numbers may be NumPy arrays. Named files must be in `folder`, as for a world file, so that an untrusted
        description can read nothing else. Raises the errors of `load`, without file and line.
        """
        limit = memory_limits.parse_size("texture_memory", texture_memory)
        with usd_named():
            world = cls._of(_core.world_from_dict(plain(description), os.fspath(folder), limit))
        warn_all(world.notices)
        return world

    def to_bytes(self) -> bytes:
        """Serialises the world exactly, with all files, for `World.from_bytes` of the same version of raycam.

        Equal worlds give equal bytes, whatever folder their files are in; backgrounds of cameras stay where they are,
        and the bytes have their paths. Raises `WorldError` if the textures, which
        the bytes include, exceed `texture_memory`.
        """
        return _core.world_to_bytes(self._core)

    @classmethod
    def from_bytes(cls, data: bytes, *, texture_memory: int | str | None = None) -> World:
        """The world that `to_bytes` serialised; raises `FormatError` or `WorldError` for invalid bytes."""
        if not isinstance(data, bytes | bytearray | memoryview):
            raise FormatError(f"data must be the bytes of World.to_bytes, not {type(data).__name__}")
        return cls._of(
            _core.world_from_bytes(
                bytes(data), memory_limits.parse_size("texture_memory", texture_memory), ""
            )
        )

    def to_gltf(self, path: str | os.PathLike[str]) -> list[Notice]:
        """Writes a GLB file (glTF 2.0); returns notices about properties that glTF cannot represent.

        Written are meshes, materials (with their `KHR_materials_*` extensions), textures, variants, cameras, suns,
        bulbs, spots, the node tree and its animations. Positions become float32. A z-up world is put below a node that
        rotates it to glTF's y-up axes. Raises `FormatError` if the file would exceed 4 GiB, and `OSError`.
        """
        data, notices = _core.world_to_gltf(self._core)
        write(path, data)
        warn_all(notices)
        return notices

    def with_cameras(self, cameras: Mapping[str, Camera]) -> World:
        """A copy with more cameras, which shares the acceleration structures. Names that are taken get a number."""
        more = [(name, camera._core) for name, camera in cameras.items()]
        return self._derived(_core.world_with_cameras(self._core, more))

    def copy(self) -> World:
        """A copy, which shares all that is built; changes of one do not reach the other."""
        return self.with_cameras({})

    def __copy__(self) -> World:
        """A copy, which shares the acceleration structures; changes of one do not reach the other."""
        return self.with_cameras({})

    def __deepcopy__(self, memo: dict[int, Any]) -> World:
        """A copy, as `copy.copy`: what both share never changes."""
        return self.with_cameras({})

    def __reduce__(self) -> tuple[Callable[..., World], tuple[Any, ...]]:
        """Pickles the world as `to_bytes` does; raises its errors."""
        return _from_pickle, (self.to_bytes(), self._folder, self.texture_memory)

    # Building ---------------------------------------------------------------------------------------------

    def add_mesh(
        self,
        vertices: npt.ArrayLike,
        faces: npt.ArrayLike,
        *,
        name: str | None = None,
        face_colors: npt.ArrayLike | None = None,
        vertex_colors: npt.ArrayLike | None = None,
        uvs: npt.ArrayLike | None = None,
        normals: npt.ArrayLike | None = None,
        material: Mapping[str, Any] | None = None,
        **placement: Any,
    ) -> int:
        """Adds a mesh as an object; returns the object's id, its value in the channel `instance`.

        `vertices` [n, 3] are float64 in metres, `faces` [m, 3] indices from 0, counter-clockwise seen from outside.
        `face_colors` [m, 3] and `vertex_colors` [n, 3] (interpolated) are linear in 0..1 as floats, sRGB as uint8.
        `uvs` [n, 2] have v = 0 at the top row of the texture. `normals` [n, 3] are used for shading. `material` has the
        keys `color`, `diffuse`, `specular`, `shininess`, `texture`, `textures`, `type`, ... of the schema, `placement`
        the keys `location`, `roll`, `pitch`, `yaw`, `scale` or `matrix`, `category` and `refine`.

        Raises `WorldError` for an empty mesh, numbers that are not finite, indices out of range, arrays of the wrong
        shape, colours outside 0..1 and unknown keys.
        """
        corners = floats("vertices", vertices, ("n", 3), error=WorldError)
        optional = {
            "face_colors": corner_values("face_colors", face_colors, 3),
            "vertex_colors": corner_values("vertex_colors", vertex_colors, 3),
            "uvs": corner_values("uvs", uvs, 2),
            "normals": corner_values("normals", normals, 3),
        }
        description: dict[str, Any] = {"vertices": corners, "triangles": indices("faces", faces)}
        description |= {key: value for key, value in optional.items() if value is not None}
        if material is not None and not isinstance(material, Mapping):
            raise WorldError(f"material must be a table of keys and values, not {material!r}")
        for part in ({"name": name} if name is not None else {}, material or {}, placement):
            twice = description.keys() & part.keys()
            if twice:
                raise WorldError(f"{', '.join(sorted(twice))}: given twice")
            description |= part
        with self._warning():
            return _core.world_add_object(self._core, plain(description), None)

    def add_object(
        self,
        description: Mapping[str, Any] | str | os.PathLike[str] | None = None,
        /,
        **keys: Unpack[ObjectKeys],
    ) -> int:
        """Adds an object, described as in `[[object]]` of a world file; returns its id.

        Takes a dict, keywords, or both; the path of a mesh file, or the word for a shape:
        `add_object(box={"size": 2}, location=[0, 0, 1], color="#cc4422")`, `add_object("sphere", radius=2)`,
        `add_object(mesh="bunny.ply", refine=1)`, `add_object(instance_of="box", location=[3, 0, 1])`.
        The keys of a shape may stand beside it, and a number or list in its place is the size of a box or plane and the
        radius of a sphere.
        With `shadow_catcher=True`, pictures with a transparent background or a photograph behind show the shadows on it
        alone, as on a ground that the photograph shows; in others it is a surface.
        The up axis of a glTF file becomes that of the world, with a notice, except with `upright=False`.
        A USD file becomes one object, without its lights and cameras, turned to the world's up axis except with
        `upright=False`. Raises `WorldError` with the key and the nearest valid name, and the errors of `load`.
        """
        given = object_keys(description, dict(keys))
        with self._warning():
            if is_usd(given.get("mesh")):
                return add_usd_object(self._core, given, self._folder)
            return _core.world_add_object(self._core, plain(given), None)

    def add_light(
        self, description: Mapping[str, Any] | str | None = None, /, **keys: Unpack[LightKeys]
    ) -> int:
        """Adds a light, described as in `[[light]]` of a world file; returns its index.

        Takes a dict, keywords, or both; or the type and keywords; one number for a strength is grey:
        `add_light("sun", direction=[-1, -1, -2], irradiance=3)`,
        `{"type": "point", "position": [0, 0, 3], "power": [60, 60, 60], "radius": 0.05}`,
        `{"type": "environment", "image": "/data/noon.hdr"}`, whose image may be an array [h, w, 3] (linear floats, or
        sRGB as uint8), `{"type": "sky", "radiance": [1, 1, 1]}`.
        `target` aims a light: a point [3] in the world, or the name of an object, whose middle is meant. It replaces
        the `direction` of a sun, spot, disk or ies light, from its `position` to the target (a sun's position only says
        where it shines from), and the edges `u` and `v` of an area light of `size` (width, height).
        Raises `WorldError`, and `FormatError` and `OSError` for files.
        """
        with self._warning():
            given = aimed(self, light_keys(description, dict(keys)))
            return _core.world_add_light(self._core, plain(given), None)

    def add_ground(
        self,
        *,
        height: float | None = None,
        size: float | None = None,
        color: npt.ArrayLike | str | None = None,
        name: str = "ground",
        **material: Any,
    ) -> int:
        """Adds a level square under the world, for shadows to fall on; returns its id.

        `height` is its coordinate along the up axis in metres (default: just below the lowest point), `size` its side
        (default: a hundred diagonals of the world's bounds). `color` (default: a light grey) and `material` are
        keys of `add_object`; a taken `name` gets a number. Raises `WorldError` for an empty world without both numbers.
        """
        return add_ground(self, height=height, size=size, color=color, name=name, **material)

    def add_studio(self, camera: Camera | None = None, *, ground: bool = True) -> None:
        """Adds the studio in which worlds without lights and cameras are shown.

        A soft key light from the upper left of `camera` (default: the default camera), a grey room that metals reflect,
        and, with `ground`, a floor. Floor and background have the linear radiance 0.62 where no shadow falls. There is
        no floor under a world that is seen from below. Pictures are best with `integrator="path"`, `max_depth=6`.
        """
        add_studio(self, camera, ground=ground)

    def add_camera(self, camera: Camera, name: str = "camera") -> None:
        """Adds a camera; a name that is taken gets a number. The first camera is the default camera."""
        hint = ": add_camera(camera, name)" if isinstance(camera, str) else ""
        camera = only_camera(camera, hint)
        self._core.add_camera(_camera_name(name), camera._core)

    def add_rig(self, rig: Rig) -> None:
        """Adds a rig under its name; its cameras are appended under the names rig/camera."""
        _core.world_add_rig(self._core, rig._core)

    def set_video(self, description: Mapping[str, Any] | None = None, /, **keys: Any) -> None:
        """Replaces the world's video, described as in `[video]` of a world file.

        Takes a dict, keywords, or both: `set_video(fps=24, seconds=4, orbit={"target": [0, 0, 0.5]})`,
        `set_video(keyframe=[{"time": 0, "object": "box", "location": [0, 0, 0]}, ...])`. Raises `WorldError`.
        """
        with self._warning():
            _core.world_set_video(self._core, plain({**(description or {}), **keys}))

    # Changing ---------------------------------------------------------------------------------------------

    def set_object(self, which: str | int, /, **keys: Unpack[ObjectChanges]) -> None:
        """Changes an object, by name or number: any key of `add_object` and `add_mesh`. What is not given stays.

        `set_object("cup", matrix=T)`, `set_object("cup", location=[0, 0, 1], yaw=30)`, `set_object(3, color="red")`,
        `set_object("cup", visible=False)`. Placement is given as a whole: with angles and no location, the object is at
        the origin, as in `add_object`. `vertices` [n, 3] alone move the vertices of the mesh, n as before; if it has
        shading normals, `normals` are given too, or None for flat faces. With `faces`, or another shape, it is another
        mesh: it keeps the object's material, but that of `mesh="file"` comes from the file. A mesh or material that
        other objects have too stays theirs. `visible=False` takes the object out of all pictures, shadows, light and
        queries; its number stays, and so do those of others.

        A change is cheap: what did not change is not built again. It is atomic, and pictures that other threads are
        rendering show the world before or after it. Keyframes and animations that move the object still do, at
        `at(time)`; in a world that `at` returned, the object stays where it is put.

        Raises `WorldError` with the nearest name for an unknown object, for a matrix that flattens, for arrays that do
        not fit, and the errors of `add_object`; the world is then as before.
        """
        with self._warning():
            _core.world_set_object(self._core, one_object(which), plain(changed_object(dict(keys))))

    def remove_object(self, which: str | int) -> None:
        """Removes an object, by name or number, with the mesh, materials and images that nothing else uses.

        Numbers are positions, as in a list: those of the objects after it, and of materials after its own, move down.
        Names stay; videos, animations and variants follow. `set_object(which, visible=False)` hides an object and keeps
        all numbers. Raises `WorldError` with the nearest name.
        """
        _core.world_remove_object(self._core, one_object(which))

    def set_light(
        self, number: int, description: Mapping[str, Any] | str | None = None, /, **keys: Unpack[LightKeys]
    ) -> None:
        """Changes a light by its index in `lights`: any key of `add_light`. What is not given stays.

        `set_light(0, irradiance=2)`; with another `type`, all is given anew. Raises `WorldError`, and the errors of
        `add_light`; the world is then as before.
        """
        lights = self.lights
        number = whole("light", number, 0, len(lights) - 1, error=WorldError)
        changed, keeps_file = changed_light(lights[number], description, dict(keys))
        with self._warning():
            _core.world_set_light(self._core, number, plain(aimed(self, changed)), keeps_file, None)

    def remove_light(self, number: int) -> None:
        """Removes a light by its index in `lights`; those after it move down. Raises `WorldError`."""
        _core.world_remove_light(self._core, whole("light", number, 0, (1 << 62), error=WorldError))

    def set_camera(self, name: str, camera: Camera) -> None:
        """Replaces the camera of this name.

        Raises `WorldError` with the nearest known name, and for a camera of a rig, which moves as a whole.
        """
        if not isinstance(camera, Camera):
            raise WorldError(f"set_camera: expected a raycam.Camera, not {camera!r}")
        _core.world_set_camera(self._core, _camera_name(name), camera._core)

    def remove_camera(self, name: str) -> None:
        """Removes the camera of this name; raises the errors of `set_camera`."""
        _core.world_remove_camera(self._core, _camera_name(name))

    # Contents ---------------------------------------------------------------------------------------------

    @property
    def up(self) -> Literal["z", "y"]:
        """The up axis."""
        return self._core.up

    @property
    def objects(self) -> list[Object]:
        """The objects in the order of their ids: records that are read-only. `set_object` changes an object."""
        found = [
            Object(number, name, category, mesh, triangles, matrix_of(matrix, name), *flags)
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
        return self._core.categories

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
        return {rig.name: Rig._of(rig, self.up) for rig in _core.world_rigs(self._core)}

    @property
    def counts(self) -> dict[str, int]:
        """The numbers of objects, meshes, triangles, mesh_triangles, zero_area_triangles, vertices, materials, ...

        `triangles` count once for each object that shows them. Triangles of zero area are kept and never hit.
        """
        return self._core.counts

    @property
    def textures(self) -> list[str]:
        """The names of the image files."""
        return self._core.textures

    @property
    def bounds(self) -> Floats | None:
        """The lower and upper corner [2, 3] of the world's bounding box, metres; None for an empty world."""
        bounds = self._core.bounds
        return None if bounds is None else np.array(bounds)

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

    def _in_studio(self, camera: Camera, *, ground: bool = True) -> World:
        """A copy in the studio; see `studio_world`."""
        return studio_world(self, camera, ground=ground)

    def _derived(self, core: _core.World) -> World:
        """A world made of this one; warns of the notices that it has in addition."""
        known = set(self._core.notices)
        warn_all(notice for notice in core.notices if notice not in known)
        world = World._of(core)
        world._folder = self._folder
        return world

    @property
    def render_settings(self) -> dict[str, Any]:
        """The settings of `[render]` of the world file: defaults of the arguments of `raycam.render`."""
        return self._core.render_settings

    def camera(self, name: str) -> Camera:
        """The camera of this name; raises `WorldError` with the nearest known name."""
        return Camera._of(self._core.camera(name), self.up)

    def default_camera(self, size: Iterable[int] = (640, 480)) -> Camera:
        """The first camera, or one that frames the whole world in a picture of `size` (width, height)."""
        wanted = size_of(tuple(size))
        return (
            Camera._of(self._core.default_camera(wanted), self.up)
            if self.cameras
            else self.view_from(size=wanted)
        )

    def view_from(
        self,
        direction: str | npt.ArrayLike = "default",
        *,
        size: Iterable[int] = (640, 480),
        fov: float = 45.0,
        zoom: float = 1.0,
        camera: Camera | None = None,
    ) -> Camera:
        """A camera from which the whole world just fits into a picture of `size` (width, height).

        `direction` is "front", "back", "left", "right", "top", "bottom", "iso", "default" (from the front right above),
        or a vector [3] from the middle of the world to the camera. The front of a z-up world looks to -y, of a y-up
        world to +z, as in Blender and glTF. `fov` is the vertical field of view in degrees. `zoom` enlarges: 1 fills
        nine tenths of the picture. `camera`, a calibration without a pose say, keeps its size, K and lens, and is put
        where the world fits: `size` and `fov` are its own then. Raises `CameraError` for an empty world,
        `SettingsError` for other values.
        """
        return framing_camera(self, direction, size=size_of(tuple(size)), fov=fov, zoom=zoom, camera=camera)

    # Time -------------------------------------------------------------------------------------------------

    @property
    def video(self) -> Video | None:
        """The world's video, or None."""
        video = self._core.video
        return None if video is None else Video(*video)

    @property
    def animations(self) -> list[Animation]:
        """The animations of the world's glTF file."""
        return [Animation(*animation) for animation in self._core.animations]

    def at(self, time: float, animation: str | int | None = None) -> World:
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
        """The names of the material variants."""
        return self._core.variants

    def with_variant(self, name: str) -> World:
        """The same world with the material variant of this name; raises `WorldError` with the nearest known name."""
        return self._derived(
            self._core.with_variant(one_of("variant", name, self.variants, error=WorldError))
        )

    def camera_at(self, camera: Camera, time: float) -> Camera:
        """`camera` as the video moves it, at a time in seconds; raises `WorldError` without a video.

        For a camera with an open shutter (`Camera.exposing`), the motion during the exposure is approximated by 32
        linear steps.
        """
        core = only_camera(camera)._core
        return Camera._of(
            self._core.video_camera(core, real("time", time, what="seconds", error=WorldError)), self.up
        )

    def rig_at(self, rig: Rig, time: float) -> Rig:
        """`rig` as the video moves it, at a time in seconds: by the keyframes of its name, or else like the camera."""
        return Rig._of(_core.world_rig_at(self._core, rig._core, float(time)), self.up)

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

    def prepare(self, *, threads: int | None = None) -> World:
        """Builds the acceleration structures now instead of at the first picture; returns the world."""
        with no_fork():
            self._core.prepare(thread_count(threads))
        return self

    def _repr_html_(self) -> str:
        """The table of objects that a notebook shows, with lights and cameras below."""
        rows = [(item.id, item.name, item.category or "", item.triangles) for item in self.objects]
        notes = [f"light: {light['type']}" for light in self.lights]
        notes += [f"camera: {name}, {one.size[0]} x {one.size[1]}" for name, one in self.cameras.items()]
        return html_table(repr(self), ("id", "name", "category", "triangles"), rows, notes[:20])

    if not TYPE_CHECKING:  # type checkers shall see what is missing

        def __getattr__(self, name: str) -> Any:
            """Raises `AttributeError`, which says what is meant by a name of another library."""
            raise no_attribute(self, name)

    def __repr__(self) -> str:
        """The counts as text."""
        counts = self.counts
        return (
            f'World(up="{self.up}"): {counts["objects"]} objects, {counts["triangles"]} triangles, '
            f"{counts['lights']} lights, {counts['cameras']} cameras"
        )


def _camera_name(name: object) -> str:
    """Returns the name of a camera; raises `WorldError` for anything else."""
    if not isinstance(name, str):
        raise WorldError(f"a camera is called by its name, not {name!r}")
    return name


def _from_pickle(data: bytes, folder: str | None, texture_memory: int | None) -> World:
    world = World._of(_core.world_from_bytes(data, texture_memory, folder or ""))
    world._folder = folder
    return world
