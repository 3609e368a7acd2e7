"""Creates a world with the objects, lights and cameras of a MuJoCo model.

The world follows the model's state.
"""

from __future__ import annotations

from collections.abc import Iterable
from copy import copy
from typing import Any

import numpy as np
import numpy.typing as npt

from ...arguments import Floats, real, wholes
from ...camera import Camera
from ...errors import Notice, WorldError
from ...notices import warn_all
from ...render import render
from ...world import World
from .cameras import model_camera
from .deformable import Deformable, deformables
from .light_model import model_lights, scene_lights
from .lights import LightSources
from .look import DEFAULT_FLAGS, MujocoLook, pixel_angle
from .materials import element_look, material_keys
from .model import GEOM_OBJECT, SDF, SITE_OBJECT, check_model, element_name, element_prefix
from .placement import RigidPlacement
from .round_geoms import ROUND, round_distances
from .scene_changes import SceneSnapshot
from .scene_geoms import scene_geom
from .shapes import covered_geoms, element_shape, with_texture
from .surfaces import Surfaces, texel_density
from .textures import color_texture, skybox_faces, texture_pixels

__all__ = ["MujocoScene", "from_mujoco"]

SHOWN_GROUPS = (0, 1, 2)
"""Groups of geoms that MuJoCo's viewer shows by default."""
MAX_GROUP = 5
"""The last group of a MuJoCo model."""
NO_ELEMENT = (-1, -1)
"""Type and id of objects that are not part of the model."""
CAMERA_ARRAYS = ("cam_resolution", "cam_fovy", "cam_sensorsize", "cam_intrinsic")
LIGHT_ARRAYS = (
    "light_active", "light_type", "light_ambient", "light_diffuse", "light_specular", "light_castshadow",
    "light_attenuation", "light_cutoff", "light_exponent",
)  # fmt: skip
"""Arrays of the model that `update` reads, because a program may change them."""


