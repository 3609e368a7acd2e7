"""Replacements for modules of other libraries, so that scripts run with one changed line.

`raycam.compat.trimesh` replaces `trimesh.ray` and `trimesh.proximity`, `raycam.compat.open3d` replaces
`RaycastingScene`, `raycam.compat.pyrender` pyrender, and `raycam.compat.mujoco` MuJoCo's renderer. These modules
use only raycam's public interface, and import the other library only in `install()`.
"""
