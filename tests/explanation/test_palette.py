"""The colours of drawn figures are those of the figures in pages."""

from __future__ import annotations

import re

from raycam.explanation.palette import BRIGHT, PALETTE, SHADES
from raycam.viewer.bundle import client_file


def test_palette_colors_equal_those_of_the_pages() -> None:
    light, dark = client_file("figure.css").split("@media")[:2]
    in_light, in_dark = (dict(re.findall(r"--([^:\s]+): (#\w+);", text)) for text in (light, dark))
    assert {name: in_light[name] for name in PALETTE} == PALETTE
    assert {name: in_dark[name] for name in BRIGHT} == BRIGHT
    for name, (color, opacity) in SHADES.items():
        assert in_light[name] == f"{color}{round(255 * opacity):02x}"