class MujocoScene:
    """A MuJoCo model as a world, created by `from_mujoco`.

    `update` moves the world's objects, lights and cameras.
    """

    def __init__(
        self,
        model: Any,
        data: Any,
        groups: tuple[int, ...],
        sites: tuple[int, ...],
        tendons: tuple[int, ...],
        dynamic_alpha: float,
    ) -> None:
        self.model, self._dynamic_alpha = model, dynamic_alpha
        self.world = World()
        """The world: one object per visible geom, site, skin, flex and tendon, and the model's lights and cameras."""
        self.elements: list[tuple[int, int]] = []
        """For each object of the world, its type (`mjtObj`, such as geom or tendon) and its id in the model."""
        self._round: dict[int, tuple[int, Floats]] = {}  # type and size of objects with curved surfaces
        self._placements: list[RigidPlacement] = []
        self._camera_values = self._light_values = b""
        self._snapshot = SceneSnapshot([], [])
        self._has_scene_lights = False
        self._deformables: dict[int, Deformable] = {}
        self._densities: dict[int, tuple[int, Floats]] = {}
        self._mean_colors: dict[int, Floats] = {}
        self._check(data)
        notices: list[Notice] = []
        covered = covered_geoms(model, groups)
        if covered:
            names = ", ".join(repr(element_name(model, "geom", geom)) for geom in covered[:5])
            more = f" and {len(covered) - 5} more" if len(covered) > 5 else ""
            text = f"geoms covered by later geoms of the same shape and position are omitted: {names}{more}"
            notices.append(Notice(text, "ignored_element"))
        for kind, count, shown in ((GEOM_OBJECT, model.ngeom, groups), (SITE_OBJECT, model.nsite, sites)):
            group = getattr(model, f"{element_prefix(kind)}_group")
            for number in range(count):
                if kind == GEOM_OBJECT and number in covered:
                    continue
                if group[number] in shown and self._element_look(kind, number)[0][3] > 0:
                    self._add_rigid(kind, number, notices)
        for deformable in deformables(model, groups, tendons, notices):
            self._add_deformable(deformable, data)
        self._world_notices: list[Notice] = []
        self._lights = LightSources(self.world, model, data, self._world_notices)
        for camera in range(model.ncam):
            self.world.add_camera(model_camera(model, camera, data), element_name(model, "cam", camera))
        if skybox_faces(model) is not None:
            text = "the skybox is not part of the world; only MujocoScene.render shows it"
            self._world_notices.append(Notice(text, "ignored_element"))
        self._camera_names = list(self.world.cameras)
        self._placements = [RigidPlacement(kind, self.elements) for kind in (GEOM_OBJECT, SITE_OBJECT)]
        self._surfaces = Surfaces(model, self.elements, self._densities, dynamic_alpha)
        self._look = MujocoLook(model, self.world, self._surfaces, self.elements)
        self.flags = np.array(DEFAULT_FLAGS, np.uint8)
        """Parts of the image of `render` by `mjtRndFlag`: shadows, reflections, the skybox, fog and haze."""
        self.update(data)
        self._notices = notices

    @property
    def notices(self) -> list[Notice]:
        """Parts of the model that are omitted or approximated in `world`.

        Notices about approximated lights and about the skybox do not apply to `render`.
        """
        return [*self._notices, *self._world_notices]

    def update(self, data: Any) -> None:
        """Moves objects, lights and cameras to the state in `data` (`geom_xpos`, `cam_xpos`, ...).

        No mesh is rebuilt, except that the vertices of skins, flexes and tendons move. Geoms and sites whose poses
        equal those of the last update are not changed. `mujoco.mj_forward` or `mj_step` must have computed the state.
        Raises `WorldError` if `data` is not a `mujoco.MjData`, or belongs to another model, or has no poses.
        """
        self._check(data)
        for placement in self._placements:
            placement.update(self.world, data)
        for number, deformable in self._deformables.items():
            self.world.set_object(number, **self._moved(deformable, data))
        headlight = self.model.vis.headlight
        lights = (
            *(getattr(self.model, name) for name in LIGHT_ARRAYS),
            *(data.light_xpos, data.light_xdir, np.array(headlight.active)),
            *(headlight.ambient, headlight.diffuse, headlight.specular),
        )
        if (values := _bytes(lights)) != self._light_values:
            self._lights.update(data)
            self._light_states, self._light_values = model_lights(self.model, data), values
        cameras = (*(getattr(self.model, name) for name in CAMERA_ARRAYS), data.cam_xpos, data.cam_xmat)
        if (values := _bytes(cameras)) != self._camera_values:
            for camera, name in enumerate(self._camera_names):
                self.world.set_camera(name, model_camera(self.model, camera, data))
            self._camera_values = values

    def _check(self, data: Any) -> None:
        """Raises `WorldError` unless `data` has the poses of this model."""
        if not hasattr(data, "geom_xpos"):
            raise WorldError(f"expected a mujoco.MjData, not {type(data).__name__}", code="wrong_type")
        if len(data.geom_xpos) != self.model.ngeom or len(data.cam_xpos) != self.model.ncam:
            raise WorldError(
                f"data belongs to another model: it has {len(data.geom_xpos)} geoms and {len(data.cam_xpos)} cameras, "
                f"expected {self.model.ngeom} and {self.model.ncam}",
                code="wrong_shape",
            )
        if self.model.ngeom and not np.any(data.geom_xmat):
            raise WorldError(
                "data has no poses yet; call mujoco.mj_forward(model, data) first", code="no_poses"
            )

    def render(self, camera: Camera, *, samples: int = 4) -> npt.NDArray[np.uint8]:
        """Returns the image in MuJoCo's own light (OpenGL's): sRGB, uint8 [h, w, 3].

        The image resembles the image of `mujoco.Renderer`: headlight, Blinn-Phong materials, shadows, one reflecting
        plane or box, blended transparent geoms, the skybox and haze. `flags` switch these parts and fog on and off.
        Shadows are exact, and light is computed at every pixel instead of every vertex. With `samples=4` (default),
        edges are antialiased; with 1, only the centre of each pixel is sampled. `raycam.render(scene.world, camera)`
        computes physically based light instead. Raises `SettingsError` for the flags of wireframes and additive
        blending.
        """
        return self._look.image(camera, self._light_states, samples=samples, flags=self.flags)

    def depth(self, camera: Camera) -> Floats:
        """Returns the depth along the camera's viewing direction in metres, float64 [h, w]; +inf for the background.

        Spheres, capsules, ellipsoids and cylinders have exact surfaces, as in `mujoco.mj_ray`, instead of meshes. Which
        object a pixel shows is determined by the meshes, so that pixels at outlines may show the background instead.
        The depth of other objects has the accuracy of float32. The depth of pixels without a ray is NaN.
        """
        frame = render(self.world, camera, channels=["depth", "instance"])
        depth, instance = frame["depth"].astype(np.float64).ravel(), frame["instance"].ravel()
        chosen = np.flatnonzero(np.isin(instance, list(self._round)))
        if len(chosen):
            chosen = chosen[np.argsort(instance[chosen], kind="stable")]
            v, u = np.divmod(chosen, camera.size[0])
            origins, directions = camera.rays(np.stack([u, v], axis=1) + 0.5 + camera.corner)
            objects = self.world.objects
            numbers, starts = np.unique(instance[chosen], return_index=True)
            for number, first, end in zip(numbers, starts, [*starts[1:], len(chosen)], strict=True):
                kind, size = self._round[int(number)]
                pose = objects[int(number)].matrix
                part = slice(first, end)
                distance = round_distances(kind, size, pose, origins[part], directions[part])
                met = np.isfinite(distance)
                points = origins[part][met] + distance[met, None] * directions[part][met]
                depth[chosen[part][met]] = (points - camera.C) @ camera.R[2]
        return depth.reshape(frame["depth"].shape)

    def frozen(self) -> MujocoScene:
        """Returns a copy that keeps the current state; it does not follow later calls of `update`."""
        found = copy(self)
        found.world, found.flags = self.world.copy(), self.flags.copy()
        found._look = self._look.for_world(found.world, self._surfaces, self.elements)
        return found

    def remember_visual(self, visual: Any) -> None:
        """Stores the geoms and lights of an `mjvScene` that `mjv_updateScene` has filled, for `with_changes`."""
        self._snapshot = SceneSnapshot(visual.geoms[: visual.ngeom], visual.lights[: visual.nlight])

    def with_changes(self, visual: Any, camera: Camera) -> MujocoScene:
        """Returns a copy that shows an `mjvScene`: its decorations, and its changes since `remember_visual`.

        Changes are geoms or lights that a program has added (such as a marker), and geoms of the model or lights that
        it has changed or removed. Changed lights affect only `render`. The copy does not follow later calls of
        `update`. If the scene has neither decorations nor changes, this scene itself is returned.

        Spheres, capsules, ellipsoids, cylinders, boxes, planes, arrows, lines and triangles are shown with their
        `rgba`, `emission`, `specular` and `shininess`, and the mean colour of their texture. The width of lines is in
        pixels of `camera`. Other types and labels are omitted, and changed geoms of other types, such as meshes, are
        shown as in the model; a notice lists them.
        """
        changes = self._snapshot.changes(visual.geoms[: visual.ngeom], visual.lights[: visual.nlight])
        found = self
        if changes.geoms or changes.removed:
            found = self._with_geoms(changes.geoms, camera, set(changes.removed))
        if changes.lights is not None:
            found = copy(self) if found is self else found
            found._light_states, found._has_scene_lights = scene_lights(changes.lights), True
        return found

    @property
    def has_scene_lights(self) -> bool:
        """True for a copy by `with_changes` whose lights differ from the model's lights."""
        return self._has_scene_lights

    def _with_geoms(self, geoms: list[Any], camera: Camera, hidden: set[tuple[int, int]]) -> MujocoScene:
        """Returns a copy that also shows `geoms`, but not the elements in `hidden`."""
        found, shown, omitted = copy(self), [], set()
        found.world, found.elements = self.world.copy(), list(self.elements)
        for geom in geoms:
            new = scene_geom(geom, camera.C, pixel_angle(camera))
            if new is None:
                element = int(geom.objtype), int(geom.objid)
                subject = "changes of geoms" if element in hidden else "geoms"
                omitted.add(f"{subject} of type {int(geom.type)} (mjtGeom)")
                hidden.discard(element)
            elif new.rgba[3] > 0:
                shown.append(new)
                texture = color_texture(self.model, geom.matid) if geom.matid < self.model.nmat else -1
                if texture >= 0:
                    omitted.add("textures (their mean colour is shown)")
                    new.rgba[:3] *= self._mean_color(texture)
                elif geom.matid >= 0 or getattr(geom, "texid", -1) >= 0:
                    omitted.add("materials without a colour texture (only the geom's colour is shown)")
                keys = material_keys(self.model, new.rgba, -1) | new.shape.keys
                if new.values.emission > 0 or new.unlit:
                    keys["emission"] = (1.0 if new.unlit else new.values.emission) * np.asarray(keys["color"])
                found.world.add_object(name=f"scene geom {len(shown)}", matrix=new.pose, **keys)
                found.elements.append(new.element)
            omitted |= {"labels"} if geom.label else set()
        if omitted:
            text = f"mjvScene: parts omitted or simplified: {', '.join(sorted(omitted))}"
            warn_all([Notice(text, "ignored_element")])
        numbers = {number for number, element in enumerate(self.elements) if element in hidden}
        for number in numbers:
            found.world.set_object(number, visible=False)
        if shown or numbers:
            elements = [*self.elements, *[NO_ELEMENT] * len(shown)]
            surfaces = self._surfaces.without(numbers)
            surfaces = surfaces.extended(shown) if shown else surfaces
            found._look = self._look.for_world(found.world, surfaces, elements)
        return found

    def _element_look(self, kind: int, number: int) -> tuple[Floats, int]:
        """The colour [4] and the material (-1: none) of an element."""
        return element_look(self.model, kind, number, self._dynamic_alpha)

    def _moved(self, deformable: Deformable, data: Any) -> Any:
        """The keys of an object with the vertices of a skin, flex or tendon in the state `data`."""
        vertices, normals = deformable.shape(self.model, data)
        return {"vertices": vertices} | ({} if normals is None else {"normals": normals})

    def _add_rigid(self, kind: int, number: int, notices: list[Notice]) -> None:
        """Adds a geom or site."""
        model, prefix = self.model, element_prefix(kind)
        name = element_name(model, prefix, number)
        shape_kind = int(getattr(model, f"{prefix}_type")[number])
        shape = element_shape(model, kind, number)
        if shape is None:
            text = f"{prefix} {name!r}: shapes of type {shape_kind} are not shown"
            notices.append(Notice(text, "ignored_element"))
            return
        if shape_kind == SDF:
            text = f"geom {name!r}: a signed distance field is shown as its mesh"
            notices.append(Notice(text, "approximated_value"))
        rgba, material = self._element_look(kind, number)
        shape = with_texture(model, kind, number, shape, material)
        body = int(getattr(model, f"{prefix}_bodyid")[number])
        self.world.add_object(
            name=name,
            category=element_name(model, "body", body),
            **shape.keys,
            **material_keys(model, rgba, material),
        )
        self._note_texture(material, shape.keys)
        if shape_kind in ROUND:
            size = np.array(getattr(model, f"{prefix}_size")[number], np.float64)
            self._round[len(self.elements)] = shape_kind, size
        self.elements.append((kind, number))

    def _add_deformable(self, deformable: Deformable, data: Any) -> None:
        model = self.model
        name = element_name(model, element_prefix(deformable.kind), deformable.number)
        rgba, material = self._element_look(deformable.kind, deformable.number)
        keys = self._moved(deformable, data)
        coordinates = deformable.coordinates(model)
        if coordinates is not None:
            keys["uvs"] = coordinates
        elif color_texture(model, material) >= 0:
            material = -1
        self._deformables[len(self.elements)] = deformable
        self.world.add_object(
            name=name,
            triangles=deformable.triangles(model),
            **keys,
            **material_keys(model, rgba, material),
        )
        self._note_texture(material, keys | {"triangles": deformable.triangles(model)})
        self.elements.append((deformable.kind, deformable.number))

    def _mean_color(self, texture: int) -> Floats:
        """Returns a texture's mean colour [3], sRGB."""
        if texture not in self._mean_colors:
            pixels = texture_pixels(self.model, texture)[:, :, :3]
            self._mean_colors[texture] = pixels.mean(axis=(0, 1)) / 255
        return self._mean_colors[texture]

    def _note_texture(self, material: int, keys: Any) -> None:
        """Keeps the texture of the object that is added next, for `render`."""
        texture = color_texture(self.model, material)
        if texture >= 0:
            size = int(self.model.tex_width[texture]), int(self.model.tex_height[texture])
            corners, uvs = (
                np.asarray(keys[name], np.float64)[keys["triangles"]] for name in ("vertices", "uvs")
            )
            self._densities[len(self.elements)] = texture, texel_density(corners, uvs, size)

    def __repr__(self) -> str:
        """Returns the number of shown geoms and the world as text."""
        geoms = sum(kind == GEOM_OBJECT for kind, _ in self.elements)
        return f"MujocoScene: {geoms} of {self.model.ngeom} geoms; {self.world!r}"


