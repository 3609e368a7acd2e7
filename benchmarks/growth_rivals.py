"""Measures how time and memory of an image grow with triangles, instances, lights, pixels and threads.

    python benchmarks/growth_rivals.py FILE.json [--mitsuba PYTHON] [--embree PYTHON] [--only AXIS ...]
    python benchmarks/growth_rivals.py FILE.json --charts FOLDER

Each run changes one of these quantities, in a process of its own. FILE.json contains the figures; further runs
add to it. `--charts` prints the tables, and writes two charts (requires matplotlib).

The scene is a height field under a lamp, rendered with direct light. Instances are copies of a small height field
next to each other; lights are point lights above the field. Times are processor times of all threads; memory is the
peak beyond the memory before the scene is built (Linux: VmHWM). Embree only casts the camera rays.

More threads than cores are simulated: `critical` is the processor time of the calling thread plus that of the busiest
other thread, which is the time of an image if each thread had its own core and nothing waits for memory.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
from height_field import height_field

BASE = {"triangles": 100_000, "instances": 1, "lights": 1, "pixels": 512 * 512, "threads": 2}
STEPS: dict[str, list[int]] = {
    "triangles": [10**4, 10**5, 10**6, 10**7, 10**8, 3 * 10**8],
    "instances": [1, 10, 100, 1_000, 10_000, 100_000, 1_000_000],
    "lights": [1, 10, 100, 1_000, 10_000, 100_000],
    "pixels": [64**2, 256**2, 1024**2, 4096**2, 16384**2],
    "threads": [1, 2, 4, 8, 16, 32, 64],
}
AXIS_BASES = {
    "threads": {"pixels": 1024**2},
    "lights": {"pixels": 128**2},
}  # differences from BASE, by quantity
# The largest steps of the other programs; more takes too long or does not fit into 20 GB.
LARGEST_STEPS = {
    "mitsuba": {"triangles": 10**7, "instances": 10**5, "lights": 10**5, "pixels": 4096**2, "threads": 0},
    "embree": {"triangles": 10**8, "instances": 0, "lights": 1, "pixels": 4096**2, "threads": 0},
}
MAX_MESH_TRIANGLES = 10**8  # more triangles are instances of a mesh of 10^7
INSTANCE_TRIANGLES = 200
EYE, TARGET, FOV = [-1.0, -1.2, 0.9], [0.0, 0.1, 0.0], 55
LIMIT_S = 550
Figures = dict[str, float]


def memory_mib(key: str) -> float:
    """Returns a memory figure of this process in MiB."""
    return int(Path("/proc/self/status").read_text().split(key + ":")[1].split()[0]) / 1024


def mesh_of(triangles: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns the height field with about as many triangles."""
    return height_field(1 + round((triangles / 2) ** 0.5), 1)


