"""Replacement for `mujoco.Renderer` without OpenGL.

After `install()`, MuJoCo programs use this replacement. Depth and ids are exact for the ray through each
pixel's centre. Colours are computed with MuJoCo's own light model and resemble MuJoCo's images;
`MujocoScene.render` describes the differences.
"""

from __future__ import annotations

import warnings
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from raycam import Camera, Notice, SettingsError, from_mujoco, render

__all__ = ["Renderer", "install", "uninstall"]

FREE, TRACKING, FIXED = 0, 1, 2
"""Values of `mjtCamera`."""
LOOKS = ("mujoco", "direct", "path")
ORIGINALS: dict[str, Any] = {}
TENDON_FLAG = 7
"""The value of `mjtVisFlag.mjVIS_TENDON`."""
Groups = tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]
"""The visible groups of geoms, sites and tendons."""
DEFAULT_GROUPS: Groups = ((0, 1, 2), (0, 1, 2), (0, 1, 2))


class Renderer:
    """Renders a MuJoCo model; constructor and methods equal those of `mujoco.Renderer`.

    `render` returns sRGB colours, uint8 [h, w, 3]. After `enable_depth_rendering`, it returns float32 [h, w]: the depth
    along the viewing direction in metres, and the far plane's depth for the background. After
    `enable_segmentation_rendering`, it returns int32 [h, w, 2]: (id, type), -1 for the background. The attribute
    `camera` replaces the model's camera by a `raycam.Camera`, and `look` selects the light of colour images: "mujoco"
    (default), or "direct" or "path" for physically based light. `max_geom` limits the geoms of `scene`, but not the
    model's geoms in images; `font_scale` has no effect, because no text is drawn. Raises `SettingsError` for sizes
    below 1, unknown cameras and looks, and calls of `render` before `update_scene`.
    """

    def __init__(
        self,
        model: Any,
        height: int = 240,
        width: int = 320,
        max_geom: int = 10000,
        font_scale: Any = None,
    ) -> None:
        if height < 1 or width < 1:
            raise SettingsError(
                f"height and width must be at least 1, got {height} and {width}", code="out_of_range"
            )
        import mujoco

        self._model, self._size = model, (int(width), int(height))
        self._scene: Any = None
        self._visual = mujoco.MjvScene(model, maxgeom=max_geom)
        self._added_from = 0
        self._groups = DEFAULT_GROUPS
        self._mode = "color"
        self._view: Camera | None = None
        self.camera: Camera | None = None
        """Camera in world coordinates that replaces the camera from `update_scene`; None (default) keeps the camera
        from `update_scene`.
        """
        self.look: Literal["mujoco", "direct", "path"] = "mujoco"
        """The light of colour images: MuJoCo's own, or the integrator `direct` or `path` of `raycam.render`."""

    @property
    def model(self) -> Any:
        """The MuJoCo model that the renderer shows."""
        return self._model

    @property
    def scene(self) -> Any:
        """The `mujoco.MjvScene`: its `flags` are used, and geoms that are added to it are shown.

        `update_scene` fills the scene with the model's geoms, and removes added geoms. Changes of the model's geoms in
        this scene have no effect.
        """
        return self._visual

    def _build(self, data: Any, groups: Groups) -> None:
        """Creates a new scene with the elements of the visible groups."""
        geoms, sites, tendons = groups
        own_light = self.look == "mujoco"
        self._scene = from_mujoco(
            self._model, data, groups=geoms, sites=sites, tendons=tendons, own_light=own_light
        )
        self._groups = groups

    @property
    def height(self) -> int:
        """The image's height in pixels."""
        return self._size[1]

    @property
    def width(self) -> int:
        """The image's width in pixels."""
        return self._size[0]

    def update_scene(self, data: Any, camera: Any = -1, scene_option: Any = None) -> None:
        """Updates the poses from `data`, and selects the camera.

        `camera` is a name, an id, -1 for the free camera, or an `mjvCamera`. Of `scene_option`, `geomgroup`,
        `sitegroup`, `tendongroup` and the flag `mjVIS_TENDON` are used. A notice names other options that differ from
        MuJoCo's defaults, such as `mjVIS_CONTACTPOINT`; they have no effect.
        """
        if scene_option is not None:
            _warn_of_unused(scene_option)
        groups = self._groups if scene_option is None else _shown_groups(scene_option)
        if self._scene is None or groups != self._groups:
            self._build(data, groups)
        else:
            self._scene.update(data)
        self._view = self._find_camera(data, camera)
        self._fill_visual(data, scene_option)

    def _fill_visual(self, data: Any, scene_option: Any) -> None:
        """Fills the `mjvScene` with the model's geoms."""
        import mujoco

        option = mujoco.MjvOption() if scene_option is None else scene_option
        view, category = mujoco.MjvCamera(), mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(self._model, data, option, None, view, category, self._visual)
        self._added_from = int(self._visual.ngeom)

    def _find_camera(self, data: Any, camera: Any) -> Camera:
        names = list(self._scene.world.cameras)
        if isinstance(camera, str):
            if camera not in names:
                raise SettingsError(
                    f"no camera {camera!r}; cameras: {', '.join(names) or 'none'}", code="unknown_name"
                )
            camera = names.index(camera)
        kind = getattr(camera, "type", None)
        if kind == FIXED:
            camera = int(camera.fixedcamid)
        elif kind is not None:
            lookat = data.xpos[camera.trackbodyid] if kind == TRACKING else camera.lookat
            return self._free(lookat, camera.distance, camera.azimuth, camera.elevation)
        if camera == -1:
            statistic, view = self._model.stat, self._model.vis.global_
            return self._free(statistic.center, 1.5 * statistic.extent, view.azimuth, view.elevation)
        if not isinstance(camera, int | np.integer) or not 0 <= camera < len(names):
            raise SettingsError(
                f"camera must be a name or -1 to {len(names) - 1}, got {camera!r}", code="index_out_of_range"
            )
        return self._fitted(self._scene.world.camera(names[camera]))

    def _fitted(self, camera: Camera) -> Camera:
        """Returns the camera with this renderer's size and an unchanged vertical field of view."""
        width, height = self._size
        scale = height / camera.size[1]
        k = camera.K * [[scale], [scale], [1]]
        k[0, 2] += (width - camera.size[0] * scale) / 2
        return camera.replace(K=k, size=self._size)

    def _free(self, lookat: Any, distance: float, azimuth: float, elevation: float) -> Camera:
        turn, rise = np.radians([float(azimuth), float(elevation)])
        forward = np.array([np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)])
        up = np.array([-np.sin(rise) * np.cos(turn), -np.sin(rise) * np.sin(turn), np.cos(rise)])
        pose = np.eye(4)
        pose[:3, :3] = np.stack([np.cross(forward, up), up, -forward], axis=1)
        pose[:3, 3] = np.asarray(lookat) - float(distance) * forward
        width, height = self._size
        focal = height / 2 / np.tan(np.radians(float(self._model.vis.global_.fovy)) / 2)
        k = [[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]]
        return Camera.from_opengl(k, pose, self._size, pixel_center="half")

    def render(self, *, out: npt.NDArray[Any] | None = None) -> npt.NDArray[Any]:
        """Returns the image, written into `out` if given.

        Raises `SettingsError` if `out` has a wrong shape.
        """
        camera = self.camera or self._view
        if self._scene is None or camera is None:
            raise SettingsError("no scene to render; call update_scene before render", code="missing_value")
        scene, added = self._scene, self._visual.geoms[self._added_from : self._visual.ngeom]
        if added:
            scene = scene.with_geoms(added, camera)
        scene.flags[:] = self._visual.flags
        found = getattr(self, f"_{self._mode}")(scene, camera)
        if out is None:
            return np.asarray(found)
        if out.shape != found.shape:
            raise SettingsError(
                f"out must have the shape {list(found.shape)}, not {list(out.shape)}", code="wrong_shape"
            )
        out[...] = found
        return out

    def _color(self, scene: Any, camera: Camera) -> npt.NDArray[Any]:
        samples = 4 if self._model.vis.quality.offsamples > 1 else 1
        if self.look == "mujoco":
            return np.asarray(scene.render(camera, samples=samples))
        if self.look not in LOOKS:
            raise SettingsError(
                f"look must be one of {', '.join(LOOKS)}, got {self.look!r}", code="unknown_name"
            )
        samples = 64 if self.look == "path" else 4
        return render(scene.world, camera, integrator=self.look, samples=samples).to_srgb8()

    def _depth(self, scene: Any, camera: Camera) -> npt.NDArray[Any]:
        depth = render(scene.world, camera, channels=["depth"])["depth"]
        far = np.float32(self._model.vis.map.zfar * self._model.stat.extent)
        # `fmin` returns `far` for the background (infinite depth) and for pixels without a ray (NaN).
        return np.asarray(np.fmin(depth, far), np.float32)

    def _segmentation(self, scene: Any, camera: Camera) -> npt.NDArray[Any]:
        instance = render(scene.world, camera, channels=["instance"])["instance"]
        # The last row is for the background, whose instance is -1.
        elements = np.array([*scene.elements, (-1, -1)], np.int32)[:, ::-1]
        return elements.take(instance, axis=0, mode="wrap")

    def enable_depth_rendering(self) -> None:
        """Makes `render` return depth."""
        self._mode = "depth"

    def disable_depth_rendering(self) -> None:
        """Makes `render` return colours."""
        self._mode = "color"

    def enable_segmentation_rendering(self) -> None:
        """Makes `render` return ids and types."""
        self._mode = "segmentation"

    def disable_segmentation_rendering(self) -> None:
        """Makes `render` return colours."""
        self._mode = "color"

    def close(self) -> None:
        """Releases the scene."""
        self._scene = self._view = None

    def __enter__(self) -> Renderer:
        """Returns the renderer."""
        return self

    def __exit__(self, *_: object) -> None:
        """Closes the renderer."""
        self.close()


