"""Worlds from MuJoCo models; only the model's arrays are read, and MuJoCo is imported only to compute the first
state.
"""

from .scene import MujocoScene, from_mujoco

__all__ = ["MujocoScene", "from_mujoco"]
