"""Benchmark: rays per second through the public array interface, with Embree for comparison.

The scenes are generated (`bench.scenes`). `primary` rays start at the camera, one for each pixel. `shadow` rays lead
from the hits to a point light. `bounce` rays start at the hits in cosine-weighted random directions. `shuffled` rays
are the bounce rays in random order. Every measurement covers a complete call, from the input arrays to the output
arrays.

If embreex is installed, its Embree traces the same rays. embreex traces single float32 rays on one thread, so its rates
compare with raycam's on one thread; its builds use all threads. Embree has faster modes (packets, more threads) that no
Python package offers; `benchmarks/embree_race.py` in raycam's source includes these modes.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import Floats, floats, whole
from ..camera import Camera
from ..doctor import processor
from ..errors import SettingsError, nearest
from ..world import World
from .scenes import SCENES, BenchScene, generate

__all__ = ["KINDS", "BenchReport", "BenchRow", "bench", "tile_order"]

KINDS = ["build", "primary", "shadow", "bounce", "shuffled"]
"""The measured calls in order. Rates are million triangles per second for `build`, and million rays per second
otherwise.
"""

RAY_OFFSET = 1e-4
"""Offset of secondary rays from the surface, as a fraction of the scene's size."""


@dataclasses.dataclass(frozen=True)
class BenchRow:
    """The result for one scene and one of `KINDS`; rates are in millions per second."""

    scene: str
    kind: str
    count: int
    """The number of triangles or rays of one call."""
    raycam: float
    """raycam's rate on all requested threads."""
    raycam_one_thread: float
    embree: float | None
    """Embree's rate: rays on one thread, builds on all threads of the machine. None without embreex."""
    differ: int | None
    """The number of rays with another result in Embree: hit instead of miss, or t differs by more than 1e-4. None for
    builds.
    """


@dataclasses.dataclass(frozen=True)
class BenchReport:
    """The results of `bench`."""

    version: str
    processor: str
    instructions: str
    threads: int
    embree: str | None
    """The version of embreex; None if embreex is not installed."""
    seed: int
    size: tuple[int, int]
    repeat: int
    rows: list[BenchRow]

    def as_dict(self) -> dict[str, Any]:
        """Returns the fields by name as JSON values."""
        return dataclasses.asdict(self)

    def _like_for_like(self, row: BenchRow) -> float:
        return row.raycam if row.kind == "build" else row.raycam_one_thread

    def __str__(self) -> str:
        """The results as a text table."""
        beside = self.embree is not None
        lines = [f"raycam {self.version}, {self.instructions}, {self.processor}", ""]
        head = f"{'':18}{'':>9}  {'raycam':>8}  {'raycam':>8}"
        under = f"{'scene':8}  {'kind':8}{'count':>9}  {_threads(self.threads):>8}  {'1 thread':>8}"
        if beside:
            head += f"  {'Embree':>8}"
            under += f"  {'single':>8}  {'ratio':>5}  {'differ':>6}"
        lines += [head, under]
        for row in self.rows:
            line = (
                f"{row.scene:8}  {row.kind:8}{row.count:9}  {row.raycam:8.2f}  {row.raycam_one_thread:8.2f}"
            )
            if row.embree is not None:
                ratio = f"{self._like_for_like(row) / row.embree:.2f}"
                line += f"  {row.embree:8.2f}  {ratio:>5}  {'' if row.differ is None else row.differ:6}"
            lines.append(line)
        lines += [
            "",
            f"Million rays (in build rows: triangles) per second; best of {self.repeat} calls with array conversions.",
            "Scenes are generated; primary rays come in tiles of 8 x 8 pixels.",
        ]
        if beside:
            lines += [
                f"Embree is used through embreex {self.embree}: single rays in one thread, builds in all threads.",
                "`ratio` is raycam's rate (watertight, float64 hits) divided by Embree's. Both use one thread for rays",
                "and all threads for builds. Embree is faster with packets and threads, which embreex does not offer.",
                "`differ` is the number of rays whose hits differ.",
            ]
        else:
            lines.append("To compare these rates with Embree's: pip install embreex")
        return "\n".join(lines)


