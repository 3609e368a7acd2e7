"""Creates errors for missing attributes that other libraries have.

The message names raycam's counterpart.
"""

from __future__ import annotations

from types import ModuleType

__all__ = ["no_attribute"]


def no_attribute(owner: object, name: str, ours: str | None = None) -> AttributeError:
    """Returns the error for an attribute that `owner`, an object or a module, does not have.

    The message names `ours`, raycam's counterpart; by default, the counterpart in the core's table of other programs'
    terms.
    """
    from .. import _core

    is_module = isinstance(owner, ModuleType)
    kind = owner.__name__ if isinstance(owner, ModuleType) else type(owner).__name__
    what = f"module {kind!r}" if is_module else f"{kind!r} object"
    ours = dict(_core.foreign_terms(kind)).get(name) if ours is None else ours
    hint = "" if ours is None else f"; use {ours}"
    return AttributeError(f"{what} has no attribute {name!r}{hint}", name=name, obj=owner)
