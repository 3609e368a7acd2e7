"""Worlds from MuJoCo models.

Only the model's arrays are read; MuJoCo is imported only to compute the initial state.
"""

from .scene import MujocoScene, from_mujoco

__all__ = ["MujocoScene", "from_mujoco"]
