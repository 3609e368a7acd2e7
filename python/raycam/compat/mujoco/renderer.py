"""Replacement for `mujoco.Renderer` without OpenGL."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from raycam import Camera, Frame, Notice, SettingsError, WorldError, render

from .model_scene import ModelScene
from .originals import original

__all__ = ["Renderer", "element_ids"]

FREE, TRACKING, FIXED = 0, 1, 2
"""Values of `mjtCamera`."""
LOOKS = ("mujoco", "direct", "path")


class Renderer:
    """Renders a MuJoCo model; constructor and methods equal those of `mujoco.Renderer`.

    `render` returns sRGB colours, uint8 [h, w, 3]. After `enable_depth_rendering`, it returns float32 [h, w]: the depth
    along the viewing direction in metres, and the far plane's depth for the background. After
    `enable_segmentation_rendering`, it returns int32 [h, w, 2]: (id, type), -1 for the background. The attribute
    `camera` replaces the model's camera by a `raycam.Camera`, `look` selects the light of colour images: "mujoco"
    (default), or "direct" or "path" for physically based light, and `channels` requests further channels of
    `raycam.render`, which `render` stores in `frame`. `max_geom` limits the geoms of `scene`, but not the
    model's geoms in images; `font_scale` has no effect, because no text is drawn. Raises `SettingsError` for sizes
    below 1, unknown cameras and looks, and arrays `out` of another shape.
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
        self._source = ModelScene(model)
        self._visual = mujoco.MjvScene(model, maxgeom=max_geom)
        self._mode = "color"
        self._view: Camera | None = None
        self.camera: Camera | None = None
        """Camera in world coordinates that replaces the camera from `update_scene`; None (default) keeps the camera
        from `update_scene`.
        """
        self.look: Literal["mujoco", "direct", "path"] = "mujoco"
        """The light of colour images: MuJoCo's own, or the integrator `direct` or `path` of `raycam.render`."""
        self.channels: Sequence[str] = ()
        """Further channels of `raycam.render`, such as "normal" or "distance", that `render` computes into `frame`."""
        self.frame: Frame | None = None
        """The channels of the last `render`; None if `channels` is empty or the image was empty."""

    @property
    def model(self) -> Any:
        """The MuJoCo model that the renderer shows."""
        return self._model

    @property
    def scene(self) -> Any:
        """The `mujoco.MjvScene`, which `update_scene` fills with the model's geoms and decorations.

        `render` uses its `flags`, and shows geoms and lights that a program adds, changes or removes in it. Changes of
        meshes and height fields have no effect.
        """
        return self._visual

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

        `camera` is a name, an id, -1 for the free camera, or an `mjvCamera`. `scene_option` selects the visible groups
        and decorations, such as contact points, joint axes and frames, and `mjVIS_TRANSPARENT`. A notice names other
        options that differ from MuJoCo's defaults, such as labels and `mjVIS_CONVEXHULL`; they have no effect. If
        `data` has no poses, because `mj_forward` was not called, images are empty as in MuJoCo, with a notice.
        """
        import mujoco

        option = mujoco.MjvOption() if scene_option is None else scene_option
        try:
            self._scene = self._source.update(data, option, own_light=self.look == "mujoco")
        except WorldError as error:
            if error.code != "no_poses":
                raise
            text = "update_scene: data has no poses, so images are empty; call mujoco.mj_forward(model, data) first"
            warnings.warn(Notice(text, "no_poses"), stacklevel=2)
            self._scene = None
            return
        self._view = self._find_camera(data, camera)
        self._fill_visual(data, option, camera)

    def _fill_visual(self, data: Any, option: Any, camera: Any) -> None:
        """Fills the `mjvScene` with geoms, lights and the camera."""
        import mujoco

        view = camera
        if not isinstance(camera, mujoco.MjvCamera):
            view = mujoco.MjvCamera()
            mujoco.mjv_defaultFreeCamera(self._model, view)
            if isinstance(camera, str) or camera >= 0:
                view.type = FIXED
                view.fixedcamid = self._model.camera(camera).id
        category = mujoco.mjtCatBit.mjCAT_ALL.value
        original("mjv_updateScene")(self._model, data, option, None, view, category, self._visual)
        self._scene.remember_visual(self._visual)

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

        If `channels` is not empty, the attribute `frame` contains these channels afterwards. Without a scene, the image
        is empty as in MuJoCo, with a notice. Raises `SettingsError` if `out` has a wrong shape, or for unknown
        channels.
        """
        camera = self.camera or self._view
        self.frame = None
        if self._scene is None or camera is None:
            text = (
                "render: no scene, so the image is empty; call mujoco.mj_forward(model, data) and "
                "update_scene(data) first"
            )
            warnings.warn(Notice(text, "missing_value"), stacklevel=2)
            found = self._empty_image(self._size if self.camera is None else self.camera.size)
        else:
            scene = self._scene.with_changes(self._visual, camera)
            scene.flags[: len(self._visual.flags)] = self._visual.flags
            found = getattr(self, f"_{self._mode}")(scene, camera)
            if self.channels and self.frame is None:
                self.frame = render(scene.world, camera, channels=list(self.channels))
        if out is None:
            return np.asarray(found)
        if out.shape != found.shape:
            raise SettingsError(
                f"out must have the shape {list(found.shape)}, not {list(out.shape)}", code="wrong_shape"
            )
        out[...] = found
        return out

    def _empty_image(self, size: tuple[int, int]) -> npt.NDArray[Any]:
        """An image without objects: black, the far plane's depth, or the background's ids."""
        width, height = size
        if self._mode == "color":
            return np.zeros((height, width, 3), np.uint8)
        if self._mode == "depth":
            return np.full((height, width), self._far())
        return np.full((height, width, 2), -1, np.int32)

    def _far(self) -> np.float32:
        """The far plane's depth in metres."""
        return np.float32(self._model.vis.map.zfar * self._model.stat.extent)

    def _color(self, scene: Any, camera: Camera) -> npt.NDArray[Any]:
        samples = 4 if self._model.vis.quality.offsamples > 1 else 1
        if self.look == "mujoco":
            return np.asarray(scene.render(camera, samples=samples))
        if self.look not in LOOKS:
            raise SettingsError(
                f"look must be one of {', '.join(LOOKS)}, got {self.look!r}", code="unknown_name"
            )
        if scene.has_scene_lights:
            text = f"renderer.scene.lights: changes have no effect with look={self.look!r}; they require look='mujoco'"
            warnings.warn(Notice(text, "ignored_element"), stacklevel=3)
        samples = 64 if self.look == "path" else 4
        return render(scene.world, camera, integrator=self.look, samples=samples).to_srgb8()

    def _depth(self, scene: Any, camera: Camera) -> npt.NDArray[Any]:
        depth = self._truth(scene, camera, "depth")
        # `fmin` returns the far plane's depth for the background (infinite depth) and for pixels without a ray (NaN).
        return np.asarray(np.fmin(depth, self._far()), np.float32)

    def _segmentation(self, scene: Any, camera: Camera) -> npt.NDArray[Any]:
        return element_ids(scene, self._truth(scene, camera, "instance"))

    def _truth(self, scene: Any, camera: Camera, channel: str) -> npt.NDArray[Any]:
        """One channel, computed in the same pass as `channels`."""
        frame = render(scene.world, camera, channels=list(dict.fromkeys([channel, *self.channels])))
        self.frame = frame if self.channels else None
        return np.asarray(frame[channel])

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
        self._source.forget()

    def __enter__(self) -> Renderer:
        """Returns the renderer."""
        return self

    def __exit__(self, *_: object) -> None:
        """Closes the renderer."""
        self.close()


def element_ids(scene: Any, instance: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """Returns ids and types (`mjtObj`) [..., 2] of the elements of instances; -1 for the background."""
    # The last row is for the background, whose instance is -1.
    elements = np.array([*scene.elements, (-1, -1)], np.int32)[:, ::-1]
    return elements.take(instance, axis=0, mode="wrap")
