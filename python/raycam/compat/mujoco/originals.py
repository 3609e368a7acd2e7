"""MuJoCo's own names that `install` has replaced."""

from __future__ import annotations

from typing import Any

__all__ = ["original", "replace_name", "restore_names"]

Place = tuple[Any, str]
_REPLACED: list[tuple[Place, Any]] = []
_MISSING = object()


def replace_name(owner: Any, name: str, value: Any) -> None:
    """Sets the attribute `name` of a module or class, and remembers its value."""
    _REPLACED.append(((owner, name), getattr(owner, name, _MISSING)))
    setattr(owner, name, value)


def restore_names() -> None:
    """Restores every replaced attribute."""
    while _REPLACED:
        (owner, name), value = _REPLACED.pop()
        if value is _MISSING:
            delattr(owner, name)
        else:
            setattr(owner, name, value)


def original(name: str) -> Any:
    """Returns MuJoCo's own function, even if `install` has replaced it."""
    import mujoco

    for (owner, found), value in _REPLACED:
        if owner is mujoco and found == name:
            return value
    return getattr(mujoco, name)