def places(count: int) -> np.ndarray:
    """Returns the centres of square cells that fill the field [n, 2], from -1 to 1, and as many as requested."""
    side = math.ceil(count**0.5)
    index = np.arange(count)
    return (np.stack([index % side, index // side], -1) + 0.5) * 2 / side - 1


def lamps(count: int) -> tuple[np.ndarray, float]:
    """Returns positions of lamps [n, 3] and the intensity of each."""
    random = np.random.default_rng(1)
    return np.column_stack([places(count), random.uniform(0.3, 0.6, count)]), 1.0 / count


def mesh_and_instances(values: dict[str, int]) -> tuple[int, int]:
    """Returns the triangles of the mesh and the number of its instances."""
    if values["instances"] > 1:
        return INSTANCE_TRIANGLES, values["instances"]
    return (
        (values["triangles"], 1)
        if values["triangles"] <= MAX_MESH_TRIANGLES
        else (10**7, values["triangles"] // 10**7)
    )


class ThreadClock:
    """Samples the processor times of this process's threads while they run."""

    def __init__(self) -> None:
        self.before = self.read()
        self.found = dict(self.before)
        self.stop = threading.Event()
        self.sampler = threading.Thread(target=self.sample)

    @staticmethod
    def read() -> dict[int, float]:
        found = {}
        for task in Path("/proc/self/task").iterdir():
            try:
                found[int(task.name)] = int((task / "schedstat").read_text().split()[0]) / 1e9
            except (OSError, ProcessLookupError):
                continue
        return found

    def sample(self) -> None:
        while not self.stop.wait(0.002):
            self.found |= self.read()

    def __enter__(self) -> ThreadClock:
        self.sampler.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.found |= self.read()
        self.stop.set()
        self.sampler.join()

    def times(self) -> tuple[float, float]:
        """Returns the time of all threads, and the calling thread's time plus that of the busiest other thread."""
        own, sampler = threading.main_thread().native_id, self.sampler.native_id
        spent = {
            task: end - self.before.get(task, 0.0) for task, end in self.found.items() if task != sampler
        }
        calling = sum(time for task, time in spent.items() if task == own)
        others = [time for task, time in spent.items() if task != own]
        return calling + sum(others), calling + max(others, default=0.0)


def raycam_image(values: dict[str, int]) -> Figures:
    """Returns the figures of an image in raycam."""
    import raycam

    vertices, faces = mesh_of(mesh_and_instances(values)[0])
    count = mesh_and_instances(values)[1]
    held, start = memory_mib("VmRSS"), time.process_time()
    world = raycam.World(up="z")
    scale = 1 / math.ceil(count**0.5)
    spots = places(count).tolist()
    world.add_mesh(vertices, faces, name="field", location=[*spots[0], 0], scale=scale)
    for x, y in spots[1:]:
        world.add_object(instance_of="field", location=[x, y, 0], scale=scale)
    positions, intensity = lamps(values["lights"])
    for position in positions.tolist():
        world.add_light({"type": "point", "position": position, "intensity": [intensity] * 3})
    side = round(values["pixels"] ** 0.5)
    camera = raycam.Camera.look_at(EYE, TARGET, [0, 0, 1], size=(side, side), fov=FOV)
    scene = time.process_time()
    world.prepare(threads=values["threads"])
    prepared = time.process_time()
    times, critical = [], []
    options: dict[str, Any] = {"integrator": "direct", "samples": 1, "channels": "color"}
    while len(times) < 3 and sum(times) < 10:
        with ThreadClock() as clock:
            raycam.render(world, camera, threads=values["threads"], **options)
        total, longest = clock.times()
        times.append(total)
        critical.append(longest)
    return {
        "scene": scene - start,
        "prepare": prepared - scene,
        "image": min(times),
        "critical": min(critical),
        "memory": memory_mib("VmHWM") - held,
    }


def mitsuba_image(values: dict[str, int]) -> Figures:
    """Returns the figures of an image in Mitsuba 3; its scene time includes the tree."""
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    transform = mi.ScalarTransform4f
    vertices, faces = mesh_of(mesh_and_instances(values)[0])
    count = mesh_and_instances(values)[1]
    held, start = memory_mib("VmRSS"), time.process_time()
    mesh = mi.Mesh("field", len(vertices), len(faces))
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = vertices.astype(np.float32).ravel()
    parameters["faces"] = faces.ravel()
    parameters.update()
    side = round(values["pixels"] ** 0.5)
    film = {"type": "hdrfilm", "width": side, "height": side, "rfilter": {"type": "box"}}
    camera = {"type": "perspective", "fov": FOV, "film": film, "sampler": {"type": "independent"}}
    camera["to_world"] = transform().look_at(origin=EYE, target=TARGET, up=[0, 0, 1])
    description: dict[str, Any] = {"type": "scene", "sensor": camera}
    scale = 1 / math.ceil(count**0.5)
    if count == 1:
        description["field"] = mesh
    else:
        description["group"] = {"type": "shapegroup", "field": mesh}
        for k, (x, y) in enumerate(places(count).tolist()):
            to_world = transform().translate([x, y, 0]).scale(scale)
            description[f"i{k}"] = {
                "type": "instance",
                "to_world": to_world,
                "group": {"type": "ref", "id": "group"},
            }
    positions, intensity = lamps(values["lights"])
    for k, position in enumerate(positions.tolist()):
        shine = {"type": "rgb", "value": [intensity] * 3}
        description[f"l{k}"] = {"type": "point", "position": position, "intensity": shine}
    scene = mi.load_dict(description)
    built = time.process_time()
    integrator = mi.load_dict({"type": "direct", "bsdf_samples": 0, "emitter_samples": 1})
    times = []
    while len(times) < 4 and sum(times) < 20:
        before = time.process_time()
        np.asarray(mi.render(scene, integrator=integrator, spp=1, seed=len(times)))
        times.append(time.process_time() - before)
    return {"scene": built - start, "prepare": 0.0, "image": min(times), "memory": memory_mib("VmHWM") - held}


def embree_image(values: dict[str, int]) -> Figures:
    """Returns the figures of the camera rays in Embree; its tree is built with the first rays."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    vertices, faces = mesh_of(values["triangles"])
    vertices, faces = vertices.astype(np.float32), faces.astype(np.int32)
    held, start = memory_mib("VmRSS"), time.process_time()
    scene = EmbreeScene()
    TriangleMesh(scene, vertices, faces)
    scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))
    built = time.process_time()
    memory = memory_mib("VmHWM") - held
    side = round(values["pixels"] ** 0.5)
    ahead = np.subtract(TARGET, EYE) / np.linalg.norm(np.subtract(TARGET, EYE))
    right = np.cross(ahead, [0, 0, 1]) / np.linalg.norm(np.cross(ahead, [0, 0, 1]))
    steps = ((np.arange(side) + 0.5) * 2 / side - 1) * math.tan(math.radians(FOV / 2))
    directions = ahead + steps[None, :, None] * right - steps[:, None, None] * np.cross(right, ahead)
    directions = directions.reshape(-1, 3).astype(np.float32)
    origins = np.tile(np.float32(EYE), (len(directions), 1))
    times = []
    for _ in range(3):
        before = time.process_time()
        scene.run(origins, directions)
        times.append(time.process_time() - before)
    return {"scene": built - start, "prepare": 0.0, "image": min(times), "memory": memory}


IMAGES = {"raycam": raycam_image, "mitsuba": mitsuba_image, "embree": embree_image}


def measure(program: str, python: str, values: dict[str, int]) -> Figures | None:
    """Returns the figures of a program in a process of its own; None if it fails or takes too long."""
    command = [python, __file__, "-", "--one", program, json.dumps(values)]
    environment = {
        key: value for key, value in os.environ.items() if key != "PYTHONPATH" or program == "raycam"
    }
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, check=False, timeout=LIMIT_S, env=environment
        )
    except subprocess.TimeoutExpired:
        return None
    if done.returncode:
        print(done.stderr[-400:], file=sys.stderr)
        return None
    figures: Figures = json.loads(done.stdout.splitlines()[-1])
    return figures


def exponent(points: list[tuple[float, float]]) -> float:
    """Returns the exponent of a power law, fitted to the last three points."""
    last = np.log(np.array(points[-3:]))
    return float(np.polyfit(last[:, 0], last[:, 1], 1)[0])


def rows_of(found: list[dict[str, Any]], axis: str, program: str) -> list[dict[str, Any]]:
    """Returns a program's figures along an axis, in order."""
    rows = [row for row in found if (row["axis"], row["program"]) == (axis, program)]
    return sorted(rows, key=lambda row: row["count"])


def seconds(row: dict[str, Any], key: str) -> float:
    """Returns the time of the scene with its tree, or of an image on each of two cores."""
    if key == "image":
        return float(row.get("critical", row["image"] / 2))
    return max(row["scene"] + row["prepare"], 1e-4)


def tables(found: list[dict[str, Any]]) -> str:
    """Returns a table for each axis, and the exponents of the last three steps."""
    lines = []
    for axis in STEPS:
        lines += [
            "",
            f"| {axis} | program | scene, s | tree, s | image, s | MiB |",
            "| --: | --- " + "| --: " * 4 + "|",
        ]
        for program in IMAGES:
            rows = rows_of(found, axis, program)
            for row in rows:
                image, memory = seconds(row, "image"), row["memory"]
                cells = [f"{row['scene']:.3f}", f"{row['prepare']:.3f}", f"{image:.4f}", f"{memory:,.0f}"]
                lines.append(f"| {row['count']:,} | {program} | {' | '.join(cells)} |")
        for program in IMAGES:
            rows = rows_of(found, axis, program)
            if len(rows) >= 3:
                scene = exponent([(row["count"], seconds(row, "scene")) for row in rows])
                image = exponent([(row["count"], seconds(row, "image")) for row in rows])
                memory = exponent([(row["count"], row["memory"]) for row in rows])
                span = f"{rows[-3]['count']:,} to {rows[-1]['count']:,}"
                lines.append(
                    f"\n{program}, exponents from {span}: scene and tree {scene:.2f}, image {image:.2f}, "
                    f"memory {memory:.2f}."
                )
    return "\n".join(lines)


def draw(found: list[dict[str, Any]], path: Path, label: str, lines: dict[str, str]) -> None:
    """Draws figures by each axis; `lines` contains a line style for each figure."""
    from matplotlib import pyplot as plt

    figure, panels = plt.subplots(1, len(STEPS), figsize=(13, 3.2), sharey=True)
    colors = {"raycam": "#c8502d", "mitsuba": "#5f7182", "embree": "#9fb0bf"}
    for panel, axis in zip(panels, STEPS, strict=True):
        for program, color in colors.items():
            rows = rows_of(found, axis, program)
            for key, style in lines.items():
                values = [row["memory"] if key == "memory" else seconds(row, key) for row in rows]
                name = f"{program}, {key}" if axis == "triangles" else None
                panel.loglog([row["count"] for row in rows], values, style, color=color, ms=3, label=name)
        panel.set_xlabel(axis)
        panel.grid(alpha=0.3)
    panels[0].set_ylabel(label)
    panels[0].legend(fontsize=6)
    figure.tight_layout()
    figure.savefig(path, dpi=90)


def main() -> None:
    """Measures, or writes tables and charts."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("file", type=Path)
    parser.add_argument("--mitsuba", metavar="PYTHON", help="Python interpreter with Mitsuba")
    parser.add_argument("--embree", metavar="PYTHON", help="Python interpreter with embreex")
    parser.add_argument("--only", nargs="+", choices=list(STEPS), default=list(STEPS))
    parser.add_argument("--largest", type=float, default=math.inf, help="largest step")
    parser.add_argument("--smallest", type=float, default=0, help="smallest step")
    parser.add_argument("--charts", type=Path, metavar="FOLDER", help="write the charts to this folder")
    parser.add_argument("--one", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print("\n" + json.dumps(IMAGES[options.one[0]](json.loads(options.one[1]))))
        return
    found = json.loads(options.file.read_text()) if options.file.exists() else []
    if options.charts:
        print(tables(found))
        styles = {"scene": "o:", "image": "o-"}
        draw(found, options.charts / "growth-time.png", "processor time, s", styles)
        draw(found, options.charts / "growth-memory.png", "peak memory, MiB", {"memory": "o-"})
        return
    pythons = {"raycam": sys.executable, "mitsuba": options.mitsuba, "embree": options.embree}
    for axis in options.only:
        for count in STEPS[axis]:
            for program, python in pythons.items():
                top = LARGEST_STEPS.get(program, {}).get(axis, math.inf)
                if not python or count > top or not options.smallest <= count <= options.largest:
                    continue
                figures = measure(program, python, {**BASE, **AXIS_BASES.get(axis, {}), axis: count})
                print(axis, count, program, figures, flush=True)
                if figures:
                    found.append({"axis": axis, "count": count, "program": program, **figures})
                    options.file.write_text(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
