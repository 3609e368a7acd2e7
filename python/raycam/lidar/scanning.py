"""`scan`: one frame of a lidar in a world."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..arguments import Floats, as_number, flag, whole
from ..errors import LidarError, nearest
from ..notices import collected, warn
from .column_buffer import ColumnBuffer
from .echoes import Echoes, find_echoes
from .intensity import device_intensity, signal_counts
from .lidar import LIGHT_SPEED, Lidar
from .near_ir import near_infrared
from .paths import Contributions, rows
from .pattern import Pattern
from .pulse_tracer import THRESHOLD, PulseTracer
from .radial_velocity import radial_velocities
from .scan_notices import LOST, warn_of_device, warn_of_empty_scan, warn_of_times
from .scan_result import Scan
from .waveform import sample_waveforms

if TYPE_CHECKING:
    from ..world import World

__all__ = [
    "KEPT",
    "LOST",
    "detect_echoes",
    "lidar_named",
    "lost_reasons",
    "scan",
    "scan_many",
    "select_echoes",
]

KEPT, NOTHING_HIT, TOO_WEAK, TOO_NEAR, TOO_FAR, REFLECTED_AWAY, BY_CHANCE = range(7)

Columns = dict[str, npt.NDArray[Any]]


def scan(
    world: World,
    lidar: Lidar | str,
    *,
    frame: int = 0,
    keep_lost: bool = False,
    threads: int | None = None,
) -> Scan:
    """Scans `world` with one frame of `lidar`; returns a `Scan`.

    A `Scan` is a mapping from field names to arrays. The frame starts at the world's time (`world.at(t)`): each pulse
    uses the world and the lidar's pose at its own time. `frame` is the frame's number: it selects the random numbers,
    and the part of a pattern that does not repeat. `lidar` may also be the name of a lidar of the world
    (`World.sensors`), as in "car/top". With `keep_lost`, pulses without an echo are listed too, with NaN positions and
    the reason in `lost`.

    ================= ================ ========================================================================
    position          float64 [n, 3]   the measured point, in sensor axes at the pulse's own time
    distance          float64 [n]      as the device reports it, in metres, with noise, rounded to its step
    time              float64 [n]      of the pulse, in seconds from the frame's start
    ring, laser, column  int32 [n]     ring as the manufacturer's driver numbers it; laser in firing order
    return, returns   int32 [n]        number of the echo, from 0, in the order of distance; number of echoes kept
    intensity         uint8 [n]        as the device reports it: a number from 0 to 255
    reflectivity      float32 [n]      1 for a white diffuse surface at normal incidence
    signal            uint16 [n]       the returned light, in counts: `signal_gain` for a white surface at 1 m
    true_distance     float64 [n]      without noise and rounding: along the beam's axis to the object that returned
                                       most of the echo's energy; if the axis misses this object, to the surface on
                                       the axis that is nearest to the echo; +inf without a surface on the axis
    true_position     float64 [n, 3]   the point on that surface, in the world; NaN without one
    instance, triangle, category, material  int32 [n]  the surface with most of the echo's energy
    normal            float64 [n, 3]   its unit normal in the world, towards the ray
    incidence         float32 [n]      its angle of incidence, in degrees
    barycentric, uv   float64          as in `World.cast_rays`
    purity            float32 [n]      that surface's share of the echo; below 1, the point is between surfaces
    bounces           int32 [n]        mirrors and glass faces on the path; 0: directly visible
    first_instance    int32 [n]        the object that the beam meets first
    radial_velocity   float32 [n]      m/s at which the distance to the surface point increases, from the motion of the
                                       lidar, the surface, mirrors and glass
    waveform          float32 [n, 65]  with the setting `waveform`: the received light around the echo, at the distances
                                       `Scan.waveform_offsets` from its maximum; 1: a white surface at 1 m
    near_ir           float32 [n]      with `near_ir_samples`: the world's red light along the beam, in W/(m² sr)
    pulse             int64 [n]        index of the pulse in `lidar.pattern(frame)`
    lost              int8 [n]         0 kept, 1 no hit, 2 too weak, 3 too near, 4 too far, 5 reflected away by a
                                       mirror, 6 missed by chance
    ================= ================ ========================================================================

    For lost pulses, ids are -1 and floats are NaN. The same call returns the same bytes on any number of threads.
    Raises `LidarError` if `lidar` is not a lidar, and `MemoryError` for frames that are too large.

    Energy: laser radar equation for extended targets (Wagner et al. 2006); detection: 5 sigma above the noise.
    """
    if isinstance(lidar, str):
        lidar = lidar_named(world, lidar)
    if not isinstance(lidar, Lidar):
        raise LidarError(f"scan requires a raycam.Lidar, not {type(lidar).__name__}", code="wrong_type")
    frame = whole("frame", frame, 0)
    keep_lost = flag("keep_lost", keep_lost)
    with collected() as notices:
        columns, pattern = _scan(world, lidar, frame, keep_lost, threads)
    for notice in notices:
        warn(notice)
    return Scan(columns, lidar=lidar, pattern=pattern, up=world.up, notices=notices)


def _scan(
    world: World, lidar: Lidar, frame: int, keep_lost: bool, threads: int | None
) -> tuple[Columns, Pattern]:
    """Returns the fields of a frame and its pulses."""
    warn_of_device(lidar)
    warn_of_times(world, lidar)
    pattern = lidar.pattern(frame)
    tracer = PulseTracer(world, lidar, pattern, frame, threads)
    buffer, counts = ColumnBuffer(len(pattern)), np.zeros(len(LOST), np.int64)
    for block in tracer.blocks():
        rows_of_block, reasons = _scan_block(tracer, block, keep_lost)
        counts += np.bincount(reasons, minlength=len(LOST))
        buffer.append(rows_of_block)
    tracer.warn_of_colors()
    if not counts[KEPT]:
        warn_of_empty_scan(lidar, counts)
    columns = buffer.finish()
    if lidar.settings["near_ir_samples"]:
        kept = np.flatnonzero(columns["lost"] == KEPT)
        columns["near_ir"] = np.full(len(columns["pulse"]), np.nan, np.float32)
        light = near_infrared(world, lidar, pattern, frame, columns["pulse"][kept], threads)
        columns["near_ir"][kept] = light
    return columns, pattern


def _scan_block(tracer: PulseTracer, block: range, keep_lost: bool) -> tuple[Columns, npt.NDArray[np.int8]]:
    """Returns the fields of a block of pulses, and the reason why each pulse has no point.

    The reason is 0 for a pulse with a point.
    """
    lidar, pattern, threads = tracer.lidar, tracer.pattern, tracer.threads
    found = tracer.trace(block)
    echoes, lost, signal = detect_echoes(tracer, found, block)
    chosen = select_echoes(echoes, lost == KEPT, lidar)
    columns = _columns(tracer, echoes, found, chosen, signal, block)
    main = echoes.main.take(chosen)
    columns["radial_velocity"] = radial_velocities(
        tracer.world, found.drift.take(main), rows(found.arrival, main), columns, columns["time"], threads
    )
    if lidar.settings["waveform"]:
        length = echoes.length.take(chosen)
        columns["waveform"] = sample_waveforms(found, columns["pulse"], length, lidar.pulse_extent)
    reasons = lost_reasons(block, echoes, lost, found, chosen)
    if keep_lost:
        columns = _with_lost(pattern, columns, block, reasons, _along_axis(found, block))
    return columns, reasons


def scan_many(
    world: World,
    lidar: Lidar | str,
    frames: int | Iterable[int],
    *,
    keep_lost: bool = False,
    threads: int | None = None,
) -> Iterator[Scan]:
    """Yields the scans of several frames one after another, so that only one scan is in memory.

    `frames` are the frames' numbers, or the number of frames, counted from frame 0. `keep_lost` and `threads` are as
    in `scan`. Frame k starts k / `rate` seconds after the world's time; a world without a time is static. If `lidar`
    is a name, each frame uses the sensor of this name in `World.sensors` at the frame's start. Raises the errors of
    `scan`, and `SettingsError` for a frame number below 0.
    """
    count = as_number(frames)
    numbers: Any = frames if count is None else range(whole("frames", count, 0))
    named = lidar_named(world, lidar) if isinstance(lidar, str) else lidar
    start = world._core.time
    for number in numbers:
        whole("frame", number, 0)
        moment = world if start is None else world.at(start + number / named.rate)
        yield scan(moment, lidar, frame=number, keep_lost=keep_lost, threads=threads)


def lidar_named(world: World, name: str) -> Lidar:
    """Returns a lidar of the world by its name.

    For a lidar on a rig, the name without the rig's name is sufficient if only one lidar has this name. Raises
    `LidarError`, with similar names, for an unknown name.
    """
    lidars = {key: sensor for key, sensor in world.sensors.items() if isinstance(sensor, Lidar)}
    if name in lidars:
        return lidars[name]
    mounted = [key for key in lidars if key.rpartition("/")[2] == name]
    if len(mounted) == 1:
        return lidars[mounted[0]]
    known = nearest("lidar", name, list(lidars)) if lidars else f"no lidar {name!r}; the world has no lidars"
    raise LidarError(known, code="unknown_name")


def _along_axis(found: Contributions, block: range) -> Columns:
    """Returns the length and position of the first surface on the axis of each pulse of a block.

    The length is [n], and the position in the world is [n, 3]. Without a surface, the length is infinite and
    the position is NaN.
    """
    length, position = np.full(len(block), np.inf), np.full((len(block), 3), np.nan)
    axis = np.flatnonzero(found.ray == 0)
    first = axis[np.unique(found.pulse[axis], return_index=True)[1]]
    length[found.pulse[first] - block.start] = found.length[first]
    position[found.pulse[first] - block.start] = found.fields["position"][first]
    return {"length": length, "position": position}


def _true_surfaces(
    found: Contributions, pulse: npt.NDArray[np.int64], length: Floats, main: npt.NDArray[np.int64]
) -> Columns:
    """Returns the length and position of the surface on the axis of each echo's pulse.

    `pulse`, `length` and `main` [n] are the echoes' pulses, lengths, and rows of their main contributions in `found`.
    The axis and the main contribution have the same path if they meet the same objects. On this path, the surface
    nearest to the echo is returned; if the axis has only other paths, the nearest surface on the axis. Without a
    surface on the axis, the length is infinite and the position is NaN.
    """
    paths = (found.fields["instance"], found.first_instance, found.bounces)
    axis = np.flatnonzero(found.ray == 0)  # contributions are sorted by pulse
    first = np.searchsorted(found.pulse[axis], pulse, side="left")
    count = np.searchsorted(found.pulse[axis], pulse, side="right") - first
    best, apart = np.full(len(pulse), -1), np.full(len(pulse), np.inf)
    on_path = np.zeros(len(pulse), bool)
    for number in range(int(count.max(initial=0))):
        own = np.flatnonzero(count > number)
        row = axis[first[own] + number]
        same = np.logical_and.reduce([path[row] == path[main[own]] for path in paths])
        distance = np.abs(found.length[row] - length[own])
        better = (same > on_path[own]) | ((same == on_path[own]) & (distance < apart[own]))
        own, row = own[better], row[better]
        best[own], apart[own], on_path[own] = row, distance[better], same[better]
    result: Columns = {"length": np.full(len(pulse), np.inf), "position": np.full((len(pulse), 3), np.nan)}
    hit = np.flatnonzero(best >= 0)
    result["length"][hit] = found.length[best[hit]]
    result["position"][hit] = found.fields["position"][best[hit]]
    return result


def detect_echoes(
    tracer: PulseTracer, found: Contributions, block: range
) -> tuple[Echoes, npt.NDArray[np.int8], Floats]:
    """Returns a block's echoes, the reasons why echoes are lost, and signal-to-noise ratios.

    The reason is 0 for an echo that is kept. The ratios are infinite without the setting `range_10`.
    """
    pattern, settings = tracer.pattern, tracer.lidar.settings
    echoes = find_echoes(found, tracer.lidar.pulse_extent, tracer.threads)
    signal = np.full(len(echoes.pulse), np.inf)
    if settings["range_10"] is not None:
        signal = THRESHOLD * echoes.energy * settings["range_10"] ** 2 / 0.1
    elif len(signal):
        signal[echoes.energy <= 0.0] = 0.0
    lost = np.zeros(len(signal), np.int8)
    margin = signal - THRESHOLD
    lost[margin < 0.0] = TOO_WEAK
    if settings["noise"] and settings["range_10"] is not None:
        heard = margin + _normals(tracer, block, "detection", echoes.pulse, _rank(echoes.pulse)) >= 0.0
        lost = np.where(heard, KEPT, np.where(margin < 0.0, TOO_WEAK, BY_CHANCE)).astype(np.int8)
    counted = pattern.range_scale[echoes.pulse] * echoes.length + pattern.range_offset[echoes.pulse]
    lost[counted < settings["min_range"]] = TOO_NEAR
    lost[counted > settings["max_range"]] = TOO_FAR
    return echoes, lost, signal


def _normals(
    tracer: PulseTracer,
    block: range,
    use: str,
    pulse: npt.NDArray[np.int64],
    rank: npt.NDArray[np.int64],
) -> Floats:
    """Returns the standard normal random number of each echo.

    An echo is given by its `pulse`, and by its number within the pulse, `rank`.
    """
    z = np.zeros(len(pulse))
    for echo in range(int(rank.max(initial=-1)) + 1):
        own = np.flatnonzero(rank == echo)
        numbers = tracer.numbers.normals(use, echo, block.start, block.stop)
        z[own] = numbers[pulse[own] - block.start]
    return z


def _rank(pulse: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Returns the number of each echo within its pulse, from 0."""
    if not len(pulse):
        return np.zeros(0, np.int64)
    first = np.concatenate([[True], np.diff(pulse) != 0])
    if first.all():
        return np.zeros(len(pulse), np.int64)
    start = np.flatnonzero(first)
    ranks: npt.NDArray[np.int64] = np.arange(len(pulse)) - np.repeat(
        start, np.diff(np.append(start, len(pulse)))
    )
    return ranks