def from_mujoco(
    model: Any,
    data: Any = None,
    *,
    groups: tuple[int, ...] = SHOWN_GROUPS,
    sites: tuple[int, ...] = (),
    tendons: tuple[int, ...] = SHOWN_GROUPS,
    own_light: bool = False,
    dynamic_alpha: float = 1.0,
) -> MujocoScene:
    """Creates a world from a `mujoco.MjModel`; returns a scene with `world` and `update(data)`.

    `data` is the `mujoco.MjData` whose state is shown (default: the initial state). Geoms, skins and flexes of `groups`
    (default: 0, 1 and 2, as in MuJoCo's viewer) that are not fully transparent become objects, named as in the model.
    The sites of the groups `sites` (default: none) and the spatial tendons of the groups `tendons` (default: 0, 1 and
    2) become objects, too. A tendon is shown as capsules along its path; a slack tendon hangs as in MuJoCo's viewer.
    The category of a geom or site is its body's name. Round shapes are triangle meshes. Colours are sRGB, as MuJoCo
    shows them; colour textures (2D and cube maps) are mapped as in MuJoCo 4.

    Directional lights become suns; spot and point lights become weaker with the square of the distance, with a notice;
    ambient light becomes a uniform sky, and the headlight a sky and a sun. Cables, image lights and the thickness of
    flexes are omitted, with notices. An opaque geom is also omitted if a later geom of the same shape and place covers
    it, as in MuJoCo's images. `MujocoScene.render` shows such a world in MuJoCo's own light. With `own_light=True`,
    notices that do not apply to this method are omitted. `dynamic_alpha` multiplies the opacity of everything that is
    not fixed to the world, as MuJoCo's flag `mjVIS_TRANSPARENT` does.

    Raises `WorldError` if `model` is not a MuJoCo model, `data` has no poses, or another argument is invalid. Also
    raises `WorldError`, with both versions, if the model's MuJoCo version lacks arrays that are read here. Raises
    `ImportError` if `data` is not given and MuJoCo is not installed.
    """
    check_model(model)
    if data is None:
        import mujoco

        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
    geom_groups, site_groups, tendon_groups = (
        tuple(wholes(name, given, 0, MAX_GROUP, error=WorldError))
        for name, given in (("groups", groups), ("sites", sites), ("tendons", tendons))
    )
    alpha = real("dynamic_alpha", dynamic_alpha, 0.0, 1.0, error=WorldError)
    scene = MujocoScene(model, data, geom_groups, site_groups, tendon_groups, alpha)
    warn_all(scene._notices if own_light else scene.notices)
    return scene


def _bytes(arrays: Iterable[Any]) -> bytes:
    """Returns the values of arrays, for comparison with later values."""
    return b"".join(array.tobytes() for array in arrays)
