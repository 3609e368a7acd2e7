"""Robots in worlds: their visual shapes become objects, which their joints move."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .. import _core, robots
from ..arguments import Floats, one_of
from ..errors import Error, FormatError, Notice, WorldError
from ..srgb import linear_from_srgb
from .capsule import capsule_mesh
from .description import plain
from .endings import MESH_ENDINGS

if TYPE_CHECKING:
    from .contents import WorldContents

__all__ = ["GEOMETRIES", "is_robot", "place_robot"]

GEOMETRIES = ("visual", "collision", "both")
"""Shapes that a robot shows."""
COLLISION_LOOK = {"color": [1.0, 0.2, 0.02], "opacity": 0.35}
"""The look of collision shapes that are shown together with the visual shapes."""
COLLADA = (".dae", ".zae")
"""Endings of Collada documents and archives."""
OWN_MATERIALS = (".glb", ".gltf", *COLLADA)
"""Endings of mesh files that contain their own materials."""
LINK_MESH_ENDINGS = (*MESH_ENDINGS, *OWN_MATERIALS)
"""Endings of mesh files of links."""


def is_robot(name: object) -> bool:
    """Returns True for the name of a robot file."""
    return isinstance(name, str | os.PathLike) and Path(name).suffix.lower() in robots.SUFFIXES


def place_robot(
    world: WorldContents,
    model: robots.RobotModel,
    files: robots.FileResolver,
    *,
    name: str | None,
    placement: Mapping[str, Any],
    geometry: str,
    category: str,
    missing: str,
    up_axis: str = "ignore",
) -> tuple[robots.Robot, list[Notice]]:
    """Adds a robot's shapes to a world, with all joints at zero; returns the robot and notices.

    `placement` moves the origin of the file. All files are located before objects are added, so the world is unchanged
    if a file is missing.
    """
    one_of("geometry", geometry, list(GEOMETRIES))
    one_of("missing", missing, ["error", "box"])
    one_of("category", category, ["link", "robot"])
    one_of("up_axis", up_axis, ["ignore", "apply"])
    description = model.description
    robot = robots.Robot.at_zero(
        description.name if name is None else name,
        description,
        _pose(world, placement) @ model.world_from_root,
    )
    if robot.name in world._robots:
        raise WorldError(
            f"robot {robot.name!r}: the name already exists; pass another name=", code="duplicate_name"
        )
    builder = _Builder(world, robot, files, geometry, category, up_axis)
    if model.mujoco is None:
        builder.find_meshes(missing)
        builder.add_objects()
        cameras = model.cameras
    else:
        cameras = builder.add_geoms(model.mujoco)
    for one in cameras:
        full = f"{robot.name}/{one.name}"
        if full in {camera for camera, _ in world._core.cameras}:
            raise WorldError(f"camera {full!r}: the name already exists", code="duplicate_name")
        placed = robots.place_camera(one.camera, robot.pose(one.link))
        world._core.add_camera(full, placed._core)
        robot._cameras.append((full, one.link, one.camera))
        if one.link != robot._kinematics.root:
            robot._inner_cameras |= {full}
    return robot, list(dict.fromkeys([*description.notices, *files.notices, *builder.notices]))


def _pose(world: WorldContents, keys: Mapping[str, Any]) -> Floats:
    """Returns world_from_root [4, 4] for the keys of an object's placement.

    Robots are z up: in a y-up world they are turned upright, except with `matrix`. Raises `WorldError` for invalid
    keys, and for a placement that is not a rotation and a translation.
    """
    given = {key: value for key, value in keys.items() if value is not None}
    probe = _core.World(world.up, "", None)
    _core.world_add_object(probe, plain({"box": {"size": 1.0}, **given}), None)
    pose = np.array(probe.objects[0][4])
    if (
        not np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-6)
        or np.linalg.det(pose[:3, :3]) < 0
    ):
        raise WorldError("matrix: a robot's pose must be a rotation and a translation", code="not_a_rotation")
    if world.up == "y" and "matrix" not in given:
        pose = pose @ np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 0], [0, -1.0, 0, 0], [0, 0, 0, 1.0]])
    return pose


class _Shape(NamedTuple):
    """A shape of a link that is shown."""

    link: str
    name: str
    """The object's name."""
    visual: robots.Visual
    is_marked: bool
    """True for a collision shape that is shown together with visual shapes."""


def _number_shapes(
    link: str, stem: str, shapes: Iterable[robots.Visual], is_marked: bool
) -> Iterator[_Shape]:
    for number, shape in enumerate(shapes, start=1):
        yield _Shape(link, stem if number == 1 else f"{stem}/{number}", shape, is_marked)


