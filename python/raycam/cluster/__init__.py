"""Pools of workers for jobs: this process, other processes, or a Dask cluster.

This file imports no module of the package, for the reason given in `jobs`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .pools import ExecutorPool, InProcessPool, make_pool

__all__ = ["ExecutorPool", "InProcessPool", "make_pool"]


def __getattr__(name: str) -> Any:
    """Imports the public names on first use."""
    if name in __all__:
        from . import pools

        return getattr(pools, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
