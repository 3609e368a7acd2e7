"""The world of a view as a world file, which is saved next to its source file."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...camera import Camera
from ...errors import Error, WorldError
from ...notices import collected
from ...world import World
from .contents import materials_of_object

__all__ = ["toml_text", "world_file"]

PLACE = ("location", "roll", "pitch", "yaw", "scale", "matrix")
PHONG_KEYS = ("diffuse", "specular", "shininess")
GLASS_KEYS = ("ior", "thin", "dispersion", "attenuation_color", "attenuation_distance", "priority", "medium")
OTHER_MODELS_KEYS = (*PHONG_KEYS, *GLASS_KEYS, "metal")
"""Keys of a material that are removed if an edit makes the material principled."""


def world_file(source: Path | None, opened: World, world: World, camera: Camera) -> str:
    """Returns an edited world as TOML that starts with `camera`.

    `world` was `opened` from the file `source` and then edited. The text refers to the same files as `source`, and
    loads from the same folder. Raises `WorldError` if it could not restore the same world: for worlds from a script,
    and for changed objects of files with several objects.
    """
    if source is None:
        raise WorldError(
            "the world was created by a script and has no world file; use Save GLB", code="cannot_write"
        )
    document = _document(source)
    entries = document.get("object", [])
    before, after = _objects(opened), _objects(world)
    if len(before) != len(after):
        raise WorldError(
            f"a script changed the number of objects from {len(before)} to {len(after)}; use Save GLB to keep them",
            code="cannot_write",
        )
    changed = [i for i, found in enumerate(after) if before[i : i + 1] != [found]]
    if changed and len(entries) != len(after):
        names = ", ".join(after[i].name for i in changed[:3])
        raise WorldError(
            f"{names}: a world file cannot store changes to single objects of a model file with several objects; to "
            "keep them, use Save GLB",
            code="cannot_write",
        )
    for i in changed:
        entries[i] = _entry(entries[i], before[i], after[i])
    if opened.lights != world.lights:
        document["light"] = world.lights
    own = document.get("camera", [])
    cameras = [own] if isinstance(own, dict) else list(own)
    taken = {each.get("name") for each in cameras} | set(world.cameras)
    name = next(f"view{i or ''}" for i in range(len(taken) + 1) if f"view{i or ''}" not in taken)
    document["camera"] = [{"name": name, **camera.to_dict()}, *cameras]
    _check(document, source, world, camera)
    return "# A world of raycam. Keep it next to the files that it names.\n\n" + toml_text(document)


def _document(source: Path) -> dict[str, Any]:
    """The tables of a world file; for another format, the tables that load the model."""
    if source.suffix.lower() == ".toml":
        try:
            return tomllib.loads(source.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise WorldError(
                f"{source.name}: the file of this world cannot be read any more ({error}); restore it, or use Save "
                "GLB, which does not require it",
                code="file_unreadable",
            ) from None
    return {"object": [{"mesh": source.name}]}


class _Object(NamedTuple):
    """The properties of an object that edits can change."""

    name: str
    visible: bool
    matrix: list[list[float]]
    materials: list[dict[str, Any]]


def _objects(world: World) -> list[_Object]:
    """The objects of a world, in the order of their ids."""
    return [
        _Object(
            each.name,
            each.visible,
            np.asarray(each.matrix).tolist(),
            materials_of_object(world, each.id),
        )
        for each in world.objects
    ]


def _entry(entry: dict[str, Any], before: _Object, after: _Object) -> dict[str, Any]:
    """The table of an object after its edits."""
    entry = dict(entry)
    if before.visible != after.visible:
        entry["visible"] = after.visible
    if before.matrix != after.matrix:
        entry = {key: value for key, value in entry.items() if key not in PLACE}
        entry["matrix"] = after.matrix
    # If a script has changed the number of slots, `_check` refuses the world file.
    pairs = list(zip(before.materials, after.materials, strict=False))
    if before.materials == after.materials:
        return entry
    if len(pairs) == 1 and "slots" not in entry:
        return _with_material(entry, *pairs[0])
    given = _tables_of_slots(entry.get("slots", {}), [old["name"] for old, _ in pairs])
    tables = (_with_material(table, *pair) for table, pair in zip(given, pairs, strict=True))
    return {**entry, "slots": {str(slot): table for slot, table in enumerate(tables) if table}}


def _tables_of_slots(tables: dict[str, Any], names: list[str]) -> list[dict[str, Any]]:
    """The table of each material slot, given tables by number or by material name; numbers take precedence."""
    by_name = {key: table for key, table in tables.items() if not (key.isdecimal() and int(key) < len(names))}
    return [tables.get(str(slot), by_name.get(name, {})) for slot, name in enumerate(names)]


def _with_material(entry: dict[str, Any], old: dict[str, Any], new: dict[str, Any]) -> dict[str, Any]:
    """The table of an object or a slot after the edits of its material."""
    if old == new:
        return entry
    entry = dict(entry)
    if new["color"] != old["color"]:
        entry["color"] = new["color"]
    if new["emission"]["value"] != old["emission"]["value"]:
        entry["emission"] = new["emission"]["value"]
    (model, values), (was, _) = (_model(each) for each in (new, old))
    if model == "Principled":
        if was != model:
            entry = {key: value for key, value in entry.items() if key not in OTHER_MODELS_KEYS}
            entry |= {"type": "principled", "color": new["color"]}
        entry |= {key: values[key]["value"] for key in ("roughness", "metallic")}
    elif model in ("Metal", "Glass"):
        entry["roughness"] = values["roughness"]
    return entry


def _model(material: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    """The name of a material's model, and the model's values."""
    model = material["model"]
    return (model, {}) if isinstance(model, str) else next(iter(model.items()))


def _check(document: dict[str, Any], source: Path, world: World, camera: Camera) -> None:
    """Builds the world from the tables, and compares it with the shown world.

    Raises `WorldError` if the worlds differ.
    """
    try:
        with collected():
            built = World.from_dict(document, folder=source.parent)
    except (Error, OSError) as error:
        raise WorldError(
            f"this world cannot be saved as a world file: {error}", code="cannot_write"
        ) from None
    if built.counts["triangles"] != world.counts["triangles"] or not _same_place(built, world):
        raise WorldError(
            f"{source.name} or a file that it uses has changed since the world was opened; open the world again, "
            "or use Save GLB",
            code="changed_file",
        )
    shown = next(iter(built.cameras.values()))
    same = (
        _close(_objects(built), _objects(world))
        and _close(built.lights, world.lights)
        and np.allclose(shown.P, camera.P, rtol=1e-9, atol=1e-9)
    )
    if not same:
        raise WorldError(
            "a world file cannot represent these changes; use Save GLB",
            code="cannot_write",
        )


def _same_place(one: World, other: World) -> bool:
    """True if two worlds have the same bounds, up to rounding."""
    bounds, others = one.bounds, other.bounds
    if bounds is None or others is None:
        return bounds is others
    return bool(np.allclose(bounds, others, rtol=1e-6, atol=1e-6 * float(np.ptp(others))))


def _close(one: Any, other: Any) -> bool:
    """True for equal values, numbers up to the rounding of float32."""
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(_close(one[key], other[key]) for key in one)
    if isinstance(one, list | tuple) and isinstance(other, list | tuple):
        return one == other or (len(one) == len(other) and all(map(_close, one, other)))
    if isinstance(one, float) or isinstance(other, float):
        return bool(np.isclose(one, other, rtol=1e-6, atol=1e-9))
    return bool(one == other)


def toml_text(document: dict[str, Any]) -> str:
    """Returns a dict of tables as TOML.

    Scalars come first, then a table or an array of tables for each key.
    """
    plain = {key: value for key, value in document.items() if not _is_table(value)}
    parts = ["".join(f"{_key(key)} = {_value(value)}\n" for key, value in plain.items())]
    for key, value in document.items():
        if not _is_table(value):
            continue
        for table in value if isinstance(value, list) else [value]:
            head = f"[[{_key(key)}]]" if isinstance(value, list) else f"[{_key(key)}]"
            rows = "".join(f"{_key(name)} = {_value(each)}\n" for name, each in table.items())
            parts.append(f"{head}\n{rows}")
    return "\n".join(part for part in parts if part)


def _is_table(value: Any) -> bool:
    return isinstance(value, dict) or (
        isinstance(value, list) and bool(value) and all(isinstance(each, dict) for each in value)
    )


def _key(key: str) -> str:
    is_bare = key and all(letter.isascii() and (letter.isalnum() or letter in "_-") for letter in key)
    return key if is_bare else _value(key)


def _value(value: Any) -> str:
    """Returns a value as TOML, with inline tables."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_key(key)} = {_value(each)}" for key, each in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, float):
        return repr(value) if np.isfinite(value) else str(value)
    return str(value)
