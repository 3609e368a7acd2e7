"""The world-file reference: tables of keys out of the JSON Schema of the structs in `scene::schema`."""

import json
from pathlib import Path
from typing import Any

from raycam import _core

Schema = dict[str, Any]


def kind(schema: Schema) -> str:
    """A type in words, with links to the tables of other types."""
    if "$ref" in schema:
        name = schema["$ref"].rsplit("/", 1)[1]
        return f"[{name}](#{name.lower()})"
    if "const" in schema:
        return f"`{json.dumps(schema['const'])}`"
    if "enum" in schema:
        return " or ".join(f"`{json.dumps(value)}`" for value in schema["enum"] if value is not None)
    for key in ("anyOf", "oneOf", "allOf"):
        if key in schema:
            return " or ".join(
                dict.fromkeys(kind(part) for part in schema[key] if part.get("type") != "null")
            )
    names = schema.get("type", "anything")
    names = [name for name in ([names] if isinstance(names, str) else names) if name != "null"]
    return " or ".join(array(schema) if name == "array" else name for name in names)


def array(schema: Schema) -> str:
    """A list in words: how many of what."""
    items = schema.get("items", {})
    if "prefixItems" in schema:
        items = schema["prefixItems"][0]
    least, most = schema.get("minItems"), schema.get("maxItems")
    count = f"{least} x " if least is not None and least == most else "list of "
    return count + kind(items)


def cell(text: str) -> str:
    """Text that may stand in a table."""
    return " ".join(text.split()).replace("|", "\\|")


def table(schema: Schema) -> list[str]:
    """One row per key."""
    lines = ["| key | value | default | meaning |", "|---|---|---|---|"]
    required = schema.get("required", [])
    for key, value in schema["properties"].items():
        default = value.get("default")
        shown = "required" if key in required else "" if default is None else f"`{json.dumps(default)}`"
        lines.append(f"| `{key}` | {cell(kind(value))} | {shown} | {cell(value.get('description', ''))} |")
    return lines


def section(name: str, schema: Schema, level: int = 2) -> list[str]:
    """A heading, what it is, and its keys, for each of its forms."""
    lines = [f"({name.lower()})=", f"{'#' * level} {name}", "", schema.get("description", ""), ""]
    if "properties" in schema:
        lines += [*table(schema), ""]
    for form in schema.get("oneOf", schema.get("anyOf", [])):
        if "properties" in form:
            tag = next((value["const"] for value in form["properties"].values() if "const" in value), "")
            lines += [f"**`{tag}`**: " if tag else "", form.get("description", ""), "", *table(form), ""]
        elif "const" in form or "enum" in form or form.get("description"):
            lines += [f"- {kind(form)}: {form.get('description', '')}"]
    return [*lines, ""]


def write(folder: Path) -> None:
    """Make `worldfile.md` and the schema itself, for editors."""
    schema = json.loads(_core.json_schema())
    lines = section("World file", schema)
    for name, part in schema.get("$defs", {}).items():
        lines += section(name, part)
    (folder / "worldfile.md").write_text("\n".join(lines), encoding="utf-8")
    (folder / "world.schema.json").write_text(json.dumps(schema, indent=2), encoding="utf-8")
