"""Velodyne's calibrations: YAML of the ROS driver, and db.xml.

Sources: `calibration.cpp` and `gen_calibration.py` of ros-drivers/velodyne.
"""

from __future__ import annotations

import math
import re
from dataclasses import asdict
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from ...errors import LidarError
from ..velodyne import Laser, laser_from_keys
from .reading import base_description, finite, read_text

__all__ = ["read_velodyne_xml", "read_velodyne_yaml"]

BY_LASERS = {16: "vlp16", 32: "vlp32c", 64: "hdl64e", 128: "vls128"}
ENTRY = re.compile(r"(?P<new>-\s*)?(?P<key>\w+)\s*:\s*(?P<value>[^\s]*)$")
XML_KEYS = {
    "rotCorrection_": ("rot_correction", math.pi / 180.0),
    "vertCorrection_": ("vert_correction", math.pi / 180.0),
    "distCorrection_": ("dist_correction", 0.01),
    "distCorrectionX_": ("dist_correction_x", 0.01),
    "distCorrectionY_": ("dist_correction_y", 0.01),
    "vertOffsetCorrection_": ("vert_offset_correction", 0.01),
    "horizOffsetCorrection_": ("horiz_offset_correction", 0.01),
}
"""For each key of db.xml, the ROS driver's key and the factor to radians or metres."""


def read_velodyne_yaml(path: Path, device: str | None) -> dict[str, Any]:
    """Returns the description of a unit calibrated by the ROS driver's YAML.

    Reads lists of `key: number`, in block and flow style, as the driver writes them; other YAML is not supported.
    """
    header: dict[str, float] = {}
    lasers: list[dict[str, float]] = []
    lines: list[tuple[int, str]] = []
    for number, line in enumerate(read_text(path).splitlines(), 1):
        plain = line.split("#", 1)[0].replace("- {", "\n- ").replace("-{", "\n- ").replace("{", "\n- ")
        lines += [(number, part.strip()) for part in re.split(r"[\n,}]", plain) if part.strip()]
    for number, line in lines:
        where = f"{path}, line {number}"
        found = ENTRY.match(line)
        if found is None:
            raise LidarError(f"{where}: expected `key: number`, got {line[:60]!r}", code="syntax")
        key, value = found["key"], found["value"]
        if found["new"]:
            lasers.append({})
        if key == "lasers" and not value:
            continue
        if key in ("num_lasers", "distance_resolution"):
            header[key] = finite(value, f"{where}: {key}")
        elif lasers and _is_number(value):
            lasers[-1][key] = finite(value, f"{where}: {key}")
        elif lasers and key in ("two_pt_correction_available",):
            continue
        else:
            raise LidarError(
                f"{where}: expected lasers, num_lasers, distance_resolution, or a laser's number; got {key}: {value}",
                code="wrong_type",
            )
    return _description(path, device, header, lasers)


def _is_number(text: str) -> bool:
    return bool(re.match(r"[-+.]?(\d|inf|nan)", text, re.IGNORECASE))


def read_velodyne_xml(path: Path, device: str | None) -> dict[str, Any]:
    """Returns the description of a unit calibrated by Velodyne's db.xml.

    The file contains degrees and centimetres.
    """
    text = read_text(path)
    if "<!ENTITY" in text:
        raise LidarError(f"{path}: XML entities are not supported", code="syntax")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as fault:
        raise LidarError(f"{path}: not an XML file: {fault}", code="syntax") from None
    lasers = []
    for item in root.iter("px"):
        identity = item.find("id_")
        if identity is None:
            continue
        number = finite(identity.text, f"{path}: id_")
        keys = {"laser_id": number}
        for name, (key, factor) in XML_KEYS.items():
            found = item.find(name)
            if found is not None:
                keys[key] = finite(found.text, f"{path}: laser {number:g}: {name}") * factor
        lasers.append(keys)
    enabled = [node.text for node in root.iter("enabled_") for node in node.iter("item")]
    if enabled:
        lasers = lasers[: sum(text == "1" for text in enabled)] or lasers
    least = root.find(".//distLSB_")
    header = {} if least is None else {"distance_resolution": finite(least.text, f"{path}: distLSB_") / 100.0}
    return _description(path, device, header, lasers)


def _description(
    path: Path, device: str | None, header: dict[str, float], lasers: list[dict[str, float]]
) -> dict[str, Any]:
    if not lasers:
        raise LidarError(f"{path}: contains no lasers; expected Velodyne's calibration", code="missing_value")
    if "num_lasers" in header and header["num_lasers"] != len(lasers):
        raise LidarError(
            f"{path}: num_lasers is {header['num_lasers']:g}, but {len(lasers)} lasers follow",
            code="wrong_shape",
        )
    by_number: dict[int, Laser] = {}
    for row, keys in enumerate(lasers):
        number = int(keys.pop("laser_id", row))
        where = f"{path}: laser {number}"
        if number in by_number or not 0 <= number < len(lasers):
            raise LidarError(
                f"{where}: laser_id must be unique and from 0 to {len(lasers) - 1}",
                code="duplicate_name",
            )
        by_number[number] = laser_from_keys(keys, where)
    description = base_description(
        path, device or _thirty_two(header, by_number), "velodyne", len(lasers), BY_LASERS
    )
    if "distance_resolution" in header:
        step = header["distance_resolution"]
        if not 0.0 < step <= 1.0:
            raise LidarError(
                f"{path}: distance_resolution is {step}; expected metres above 0, at most 1",
                code="out_of_range",
            )
        description["step"] = step
    table = dict(description["velodyne"])
    for name in ("elevations", "rot_corrections", "heights"):
        table.pop(name, None)
    table["lasers"] = [asdict(by_number[number]) for number in range(len(lasers))]
    description["velodyne"] = table
    return description


def _thirty_two(header: dict[str, float], lasers: dict[int, Laser]) -> str | None:
    """Returns the device with 32 lasers; None for another number of lasers.

    The lowest laser distinguishes two devices: the HDL-32E's is at -30.67 degrees, the VLP-32C's at -25
    degrees.
    """
    if len(lasers) != 32:
        return None
    lowest = min(laser.vert_correction for laser in lasers.values())
    return "hdl32e" if math.degrees(lowest) < -28.0 else "vlp32c"