def select_echoes(echoes: Echoes, heard: npt.NDArray[np.bool_], lidar: Lidar) -> npt.NDArray[np.int64]:
    """Returns the echoes that are reported, in the order of pulse and distance."""
    at = np.flatnonzero(heard)
    pulse = echoes.pulse[at]
    rank = _rank(pulse)
    if not rank.any():
        return at
    last = np.append(np.diff(pulse) != 0, True) if len(pulse) else np.zeros(0, bool)
    order = np.lexsort((at, -echoes.energy[at], pulse))
    by_energy = np.empty(len(at), np.int64)
    by_energy[order] = _rank(pulse[order])
    mode = lidar.returns
    if mode == "first":
        chosen = rank == 0
    elif mode == "last":
        chosen = last
    elif mode == "strongest":
        chosen = by_energy == 0
    elif mode == "all":
        chosen = rank < lidar.max_returns
    else:
        # If the last echo is the strongest, the second strongest is reported as well (VLP-16 manual, 9.3.2).
        both = np.zeros(int(pulse.max()) + 1 if len(pulse) else 0, bool)
        both[pulse[last & (by_energy == 0)]] = True
        chosen = (by_energy == 0) | last | (both[pulse] & (by_energy == 1))
    picked: npt.NDArray[np.int64] = at[chosen]
    return picked


