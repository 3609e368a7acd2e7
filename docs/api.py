"""Writes the Python reference: a page for each public class and function.

The parameters are listed in tables. The meaning of a parameter is the first sentence of the docstring about
the parameter.
"""

from __future__ import annotations

import enum
import importlib
import inspect
import re
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass, is_dataclass
from pathlib import Path
from typing import Any

SECTIONS: dict[str, list[str]] = {
    "Worlds": ["load", "World", "Object", "Texture", "Topology", "Video", "Animation", "robots.Robot", "data"],
    "Cameras": ["Camera", "Rig", "Sensor", "Background", "load_cameras", "save_cameras", "Cameras"],
    "Lidars": ["Lidar", "load_lidar", "scan", "scan_many", "Scan", "explain_beam", "BeamExplanation"],
    "Pictures": ["render", "Frame", "render_many", "Frames", "progressive", "Progressive", "Cancel", "view", "Viewer"],
    "Labels and motion": ["label", "Label", "box3d", "Box3D", "keypoints", "Keypoints", "flow", "disparity"],
    "Estimates": ["refine", "Refined"],
    "Data sets": ["dataset.write", "dataset.views", "dataset.DatasetResult"],
    "Photographs": [
        *("photo_truth", "surface_visibility", "SurfaceVisibility", "sample_surface", "SurfaceSamples"),
        *("texture_from_photos", "PhotoTexture", "bake", "BakedMaps"),
        *("photos.PhotographFit", "photos.coverage_world", "photos.coverage_picture"),
    ],
    "Videos": ["video.write_video", "video.VideoPlan"],
    "Randomised worlds": ["Recipe", "sample", "settle", "Settled", "randomize.views.place_camera"],
    "Checks": ["explain", "Explanation", "selfcheck", "SelfCheck", "reference"],
    "Other libraries": [
        *("from_trimesh", "from_open3d", "from_mujoco", "from_newton"),
        *("compat.pyrender", "compat.trimesh", "compat.open3d"),
        "compat.open3d.t.geometry.RaycastingScene", "compat.mujoco.Renderer",
    ],
    "Errors and notices": ["errors", "strict"],
}  # fmt: skip
SENTENCE = re.compile(r"(?<=[.;])\s+(?=[A-Z`\"])|\n\s*\*\s+|\n\s*\n")
NO_DEFAULT = inspect.Parameter.empty


@dataclass(frozen=True)
class Page:
    """A page of the Python reference."""

    name: str
    """The name after `raycam.`."""
    text: str
    """The page as Markdown."""
    summary: str
    """The first line of its docstring."""


def named(name: str) -> Any:
    """Returns the object of the package with a dotted name."""
    parts = name.split(".")
    found: Any = importlib.import_module("raycam")
    for number, part in enumerate(parts):
        found = getattr(found, part, None) or importlib.import_module(
            "raycam." + ".".join(parts[: number + 1])
        )
    return found


def doc_of(item: Any) -> str:
    """Returns the docstring, in which `$` is escaped, because Markdown would read formulas."""
    return (inspect.getdoc(item) or "").replace("$", "\\$")


def meaning(name: str, text: str) -> str:
    """Returns the sentence of a docstring that describes a parameter, or an empty string.

    It is the first sentence that begins with the parameter's name, or otherwise the first that contains the
    name.
    """
    sentences = [" ".join(sentence.split()).removeprefix("* ") for sentence in SENTENCE.split(text)]
    word = re.escape(name)
    for pattern in (rf"`{word}\b", rf".*`{word}` (?:is|are|has|gives|\()", rf".*`{word}\b"):
        for sentence in sentences:
            if re.match(pattern, sentence):
                return sentence
    return ""


def cell(text: str) -> str:
    """Returns a text as a cell of a Markdown table."""
    return " ".join(text.split()).replace("|", "\\|")


def type_of(annotation: Any) -> str:
    """Returns a short form of an annotation, without module names."""
    text = annotation if isinstance(annotation, str) else getattr(annotation, "__name__", str(annotation))
    for long, short in (("npt.ArrayLike", "array"), ("npt.NDArray", "array"), ("os.PathLike[str]", "path")):
        text = text.replace(long, short)
    return re.sub(r"\b(?:np|npt|os|typing|collections\.abc)\.", "", text).strip("'")


def signature_of(item: Any) -> inspect.Signature | None:
    """Returns the signature, or None if an object of the compiled part has no signature."""
    try:
        return inspect.signature(item)
    except (TypeError, ValueError):
        return None


def parameters(item: Any, text: str) -> list[str]:
    """Returns the table of a function's parameters."""
    signature = signature_of(item)
    given = (
        []
        if signature is None
        else [p for p in signature.parameters.values() if p.name not in ("self", "cls")]
    )
    if not given:
        return []
    lines = ["| parameter | type | default | meaning |", "|---|---|---|---|"]
    for one in given:
        stars = {one.VAR_POSITIONAL: "*", one.VAR_KEYWORD: "**"}.get(one.kind, "")
        kind = "" if one.annotation is NO_DEFAULT else f"`{cell(type_of(one.annotation))}`"
        value = one.default.name if isinstance(one.default, enum.Enum) else repr(one.default)
        default = (
            "required" if one.default is NO_DEFAULT and not stars else "" if stars else f"`{cell(value)}`"
        )
        lines.append(f"| `{stars}{one.name}` | {kind} | {default} | {cell(meaning(one.name, text))} |")
    return [*lines, ""]


