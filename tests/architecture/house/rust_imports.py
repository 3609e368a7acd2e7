"""Arrows between the files of a crate.

A path (`use crate::a::X`, `super::a::f(…)`, `a::f(…)` after `use crate::a`) leads to the file that *defines* what it
names; re-exports are followed, so they make no arrow of their own. A module that is only imported makes no arrow
either: what is then named through it does. `mod child;` is no arrow, nor is anything under `#[cfg(test)]`.
Calls of methods cannot be told by their text and are not read.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from .source import product_code_of

TOKEN = re.compile(r"[A-Za-z_]\w*|::|[{}()\[\];,*!#=<>.:]|\S")
VISIBILITY = re.compile(r"\bpub\s*\((?:crate|super|self|in\s+[\w:]+)\)")
ITEMS = {"fn", "struct", "enum", "trait", "type", "union", "const", "static"}
TYPES = {"struct", "enum", "trait", "type", "union"}
HEADS = {"crate", "self", "super"}
WORD = re.compile(r"[A-Za-z_]\w*$")


@dataclass
class Module:
    """A module: its file, what it defines, and what it imports."""

    file: Path
    parent: Module | None
    name: str = ""
    children: dict[str, Module] = field(default_factory=dict)
    items: dict[str, str] = field(default_factory=dict)
    bindings: dict[str, tuple[str, ...]] = field(default_factory=dict)
    public_bindings: set[str] = field(default_factory=set)
    globs: list[tuple[str, ...]] = field(default_factory=list)
    paths: set[tuple[str, ...]] = field(default_factory=set)
    words: set[str] = field(default_factory=set)

    @property
    def root(self) -> Module:
        """The crate's root module."""
        return self if self.parent is None else self.parent.root

    def everything(self) -> list[Module]:
        """The module and all below it."""
        return [self, *(deep for child in self.children.values() for deep in child.everything())]


@cache
def read_crate(source: Path) -> Module:
    """The module tree of a crate, from its `src` folder."""
    root = Module(source / "lib.rs", None)
    _Reader(root, source).read()
    return root


def arrows(source: Path) -> dict[str, set[str]]:
    """For each file under `src`, the files whose definitions it names."""
    found: dict[str, set[str]] = {}
    for module in read_crate(source).everything():
        own = found.setdefault(module.file.relative_to(source).as_posix(), set())
        for target in _targets(module):
            if target != module.file:
                own.add(target.relative_to(source).as_posix())
    return found


def types(source: Path) -> dict[str, list[str]]:
    """For each type name that modules of the crate define, the files that define it."""
    found: dict[str, list[str]] = {}
    for module in read_crate(source).everything():
        for name, kind in module.items.items():
            if kind in TYPES:
                found.setdefault(name, []).append(module.file.relative_to(source).as_posix())
    return found


def resolved(module: Module, name: str) -> Module | Path | None:
    """The module or the defining file of a name that a module imports."""
    return _resolve(module, module.bindings[name])


