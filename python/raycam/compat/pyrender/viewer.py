"""The viewer of pyrender, of which only the lights are here."""

from __future__ import annotations

from typing import Any

import numpy as np

from .light import DirectionalLight
from .node import Node

__all__ = ["Viewer"]


class Viewer:
    """A window of pyrender, which is not here; `raycam.view` shows worlds in a browser."""

    def __init__(self, *_arguments: Any, **_options: Any) -> None:
        raise NotImplementedError(
            "pyrender's window is not here: raycam.view(world) shows a world in the browser"
        )

    def _create_raymond_lights(self) -> list[Node]:
        """Three suns of intensity 1 around z, 30 degrees off it and 120 apart."""
        nodes = []
        for turn in (0, 2 / 3, 4 / 3):
            polar, around = np.pi / 6, np.pi * turn
            back = np.array([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)])
            right = np.array([-back[1], back[0], 0.0]) / np.hypot(back[0], back[1])
            matrix = np.eye(4)
            matrix[:3, :3] = np.column_stack([right, np.cross(back, right), back])
            nodes.append(Node(light=DirectionalLight(color=np.ones(3), intensity=1.0), matrix=matrix))
        return nodes
