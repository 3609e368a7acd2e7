"""Methods of `World` that change its contents or place cameras around it.

Objects, lights and cameras can be added, changed and removed.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Literal, Unpack

import numpy.typing as npt

from .. import _core
from ..arguments import floats, size_of, whole, word
from ..camera import Camera, check_camera
from ..errors import FormatError, Notice, SettingsError, WorldError
from ..notices import warn
from ..rig import Rig
from ..robots import FileResolver, JointValues, Robot, RobotModel, read_robots
from ..sensors import Sensor
from ..sensors.sensor import require_sensor, sensor_row
from .chosen import one_object
from .contents import WorldContents
from .description import corner_values, indices, plain
from .edit import describe_light_change, describe_object_change
from .framing import framing_camera
from .joint_keyframes import expand_joint_keyframes
from .keys import FogKeys, LightKeys, ObjectChanges, ObjectKeys, light_keys, merge_keys, object_keys
from .robot_files import place_robot
from .robot_joints import move_robot
from .targets import aim_light
from .usd_files import add_usd_object, is_usd

__all__ = ["WorldBuilding"]


class WorldBuilding(WorldContents):
    """Base class of `World` with the methods that change a world or place a camera around it."""

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
        """Adds a mesh as an object; returns the object's id.

        The id is the value of the object in the channel `instance`.

        `vertices` [n, 3] are float64 in metres, `faces` [m, 3] indices from 0, counter-clockwise seen from outside.
        `face_colors` [m, 3] and `vertex_colors` [n, 3] (interpolated) are linear values in 0..1 if they are floats,
        and sRGB if they are uint8. `uvs` [n, 2] have v = 0 at the top row of the texture. `normals` [n, 3] are used
        for shading. `material` has the keys of a material in a world file: `color`, `diffuse`, `specular`,
        `shininess`, `texture`, `textures`, `type`, ... `placement` has the keys `location`, `roll`, `pitch`, `yaw`,
        `scale` or `matrix`, `category`, `refine` and `displace`.

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
                raise WorldError(f"{', '.join(sorted(twice))}: passed twice", code="duplicate_name")
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

        Accepts a dict, keywords, or both; or the path of a mesh file, or the name of a shape, followed by keywords:
        `add_object(box={"size": 2}, location=[0, 0, 1], color="#cc4422")`, `add_object("sphere", radius=2)`,
        `add_object(mesh="bunny.ply", refine=1)`, `add_object(instance_of="box", location=[3, 0, 1])`. The keys of a
        shape may also be given next to it, as `radius` above. Instead of a shape's table, a number or list may be
        given: the size of a box or plane, or the radius of a sphere. `add_object(sphere=2)` adds a sphere with a radius
        of 2 m.

        An object with `shadow_catcher=True` represents the ground in a photograph: in images with a transparent
        background or a background photo, only the shadows on it are visible. In all other images it is an ordinary
        surface.

        A glTF file is rotated from its up axis (y) to the world's, with a notice, unless `upright=False`. A `matrix`
        applies to the file's own axes: with a `matrix`, the file is not rotated (with a notice) unless
        `upright=True`. A USD file becomes one object, without its lights and cameras, and is rotated in the same way.

        Raises `WorldError` with the key and the nearest valid name, and the errors of `load`.
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
        geometry: Literal["visual", "collision", "both"] = "visual",
        category: Literal["link", "robot"] = "link",
        missing: Literal["error", "box"] = "error",
        up_axis: Literal["ignore", "apply"] = "ignore",
        clamp_joints: bool = False,
        xacro_args: Mapping[str, str] | None = None,
        **placement: Any,
    ) -> Robot:
        """Adds a robot from a file; returns the robot, as in `robots`.

        Files are .urdf, .xacro, .sdf (with one model) or .xml.

        Every shape of a link becomes an object named `robot/link`, `robot/link/2`, ... Its category is the
        link's name, or the robot's name with `category="robot"`. `name` is the robot's name (default: as in
        its file). `joints` are values by joint name or a vector; for these and `clamp_joints`, see
        `set_joints`. `placement` has the keys `location`, `roll`, `pitch`, `yaw` or `matrix` of the root
        link; in a y-up world, a robot is turned upright without `matrix`.

        Meshes are .stl, .obj, .ply, .off, .glb, .gltf, .dae or .zae; Collada requires the extra `raycam[robots]`.
        Files are read from the robot's package folder only: the nearest parent folder with a package.xml, or else the
        folder of the file (its parent if the folder is called urdf, robots or similar). `package://NAME` is searched
        among the parent folders, next to the robot's package, and in `packages`. If `folder` is given, no file outside
        it is read.

        `geometry="collision"` shows collision shapes instead of visual ones. With `geometry="both"`, collision shapes
        are shown too, half transparent and orange, as objects `robot/link/collision`. With `missing="box"`, a mesh
        that cannot be found is replaced by the link's collision shape, or by a box of 0.1 m, with a notice. The up axis
        of .dae files is ignored, as in RViz; if parts of a robot appear rotated, pass `up_axis="apply"`, which applies
        it. A xacro file, which requires the `raycam[robots]` extra, is expanded with the arguments `xacro_args`, in a
        process that can read only these folders.

        An .xml file is MJCF, URDF or SDF. MJCF is compiled by MuJoCo (`raycam[mujoco]`): bodies become links, visible
        are the geoms of the groups 0 to 2, and `geometry="collision"` shows the geoms that collide. Joints start as in
        the file (`qpos0`); joints that an equality constraint couples linearly mimic each other. A ball joint has four
        values (a quaternion x y z w).

        Raises `FormatError` with the line for a malformed file, and with a list of all meshes that are missing;
        `WorldError` for a name that is already used, unknown joints and an invalid placement.
        """
        files = FileResolver(Path(path), folder, packages)
        if name is not None and (not isinstance(name, str) or not name):
            raise WorldError(f"a robot's name must be a string, got {name!r}", code="wrong_type")
        models = read_robots(path, files, xacro_args)
        if len(models) > 1:
            names = ", ".join(model.description.name for model in models[:10])
            raise FormatError(
                f"{os.fspath(path)}: the file contains {len(models)} models ({names}); raycam.load loads all models",
                code="unsupported_feature",
            )
        compiled = models[0].mujoco
        if models[0].lights or (compiled is not None and compiled.model.nlight):
            text = f"{os.fspath(path)}: the file's lights are not added; raycam.load loads the robot with its lights"
            warn(Notice(text, "ignored_element"))
        robot = self._add_model(
            models[0],
            files,
            name=name,
            placement=placement,
            geometry=geometry,
            category=category,
            missing=missing,
            up_axis=up_axis,
        )
        if joints is not None:
            self.set_joints(robot.name, joints, clamp_joints=clamp_joints)
        return robot

    def _add_model(self, model: RobotModel, files: FileResolver, **how: Any) -> Robot:
        """Adds a robot of a file; `how` contains the arguments of `place_robot`."""
        with self._warning():
            robot, notices = place_robot(self, model, files, **how)
            self._core.set_notices([*self._core.notices, *notices])
        self._robots[robot.name] = robot
        return robot

    def set_joints(self, robot: str, joints: JointValues, *, clamp_joints: bool = False) -> None:
        """Sets joint values of a robot, by its name, and moves its objects and cameras.

        `joints` maps joint names to values; joints that it does not contain are unchanged. It may also be a vector in
        the order of `Robot.joints`. Values are in radians and metres. A planar joint has three values (x, y, yaw), a
        floating joint seven values (x y z, then a quaternion x y z w) or a matrix [4, 4].

        Values beyond a joint's limits are used as given, with a notice; with `clamp_joints=True` they are clamped.
        Only transforms change, so no mesh is rebuilt. Objects of the robot that were removed before are not added
        again. Raises `WorldError` for an unknown robot or joint, with the nearest name, and for a vector of the wrong
        length.
        """
        move_robot(self, robot, joints, clamp=clamp_joints)

    def add_light(
        self, description: Mapping[str, Any] | str | None = None, /, **keys: Unpack[LightKeys]
    ) -> int:
        """Adds a light, described as in `[[light]]` of a world file; returns its index.

        Accepts a dict, keywords, or both; or the type followed by keywords. A strength that is a single number means
        grey light: `add_light("sun", direction=[-1, -1, -2], irradiance=3)`, `{"type": "point", "position": [0, 0, 3],
        "power": [60, 60, 60], "radius": 0.05}`, `{"type": "environment", "image": "/data/noon.hdr"}`, whose image may
        be an array [h, w, 3] (linear floats, or sRGB as uint8), `{"type": "sky", "radiance": [1, 1, 1]}`. `target` aims
        a light at a point [3] in the world, or at the centre of an object by name. For a sun, spot, disk or ies light,
        it replaces `direction`: the light points from `position` to the target. (For a sun, `position` has no other
        effect.) For an area light of `size` (width, height), it replaces the edges `u` and `v`. With `body=True`, a
        light with a size is an object too, which occludes and has an id.

        Raises `WorldError` for an invalid light, and `FormatError` or `OSError` for its files.
        """
        with self._warning():
            given = aim_light(self, light_keys(description, dict(keys)))
            return _core.world_add_light(self._core, plain(given), None)

    def set_fog(self, description: Mapping[str, Any] | None = None, /, **keys: Unpack[FogKeys]) -> None:
        """Fills the world outside of objects with fog, which replaces earlier fog.

        The fog is described as in `[fog]` of a world file.

        Accepts a dict, keywords, or both; without any, the fog is removed. `visibility` is the distance in metres after
        which 5 % of the contrast remains: `set_fog(visibility=80)`. `extinction` is the fraction of light that is
        absorbed or scattered, per metre (ln 20 / `visibility`). `albedo` (default: 1) is the fraction of this light
        that is scattered. Both values are a number or linear red, green and blue. `g` (default: 0) is the mean cosine
        of the scattering angle, between -1 and 1. `height` is the coordinate along the up axis at which the fog ends;
        the fog is below it (default: everywhere).

        Raises `WorldError` for an invalid value; the fog is then unchanged.
        """
        given = merge_keys(description, keys)
        with self._warning():
            _core.world_set_fog(self._core, plain(given) if given else None)

    def add_camera(self, camera: Camera, name: str = "camera") -> None:
        """Adds a camera; the first camera is the default camera.

        A number is appended to a `name` that already exists. Raises `SettingsError` if `camera` is not a
        `raycam.Camera`, and `WorldError` if `name` is not a string.
        """
        hint = ": add_camera(camera, name)" if isinstance(camera, str) else ""
        camera = check_camera(camera, hint)
        self._core.add_camera(_camera_name(name), camera._core)

    def add_rig(self, rig: Rig) -> None:
        """Adds `rig` under its name.

        Its cameras and other sensors are added with names such as rig/camera.

        Raises `SettingsError` for a sensor that a world cannot store (see `add_sensor`).
        """
        described = [sensor_row(name, sensor) for name, sensor in rig._mounted.items()]
        _core.world_add_rig(self._core, rig._core.with_sensors(described))

    def add_sensor(self, sensor: Sensor, name: str = "sensor") -> None:
        """Adds a `sensor` that is not a camera, such as a lidar.

        A number is appended to a `name` that already exists. Raises `SettingsError` for an object that is not a sensor,
        and for a class that cannot be imported or has no `from_dict`.
        """
        _core.world_add_sensor(
            self._core, *sensor_row(word("name", name, error=WorldError), require_sensor("sensor", sensor))
        )

    def set_video(self, description: Mapping[str, Any] | None = None, /, **keys: Any) -> None:
        """Replaces the world's video, described as in `[video]` of a world file.

        Accepts a dict, keywords, or both: `set_video(fps=24, seconds=4, orbit={"target": [0, 0, 0.5]})`,
        `set_video(keyframe=[{"time": 0, "object": "box", "location": [0, 0, 0]}, ...])`. A keyframe with `robot` and
        `joints`, a table of joint values, moves a robot: `{"time": 2, "robot": "arm", "joints": {"elbow": 0.5}}`. Its
        joints are interpolated linearly, and the cameras on its links move with it. A keyframe with `camera` moves only
        the world's camera of this name. Raises `WorldError` for an invalid description.
        """
        given, motions = expand_joint_keyframes(self, {**(description or {}), **keys})
        with self._warning():
            _core.world_set_video(self._core, plain(given))
        for name, robot in self._robots.items():
            robot._motion = motions.get(name)

    # Changing ---------------------------------------------------------------------------------------------

    def set_object(self, which: str | int, /, **keys: Unpack[ObjectChanges]) -> None:
        """Changes an object, by name or number, with any key of `add_object` and `add_mesh`.

        `set_object("cup", matrix=T)`, `set_object("cup", location=[0, 0, 1], yaw=30)`, `set_object(3, color="red")`,
        `set_object("cup", visible=False)`. Properties without a key keep their values, except that the placement is
        replaced as a whole: with angles but no location, the object is at the origin, as in `add_object`.

        `vertices` [n, 3] alone moves the n vertices of the mesh; a mesh with shading normals also requires `normals`,
        or `normals=None` for flat faces. `faces` or another shape replace the mesh and keep the object's material,
        but `mesh="file"` takes the material from the file. If several objects share a mesh or material, only this
        object changes. `visible=False` removes the object from images, shadows, light and queries; all ids are
        unchanged.

        Keys of materials change the materials of all slots. The key `slots` changes the materials of single slots,
        which are specified by their number, or by the name of their material as in `objects[i].materials`:
        `set_object("car", slots={"windows": {"type": "glass"}, 2: {"color": "red"}})`.

        A change is fast, because only the changed parts are rebuilt, and atomic: an image that another thread is
        rendering shows the world either before or after the change. Keyframes and animations of the object still
        apply in worlds that `at(time)` returns later; in a world that `at` has returned, the object stays where you
        place it.

        Raises `WorldError` for an unknown object (with the nearest name), for a singular matrix and for arrays of the
        wrong shape, and the errors of `add_object`; after an error, the world is unchanged.
        """
        with self._warning():
            _core.world_set_object(self._core, one_object(which), plain(describe_object_change(dict(keys))))

    def remove_object(self, which: str | int) -> None:
        """Removes an object, by name or number.

        Its mesh, materials and images are also removed, unless other objects use them.

        As in a list, the ids of all later objects, and of later materials, decrease. Names are unchanged; videos,
        animations and variants still refer to the same objects. To keep all ids, hide the object instead:
        `set_object(which, visible=False)`. Raises `WorldError` for an unknown object, with the nearest name.
        """
        _core.world_remove_object(self._core, one_object(which))

    def set_light(
        self, number: int, description: Mapping[str, Any] | str | None = None, /, **keys: Unpack[LightKeys]
    ) -> None:
        """Changes light `number`, its index in `lights`, with any key of `add_light`.

        `set_light(0, irradiance=2)`. Properties without a key keep their values, but a new `type` replaces the whole
        light. Raises `WorldError` for an unknown index, and the errors of `add_light`; after an error, the world is
        unchanged.
        """
        lights = self.lights
        number = whole("light", number, 0, len(lights) - 1, error=WorldError)
        changed, keeps_file = describe_light_change(lights[number], description, dict(keys))
        with self._warning():
            _core.world_set_light(self._core, number, plain(aim_light(self, changed)), keeps_file, None)

    def remove_light(self, number: int) -> None:
        """Removes light `number`, its index in `lights`; later indices decrease.

        Raises `WorldError` for a wrong index.
        """
        _core.world_remove_light(self._core, whole("light", number, 0, (1 << 62), error=WorldError))

    def set_camera(self, name: str, camera: Camera) -> None:
        """Replaces the camera with this `name` by `camera`.

        Raises `WorldError` for an unknown name, with the nearest name, and for a rig's camera, which moves with its
        rig.
        """
        if not isinstance(camera, Camera):
            raise WorldError(f"set_camera: expected a raycam.Camera, not {camera!r}", code="wrong_type")
        _core.world_set_camera(self._core, _camera_name(name), camera._core)

    def remove_camera(self, name: str) -> None:
        """Removes the camera of this name; raises the errors of `set_camera`."""
        _core.world_remove_camera(self._core, _camera_name(name))

    def default_camera(self, size: Iterable[int] = (640, 480)) -> Camera:
        """Returns the first camera, or a camera that shows the whole world.

        `size` (width, height) is the size of the image that shows the whole world. Cameras that a robot's file has on
        its links are not used by default; `camera(name)` returns them.
        """
        wanted = size_of(tuple(size))
        name = self._first_camera
        return self.view_from(size=wanted) if name is None else self.camera(name)

    def view_from(
        self,
        direction: str | npt.ArrayLike = "default",
        *,
        size: Iterable[int] | None = None,
        fov: float | None = None,
        zoom: float = 1.0,
        camera: Camera | None = None,
    ) -> Camera:
        """Returns a camera from which the whole world just fits into the image.

        `direction` is "front", "back", "left", "right", "top", "bottom", "iso", "default" (from the front right above),
        or a vector [3] from the world's centre to the camera. The front side faces -y in a z-up world and +z in a y-up
        world, as in Blender and glTF. `size` (width, height) defaults to (640, 480), and `fov`, the vertical field of
        view in degrees, to 45. `zoom` is the scale of the world in the image: at 1 it fills 90 % of the image. A given
        `camera`, such as a calibration without a pose, keeps its size, K and lens, and is moved until the world fits.
        Raises `CameraError` for an empty world and `SettingsError` for invalid arguments, and for `size` or `fov`
        together with `camera`.
        """
        given: dict[str, Any] = {}
        if size is not None:
            given["size"] = size_of(tuple(size))
        if fov is not None:
            given["fov"] = fov
        if camera is not None and given:
            raise SettingsError(
                f"view_from got camera and {' and '.join(given)}: the camera keeps its own size and lens; pass "
                "either camera, or size and fov",
                code="conflicting_values",
            )
        return framing_camera(self, direction, zoom=zoom, camera=camera, **given)


def _camera_name(name: object) -> str:
    """Returns the name of a camera; raises `WorldError` for anything else."""
    if not isinstance(name, str):
        raise WorldError(f"camera names must be strings, got {name!r}", code="wrong_type")
    return name