def _shown_groups(option: Any) -> Groups:
    """The visible groups of an `mjvOption`."""
    geoms, sites, tendons = (
        tuple(number for number, shown in enumerate(groups) if shown)
        for groups in (option.geomgroup, option.sitegroup, option.tendongroup)
    )
    return geoms, sites, tendons if option.flags[TENDON_FLAG] else ()


def _warn_of_unused(option: Any) -> None:
    """Gives a notice that names the changed values of an `mjvOption` that have no effect."""
    import mujoco

    default = mujoco.MjvOption()
    changed = np.flatnonzero(np.asarray(option.flags) != default.flags)
    names = [mujoco.mjtVisFlag(int(flag)).name for flag in changed if flag != TENDON_FLAG]
    values = ("frame", "label", "jointgroup", "actuatorgroup", "flexgroup", "skingroup")
    names += [name for name in values if np.any(getattr(option, name) != getattr(default, name))]
    if names:
        warnings.warn(
            Notice(f"scene_option: settings without effect in raycam: {', '.join(names)}", "ignored_element"),
            stacklevel=3,
        )


def install() -> None:
    """Replaces `mujoco.Renderer` by this class."""
    import mujoco

    ORIGINALS.setdefault("Renderer", mujoco.Renderer)
    mujoco.Renderer = Renderer


def uninstall() -> None:
    """Restores MuJoCo's own renderer."""
    import mujoco

    if ORIGINALS:
        mujoco.Renderer = ORIGINALS.pop("Renderer")
