"""A model's scene that follows its state and an `mjvOption`."""

from __future__ import annotations

from typing import Any

from raycam import from_mujoco

from .shown_parts import ShownParts, shown_parts, warn_of_unused

__all__ = ["ModelScene"]

LOOK_ARRAYS = (
    "geom_type", "geom_size", "geom_rgba", "geom_matid", "geom_group", "site_type", "site_size", "site_rgba",
    "site_matid", "site_group", "tendon_rgba", "tendon_matid", "tendon_group", "mat_rgba", "mat_emission",
    "mat_specular", "mat_shininess", "mat_reflectance", "mat_texid", "mat_texrepeat",
)  # fmt: skip
"""The model's arrays of shapes and colours; if a program changes them, a new scene is built."""


class ModelScene:
    """Keeps a `MujocoScene` of a model; builds a new one if visible parts or colours have changed."""

    def __init__(self, model: Any) -> None:
        self.model = model
        self._scene: Any = None
        self._shown, self._looks = ShownParts(), b""

    def update(self, data: Any, option: Any, *, own_light: bool = True) -> Any:
        """Returns the `MujocoScene` at the state in `data`, with the parts that an `mjvOption` shows.

        `own_light` is False for physically based light. Raises `WorldError` with the code `no_poses` if `data` has no
        poses.
        """
        warn_of_unused(option)
        shown = shown_parts(option)
        looks = b"".join(getattr(self.model, name).tobytes() for name in LOOK_ARRAYS)
        if self._scene is not None and (shown, looks) == (self._shown, self._looks):
            self._scene.update(data)
        else:
            self._scene = from_mujoco(
                self.model,
                data,
                groups=shown.geoms,
                sites=shown.sites,
                tendons=shown.tendons,
                own_light=own_light,
                dynamic_alpha=float(self.model.vis.map.alpha) if shown.transparent else 1.0,
            )
            self._shown, self._looks = shown, looks
        return self._scene

    def forget(self) -> None:
        """Makes the next `update` build a new scene, because textures, meshes or height fields have changed."""
        self._scene = None
