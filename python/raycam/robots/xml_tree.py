"""XML documents as trees of elements with line numbers, within budgets and without entities."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from typing import NoReturn
from xml.parsers import expat

from ..errors import FormatError

__all__ = ["LFS_POINTER", "ROOT_BYTES", "Element", "XmlLimits", "check_xml", "parse_xml", "root_tag"]

LFS_POINTER = b"version https://git-lfs.github.com"
"""First bytes of a file that Git LFS has not downloaded."""
ROOT_BYTES = 64 << 10
"""Number of bytes at a document's start in which the root element is searched for."""


@dataclass(frozen=True)
class XmlLimits:
    """Limits for a single XML document."""

    bytes: int = 64 << 20
    """Maximum size of the document in bytes."""
    elements: int = 300_000
    """Maximum number of elements."""
    depth: int = 100
    """Maximum nesting depth of elements."""


@dataclass
class Element:
    """An element of an XML document."""

    tag: str
    """The name without its namespace prefix."""
    attributes: dict[str, str]
    line: int
    """The line of the start tag, from 1."""
    children: list[Element] = field(default_factory=list)
    text: str = ""
    """All character data directly inside the element."""

    def find(self, tag: str) -> Element | None:
        """Returns the first child with this tag, or None."""
        return next(self.find_all(tag), None)

    def find_all(self, tag: str) -> Iterator[Element]:
        """Iterates over the children with this tag."""
        return (child for child in self.children if child.tag == tag)


def parse_xml(data: bytes, name: str, limits: XmlLimits | None = None) -> Element:
    """Parses a document and returns its root element; error messages begin with `name`.

    Entity declarations and external identifiers are rejected, so nothing is expanded and no other file is read.
    Raises `FormatError` with file and line for such declarations and identifiers, for malformed XML and beyond the
    limits.
    """
    builder = _Builder(name, limits or XmlLimits(), keep=True)
    builder.parse(data)
    assert builder.root is not None
    return builder.root


def check_xml(data: bytes, name: str, limits: XmlLimits | None = None) -> None:
    """Raises the errors of `parse_xml` without building a tree.

    This function is used for documents that another library parses.
    """
    _Builder(name, limits or XmlLimits(), keep=False).parse(data)


def root_tag(data: bytes) -> str | None:
    """Returns the root element's tag without its namespace prefix.

    `data` is the beginning of a document. The result is None if `data` contains no start tag. Faults after the start
    tag are ignored.
    """
    tags: list[str] = []
    parser = expat.ParserCreate()
    parser.StartElementHandler = lambda tag, _: tags.append(tag.rpartition(":")[2])
    with suppress(expat.ExpatError):
        parser.Parse(data)
    return tags[0] if tags else None


class _Builder:
    """Handlers of expat that check the limits and build the tree."""

    def __init__(self, name: str, limits: XmlLimits, *, keep: bool) -> None:
        self.root: Element | None = None
        self._name, self._limits, self._keep = name, limits, keep
        self._open: list[Element] = []
        self._texts: list[list[str]] = []
        self._depth = self._count = 0
        self._parser = expat.ParserCreate()
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.EntityDeclHandler = self._refuse_entity
        self._parser.StartDoctypeDeclHandler = self._check_doctype
        if keep:
            self._parser.CharacterDataHandler = self._add_text
            self._parser.buffer_text = True

    def parse(self, data: bytes) -> None:
        """Parses the whole document."""
        if len(data) > self._limits.bytes:
            raise FormatError(
                f"{self._name}: file too large: {len(data)} bytes; the limit is {self._limits.bytes}",
                code="budget_exceeded",
            )
        if data.startswith(LFS_POINTER):
            raise FormatError(
                f"{self._name}: a Git LFS pointer instead of the file; run git lfs pull",
                code="placeholder_file",
            )
        try:
            self._parser.Parse(data, True)
        except expat.ExpatError as error:
            raise FormatError(
                f"{self._name}:{error.lineno}: invalid XML: {expat.ErrorString(error.code)}"
            ) from None

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self._count += 1
        self._depth += 1
        if self._count > self._limits.elements:
            self._fail(f"too many XML elements; the limit is {self._limits.elements}", "budget_exceeded")
        if self._depth > self._limits.depth:
            self._fail(
                f"XML elements are nested too deeply; the limit is {self._limits.depth}", "budget_exceeded"
            )
        if not self._keep:
            return
        element = Element(tag.rpartition(":")[2], attributes, self._parser.CurrentLineNumber)
        if self._open:
            self._open[-1].children.append(element)
        else:
            self.root = element
        self._open.append(element)
        self._texts.append([])

    def _end(self, tag: str) -> None:
        self._depth -= 1
        if self._keep:
            self._open.pop().text = "".join(self._texts.pop())

    def _add_text(self, text: str) -> None:
        if self._texts:
            self._texts[-1].append(text)

    def _refuse_entity(self, name: str, *_: object) -> None:
        self._fail(
            f"the document declares the entity {name!r}; entities are not supported, write their text",
            "unsupported_feature",
        )

    def _check_doctype(self, name: str, system: str | None, public: str | None, internal: bool) -> None:
        if system is not None or public is not None:
            self._fail(
                f"the document type refers to {system or public!r}; external files are not read",
                "outside_root",
            )

    def _fail(self, text: str, code: str) -> NoReturn:
        raise FormatError(f"{self._name}:{self._parser.CurrentLineNumber}: {text}", code=code)
