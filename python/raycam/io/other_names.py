"""Names that other libraries have for things which raycam calls otherwise: errors of missing names say ours."""

from __future__ import annotations

from types import ModuleType

__all__ = ["no_attribute"]

LOAD = "raycam.load(path)"
MOVE = "world.set_object(name, location=...), or matrix=..."
RAYS = "world.cast_rays(origins, directions)"
SHAPE = 'world.add_object(box={"size": 1}), sphere=, cylinder=, plane=, ...'

OF_RAYCAM = {
    **dict.fromkeys(
        ("read", "open", "load_mesh", "load_scene", "load_world", "load_model", "load_file"), LOAD
    ),
    **dict.fromkeys(("Scene", "Mesh", "Model"), f"raycam.World(), or {LOAD}"),
    **dict.fromkeys(("load_camera", "load_calibration", "read_cameras"), "raycam.load_cameras(path)"),
    **dict.fromkeys(("Light", "PointLight", "DirectionalLight", "SpotLight"), 'world.add_light("sun", ...)'),
    **dict.fromkeys(("Material", "BSDF"), "the keys of world.add_object(..., color=, roughness=, metallic=)"),
    **dict.fromkeys(("cast_rays", "ray_intersect", "raycast"), RAYS),
    **dict.fromkeys(("show", "Viewer3D", "viewer_open"), "raycam.view(world)"),
    **dict.fromkeys(("Renderer", "OffscreenRenderer"), "raycam.render(world, camera)"),
    **dict.fromkeys(("imwrite", "save", "write_image"), "frame.save(path)"),
    **dict.fromkeys(("look_at", "PinholeCamera", "PerspectiveCamera"), "raycam.Camera.look_at(...)"),
}
OF_WORLD = {
    **dict.fromkeys(("contains", "contains_points", "compute_occupancy"), "world.inside(points)"),
    **dict.fromkeys(("ray", "raycast", "ray_intersect", "intersects_location", "trace", "intersect"), RAYS),
    **dict.fromkeys(("compute_distance", "nearest", "closest_point"), "world.closest_points(points)"),
    "compute_signed_distance": "world.signed_distance(points)",
    **dict.fromkeys(("add_box", "add_cube", "add_sphere", "add_cylinder", "add_plane", "add_shape"), SHAPE),
    **dict.fromkeys(
        ("add", "add_geometry", "add_triangles", "add_model"), "world.add_mesh, world.add_object"
    ),
    **dict.fromkeys(("add_floor", "ground"), "world.add_ground()"),
    **dict.fromkeys(
        ("move_object", "move", "set_pose", "set_transform", "set_location", "apply_transform"), MOVE
    ),
    **dict.fromkeys(
        ("meshes", "geometry", "nodes", "instances", "get_object"), "world.objects, world.triangles(i)"
    ),
    **dict.fromkeys(("vertices", "faces"), "world.triangles(), the corners [n, 3, 3] in the world"),
    **dict.fromkeys(("bounding_box", "aabb", "extents", "extent", "bbox"), "world.bounds"),
    **dict.fromkeys(("save", "export", "write", "to_glb"), "world.to_gltf(path)"),
    **dict.fromkeys(("render", "snapshot"), "raycam.render(world, camera)"),
    **dict.fromkeys(("show", "view", "plot"), "raycam.view(world)"),
    **dict.fromkeys(("size", "resolution"), "the camera's: world.view_from(side, size=(width, height))"),
    **dict.fromkeys(("animate", "add_keyframe", "keyframes"), "world.set_video(keyframe=[...])"),
}
OF_FRAME = {
    **dict.fromkeys(("image", "rgb", "img", "pixels"), 'frame["color"], linear; frame.to_srgb8() as bytes'),
    **dict.fromkeys(("rgba",), "frame.to_srgba8()"),
    **dict.fromkeys(("mask", "masks", "segmentation", "ids"), 'frame["instance"], -1 for the background'),
    **dict.fromkeys(("normals",), 'frame["normal"]'),
    **dict.fromkeys(("points", "point_cloud"), 'frame["position"], NaN for the background'),
    **dict.fromkeys(("bboxes", "boxes", "labels", "bbox"), "raycam.label(world, camera)"),
    **dict.fromkeys(("shape", "width", "height", "resolution"), "frame.size, (width, height)"),
    **dict.fromkeys(("plot", "display"), "frame.show()"),
    **dict.fromkeys(("to_file", "write", "imwrite", "export"), "frame.save(path)"),
}
OF_CAMERA = {
    **dict.fromkeys(("width", "height", "resolution", "image_size"), "camera.size, (width, height)"),
    **dict.fromkeys(("intrinsics", "intrinsic", "matrix", "camera_matrix", "k"), "camera.K"),
    **dict.fromkeys(
        ("fx", "fy", "cx", "cy", "focal", "focal_length"), "camera.K, [[fx, skew, cx], [0, fy, cy], ...]"
    ),
    **dict.fromkeys(
        ("fov", "yfov", "hfov"), "camera.K; raycam.Camera.look_at(..., fov=degrees) makes a camera"
    ),
    **dict.fromkeys(("dist", "dist_coeffs", "D", "coeffs"), "camera.distortion"),
    **dict.fromkeys(
        ("pose", "extrinsics", "transform", "T", "world_to_camera"), "camera.R (camera_from_world), camera.C"
    ),
    **dict.fromkeys(("position", "eye", "origin"), "camera.location"),
    **dict.fromkeys(("set_pose", "move_to"), "camera.at_pose(R, C), another camera"),
    **dict.fromkeys(("world_to_pixel", "project_points", "projectPoints"), "camera.project(points)"),
    **dict.fromkeys(("unproject", "pixel_to_ray", "ray"), "camera.rays(pixels)"),
}
TABLES = {"raycam": OF_RAYCAM, "World": OF_WORLD, "Frame": OF_FRAME, "Camera": OF_CAMERA}


def no_attribute(owner: object, name: str, ours: str | None = None) -> AttributeError:
    """The error of a name that `owner`, an object or a module, has not.

    It says `ours`, raycam's way to the same, by default that of the tables, where another library has the name.
    """
    is_module = isinstance(owner, ModuleType)
    kind = owner.__name__ if isinstance(owner, ModuleType) else type(owner).__name__
    what = f"module {kind!r}" if is_module else f"{kind!r} object"
    ours = TABLES.get(kind, {}).get(name) if ours is None else ours
    hint = "" if ours is None else f"; it is {ours}"
    return AttributeError(f"{what} has no attribute {name!r}{hint}", name=name, obj=owner)
