"""nuScenes: key frames and sweeps of cameras and lidars on a rig, with boxes of objects.

Source: nuscenes-devkit, docs/schema_nuscenes.md and docs/instructions_nuscenes.md.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ..annotations.labels import box3d
from ..arguments import Floats, product, real, whole
from ..errors import CameraError, SettingsError
from ..lidar import Lidar, Scan
from .lidars import check_rigs, lidars_of, pose_of, scan_lidar
from .plan import NO_LENSES, Format, Index, Made, Plan, Record, k_with_integer_centers, png
from .training.cdr import body_of, mount_of, quaternion

__all__ = ["FORMAT"]

OPTIONS: dict[str, Any] = {
    "version": "v1.0-mini",
    "scene": "scene-0001",
    "key_every": 1,
    "fps": 20.0,
    "start_time": 0.0,
}
VISIBILITIES = (("1", "v0-40", 0.4), ("2", "v40-60", 0.6), ("3", "v60-80", 0.8), ("4", "v80-100", np.inf))
"""Token, level and upper limit of the visible fraction."""
MAP = "maps/map.png"


def token(*parts: object) -> str:
    """Returns the token of a row of a table: 32 hexadecimal digits that depend only on `parts`."""
    text = "/".join(str(part) for part in parts)
    return hashlib.md5(text.encode(), usedforsecurity=False).hexdigest()


def check(plan: Plan) -> None:
    """Raises an error for a world, views or cameras that nuScenes does not support.

    The world must be z up, all views must belong to rigs with a lidar, and the cameras, if any, must be pinholes.
    """
    check_rigs(plan, "nuscenes")
    if plan.world.up != "z":
        raise SettingsError(
            f"nuscenes requires a world with up = z, not {plan.world.up}", code="unsupported_feature"
        )
    for frame in plan.rigs:
        if not lidars_of(plan.shots[frame[0]]):
            raise SettingsError(f"the rig of view {frame[0]} has no lidar", code="missing_value")
    for number, view in enumerate(plan.shots):
        if view.has_camera and view.camera.model != "pinhole":
            raise CameraError(
                f"camera {number} has a lens model, which nuScenes does not support; {NO_LENSES}",
                code="unsupported_camera",
            )
    _check_options(plan)


def _check_options(plan: Plan) -> None:
    for name in ("version", "scene"):
        value = plan.options[name]
        if not isinstance(value, str) or not value or set(value) & set("/\\:") or value.startswith("."):
            raise SettingsError(f"{name} is {value!r}, expected a name", code="invalid_value")
    whole("key_every", plan.options["key_every"], 1)
    real("fps", plan.options["fps"], 0, above=True, what="a number of frames per second")
    real("start_time", plan.options["start_time"], 0, 2**40, what="a time in seconds")


def timestamp(plan: Plan, number: int) -> int:
    """The time of a pose in microseconds."""
    time = plan.shots[plan.rigs[number][0]].time
    seconds = time if time is not None else number / float(plan.options["fps"])
    return round((float(plan.options["start_time"]) + seconds) * 1e6)


def is_key(plan: Plan, number: int) -> bool:
    """True if a pose is a key frame, which has annotations."""
    return number % int(plan.options["key_every"]) == 0


def pose_row(name: str, rotation: Floats, translation: Floats) -> dict[str, Any]:
    """Returns token, translation and rotation (w, x, y, z) of a pose."""
    x, y, z, w = quaternion(rotation)
    return {"token": name, "translation": [float(v) for v in translation], "rotation": [w, x, y, z]}


def make(plan: Plan, number: int) -> Made:
    """Creates the images and scans of a pose; the rows of its tables are in the record."""
    views = plan.rigs[number]
    R, C = body_of(plan, views)
    folder = "samples" if is_key(plan, number) else "sweeps"
    stamp = timestamp(plan, number)
    files: dict[str, bytes] = {}
    data, mounts = [], []
    seen: dict[int, float] = {}
    pictured = [view for view in views if plan.shots[view].has_camera]
    for view in pictured:
        shot = plan.shot(view)
        rig = plan.shots[view].rig
        assert rig is not None
        channel, camera = rig[1], shot.camera
        frame = shot.render(["color", "instance"])
        name = f"{folder}/{channel}/{plan.options['scene']}__{channel}__{stamp}.png"
        files[name] = frame.to_png()
        for item in shot.labels(frame["instance"]) if is_key(plan, number) else []:
            seen[item.object] = max(seen.get(item.object, 0.0), item.visible_fraction)
        turn, place = mount_of(camera, R, C)
        mounts.append(
            [channel, "camera", turn.tolist(), place.tolist(), k_with_integer_centers(camera).tolist()]
        )
        data.append([channel, name, "png", *camera.size])
    points: dict[int, int] = {}
    for channel, lidar in lidars_of(plan.shots[views[0]]).items():
        scan = scan_lidar(plan, views[0], lidar)
        name = f"{folder}/{channel}/{plan.options['scene']}__{channel}__{stamp}.pcd.bin"
        files[name] = scan_bytes(scan)
        for item_id, count in zip(*np.unique(scan["instance"], return_counts=True), strict=True):
            points[int(item_id)] = points.get(int(item_id), 0) + int(count)
        turn, place = lidar_mount(lidar, R, C)
        mounts.append([channel, "lidar", turn.tolist(), place.tolist(), []])
        data.append([channel, name, "pcd", 0, 0])
    visible = seen if pictured else None
    boxes = visible_boxes(plan, views[0], visible, points) if is_key(plan, number) else []
    record: Record = {"stamp": stamp, "R": R.tolist(), "C": C.tolist(), "data": data, "boxes": boxes}
    if number == 0:
        record["mounts"] = mounts
    return files, record


def scan_bytes(scan: Scan) -> bytes:
    """Returns the points of a scan as bytes: float32 [n, 5], little endian.

    The columns are x, y, z, intensity and ring. Positions are in the axes of the sensor at the frame's start.
    """
    columns = [scan.deskewed(0.0), scan["intensity"], scan["ring"]]
    return np.column_stack(columns).astype("<f4").tobytes()


def lidar_mount(lidar: Lidar, R: Floats, C: Floats) -> tuple[Floats, Floats]:
    """Returns the rotation body_from_lidar and the lidar's position on the body."""
    pose = pose_of(lidar)
    return product(R, pose[:3, :3]), product(R, pose[:3, 3] - C)


