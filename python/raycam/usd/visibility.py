"""Prims that are hidden by their visibility or purpose."""

from __future__ import annotations

from typing import Any

from pxr import Sdf, Usd, UsdGeom

__all__ = ["PrimVisibility"]


class PrimVisibility:
    """The visibility and purpose of prims, with those of their parents computed once."""

    def __init__(self, time: Usd.TimeCode) -> None:
        self._time = time
        self._visible: dict[Sdf.Path, bool] = {}
        self._purposes: dict[Sdf.Path, Any] = {}

    def hidden_reason(self, prim: Usd.Prim) -> str | None:
        """The reason why a prim is not shown; None if the prim is shown."""
        imageable = UsdGeom.Imageable(prim)
        if not imageable:
            return None
        if not self._is_visible(prim):
            return "invisible"
        parent = prim.GetParent()
        path = parent.GetPath()
        if path not in self._purposes:
            above = UsdGeom.Imageable(parent)
            self._purposes[path] = above.ComputePurposeInfo() if above else None
        above_info = self._purposes[path]
        info = imageable.ComputePurposeInfo(above_info) if above_info else imageable.ComputePurposeInfo()
        purpose = info.purpose
        return f"of purpose {purpose}" if purpose in (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy) else None

    def _is_visible(self, prim: Usd.Prim) -> bool:
        path = prim.GetPath()
        if path not in self._visible:
            parent = prim.GetParent()
            above = True if not parent or parent.IsPseudoRoot() else self._is_visible(parent)
            imageable = UsdGeom.Imageable(prim)
            own = imageable.GetVisibilityAttr().Get(self._time) if imageable else None
            self._visible[path] = above and own != UsdGeom.Tokens.invisible
        return self._visible[path]
