"""Former name of the Dask preload `raycam.cluster.dask_worker`, kept for one release."""

from __future__ import annotations

from .cluster.dask_worker import dask_setup

__all__ = ["dask_setup"]