def _columns(
    tracer: PulseTracer,
    echoes: Echoes,
    found: Contributions,
    chosen: npt.NDArray[np.int64],
    signal: Floats,
    block: range,
) -> Columns:
    """Returns the fields of the reported echoes."""
    pattern, settings = tracer.pattern, tracer.lidar.settings
    pulse, main = echoes.pulse.take(chosen), echoes.main.take(chosen)
    scale, offset = rows(pattern.range_scale, pulse), rows(pattern.range_offset, pulse)
    distance = scale * echoes.length.take(chosen) + offset
    rank = _rank(pulse)
    length = echoes.length.take(chosen)
    if echoes.is_single and not found.ray.any():
        true = {"length": length, "position": found.fields["position"].take(main, axis=0)}
    else:
        true = _true_surfaces(found, pulse, length, main)
    if settings["noise"]:
        z = _normals(tracer, block, "distance", pulse, rank)
        distance = _noisy(distance, signal[chosen], z, settings)
    along = (distance - offset) / scale
    reflectivity = (echoes.energy.take(chosen) * length**2).astype(np.float32)
    returns = np.bincount(pulse - block.start, minlength=len(block))[pulse - block.start]
    columns: Columns = {
        "position": pattern.origins.take(pulse, axis=0)
        + along[:, None] * pattern.directions.take(pulse, axis=0),
        "distance": distance,
        "time": pattern.times.take(pulse, axis=0),
        "ring": pattern.rings.take(pulse, axis=0),
        "laser": pattern.lasers.take(pulse, axis=0),
        "column": pattern.columns.take(pulse, axis=0),
        "return": rank.astype(np.int32),
        "returns": returns.astype(np.int32),
        "intensity": device_intensity(tracer.lidar.family, reflectivity),
        "reflectivity": reflectivity,
        "signal": signal_counts(echoes.energy.take(chosen), settings["signal_gain"]),
        "true_distance": scale * true["length"] + offset,
        "true_position": true["position"],
    }
    for name in ("instance", "triangle", "category", "material", "normal", "incidence", "barycentric", "uv"):
        columns[name] = found.fields[name].take(main, axis=0)
    columns["purity"] = echoes.purity.take(chosen, axis=0)
    columns["bounces"] = found.bounces.take(main)
    columns["first_instance"] = found.first_instance.take(main)
    columns["pulse"] = pulse
    columns["lost"] = np.zeros(len(pulse), np.int8)
    return columns