def visible_boxes(
    plan: Plan, view: int, seen: dict[int, float] | None, points: dict[int, int]
) -> list[Record]:
    """Returns the boxes of the labelled objects that are visible to a camera or a lidar.

    `seen` contains the greatest visible fraction of each object. It is None without cameras; the boxes then have no
    visibility, for which nuScenes uses an empty token.
    """
    shot, found = plan.shot(view), []
    labelled = set(plan.labelled_of(shot.objects))
    for item in shot.objects:
        fraction, count = (seen or {}).get(item.id, 0.0), points.get(item.id, 0)
        if item.id not in labelled or not (fraction > 0.0 or count):
            continue
        box = box3d(shot.world, item.id)
        length, width, height = (float(value) for value in box.size)
        found.append(
            {
                "object": item.id,
                "name": item.name,
                "category": item.category or "object",
                "translation": [float(value) for value in box.center],
                "size": [width, length, height],
                "rotation": pose_row("", box.rotation, box.center)["rotation"],
                "visibility_token": "" if seen is None else visibility(fraction),
                "num_lidar_pts": count,
            }
        )
    return found


def visibility(fraction: float) -> str:
    """Returns the token of a visible fraction."""
    return next(name for name, _, limit in VISIBILITIES if fraction < limit)


def units(plan: Plan) -> int:
    """The number of poses of the rig."""
    return max(1, len(plan.rigs))


def index(plan: Plan, records: Callable[[], Iterator[Record]]) -> Index:
    """Creates the thirteen tables, and a map that is drivable everywhere."""
    folder, scene = str(plan.options["version"]), str(plan.options["scene"])
    keys = [number for number in range(units(plan)) if is_key(plan, number)]
    tables: dict[str, Iterator[dict[str, Any]]] = {
        "category": (_named("category", name) for name in plan.categories.values()),
        "attribute": iter(()),
        "visibility": (_visibility(*row) for row in VISIBILITIES),
        "instance": instances(records),
        **sensors(next(records())["mounts"]),
        "ego_pose": ego_poses(records),
        **scenes(scene, keys),
        "sample": samples(plan, keys, token("scene", scene)),
        "sample_data": sample_data(plan, records, keys),
        "sample_annotation": sample_annotations(plan, records),
    }
    for name, rows in tables.items():
        yield f"{folder}/{name}.json", _json_list(rows)
    yield MAP, [png(np.full((16, 16), 255, np.uint8))]


def sensors(mounts: list[list[Any]]) -> dict[str, Iterator[dict[str, Any]]]:
    """Returns the tables of sensors and of their poses on the body."""
    devices = (
        {"token": token("sensor", mount[0]), "channel": mount[0], "modality": mount[1]} for mount in mounts
    )
    places = (
        {
            **pose_row(token("calibrated", mount[0]), np.array(mount[2]), np.array(mount[3])),
            "sensor_token": token("sensor", mount[0]),
            "camera_intrinsic": mount[4],
        }
        for mount in mounts
    )
    return {"sensor": devices, "calibrated_sensor": places}


