"""The text that describes a lidar."""

from __future__ import annotations

import raycam
from raycam.lidar.description import describe_lidar


def test_description_contains_pattern_settings_and_sources() -> None:
    lines = describe_lidar(raycam.Lidar("vlp16", rate=5)).splitlines()
    for line in (
        "pulses per frame: 57856 (16 lasers, 3616 columns)",
        "elevations: -15.00 to 15.00 degrees",
        "rate: 5 Hz",
        "range_10: unknown",
        "max_range: 100 metres",
        "visibility: the world's fog",
    ):
        assert line in lines
    assert any(line.startswith("source: VLP-16 User Manual") for line in lines)