def _noisy(distance: Floats, signal: Floats, z: Floats, settings: dict[str, Any]) -> Floats:
    """Returns the distances with noise, rounded to the device's step.

    `z` are the standard normal random numbers of the noise.
    """
    with np.errstate(divide="ignore"):
        weak = np.where(np.isfinite(signal), LIGHT_SPEED * settings["rise_time"] / (2.0 * signal), 0.0)
    sigma = np.sqrt(settings["range_noise"] ** 2 + weak**2)
    noisy = distance + sigma * z
    step = settings["step"]
    counted: Floats = np.round(noisy / step) * step if step > 0.0 else noisy
    return counted


def lost_reasons(
    block: range,
    echoes: Echoes,
    lost: npt.NDArray[np.int8],
    found: Contributions,
    chosen: npt.NDArray[np.int64],
) -> npt.NDArray[np.int8]:
    """Returns the reason why each pulse of a block has no point; 0 for a pulse with a point.

    The pulse's strongest echo determines the reason.
    """
    reasons = np.full(len(block), NOTHING_HIT, np.int8)
    reasons[found.deflected] = REFLECTED_AWAY
    pulse = echoes.pulse - block.start
    if (np.diff(pulse) > 0).all():
        reasons[pulse] = lost
    else:
        order = np.argsort(echoes.energy, kind="stable")
        reasons[pulse[order]] = lost[order]
    reasons[pulse[chosen]] = KEPT
    return reasons


def _with_lost(
    pattern: Pattern, columns: Columns, block: range, reasons: npt.NDArray[np.int8], axis: Columns
) -> Columns:
    """Returns the fields with a row for each lost pulse of a block, in the order of pulses."""
    own = np.flatnonzero(reasons != KEPT)
    gone = own + block.start
    lost: Columns = {}
    for name, array in columns.items():
        shape = (len(gone), *array.shape[1:])
        missing: Any = np.nan if array.dtype.kind == "f" else 0 if array.dtype.kind == "u" else -1
        lost[name] = np.full(shape, missing, array.dtype)
    lost.update(
        time=pattern.times[gone],
        ring=pattern.rings[gone],
        laser=pattern.lasers[gone],
        column=pattern.columns[gone],
        pulse=gone,
        lost=reasons[own],
        returns=np.zeros(len(gone), np.int32),
        true_distance=pattern.range_scale[gone] * axis["length"][own] + pattern.range_offset[gone],
        true_position=axis["position"][own],
    )
    order = np.argsort(np.concatenate([columns["pulse"], gone]), kind="stable")
    return {name: np.concatenate([array, lost[name]]).take(order, axis=0) for name, array in columns.items()}