def bench(
    scenes: Sequence[str] | None = None,
    *,
    triangles: int = 1_000_000,
    size: tuple[int, int] = (640, 480),
    repeat: int = 5,
    threads: int | None = None,
    seed: int = 1,
    progress: Callable[[int, int], object] | None = None,
) -> BenchReport:
    """Measures the named scenes (default: all).

    Each scene has about `triangles` triangles and an image of `size` pixels. Every figure is the best of `repeat`
    calls after one warm-up call. `threads` is the number of threads of raycam (None: all). `seed` selects the scenes'
    random numbers. `progress(done, total)` counts the figures. Raises `SettingsError` for unknown names and numbers
    out of range.
    """
    names = list(SCENES) if scenes is None else list(scenes)
    for name in names:
        if name not in SCENES:
            raise SettingsError(nearest("scene", name, list(SCENES)), code="unknown_name")
    repeat = whole("repeat", repeat, 1, 1000)
    used = _core.available_threads() if threads is None else whole("threads", threads, 1, 1 << 16)
    rows: list[BenchRow] = []
    for name in names:
        for row in _measure(name, generate(name, triangles, seed), size, repeat, used, seed):
            rows.append(row)
            if progress is not None:
                progress(len(rows), len(names) * len(KINDS))
    return BenchReport(
        version=_core.__version__,
        processor=processor(),
        instructions=_core.instruction_set(),
        threads=used,
        embree=_embree_version(),
        seed=seed,
        size=size,
        repeat=repeat,
        rows=rows,
    )


def _measure(
    name: str, scene: BenchScene, size: tuple[int, int], repeat: int, threads: int, seed: int
) -> Iterator[BenchRow]:
    def world(threads: int) -> World:
        made = World()
        made.add_mesh(scene.vertices, scene.faces)
        return made.prepare(threads=threads)

    # Builds take long, so at most two are measured.
    builds = min(repeat, 2)
    embree = None if _embree_version() is None else _Embree(scene)
    yield BenchRow(
        scene=name,
        kind="build",
        count=len(scene.faces),
        raycam=_rays_per_second(len(scene.faces), builds, lambda: world(threads)),
        raycam_one_thread=_rays_per_second(len(scene.faces), builds, lambda: world(1)),
        embree=None
        if embree is None
        else _rays_per_second(len(scene.faces), builds, lambda: _Embree(scene).build()),
        differ=None,
    )
    ours = world(threads)

    def row(kind: str, origins: Floats, directions: Floats, t_max: float) -> BenchRow:
        coherent = kind not in ("bounce", "shuffled")

        def trace(threads: int) -> npt.NDArray[Any]:
            if kind == "shadow":
                return ours.occluded(
                    origins, directions, t_max, exact=False, coherent=coherent, threads=threads
                )
            return ours.cast_rays(origins, directions, exact=False, coherent=coherent, threads=threads)["t"]

        n = len(origins)
        theirs, differ = None, None
        if embree is not None:
            o, d = (np.ascontiguousarray(a, np.float32) for a in (origins, directions))
            theirs = _rays_per_second(n, repeat, lambda: embree.trace(kind, o, d, t_max))
            differ = count_mismatches(trace(threads), embree.trace(kind, o, d, t_max))
        return BenchRow(
            scene=name,
            kind=kind,
            count=n,
            raycam=_rays_per_second(n, repeat, lambda: trace(threads)),
            raycam_one_thread=_rays_per_second(n, repeat, lambda: trace(1)),
            embree=theirs,
            differ=differ,
        )

    camera = Camera.look_at(scene.eye, scene.target, [0, 0, 1], size=size, fov=scene.fov)
    origins, directions = (_to_float32(rays) for rays in camera.rays(tile_order(*camera.size)))
    yield row("primary", origins, directions, np.inf)
    hits = ours.cast_rays(origins, directions, threads=threads)
    met = hits["instance"] >= 0
    normal = hits["normal"][met].astype(np.float64)
    starts = _to_float32(hits["position"][met] + RAY_OFFSET * np.ptp(scene.vertices, 0).max() * normal)
    yield row("shadow", starts, _to_float32(np.asarray(scene.light) - starts), 1.0)
    # Random points on the unit sphere around the normal's tip give cosine-weighted directions.
    rng = np.random.default_rng(seed)
    ball = rng.normal(size=starts.shape)
    ways = _to_float32(normal + ball / np.linalg.norm(ball, axis=1)[:, None])
    yield row("bounce", starts, ways, np.inf)
    order = rng.permutation(len(starts))
    yield row("shuffled", starts[order], ways[order], np.inf)


