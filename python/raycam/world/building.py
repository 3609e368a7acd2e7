"""Objects, lights and cameras of a world: adding, changing and removing them, and framing cameras."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Literal, Unpack

import numpy.typing as npt

from .. import _core
from ..arguments import floats, size_of, whole
from ..camera import Camera, check_camera
from ..errors import FormatError, Notice, WorldError
from ..notices import warn
from ..rig import Rig
from ..robots import FileResolver, JointValues, Robot, RobotModel, read_robots
from .chosen import one_object
from .contents import WorldContents
from .description import corner_values, indices, plain
from .edit import describe_light_change, describe_object_change
from .framing import framing_camera
from .joint_keyframes import expand_joint_keyframes
from .keys import LightKeys, ObjectChanges, ObjectKeys, light_keys, object_keys
from .robot_files import place_robot
from .robot_joints import move_robot
from .targets import aim_light
from .usd_files import add_usd_object, is_usd

__all__ = ["WorldBuilding"]


class WorldBuilding(WorldContents):
    """Base of `World` with the methods that change it, and with framing cameras."""

    __slots__ = ()

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
            raise WorldError(
                f"material must be a table of keys and values, not {material!r}", code="wrong_type"
            )
        for part in ({"name": name} if name is not None else {}, material or {}, placement):
            twice = description.keys() & part.keys()
            if twice:
                raise WorldError(f"{', '.join(sorted(twice))}: given twice", code="duplicate_name")
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
        A glTF file is turned from its up axis (y) to the world's, with a notice, except with `upright=False`. A
        `matrix` applies to the file's own axes: the file is then not turned, with a notice, except with `upright=True`.
        A USD file becomes one object, without its lights and cameras, and is turned in the same way. Raises
        `WorldError` with the key and the nearest valid name, and the errors of `load`.
        """
        given = object_keys(description, dict(keys))
        with self._warning():
            if is_usd(given.get("mesh")):
                return add_usd_object(self._core, given, self._folder)
            return _core.world_add_object(self._core, plain(given), None)

    def add_robot(
        self,
        path: str | os.PathLike[str],
        *,
        name: str | None = None,
        joints: JointValues | None = None,
        packages: Iterable[str | os.PathLike[str]] = (),
        folder: str | os.PathLike[str] | None = None,
        geometry: Literal["visual", "collision"] = "visual",
        category: Literal["link", "robot"] = "link",
        missing: Literal["error", "box"] = "error",
        clamp_joints: bool = False,
        xacro_args: Mapping[str, str] | None = None,
        **placement: Any,
    ) -> Robot:
        """Adds a robot from a file (.urdf, .xacro, .sdf with one model); returns it, as in `robots`.

        Every shape of a link becomes an object, named `robot/link`, `robot/link/2`, ..., with the category `link`
        or, with `category="robot"`, the robot's name. `name` is the robot's name (default: as in its file). `joints`
        are values by joint name or a vector (see `set_joints`). `placement` has the keys `location`, `roll`,
        `pitch`, `yaw` or `matrix` of the root link; in a y-up world, a robot is turned upright without `matrix`.

        Meshes are .stl, .obj, .ply, .off, .glb, .gltf, or .dae, which requires the `raycam[robots]` extra. Files are
        read from the package folder of the robot: the nearest folder above with package.xml, or else its own folder
        (the one above if it is called urdf, robots or similar). `package://NAME` is the folder NAME above the robot,
        beside its package, or in one of `packages`. With `folder`, nothing outside it is read.

        `geometry="collision"` shows collision shapes. `missing="box"` shows collision shapes, or a box of 0.1 m,
        instead of meshes that cannot be found, with a notice. A xacro file, which requires the `raycam[robots]` extra,
        is expanded with the arguments `xacro_args`, in a process that reads only these folders.

        Raises `FormatError` with lines for a malformed file, and with all missing meshes at once; `WorldError` for a
        taken name, unknown joints and invalid placement.
        """
        files = FileResolver(Path(path), folder, packages)
        if name is not None and (not isinstance(name, str) or not name):
            raise WorldError(f"a robot's name must be a string, got {name!r}")
        models = read_robots(path, files, xacro_args)
        if len(models) > 1:
            names = ", ".join(model.description.name for model in models[:10])
            raise FormatError(
                f"{os.fspath(path)}: the file contains {len(models)} models ({names}); raycam.load loads them all",
                code="unsupported_feature",
            )
        robot = self._add_model(
            models[0],
            files,
            name=name,
            placement=placement,
            geometry=geometry,
            category=category,
            missing=missing,
        )
        if joints is not None:
            self.set_joints(robot.name, joints, clamp_joints=clamp_joints)
        return robot

    def _add_model(self, model: RobotModel, files: FileResolver, **how: Any) -> Robot:
        """Adds a robot of a file; `how` has the arguments of `place_robot`."""
        with self._warning():
            robot, notices = place_robot(self, model, files, **how)
            self._core.set_notices([*self._core.notices, *notices])
        self._robots[robot.name] = robot
        return robot

    def set_joints(self, robot: str, joints: JointValues, *, clamp_joints: bool = False) -> None:
        """Sets joint values of a robot, by its name, and moves its objects and cameras.

        `joints` maps joint names to values, and other joints stay; or it is a vector in the order of `Robot.joints`.
        Values are in radians and metres; a planar joint has three (x, y, yaw), a floating one seven (x y z, and a
        quaternion x y z w) or a matrix [4, 4]. Values beyond the limits are used, with a notice; `clamp_joints`
        clamps them. Only transforms change, no mesh is built again. Objects of the robot that were removed stay away.
        Raises `WorldError` with the nearest name for an unknown robot or joint, and for a vector of another length.
        """
        move_robot(self, robot, joints, clamp=clamp_joints)

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
            given = aim_light(self, light_keys(description, dict(keys)))
            return _core.world_add_light(self._core, plain(given), None)

    def add_camera(self, camera: Camera, name: str = "camera") -> None:
        """Adds a camera; a name that is taken gets a number. The first camera is the default camera."""
        hint = ": add_camera(camera, name)" if isinstance(camera, str) else ""
        camera = check_camera(camera, hint)
        self._core.add_camera(_camera_name(name), camera._core)

    def add_rig(self, rig: Rig) -> None:
        """Adds a rig under its name; its cameras are appended under the names rig/camera."""
        others = [name for name, sensor in rig.sensors.items() if not isinstance(sensor, Camera)]
        if others:
            message = (
                f"rig {rig.name!r}: a world stores only a rig's cameras, not the sensors {', '.join(others)}; pass "
                "the rig itself to videos and data sets"
            )
            warn(Notice(message, "ignored_element"))
        _core.world_add_rig(self._core, rig._core)

    def set_video(self, description: Mapping[str, Any] | None = None, /, **keys: Any) -> None:
        """Replaces the world's video, described as in `[video]` of a world file.

        Takes a dict, keywords, or both: `set_video(fps=24, seconds=4, orbit={"target": [0, 0, 0.5]})`,
        `set_video(keyframe=[{"time": 0, "object": "box", "location": [0, 0, 0]}, ...])`. A keyframe with `robot` and
        `joints`, a table of joint values, moves a robot: `{"time": 2, "robot": "arm", "joints": {"elbow": 0.5}}`. Its
        joints are interpolated linearly. Raises `WorldError`.
        """
        given = expand_joint_keyframes(self, {**(description or {}), **keys})
        with self._warning():
            _core.world_set_video(self._core, plain(given))

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
            _core.world_set_object(self._core, one_object(which), plain(describe_object_change(dict(keys))))

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
        changed, keeps_file = describe_light_change(lights[number], description, dict(keys))
        with self._warning():
            _core.world_set_light(self._core, number, plain(aim_light(self, changed)), keeps_file, None)

    def remove_light(self, number: int) -> None:
        """Removes a light by its index in `lights`; those after it move down. Raises `WorldError`."""
        _core.world_remove_light(self._core, whole("light", number, 0, (1 << 62), error=WorldError))

    def set_camera(self, name: str, camera: Camera) -> None:
        """Replaces the camera of this name.

        Raises `WorldError` with the nearest known name, and for a camera of a rig, which moves as a whole.
        """
        if not isinstance(camera, Camera):
            raise WorldError(f"set_camera: expected a raycam.Camera, not {camera!r}", code="wrong_type")
        _core.world_set_camera(self._core, _camera_name(name), camera._core)

    def remove_camera(self, name: str) -> None:
        """Removes the camera of this name; raises the errors of `set_camera`."""
        _core.world_remove_camera(self._core, _camera_name(name))

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


def _camera_name(name: object) -> str:
    """Returns the name of a camera; raises `WorldError` for anything else."""
    if not isinstance(name, str):
        raise WorldError(f"camera names must be strings, got {name!r}", code="wrong_type")
    return name