class _Reader:
    """Reads the tokens of one file into its module, and then the files of its child modules."""

    def __init__(self, module: Module, folder: Path) -> None:
        self.module = module
        self.folder = folder  # of its child modules
        code = VISIBILITY.sub("pub", product_code_of(module.file))
        self.tokens = TOKEN.findall(code)
        self.at = 0

    def read(self) -> None:
        self._read_block(self.module, self.folder)

    def _read_block(self, module: Module, folder: Path) -> None:
        """Reads up to the closing brace of a module, or the end of the file."""
        depth = 0
        public = False
        while self.at < len(self.tokens):
            token = self.tokens[self.at]
            after = self.tokens[self.at + 1] if self.at + 1 < len(self.tokens) else ""
            if token == "{":
                depth += 1
            elif token == "}":
                if depth == 0:
                    return
                depth -= 1
            elif token == "use" and after != "<" and not self._follows("::"):  # `use<..>` captures lifetimes
                self.at += 1
                self._read_use(module, (), public)
            elif token == "mod" and depth == 0 and WORD.match(after):
                self._read_child(module, after, folder)
            elif (
                token in ITEMS
                and depth == 0
                and WORD.match(after)
                and after not in ITEMS | {"unsafe", "extern"}
            ):
                module.items.setdefault("_" if after == "_" else after, token)
            elif token == "macro_rules" and after == "!":
                module.items[self.tokens[self.at + 2]] = "macro"
            elif WORD.match(token) and not self._follows("::"):
                self._read_path(module)
            public = token == "pub"
            self.at += 1

    def _follows(self, sign: str) -> bool:
        return self.at > 0 and self.tokens[self.at - 1] == sign

    def _read_child(self, module: Module, name: str, folder: Path) -> None:
        sign = self.tokens[self.at + 2]
        if sign == "{":
            child = module.children[name] = Module(module.file, module, name)
            self.at += 3
            self._read_block(child, folder / name)
        elif sign == ";":
            for file in (folder / f"{name}.rs", folder / name / "mod.rs"):
                if file.exists():
                    child = module.children[name] = Module(file, module, name)
                    _Reader(child, folder / name).read()

    def _read_path(self, module: Module) -> None:
        """Notes `a::b::c`, and the word alone."""
        parts = [self.tokens[self.at]]
        while self.tokens[self.at + 1 : self.at + 2] == ["::"] and WORD.match(
            self.tokens[self.at + 2] if self.at + 2 < len(self.tokens) else ""
        ):
            parts.append(self.tokens[self.at + 2])
            self.at += 2
        module.words.add(parts[0])
        if len(parts) > 1:
            module.paths.add(tuple(parts))

    def _read_use(self, module: Module, before: tuple[str, ...], public: bool) -> None:
        """Reads one tree of a `use`, up to the comma, brace or semicolon after it."""
        path = before
        while True:
            token = self.tokens[self.at]
            if token == "{":
                self.at += 1
                while self.tokens[self.at] != "}":
                    self._read_use(module, path, public)
                    if self.tokens[self.at] == ",":
                        self.at += 1
                self.at += 1
                return
            if token == "*":
                module.globs.append(path)
            elif token == "as":
                self._bind(module, self.tokens[self.at + 1], path, public)
                self.at += 2
                return
            elif token in (",", "}", ";"):
                if path[-1] == "self":
                    path = path[:-1]
                if path and self.tokens[self.at - 1] not in ("*", "}"):
                    self._bind(module, path[-1], path, public)
                return
            elif token != "::":
                path = (*path, token)
            self.at += 1

    @staticmethod
    def _bind(module: Module, name: str, path: tuple[str, ...], public: bool) -> None:
        module.bindings[name] = path
        if public:
            module.public_bindings.add(name)


def _targets(module: Module) -> set[Path]:
    """The files that a module's code leads to."""
    found: set[Path | None] = set()
    for name, path in module.bindings.items():
        if name not in module.public_bindings or name in module.words:
            found.add(_file_of(module, path))
    for path in module.paths:
        found.add(_file_of(module, path))
    for glob in module.globs:
        target = _resolve(module, glob)
        if isinstance(target, Module):
            for word in module.words & (set(target.items) | set(target.bindings)):
                found.add(_file_of(target, ("self", word)))
        elif target is not None:
            found.add(target)  # the variants of an enum
    return {file for file in found if file is not None}


def _file_of(module: Module, path: tuple[str, ...]) -> Path | None:
    target = _resolve(module, path)
    return None if isinstance(target, Module) else target


def _resolve(module: Module, path: tuple[str, ...], depth: int = 0) -> Module | Path | None:
    """The module or the defining file that a path leads to; None for other crates."""
    if depth > 20 or not path:
        return None
    head = path[0]
    here: Module | Path | None
    if head == "crate":
        here = module.root
    elif head == "self":
        here = module
    elif head == "super":
        here = module.parent
    elif head in module.children:
        here = module.children[head]
    elif head in module.bindings and module.bindings[head] != path[:1]:
        here = _resolve(module, module.bindings[head], depth + 1)
    elif head in module.items:
        return module.file
    else:
        return None
    for name in path[1:]:
        if not isinstance(here, Module):
            return here
        here = here.parent if name == "super" else _member(here, name, depth)
    return here


def _member(module: Module, name: str, depth: int) -> Module | Path | None:
    """The item of a module under a name; a name that is nowhere was made by a macro of the module."""
    return _shown(module, name, depth) or module.file


def _shown(module: Module, name: str, depth: int) -> Module | Path | None:
    """A child, a definition, or a re-export of a module; None where it has none of this name."""
    if name in module.children:
        return module.children[name]
    if name in module.items:
        return module.file
    if name in module.bindings:
        return _resolve(module, module.bindings[name], depth + 1)
    for glob in module.globs if depth < 20 else ():
        source = _resolve(module, glob, depth + 1)
        if isinstance(source, Module) and source is not module:
            found = _shown(source, name, depth + 1)
            if found is not None:
                return found
    return None
