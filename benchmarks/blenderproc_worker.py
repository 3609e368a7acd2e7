"""Renders with BlenderProc for `bench_blenderproc.py`; prints the seconds as JSON.

Arguments: WORLD.npz THREADS FOLDER
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
import time
import types
from pathlib import Path

import bpy
import numpy as np


def blenderproc() -> types.ModuleType:
    """Returns the module `blenderproc` in a Python with `bpy`, without installing packages.

    BlenderProc would otherwise install packages into Blender.
    """
    os.environ["INSIDE_OF_THE_INTERNAL_BLENDER_PYTHON_ENVIRONMENT"] = "1"
    packages = next(path for path in sys.path if path.endswith("site-packages"))
    # BlenderProc removes this path from sys.path; another spelling of it remains.
    sys.path.append(packages + os.sep)
    setup = types.ModuleType("blenderproc.python.utility.SetupUtility")
    setup.SetupUtility = type("SetupUtility", (), {"setup": staticmethod(lambda *_: sys.argv)})
    sys.modules[setup.__name__] = setup
    import blenderproc as bproc
    from blenderproc.python.renderer import RendererUtility
    from blenderproc.python.utility import Initializer
    from blenderproc.python.utility.Utility import Utility

    Utility.temp_dir = tempfile.mkdtemp()
    # The same settings as bproc.init(), except for the language, which Blender as a module does not support.
    bproc.clean_up(clean_up_camera=True)
    bpy.context.scene.render.engine = "CYCLES"
    RendererUtility.set_render_devices()
    Initializer._Initializer.set_default_parameters()
    return bproc


def main() -> None:
    given = np.load(sys.argv[1])
    threads, folder = int(sys.argv[2]), Path(sys.argv[3])
    bproc = blenderproc()
    bproc.renderer.set_cpu_threads(threads)
    for number, category in enumerate(given["categories"]):
        mesh = bpy.data.meshes.new(f"object{number}")
        corners = given[f"triangles{number}"].reshape(-1, 3)
        mesh.from_pydata(corners.tolist(), [], np.arange(len(corners)).reshape(-1, 3).tolist())
        item = bpy.data.objects.new(f"object{number}", mesh)
        bpy.context.scene.collection.objects.link(item)
        thing = bproc.types.MeshObject(item)
        thing.set_cp("category_id", int(category))
        material = bproc.material.create(f"material{number}")
        material.set_principled_shader_value("Base Color", [*given["colors"][number], 1.0])
        thing.add_material(material)
    sun = bproc.types.Light()
    sun.set_type("SUN")
    sun.set_energy(3)
    bproc.camera.set_intrinsics_from_K_matrix(given["K"], *given["size"].tolist())
    for matrix in given["poses"]:
        bproc.camera.add_camera_pose(matrix)

    taken: dict[str, float] = {}

    def timed(name: str, work: object) -> object:
        start = time.perf_counter()
        result = work()
        taken[name] = time.perf_counter() - start
        return result

    render = bproc.renderer
    render.set_max_amount_of_samples(1)
    render.set_noise_threshold(0)
    render.set_denoiser(None)
    render.render()  # not measured: the first call builds data that later calls reuse
    colors = timed("color", render.render)["colors"]
    render.enable_depth_output(activate_antialiasing=False)
    render.enable_normals_output()
    timed("maps", render.render)
    masks = timed("masks", lambda: render.render_segmap(map_by=["instance", "class", "name"]))
    timed(
        "coco",
        lambda: bproc.writer.write_coco_annotations(
            str(folder),
            instance_segmaps=masks["instance_segmaps"],
            instance_attribute_maps=masks["instance_attribute_maps"],
            colors=colors,
            color_file_format="PNG",
        ),
    )
    found = {"blender": bpy.app.version_string, "blenderproc": bproc.__version__, "seconds": taken}
    found["objects"] = [len(np.unique(mask)) for mask in masks["instance_segmaps"]]
    print("found " + json.dumps(found), flush=True)
    os._exit(0)  # Blender as a module may crash in a normal exit


if __name__ == "__main__":
    main()
