"""What a Dask worker keeps for a job: its package, in a file of its own. Imported by nobody without Dask."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from distributed import WorkerPlugin

from . import files, workers

__all__ = ["Delivery"]


class Delivery(WorkerPlugin):  # type: ignore[misc]
    """Brings a package to every worker there is, and to those that join later."""

    def __init__(self, job: str, data: bytes) -> None:
        self._job, self._data = job, data

    def setup(self, worker: Any) -> None:
        """Puts the package where `workers.make` looks for it."""
        folder = Path(worker.local_directory) / "raycam"
        folder.mkdir(exist_ok=True)
        files.write(folder / self._job, self._data)
        if folder not in workers.PLACES:
            workers.PLACES.append(folder)
