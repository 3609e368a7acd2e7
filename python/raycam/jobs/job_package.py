"""The package of a job: the complete input of its frames, as bytes identified by their hash.

The bytes are a line of JSON, followed by the world from `World.to_bytes`:

    {"raycam": "0.1.0", "kind": "video", "frames": 96, "settings": {...}}

Frame n of a job is a pure function of (package, n): the same bytes give the same files on any machine.

In the job's folder, packages up to a limit are compressed by zlib, because the numbers of many cameras can be a large
part of a small data set.
"""

from __future__ import annotations

import hashlib
import json
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .._core import __version__
from ..errors import FormatError, JobError
from ..world import World
from .kinds import FrameMakerFactory

__all__ = ["JobPackage"]

COMPRESSION_LIMIT_BYTES = 4 << 20
"""Maximum size of a package that is compressed in the job's folder; larger packages consist mostly of images."""


class JobPackage:
    """The input of a worker for the frames of a job.

    `kind` is a kind of `jobs.kinds`, `frames` the number of frames, `settings` plain JSON that the kind interprets.
    `world` is a world or its bytes; `World.with_cameras` adds cameras to it. `factory` replaces the kind's own
    factory of frame makers in this process, for frames that need objects of the caller; it is not part of the bytes.

    Raises `JobError` if `settings` are not JSON or `frames` is less than 1.
    """

    def __init__(
        self,
        kind: str,
        frames: int,
        settings: Mapping[str, Any],
        world: World | bytes,
        factory: FrameMakerFactory | None = None,
    ) -> None:
        if frames < 1:
            raise JobError(f"a job requires at least one frame, got {frames}", code="out_of_range")
        behind = _background_hashes(world) if isinstance(world, World) else {}
        if behind:
            settings = {**settings, "backgrounds": behind}
        try:
            # The settings as they will be read: tuples become lists, keys become strings.
            plain = json.loads(json.dumps(settings, allow_nan=False, sort_keys=True))
        except (TypeError, ValueError) as fault:
            raise JobError(f"the settings of a job must be plain JSON: {fault}", code="wrong_type") from None
        self.kind = kind
        """The kind of the job, a key of `jobs.kinds.KINDS`."""
        self.frames = frames
        """The number of frames, which count from 0."""
        self.settings: dict[str, Any] = plain
        """The settings that the kind interprets."""
        self.factory = factory
        """The factory for this process's frame maker; None to use the factory of the job's kind."""
        self._world: World | None = None if isinstance(world, bytes) else world
        self.world_bytes = world if isinstance(world, bytes) else world.to_bytes()
        """The world from `World.to_bytes`."""
        header = {"raycam": __version__, "kind": kind, "frames": frames, "settings": plain}
        self._header = json.dumps(header, sort_keys=True, separators=(",", ":")).encode() + b"\n"
        hasher = hashlib.sha256(self._header)
        hasher.update(self.world_bytes)
        self.id = hasher.hexdigest()
        """SHA-256 of the package in hexadecimal, equal for equal frames."""

    @staticmethod
    def check_backgrounds(settings: Mapping[str, Any]) -> None:
        """Raises `JobError` if the cameras' background photos differ from the package's photos.

        Raises `OSError` if a photo cannot be read.
        """
        for path, known in settings.get("backgrounds", {}).items():
            if _hash_of(path) != known:
                raise JobError(
                    f"{path}: the background has changed since the job began; restore the file, or start a new "
                    "job in another output folder",
                    code="changed_input",
                )

    @property
    def world(self) -> World:
        """The world, read on first use; raises `FormatError` if its bytes are invalid."""
        if self._world is None:
            self._world = World.from_bytes(self.world_bytes)
        return self._world

    def describe(self) -> dict[str, Any]:
        """The contents of `job.json`: the readable part of the package, with the hash of the world."""
        return {
            "raycam": __version__,
            "kind": self.kind,
            "frames": self.frames,
            "world": hashlib.sha256(self.world_bytes).hexdigest(),
            "settings": self.settings,
        }

    def to_bytes(self) -> bytes:
        """The package as bytes, whose SHA-256 is `id`."""
        return self._header + self.world_bytes

    def to_file(self) -> bytes:
        """Returns the bytes of the package's file, compressed up to `COMPRESSION_LIMIT_BYTES`."""
        data = self.to_bytes()
        return zlib.compress(data) if len(data) <= COMPRESSION_LIMIT_BYTES else data

    def exists_in(self, path: Path) -> bool:
        """True if a file contains exactly this package."""
        try:
            return hashlib.sha256(_unpack(path.read_bytes())).hexdigest() == self.id
        except FileNotFoundError:
            return False

    @staticmethod
    def check(data: bytes, name: str, id: str) -> None:
        """Raises `FormatError` if the bytes of the file `name` are not the package with this `id`."""
        _check_hash(_unpack(data), name, id)

    @classmethod
    def from_bytes(cls, data: bytes, name: str, id: str) -> JobPackage:
        """Reads the package from the bytes of the file `name`, which must have this `id`.

        Raises `FormatError` for an invalid package or another id, and `JobError` for a package of another raycam
        version.
        """
        unpacked = _unpack(data)
        _check_hash(unpacked, name, id)
        header, newline, world = unpacked.partition(b"\n")
        try:
            if not newline:
                raise ValueError
            fields = json.loads(header)
            version, kind, frames, settings = (
                fields[key] for key in ("raycam", "kind", "frames", "settings")
            )
        except (ValueError, KeyError, TypeError):
            raise FormatError(f"{name}: not a job package", code="wrong_format") from None
        if version != __version__:
            raise JobError(
                f"{name}: created by raycam {version}, but {__version__} is installed; all machines must use the same "
                "version, so that the frames match",
                code="changed_input",
            )
        return cls(kind, frames, settings, world)


def _check_hash(unpacked: bytes, name: str, id: str) -> None:
    """Raises `FormatError` if the hash of an unpacked package is not `id`."""
    found = hashlib.sha256(unpacked).hexdigest()
    if found != id:
        raise FormatError(
            f"{name}: the file is damaged or belongs to another job: its hash is {found[:12]}, expected {id[:12]}",
            code="damaged_job",
        )


def _unpack(data: bytes) -> bytes:
    """Returns the bytes of a stored package; damaged bytes are returned unchanged, so that their hash differs."""
    if data.startswith(b"{"):
        return data
    stream = zlib.decompressobj()
    try:
        unpacked = stream.decompress(data, COMPRESSION_LIMIT_BYTES)
    except zlib.error:
        return data
    return unpacked if stream.eof and not stream.unused_data else data


def _background_hashes(world: World) -> dict[str, str]:
    """The SHA-256 hashes of the cameras' background photos, by path."""
    behind = (camera.background for camera in world.cameras.values())
    return {found.file: _hash_of(found.file) for found in behind if found is not None}


def _hash_of(path: str) -> str:
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
