"""The lidar devices that raycam includes."""

from __future__ import annotations

from raycam.lidar import device_description, device_names


def test_device_names_are_sorted_and_have_descriptions_with_sources() -> None:
    names = device_names()
    assert names == sorted(names)
    assert {"vlp16", "os1-128", "pandar64", "hdl64e"} <= set(names)
    for name in names:
        description = device_description(name)
        assert description["name"] == name
        assert description["sources"]
        assert description["title"]


def test_device_descriptions_are_copies() -> None:
    device_description("vlp16")["step"] = 1.0
    assert device_description("vlp16")["step"] == 0.002