def scenes(scene: str, keys: list[int]) -> dict[str, Iterator[dict[str, Any]]]:
    """Returns the tables of the log, the scene and the map, each with one row."""
    log = token("log", scene)
    about = {"logfile": "", "vehicle": "raycam", "date_captured": "1970-01-01", "location": "raycam"}
    row = {
        "token": token("scene", scene),
        "log_token": log,
        "nbr_samples": len(keys),
        "first_sample_token": token("sample", keys[0]),
        "last_sample_token": token("sample", keys[-1]),
        "name": scene,
        "description": "simulated by raycam",
    }
    area = {"token": token("map"), "log_tokens": [log], "category": "semantic_prior", "filename": MAP}
    return {"log": iter([{"token": log, **about}]), "scene": iter([row]), "map": iter([area])}


def _json_list(rows: Iterator[dict[str, Any]]) -> Iterator[bytes]:
    """Yields a JSON list in pieces."""
    first = True
    for row in rows:
        yield (b"[\n" if first else b",\n") + json.dumps(row).encode()
        first = False
    yield b"[]\n" if first else b"\n]\n"


def _named(table: str, name: str) -> dict[str, Any]:
    return {"token": token(table, name), "name": name, "description": ""}


def _visibility(name: str, level: str, limit: float) -> dict[str, Any]:
    return {"token": name, "level": level, "description": f"visible fraction of {level[1:]} %"}


def ego_poses(records: Callable[[], Iterator[Record]]) -> Iterator[dict[str, Any]]:
    """Yields the poses of the rig's body in the world, one for each file."""
    for number, record in enumerate(records()):
        for channel, *_ in record["data"]:
            pose = pose_row(token("ego", number, channel), np.array(record["R"]).T, np.array(record["C"]))
            yield {**pose, "timestamp": record["stamp"]}


def samples(plan: Plan, keys: list[int], scene: str) -> Iterator[dict[str, Any]]:
    """Yields the rows of the table of key frames."""
    for place, number in enumerate(keys):
        yield {
            "token": token("sample", number),
            "timestamp": timestamp(plan, number),
            "prev": token("sample", keys[place - 1]) if place else "",
            "next": token("sample", keys[place + 1]) if place + 1 < len(keys) else "",
            "scene_token": scene,
        }


def sample_data(
    plan: Plan, records: Callable[[], Iterator[Record]], keys: list[int]
) -> Iterator[dict[str, Any]]:
    """Yields the rows of the table of files, one for each channel of each frame.

    A sweep belongs to the next key frame. Sweeps after the last key frame belong to the last key frame.
    """
    every, total = int(plan.options["key_every"]), units(plan)
    for number, record in enumerate(records()):
        key = min(-(-number // every) * every, keys[-1])
        for channel, name, kind, width, height in record["data"]:
            yield {
                "token": token("data", number, channel),
                "sample_token": token("sample", key),
                "ego_pose_token": token("ego", number, channel),
                "calibrated_sensor_token": token("calibrated", channel),
                "timestamp": record["stamp"],
                "fileformat": kind,
                "is_key_frame": is_key(plan, number),
                "height": height,
                "width": width,
                "filename": name,
                "prev": token("data", number - 1, channel) if number else "",
                "next": token("data", number + 1, channel) if number + 1 < total else "",
            }


def instances(records: Callable[[], Iterator[Record]]) -> Iterator[dict[str, Any]]:
    """Yields the objects that have a box in at least one key frame."""
    found: dict[int, list[Any]] = {}
    for number, record in enumerate(records()):
        for box in record["boxes"]:
            row = found.setdefault(box["object"], [box["category"], number, number, 0])
            row[2], row[3] = number, row[3] + 1
    for item, (category, first, last, count) in sorted(found.items()):
        yield {
            "token": token("instance", item),
            "category_token": token("category", category),
            "nbr_annotations": count,
            "first_annotation_token": token("annotation", first, item),
            "last_annotation_token": token("annotation", last, item),
        }


def sample_annotations(plan: Plan, records: Callable[[], Iterator[Record]]) -> Iterator[dict[str, Any]]:
    """Yields the rows of the table of boxes.

    Each box is linked with the boxes of the same object in the key frames before and after.
    """
    frames: dict[int, list[int]] = {}
    for number, record in enumerate(records()):
        for box in record["boxes"]:
            frames.setdefault(box["object"], []).append(number)
    places: dict[int, int] = {}
    for number, record in enumerate(records()):
        for box in record["boxes"]:
            item = box["object"]
            place = places.get(item, 0)
            places[item], own = place + 1, frames[item]
            yield {
                "token": token("annotation", number, item),
                "sample_token": token("sample", number),
                "instance_token": token("instance", item),
                "visibility_token": box["visibility_token"],
                "attribute_tokens": [],
                "translation": box["translation"],
                "size": box["size"],
                "rotation": box["rotation"],
                "prev": token("annotation", own[place - 1], item) if place else "",
                "next": token("annotation", own[place + 1], item) if place + 1 < len(own) else "",
                "num_lidar_pts": box["num_lidar_pts"],
                "num_radar_pts": 0,
            }


FORMAT = Format(make, index, check, OPTIONS, units=units, posed=True, writes_lidars=True)
