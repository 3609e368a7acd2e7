"""The package of a job: everything that its frames are a function of, as bytes named by their hash.

A line of JSON, then the world as `World.to_bytes` gives it:

    {"raycam": "0.1.0", "kind": "video", "frames": 96, "settings": {...}}

Frame n of a job is a pure function of (package, n): whoever has these bytes makes the same files, on any machine.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .._core import __version__
from ..errors import FormatError, JobError
from ..world import World

__all__ = ["JobPackage"]


class JobPackage:
    """What a worker needs to make the frames of a job.

    `kind` is a registered kind of `jobs.kinds`, `frames` how many there are, `settings` whatever the kind makes
    of it: plain JSON. `world` is a world, or the bytes of one; cameras go with it by `World.with_cameras`.

    Raises `JobError` where `settings` are not JSON or `frames` is less than 1.
    """

    def __init__(
        self,
        kind: str,
        frames: int,
        settings: Mapping[str, Any],
        world: World | bytes,
    ) -> None:
        if frames < 1:
            raise JobError(f"a job of {frames} frames: there must be at least one")
        try:
            # As it will be read: tuples are lists, keys are strings.
            plain = json.loads(json.dumps(settings, allow_nan=False, sort_keys=True))
        except (TypeError, ValueError) as fault:
            raise JobError(f"the settings of a job must be plain JSON: {fault}") from None
        self.kind = kind
        """What the frames are: a kind of `jobs.kinds`."""
        self.frames = frames
        """How many there are, numbered from 0."""
        self.settings: dict[str, Any] = plain
        """What the kind makes of it."""
        self._world: World | None = None if isinstance(world, bytes) else world
        self.world_bytes = world if isinstance(world, bytes) else world.to_bytes()
        """The world as `World.to_bytes` gives it."""
        header = {"raycam": __version__, "kind": kind, "frames": frames, "settings": plain}
        self._header = json.dumps(header, sort_keys=True, separators=(",", ":")).encode() + b"\n"
        hasher = hashlib.sha256(self._header)
        hasher.update(self.world_bytes)
        self.id = hasher.hexdigest()
        """SHA-256 of all of it, in hexadecimal: the same for the same frames."""

    @property
    def world(self) -> World:
        """The world, read at the first time; raises `FormatError` where its bytes are none."""
        if self._world is None:
            self._world = World.from_bytes(self.world_bytes)
        return self._world

    def describe(self) -> dict[str, Any]:
        """What `job.json` says: everything for people to read and to compare, the world as its hash."""
        return {
            "raycam": __version__,
            "kind": self.kind,
            "frames": self.frames,
            "world": hashlib.sha256(self.world_bytes).hexdigest(),
            "settings": self.settings,
        }

    def to_bytes(self) -> bytes:
        """All of it; the SHA-256 of this is `id`."""
        return self._header + self.world_bytes

    def exists_in(self, path: Path) -> bool:
        """Whether a file holds it, every byte."""
        try:
            return hashlib.sha256(path.read_bytes()).hexdigest() == self.id
        except FileNotFoundError:
            return False

    @staticmethod
    def check(data: bytes, name: str, id: str) -> None:
        """Raises `FormatError` where the bytes of the file `name` are not those of the package with this `id`."""
        found = hashlib.sha256(data).hexdigest()
        if found != id:
            raise FormatError(f"{name}: expected the job {id[:12]}, its bytes are those of {found[:12]}")

    @classmethod
    def from_bytes(cls, data: bytes, name: str, id: str) -> JobPackage:
        """The package in the bytes of the file `name`, which must be the one with this `id`.

        Raises `FormatError` where it is another or none, and `JobError` where another version of raycam made it.
        """
        cls.check(data, name, id)
        header, newline, world = data.partition(b"\n")
        try:
            if not newline:
                raise ValueError
            fields = json.loads(header)
            version, kind, frames, settings = (
                fields[key] for key in ("raycam", "kind", "frames", "settings")
            )
        except (ValueError, KeyError, TypeError):
            raise FormatError(f"{name}: this is no package of a job") from None
        if version != __version__:
            raise JobError(
                f"{name}: made by raycam {version}, this is {__version__}; the same on all machines is needed, or the "
                "frames would not go together"
            )
        return cls(kind, frames, settings, world)