def call_of(name: str, item: Any) -> str:
    """Returns a call of a function with the names of its parameters, without their defaults."""
    signature = signature_of(item)
    words: list[str] = []
    for one in [] if signature is None else signature.parameters.values():
        if one.name in ("self", "cls"):
            continue
        if (
            one.kind is one.KEYWORD_ONLY
            and "*" not in words
            and not any(word.startswith("*") for word in words)
        ):
            words.append("*")
        stars = {one.VAR_POSITIONAL: "*", one.VAR_KEYWORD: "**"}.get(one.kind, "")
        words.append(f"{stars}{one.name}")
    return textwrap.fill(f"{name}({', '.join(words)})", 90, subsequent_indent="    ", break_on_hyphens=False)


def members(kind: type) -> Iterator[tuple[str, Any]]:
    """Yields the public members that raycam's classes define, in the order of the source."""
    told: set[str] = set()
    for base in kind.__mro__:
        if not base.__module__.startswith("raycam"):
            continue
        for name, value in vars(base).items():
            if not name.startswith("_") and name not in told:
                told.add(name)
                yield name, value


def function(heading: str, name: str, item: Any) -> list[str]:
    """Returns the text of a function or method: its call, its docstring and its parameters."""
    text = doc_of(item)
    return [heading, "", "```text", call_of(name, item), "```", "", text, "", *parameters(item, text)]


def class_page(name: str, kind: type) -> list[str]:
    """Returns the page of a class: its docstring, constructor, attributes and methods."""
    text = doc_of(kind)
    lines = [f"# {name}", "", text, ""]
    if not issubclass(kind, BaseException) and not is_dataclass(kind) and "__init__" in vars(kind):
        lines += ["## Constructor", "", "```text", call_of(name, kind.__init__), "```", ""]
        lines += parameters(kind.__init__, text)
    attributes, methods = [], []
    for member, value in members(kind):
        if (
            isinstance(value, property)
            or inspect.isgetsetdescriptor(value)
            or inspect.ismemberdescriptor(value)
        ):
            attributes.append(f"| `{member}` | {returned(value)} | {cell(doc_of(value))} |")
        elif getattr(value, "func", None) is not None:  # a cached property
            attributes.append(f"| `{member}` | {returned(value)} | {cell(doc_of(value.func))} |")
        elif callable(value) or isinstance(value, classmethod | staticmethod):
            methods += function(f"## {member}", f".{member}", getattr(kind, member))
    for member, annotation in getattr(kind, "__annotations__", {}).items():
        if not member.startswith("_") and not any(line.startswith(f"| `{member}`") for line in attributes):
            attributes.append(
                f"| `{member}` | `{cell(type_of(annotation))}` | {cell(field_meaning(kind, member))} |"
            )
    if attributes:
        lines += ["## Attributes", "", "| attribute | type | meaning |", "|---|---|---|", *attributes, ""]
    return lines + methods


def returned(value: Any) -> str:
    """Returns the type of a property."""
    getter = getattr(value, "fget", None) or getattr(value, "func", None)
    annotation = getattr(getter, "__annotations__", {}).get("return", "")
    return f"`{cell(type_of(annotation))}`" if annotation else ""


def field_meaning(kind: type, name: str) -> str:
    """Returns the docstring below a field in the source of its class."""
    try:
        source = inspect.getsource(kind)
    except (OSError, TypeError):
        return ""
    found = re.search(rf'^    {re.escape(name)}: [^\n]*\n    """(.*?)"""', source, re.M | re.S)
    return found[1] if found else ""


def module_page(name: str, module: Any) -> list[str]:
    """Returns the page of a module: its public functions and classes."""
    lines = [f"# {name}", "", doc_of(module), ""]
    for member in getattr(module, "__all__", [n for n in vars(module) if not n.startswith("_")]):
        item = getattr(module, member)
        if inspect.isclass(item) and item.__module__.startswith("raycam"):
            lines += [f"## {member}", "", doc_of(item), ""]
        elif inspect.isfunction(item):
            lines += function(f"## {member}", f"{name}.{member}", item)
    return lines


def pages() -> dict[str, list[Page]]:
    """Returns the pages of each section."""
    found: dict[str, list[Page]] = {}
    for section, names in SECTIONS.items():
        for name in names:
            item = named(name)
            if inspect.ismodule(item):
                lines = module_page(f"raycam.{name}", item)
            elif inspect.isclass(item):
                lines = class_page(f"raycam.{name}", item)
            else:
                lines = function(f"# raycam.{name}", f"raycam.{name}", item)
            summary = doc_of(item).partition("\n\n")[0]
            found.setdefault(section, []).append(Page(name, "\n".join(lines) + "\n", summary))
    return found


def write(folder: Path) -> None:
    """Writes a page for each name into `reference/api`.

    Also writes the list of pages, `api.md`, and the text of all pages, `reference.txt`.
    """
    target = folder.parent / "reference" / "api"
    target.mkdir(exist_ok=True)
    index, whole = [], []
    for section, found in pages().items():
        index += [f"## {section}", "", "| name | what it is |", "|---|---|"]
        index += [f"| [`{page.name}`](api/{page.name}.md) | {cell(page.summary)} |" for page in found]
        index += ["", "```{toctree}", ":hidden:", "", *(f"api/{page.name}" for page in found), "```", ""]
        for page in found:
            (target / f"{page.name}.md").write_text(page.text, encoding="utf-8")
            whole.append(page.text)
    (folder / "api.md").write_text("\n".join(index), encoding="utf-8")
    (folder / "reference.txt").write_text("\n".join(whole), encoding="utf-8")
