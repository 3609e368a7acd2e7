"""The order of folders in each crate and in the package.

Each entry may import from earlier entries. An entry is a folder, or a file without its extension. A file
belongs to the longest entry that contains it, so `scene/query` may be above `traverse` while the rest of
`scene` is below.
"""

ORDER = {
    "bvh": """
        error exact simd platform aabb ray node limits
        build blas scene
        traverse/stack traverse/trav_ray traverse/near_ties traverse/node_test traverse/triangle traverse/single
        traverse/packet traverse/stream traverse/exact traverse/point traverse/closest traverse/occluded traverse/mod
        scene/ties scene/query lib
    """,
    "scene": """
        codes counted notice error_code error written named_enum up foreign_terms math color medium mesh texture
        material displacement camera light
        animation render_options video model world schema
        triangles lib
    """,
    "formats": """
        error budget io encode geometry image codec obj ply stl off ies gltf polygon_arrays world_file bundle registry
        asset_loader lib
    """,
    "calibration": """
        document quaternion_key pose pose_map rig_mount record rig files folder picture_size intrinsics plausibility
        colmap ros opencv kitti calibration_tools slam_settings trajectory devices bop photogrammetry view_synthesis
        radiance_fields datasets open_folder unknown_file formats lib
    """,
    "render": """
        error control memory thread_pool soa lobes sampling film settings prepare interaction media bsdf light
        path_guiding prepare/world motion ground_truth integrator guiding guiding_switch tile_renderer annotations
        lidar queries render render_many progressive lib
    """,
    "settle": """
        error convert random surface parts hull request bodies start simulation judge overlap settle lib
    """,
    "web": """
        failure request page lib
    """,
    "bindings": """
        error notice cancel interruptible arrays py_value elementary buffer_pool camera world/state queries render world
        lib
    """,
    "python": """
        errors codes notices progress arguments elementary rotations srgb read_only one_line _serialization io camera
        sensors/sensor rig usd robots world calibration reference render sensors lidar annotations
        interop data randomize jobs cluster video dataset baking photos calibration_check explanation viewer lecture
        info doctor bench demo cli
        __main__ __init__ compat
    """,
}

DELEGATIONS = {
    "camera/camera.py": {"render/render.py", "robots/mounted.py", "robots/robot.py", "world/world.py"},
    "sensors/sensor.py": {"lidar/world_table.py", "world/world.py"},
    "lidar/lidar.py": {"lidar/scanning.py"},
    "rig/rig.py": {"annotations/rig_frames.py", "render/frame.py", "world/world.py"},
    "render/frame.py": {"render/composition.py", "viewer/page.py"},
    "explanation/explanation.py": {"viewer/explanation_page.py"},
    "world/load.py": {"interop/mujoco/parts.py"},
    "world/robot_files.py": {"interop/mujoco/parts.py"},
}
"""Files that call a module later in the order, with these modules: `Camera.sample`, `Rig.render`, `Frame.over`,
`Frame.show`, `Explanation.save_figure`, and reading robots from MJCF files.

Such a method imports the function when it is called, and types of later modules under `TYPE_CHECKING`.
"""


def order_of(house: str) -> list[str]:
    """The entries of a crate or of the Python package, from the lowest to the highest."""
    return ORDER[house].split()
