"""Summaries of worlds and cameras as text."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from .camera import Camera
from .rig import Rig
from .robots import Robot
from .world import World
from .world.settle import find_overlaps

__all__ = ["info", "info_cameras"]


def info(world: World) -> str:
    """Returns a description of a world as text.

    The text contains counts, bounds, objects, lights, cameras with their matrices, video, animations and
    notices.
    """
    return "\n".join(_lines(world))


def info_cameras(cameras: Mapping[str, Camera], rigs: Mapping[str, Rig] | None = None) -> str:
    """Returns a description of cameras as text.

    The text contains K, R, P, C, angles and lens of each camera, and the relative poses of the cameras of `rigs`.
    """
    lines = [f"cameras    {len(cameras)}"]
    lines += [line for name, camera in cameras.items() for line in _camera(f"{name!r}", camera)]
    if rigs:
        lines += _rigs(rigs)
    return "\n".join(lines)


def _lines(world: World) -> Iterator[str]:
    counts = world.counts
    bounds = world.bounds
    zero = counts["zero_area_triangles"]
    yield f"{world.up} up"
    yield f"objects    {counts['objects']}, of {_many(counts['meshes'], 'mesh', 'meshes')}"
    yield f"triangles  {counts['triangles']}" + (f", {zero} of zero area (kept, never hit)" if zero else "")
    if counts["mesh_triangles"] != counts["triangles"]:
        yield f"           {counts['mesh_triangles']} stored; the others are instances of these"
    yield f"vertices   {counts['vertices']}"
    yield f"materials  {counts['materials']}, {_many(counts['textures'], 'texture', 'textures')}"
    if bounds is not None:
        low, high = (_vector(corner) for corner in bounds)
        yield f"bounds     {low} to {high}, size {_vector(bounds[1] - bounds[0])}"
    for item in world.objects[:20]:
        category = f", {item.category}" if item.category else ""
        yield f"  object {item.id} {item.name!r}: {item.triangles} triangles at {_vector(item.matrix[:3, 3])}{category}"
    if len(world.objects) > 20:
        yield f"  and {len(world.objects) - 20} more"
    for robot in world.robots.values():
        yield from _robot(robot)
    for one, other, depth in find_overlaps(world):
        yield f"overlap    {one!r} and {other!r}: {1e3 * depth:.1f} mm"
    yield f"lights     {counts['lights']}"
    for light in world.lights:
        values = ", ".join(f"{key} {_light_value(value)}" for key, value in light.items() if key != "type")
        yield f"  {light['type']}: {values}"
    if world.fog is not None:
        yield "fog        " + ", ".join(f"{key} {_light_value(value)}" for key, value in world.fog.items())
    yield f"cameras    {counts['cameras']}"
    for name, camera in world.cameras.items():
        yield from _camera(f"{name!r}", camera)
    if world.rigs:
        yield from _rigs(world.rigs)
    if world._first_camera is None and bounds is not None:
        yield from _camera("(default camera, which shows the whole world)", world.default_camera())
    if world.video is not None:
        video = world.video
        yield f"video      {video.frames} frames, {video.seconds:g} s at {video.fps:g} fps"
    if world.animations:
        yield f"animations {len(world.animations)}"
        yield from (f"  animation {each.name!r}: {each.duration:.6g} s" for each in world.animations)
    if world.variants:
        yield "variants   " + ", ".join(map(repr, world.variants))
    if world.render_settings:
        yield "rendering  " + ", ".join(f"{key} {value}" for key, value in world.render_settings.items())
    yield f"notices    {len(world.notices)}"
    yield from (f"  {notice}" for notice in world.notices)


def _robot(robot: Robot) -> Iterator[str]:
    """The joints of a robot with their limits, and its tree of links."""
    links, joints = _many(len(robot.links), "link", "links"), _many(len(robot.joints), "joint", "joints")
    yield f"robot      {robot.name!r}: {links}, {joints}"
    for name, (low, high) in robot.limits.items():
        limits = "not limited" if np.isinf([low, high]).all() else f"{low:g} to {high:g}"
        yield f"  joint {name!r}: {robot.description.joints[name].type}, {limits}"
    children: dict[str, list[str]] = {}
    for joint in robot.description.joints.values():
        children.setdefault(joint.parent, []).append(joint.child)
    moved = {joint.child for joint in robot.description.joints.values()}
    waiting = [(name, 1) for name in robot.links if name not in moved]
    while waiting:
        link, depth = waiting.pop()
        yield f"{'  ' * depth}link {link}"
        waiting += [(child, depth + 1) for child in reversed(children.get(link, []))]


def _camera(name: str, camera: Camera) -> Iterator[str]:
    width, height = camera.size
    yield f"  camera {name}: {width} x {height}, pixel_center {camera.pixel_center}"
    for label, matrix in (("K", camera.K), ("R", camera.R), ("P", camera.P)):
        for i, row in enumerate(matrix):
            yield f"    {label if i == 0 else ' '}  " + " ".join(_fixed(value) for value in row)
    name, center = ("center", camera.center) if camera.is_parallel else ("C ", camera.C)
    yield f"    {name} {_vector(center)}"
    yield f"    roll {camera.roll_pitch_yaw[0]:.6g}, pitch {camera.roll_pitch_yaw[1]:.6g}, " + (
        f"yaw {camera.roll_pitch_yaw[2]:.6g} degrees"
    )
    if camera.distortion is not None:
        yield f"    lens {camera.model}, distortion {_vector(camera.distortion)}"


def _rigs(rigs: Mapping[str, Rig]) -> Iterator[str]:
    yield f"rigs       {len(rigs)}"
    for name, rig in rigs.items():
        roll, pitch, yaw = rig.roll_pitch_yaw
        yield f"  rig {name!r}: body at {_vector(rig.C)}, roll {roll:.6g}, pitch {pitch:.6g}, yaw {yaw:.6g}"
        mounts = rig.mounts
        first = next(iter(mounts.values()))
        for own, camera in mounts.items():
            apart = first.R @ (camera.location - first.location)
            cosine = np.clip((np.trace(camera.R @ first.R.T) - 1.0) / 2.0, -1.0, 1.0)
            size = "{} x {}".format(*camera.size)
            yield f"    camera {own!r}: {size}, {camera.model}, at {_vector(camera.location)} of the body" + (
                f"; from the first {_vector(apart)}, turned by {np.degrees(np.arccos(cosine)):.6g} degrees"
                if camera is not first
                else ""
            )


def _light_value(value: object) -> str:
    """A light's value as text: a file name, true or false, numbers, or the shape of an image."""
    if isinstance(value, str):
        return repr(value)
    if isinstance(value, bool):
        return str(value).lower()
    numbers = np.asarray(value)
    if numbers.dtype.kind not in "iuf":
        return str(value)
    return _vector(numbers) if numbers.size <= 16 else "array of " + " x ".join(map(str, numbers.shape))


def _many(count: int, one: str, more: str) -> str:
    return f"{count} {one if count == 1 else more}"


def _fixed(value: float) -> str:
    """Returns a number as text with six decimals; zero has no sign."""
    text = f"{value:14.6f}"
    return f"{0.0:14.6f}" if float(text) == 0.0 else text


def _vector(values: object) -> str:
    """Returns numbers as text with six significant digits or six decimals, whichever is more.

    Large values therefore keep millimetres.
    """
    numbers = np.atleast_1d(np.asarray(values, dtype=np.float64)) + 0.0
    return " ".join(f"{value:.{6 + _digits(value)}g}" for value in numbers)


def _digits(value: float) -> int:
    """The number of digits before the decimal point."""
    return len(str(int(abs(value)))) if 1.0 <= abs(value) < 1e9 else 0
