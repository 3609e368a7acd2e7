"""Names of Open3D that `raycam.compat.open3d` does not contain, each with an alternative."""

from __future__ import annotations

from typing import Any

__all__ = ["HintingType", "Hints", "raise_missing"]

ALTERNATIVES = {
    "camera": "use raycam.Camera, or Camera.from_opencv(K, R, t, size)",
    "data": "use raycam.data.path(name), or files of your own with io.read_triangle_mesh",
    "ml": "install Open3D; for training data, use raycam.dataset",
    "pipelines": "install Open3D for registration and reconstruction",
    "visualization": "use raycam.render(world, camera) for images and raycam.view(world) for a live view; "
    "create the world with world.add_mesh(mesh.vertices, mesh.triangles)",
    "PointCloud": "use NumPy arrays [n, 3]: raycam has no point clouds",
    "LineSet": "use NumPy arrays [n, 2, 3]: raycam has no lines",
    "TetraMesh": "use a TriangleMesh of the tetrahedra's outer triangles",
    "AxisAlignedBoundingBox": "use get_min_bound() and get_max_bound(), or raycam's world.bounds",
    "OrientedBoundingBox": "use raycam.box3d(world, object)",
    "get_axis_aligned_bounding_box": "use get_min_bound() and get_max_bound(), or raycam's world.bounds",
    "is_watertight": "use raycam: world.add_mesh(mesh.vertices, mesh.triangles), then world.topology()",
    "read_point_cloud": "use NumPy arrays [n, 3]: raycam has no point clouds",
    "write_triangle_mesh": "use raycam: world.add_mesh(mesh.vertices, mesh.triangles), then world.to_gltf(path)",
    "read_image": "use imageio or Pillow",
    "write_image": "use imageio or Pillow",
    "cuda": "raycam supports only the CPU",
    "HashMap": "use a dict, or numpy.unique",
    "HashSet": "use a set, or numpy.unique",
}
"""Alternatives by name; all other names get their owner's general alternative."""


def raise_missing(owner: str, name: str, general: str) -> Any:
    """Raises an `AttributeError` that names an alternative.

    For Python's own names (`__len__`, `_x`), the error contains no alternative.
    """
    if name.startswith("_"):
        raise AttributeError(f"{owner} has no attribute {name!r}")
    raise AttributeError(
        f"{owner}.{name}: not in raycam.compat.open3d; {ALTERNATIVES.get(name, general)}",
        name=name,
    )


class HintingType(type):
    """Metaclass of classes without some of Open3D's static methods.

    Access to a missing static method raises an error that names an alternative.
    """

    def __getattr__(cls, name: str) -> Any:
        """Raises an `AttributeError` that names an alternative."""
        return raise_missing(cls.__name__, name, getattr(cls, "_ALTERNATIVE", ""))


class Hints(metaclass=HintingType):
    """Base of classes whose missing attributes raise an error that names an alternative."""

    _ALTERNATIVE = "install Open3D, or use trimesh"

    def __getattr__(self, name: str) -> Any:
        """Raises an `AttributeError` that names an alternative."""
        return raise_missing(type(self).__name__, name, type(self)._ALTERNATIVE)
