"""Modules that stand in for those of other libraries, so that scripts run with one line changed.

`raycam.compat.trimesh` for `trimesh.ray` and `trimesh.proximity`, `raycam.compat.open3d` for `RaycastingScene`,
`raycam.compat.pyrender` for pyrender, `raycam.compat.mujoco` for `mujoco.Renderer`. They use the public names of raycam
alone, and import the other library only in `install()`.
"""
