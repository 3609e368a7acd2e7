"""Devices: the TOML files of this package, which list every number with its source."""

from __future__ import annotations

import tomllib
from functools import lru_cache
from pathlib import Path
from typing import Any

from ..errors import LidarError, nearest

__all__ = ["device_description", "device_names"]

FOLDER = Path(__file__).with_name("devices")


def device_names() -> list[str]:
    """Returns the names of all devices, sorted."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def device_description(name: object) -> dict[str, Any]:
    """Returns the description of a device.

    Raises `LidarError` with similar names for an unknown device.
    """
    if not isinstance(name, str) or name not in device_names():
        raise LidarError(
            f"{nearest('lidar', name, device_names())}; to list all devices, run: raycam lidars",
            code="unknown_name",
        )
    return dict(_read(name))


@lru_cache
def _read(name: str) -> dict[str, Any]:
    with (FOLDER / f"{name}.toml").open("rb") as file:
        return {"name": name, **tomllib.load(file)}
