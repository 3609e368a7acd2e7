"""Writes the world-file reference: tables of keys from the JSON Schema.

The schema comes from the structs in `scene::schema`.
"""

import json
import re
from pathlib import Path
from typing import Any

from raycam import _core

Schema = dict[str, Any]


class Reference:
    """The sections of the reference, in the order in which they are first referred to.

    There is a section for each table and each named choice of a schema.
    """

    def __init__(self, schema: Schema) -> None:
        """Creates the sections of the whole `schema`."""
        self.parts: dict[str, Schema] = schema.get("$defs", {})
        self.needed: list[str] = []
        self.lines = self.section("World file", schema)
        for name in self.needed:  # the loop itself adds names to this list
            self.lines += self.section(title(name), self.parts[name])

    def kind(self, schema: Schema) -> str:
        """Returns a type in words, with links to the types that have a section of their own."""
        if "$ref" in schema:
            name = schema["$ref"].rsplit("/", 1)[1]
            if not has_section(self.parts[name]):
                return self.kind(self.parts[name])
            if name not in self.needed:
                self.needed.append(name)
            return f"[{title(name)}](#{anchor(title(name))})"
        if "const" in schema:
            return f"`{json.dumps(schema['const'])}`"
        if "enum" in schema:
            return either(f"`{json.dumps(value)}`" for value in schema["enum"] if value is not None)
        for key in ("anyOf", "oneOf", "allOf"):
            if key in schema:
                return either(self.kind(part) for part in schema[key] if part.get("type") != "null")
        if isinstance(schema.get("additionalProperties"), dict):
            return f"table of {self.kind(schema['additionalProperties'])}"
        names = schema.get("type", "anything")
        names = [names] if isinstance(names, str) else [name for name in names if name != "null"]
        return either(self.array(schema) if name == "array" else name for name in names)

    def array(self, schema: Schema) -> str:
        """Returns a list's type in words: the number and the type of its items."""
        items = schema["prefixItems"][0] if "prefixItems" in schema else schema.get("items", {})
        least, most = schema.get("minItems"), schema.get("maxItems")
        count = f"{least} x " if least is not None and least == most else "list of "
        return count + self.kind(items)

    def table(self, schema: Schema) -> list[str]:
        """Returns a table with one row per key."""
        lines = ["| key | value | default | meaning |", "|---|---|---|---|"]
        for key, value in schema["properties"].items():
            default = value.get("default")
            said = (
                any(one is not None for one in default.values())
                if isinstance(default, dict)
                else default is not None
            )
            shown = f"`{json.dumps(default)}`" if said else ""
            shown = "required" if key in schema.get("required", []) else shown
            cells = (f"`{key}`", self.kind(value), shown, value.get("description", ""))
            lines.append(
                "| " + " | ".join(" ".join(cell.split()).replace("|", "\\|") for cell in cells) + " |"
            )
        return [*lines, ""]

    def section(self, heading: str, schema: Schema) -> list[str]:
        """Returns a section: a heading, the description, and the keys or choices."""
        lines = [f"({anchor(heading)})=", f"## {heading}", "", schema.get("description", ""), ""]
        if "properties" in schema:
            lines += self.table(schema)
        for form in schema.get("oneOf", []):
            if "properties" in form:
                tag = next(value["const"] for value in form["properties"].values() if "const" in value)
                lines += [f"**`{tag}`**: {form.get('description', '')}", "", *self.table(form)]
            else:
                lines += [f"- {self.kind(form)}: {form.get('description', '')}"]
        return [*lines, ""]


def has_section(schema: Schema) -> bool:
    """Returns True if a schema has keys or described choices, which do not fit into a cell."""
    return "properties" in schema or any("description" in form for form in schema.get("oneOf", []))


def either(kinds: Any) -> str:
    """Joins the names with "or", each name once."""
    return " or ".join(dict.fromkeys(kinds))


def title(name: str) -> str:
    """Returns a struct's name as a heading: `CameraSpec` becomes camera."""
    words = re.sub(r"(?<=[a-z])(Spec|Shape|Name|Type|Table)$", "", name)
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", words).lower()


def anchor(heading: str) -> str:
    """Returns the anchor of a heading."""
    return "world-" + heading.lower().replace(" ", "-")


def write(folder: Path) -> None:
    """Writes `worldfile.md`, and the schema itself for editors."""
    text = _core.json_schema()
    (folder / "worldfile.md").write_text("\n".join(Reference(json.loads(text)).lines), encoding="utf-8")
    (folder / "world.schema.json").write_text(text, encoding="utf-8")
