"""The Python reference: a page for each class and function of the public interface, with its parameters in tables.

The meaning of a parameter is the sentence of the docstring that first names it.
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
    "Cameras": ["Camera", "Rig", "Sensor", "load_cameras", "save_cameras", "Cameras"],
    "Lidars": ["Lidar", "load_lidar", "scan", "scan_many", "Scan", "explain_beam", "BeamExplanation"],
    "Pictures": ["render", "Frame", "render_many", "Frames", "progressive", "Progressive", "Cancel", "view", "Viewer"],
    "Labels and motion": ["label", "Label", "box3d", "Box3D", "keypoints", "Keypoints", "flow", "disparity"],
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
        *("from_trimesh", "from_open3d", "from_mujoco", "compat.pyrender", "compat.trimesh", "compat.open3d"),
        "compat.open3d.t.geometry.RaycastingScene", "compat.mujoco.Renderer",
    ],
    "Errors and notices": ["errors", "strict"],
}  # fmt: skip
SENTENCE = re.compile(r"(?<=[.;])\s+(?=[A-Z`\"])|\n\s*\*\s+|\n\s*\n")
NO_DEFAULT = inspect.Parameter.empty


@dataclass(frozen=True)
class Page:
    """A page of the reference."""

    name: str
    """The name after `raycam.`."""
    text: str
    """The page as Markdown."""
    summary: str
    """The first line of its docstring."""


def named(name: str) -> Any:
    """The object of a dotted name in the package."""
    parts = name.split(".")
    found: Any = importlib.import_module("raycam")
    for number, part in enumerate(parts):
        found = getattr(found, part, None) or importlib.import_module(
            "raycam." + ".".join(parts[: number + 1])
        )
    return found


def doc_of(item: Any) -> str:
    """The docstring, with what Markdown reads as formulas escaped."""
    return (inspect.getdoc(item) or "").replace("$", "\\$")


def meaning(name: str, text: str) -> str:
    """The sentence of a docstring that is about a parameter: one that begins with its name, or the first with it."""
    sentences = [" ".join(sentence.split()).removeprefix("* ") for sentence in SENTENCE.split(text)]
    word = re.escape(name)
    for pattern in (rf"`{word}\b", rf".*`{word}` (?:is|are|has|gives|\()", rf".*`{word}\b"):
        for sentence in sentences:
            if re.match(pattern, sentence):
                return sentence
    return ""


def cell(text: str) -> str:
    """A text as a cell of a table."""
    return " ".join(text.split()).replace("|", "\\|")


def type_of(annotation: Any) -> str:
    """An annotation in short words."""
    text = annotation if isinstance(annotation, str) else getattr(annotation, "__name__", str(annotation))
    for long, short in (("npt.ArrayLike", "array"), ("npt.NDArray", "array"), ("os.PathLike[str]", "path")):
        text = text.replace(long, short)
    return re.sub(r"\b(?:np|npt|os|typing|collections\.abc)\.", "", text).strip("'")


def signature_of(item: Any) -> inspect.Signature | None:
    """The signature; None where the compiled part has none."""
    try:
        return inspect.signature(item)
    except (TypeError, ValueError):
        return None


def parameters(item: Any, text: str) -> list[str]:
    """The table of parameters of a function."""
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
    """A call with the names of the parameters: those with defaults in short."""
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
    """The public members of a class that the package defines, in the order of the source."""
    told: set[str] = set()
    for base in kind.__mro__:
        if not base.__module__.startswith("raycam"):
            continue
        for name, value in vars(base).items():
            if not name.startswith("_") and name not in told:
                told.add(name)
                yield name, value


def function(heading: str, name: str, item: Any) -> list[str]:
    """A function or method: its call, what it does, and its parameters."""
    text = doc_of(item)
    return [heading, "", "```text", call_of(name, item), "```", "", text, "", *parameters(item, text)]


def class_page(name: str, kind: type) -> list[str]:
    """A class: what it is, its constructor, attributes and methods."""
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
    """The type of a property."""
    getter = getattr(value, "fget", None) or getattr(value, "func", None)
    annotation = getattr(getter, "__annotations__", {}).get("return", "")
    return f"`{cell(type_of(annotation))}`" if annotation else ""


def field_meaning(kind: type, name: str) -> str:
    """The text under a field in the source of its class."""
    try:
        source = inspect.getsource(kind)
    except (OSError, TypeError):
        return ""
    found = re.search(rf'^    {re.escape(name)}: [^\n]*\n    """(.*?)"""', source, re.M | re.S)
    return found[1] if found else ""


def module_page(name: str, module: Any) -> list[str]:
    """A module: its public functions and classes."""
    lines = [f"# {name}", "", doc_of(module), ""]
    for member in getattr(module, "__all__", [n for n in vars(module) if not n.startswith("_")]):
        item = getattr(module, member)
        if inspect.isclass(item) and item.__module__.startswith("raycam"):
            lines += [f"## {member}", "", doc_of(item), ""]
        elif inspect.isfunction(item):
            lines += function(f"## {member}", f"{name}.{member}", item)
    return lines


def pages() -> dict[str, list[Page]]:
    """All pages by section."""
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
    """Makes a page for each name in `reference/api`, and `api.md` and `reference.txt`, the list and all of it."""
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
