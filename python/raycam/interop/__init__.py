"""Worlds from the meshes and scenes of other Python packages."""