def tile_order(width: int, height: int) -> Floats:
    """Returns the pixel centres [n, 2] of an image, tile by tile (8 x 8 pixels).

    Neighbouring pixels are therefore traced together.
    """
    v, u = np.divmod(np.arange(width * height), width)
    order = np.lexsort((u % 8, v % 8, u // 8, v // 8))
    return floats("pixels", np.stack([u[order], v[order]], -1), ("n", 2))


def _to_float32(a: Floats) -> Floats:
    """Rounds to float32 values, so that raycam and Embree trace the same rays."""
    return a.astype(np.float32).astype(np.float64)


def _rays_per_second(count: int, repeat: int, call: Callable[[], object]) -> float:
    """Returns the rate in millions per second, the best of `repeat` calls after a warm-up call."""
    best = np.inf
    for turn in range(repeat + 1):
        start = time.perf_counter()
        call()
        if turn:
            best = min(best, time.perf_counter() - start)
    return count / best / 1e6


def count_mismatches(ours: npt.NDArray[Any], theirs: npt.NDArray[Any]) -> int:
    """Returns the number of different results: bools, or t with +inf for a miss."""
    if ours.dtype == bool:
        return int((ours != theirs).sum())
    hit = np.isfinite(ours)
    apart = hit != np.isfinite(theirs)
    both = hit & ~apart
    apart[both] = np.abs(ours[both] - theirs[both]) > 1e-4 * ours[both]
    return int(apart.sum())


class _Embree:
    """Embree, used through embreex, with a scene of one mesh."""

    def __init__(self, scene: BenchScene) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self._scene = EmbreeScene()
        vertices, faces = scene.vertices.astype(np.float32), scene.faces.astype(np.int32)
        # embreex reads the arrays later, when Embree builds.
        self._mesh = TriangleMesh(self._scene, vertices, faces), vertices, faces

    def build(self) -> None:
        """Builds the scene; Embree builds its tree at the first ray, so this method traces one ray."""
        away = np.array([[0, 0, 1]], np.float32)
        self._scene.run(1e6 * away, away)

    def trace(
        self, kind: str, origins: npt.NDArray[np.float32], directions: npt.NDArray[np.float32], t_max: float
    ) -> npt.NDArray[Any]:
        """Traces the rays; returns bools as `World.occluded` does, or t as `World.cast_rays` does."""
        if kind == "shadow":
            dark = self._scene.run(origins, directions, t_max, query="OCCLUDED")
            return np.asarray(dark) >= 0
        hits = self._scene.run(origins, directions, output=True)
        return np.where(hits["primID"] >= 0, hits["tfar"].astype(np.float64), np.inf)


def _embree_version() -> str | None:
    from importlib import metadata, util

    return metadata.version("embreex") if util.find_spec("embreex") else None


def _threads(n: int) -> str:
    return f"{n} thread{'s' if n > 1 else ''}"