class _Builder:
    """The state of adding a robot's objects."""

    def __init__(
        self,
        world: WorldContents,
        robot: robots.Robot,
        files: robots.FileResolver,
        geometry: str,
        category: str,
        up_axis: str,
    ) -> None:
        self._up_axis = up_axis
        self._world, self._robot, self._files = world, robot, files
        self._geometry, self._category = geometry, category
        self._found: dict[str, Path | None] = {}
        self.notices: list[Notice] = []

    def _shapes(self) -> Iterator[_Shape]:
        """The shown shapes in the order of the file; with "both", a link's collision shapes after its visual shapes."""
        both = self._geometry == "both"
        for link in self._robot.description.links.values():
            stem = f"{self._robot.name}/{link.name}"
            if self._geometry != "collision":
                yield from _number_shapes(link.name, stem, link.visuals, False)
            if self._geometry != "visual":
                yield from _number_shapes(
                    link.name, f"{stem}/collision" if both else stem, link.collisions, both
                )

    def find_meshes(self, missing: str) -> None:
        """Finds all meshes; raises `FormatError` with all missing meshes, unless boxes replace them."""
        faults: dict[str, str] = {}
        for _, _, shape, _ in self._shapes():
            name = shape.geometry.file
            if shape.geometry.kind != "mesh" or name in self._found or name in faults:
                continue
            at = f"{self._robot.description.file}:{shape.line}"
            try:
                path = self._files.find(name)
                if path.suffix.lower() not in LINK_MESH_ENDINGS:
                    raise robots.Missing(
                        f"unknown kind of mesh {path.suffix!r}; expected {', '.join(LINK_MESH_ENDINGS)}"
                    )
                self._found[name] = path
            except robots.Missing as reason:
                faults[name] = f"{at}: mesh {name!r}: {reason}"
        if faults and missing == "error":
            raise FormatError(
                f"{self._robot.description.file}: meshes that cannot be used ({len(faults)}): "
                f"{robots.list_faults(faults.values())}; pass packages=[...] or folder=, or show boxes instead with"
                ' world.add_robot(..., missing="box")',
                code="file_not_found",
            )
        for name, fault in faults.items():
            self._found[name] = None
            self.notices.append(
                Notice(f"{fault}; its collision shapes or a box are shown instead", "ignored_element")
            )

    def add_objects(self) -> None:
        """Adds one object for each shape; in a failed call, the objects added so far are removed."""
        before = self._world._core.object_count
        placed: list[tuple[int, str, Floats]] = []
        poses = self._robot._kinematics.poses(self._robot._values[None])
        try:
            for link, label, shape, is_marked in self._shapes():
                for shown, own in self._replaced(link, shape):
                    world_from_link = self._robot.world_from_root @ poses[link][0]
                    added = self._add(label, link, shown, world_from_link @ shown.link_from_visual @ own)
                    placed.append((added, link, shown.link_from_visual @ own))
                    if is_marked:
                        _core.world_set_object(self._world._core, added, plain(COLLISION_LOOK))
        except (Error, OSError):
            for _ in range(self._world._core.object_count - before):
                _core.world_remove_object(self._world._core, before)
            raise
        names = [item[0] for item in self._world._core.objects]
        self._robot._parts.extend((names[number], link, matrix) for number, link, matrix in placed)

    def add_geoms(self, compiled: robots.CompiledModel) -> list[robots.SdfCamera]:
        """Adds one object for each geom of a MuJoCo model.

        Returns the model's cameras on their links.
        """
        from ..interop.mujoco.parts import link_cameras, link_geoms

        geoms, notices = link_geoms(compiled.model, self._geometry)
        both = self._geometry == "both"
        cameras, more = link_cameras(compiled.model)
        self.notices += [*notices, *more]
        links = compiled.links
        poses = self._robot._kinematics.poses(self._robot._values[None])
        numbers: dict[str, int] = {}
        for body, shape, link_from_mesh, is_visible in geoms:
            link = links[body]
            is_marked = both and not is_visible
            stem = f"{self._robot.name}/{link}" + ("/collision" if is_marked else "")
            number = numbers[stem] = numbers.get(stem, 0) + 1
            keys = {
                "name": stem if number == 1 else f"{stem}/{number}",
                "matrix": self._robot.world_from_root @ poses[link][0] @ link_from_mesh,
                "category": self._robot.name if self._category == "robot" else link,
            }
            shape |= COLLISION_LOOK if is_marked else {}
            added = _core.world_add_object(self._world._core, plain(keys | shape), None)
            name = self._world._core.objects[added][0]
            self._robot._parts.append((name, link, link_from_mesh))
        return [robots.SdfCamera(one.name, links[one.body], one.camera) for one in cameras]

    def _replaced(self, link: str, shape: robots.Visual) -> list[tuple[robots.Visual, Floats]]:
        """The shape with its scale [4, 4], or the replacement of a missing mesh."""
        if shape.geometry.kind != "mesh":
            return [(shape, np.eye(4))]
        if self._found[shape.geometry.file] is not None:
            return [(shape, np.diag([*shape.geometry.scale, 1.0]))]
        collisions = [
            other
            for other in self._robot.description.links[link].collisions
            if other.geometry.kind != "mesh" and self._geometry == "visual"
        ]
        box = robots.Visual(
            shape.link_from_visual, robots.Geometry("box", (0.1, 0.1, 0.1)), shape.material, shape.line
        )
        return [(other, np.eye(4)) for other in collisions or [box]]

    def _add(self, name: str, link: str, shape: robots.Visual, world_from_mesh: Floats) -> int:
        geometry = shape.geometry
        keys: dict[str, Any] = {
            "name": name,
            "matrix": world_from_mesh,
            "category": self._robot.name if self._category == "robot" else link,
        }
        if geometry.kind == "mesh":
            path = self._found[geometry.file]
            assert path is not None
            return self._add_mesh(path, keys, shape.material)
        keys |= self._material(shape.material)
        sizes = [size if size > 0 else 1e-9 for size in geometry.size]
        if 0.0 in geometry.size:
            self.notices.append(
                Notice(
                    f"{self._robot.description.file}:{shape.line}: a {geometry.kind} has a size of 0; "
                    "the size 1 nm is shown instead",
                    "replaced_value",
                )
            )
        if geometry.kind == "box":
            keys["box"] = {"size": sizes}
        elif geometry.kind == "sphere":
            keys["sphere"] = {"radius": sizes[0]}
        elif geometry.kind == "cylinder":
            keys["cylinder"] = {"radius": sizes[0], "height": sizes[1]}
        else:
            vertices, faces, normals = capsule_mesh(sizes[0], sizes[1])
            keys |= {"vertices": vertices, "triangles": faces, "normals": normals}
        return _core.world_add_object(self._world._core, plain(keys), None)

    def _add_mesh(self, path: Path, keys: dict[str, Any], material: robots.Material) -> int:
        core, suffix = self._world._core, path.suffix.lower()
        if suffix in COLLADA:
            with TemporaryDirectory(prefix="raycam-robot-") as folder:
                data, notices = robots.collada_to_glb(
                    path, lambda name: self._image(path, name), up_axis=self._up_axis
                )
                copy = Path(folder, f"{path.stem}.glb")
                copy.write_bytes(data)
                self.notices += notices
                before = len(core.notices)
                try:
                    number = _core.world_add_object(
                        core, plain(keys | {"mesh": copy, "upright": False}), None
                    )
                except Error as error:
                    raise type(error)(
                        str(error).replace(os.fspath(copy), os.fspath(path)), code=error.code
                    ) from None
                own = [
                    Notice(str(notice).replace(os.fspath(copy), os.fspath(path)), notice.code)
                    for notice in core.notices[before:]
                ]
                core.set_notices([*core.notices[:before], *own])
            return number
        if suffix in (".glb", ".gltf"):
            keys["upright"] = False
        elif not _has_materials(path):
            keys |= self._material(material)
            if suffix == ".stl" and "color" in keys:
                keys["face_colors"] = []  # as in RViz, the description's colour replaces the facets' colours
        return _core.world_add_object(core, plain(keys | {"mesh": path}), None)

    def _image(self, mesh: Path, name: str) -> Path:
        """Returns the path of an image named by a mesh; raises `OSError` if the image is not found."""
        try:
            if "://" in name or Path(name).is_absolute():
                return self._files.find(name)
            return self._files.find(os.fspath(mesh.parent / name))
        except robots.Missing as reason:
            raise FileNotFoundError(str(reason)) from None

    def _material(self, material: robots.Material) -> dict[str, Any]:
        """The object's material keys; colours of URDF are sRGB, as in RViz."""
        keys: dict[str, Any] = {}
        if material.rgba is not None:
            srgb = np.array(material.rgba[:3])
            keys["color"] = linear_from_srgb(srgb)
            if 0 < material.rgba[3] < 1:
                keys["opacity"] = material.rgba[3]
            elif material.rgba[3] == 0:
                self.notices.append(
                    Notice(
                        f"{self._robot.description.file}: material {material.name!r} is fully transparent (alpha 0); "
                        "it is shown opaque",
                        "ignored_transparency",
                    )
                )
        surface = {"roughness": material.roughness, "metallic": material.metallic}
        stated = {name: value for name, value in surface.items() if value is not None}
        if stated:
            keys |= {"type": "principled", **stated}
        if material.emission is not None:
            keys["emission"] = linear_from_srgb(np.array(material.emission))
        if material.texture is not None:
            try:
                keys["texture"] = self._files.find(material.texture)
            except robots.Missing as reason:
                self.notices.append(
                    Notice(
                        f"{self._robot.description.file}: texture {material.texture!r} is not shown: {reason}",
                        "missing_file",
                    )
                )
        return keys


def _has_materials(path: Path) -> bool:
    """True for an OBJ file with materials, which replace the description's, as in RViz."""
    if path.suffix.lower() != ".obj":
        return False
    with path.open("rb") as file:
        return any(line.startswith(b"usemtl") for line in file)
