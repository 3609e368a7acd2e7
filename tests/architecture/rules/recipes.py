"""The recipes of CONTRIBUTING.md as data: their steps, and the words in backticks."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from . import rust_facts
from .source import CRATES, text_of

PATH = re.compile(r"[\w.*-]+(/[\w.*-]+)+/?$|\w+\.(rs|py|pyi|md|toml|yaml)$")
NAME = re.compile(r"[A-Za-z_]\w*((::|\.)\w+)*(\(\))?$")
# Stands for a file or a name that the reader chooses.
NEW = re.compile(r"foo|Foo|FOO")


@dataclass
class Recipe:
    """A section of CONTRIBUTING.md such as "A light"."""

    title: str
    text: str

    @property
    def ticked(self) -> list[str]:
        """The words in backticks."""
        return re.findall(r"`([^`]+)`", self.text)

    @property
    def paths(self) -> list[str]:
        """Files and folders named in the section."""
        return [word for word in self.ticked if PATH.match(word)]

    @property
    def names(self) -> list[str]:
        """Types, functions, constants and variants named in the section."""
        return [
            word for word in self.ticked if NAME.match(word) and not PATH.match(word) and not NEW.search(word)
        ]

    @property
    def commands(self) -> list[str]:
        """The commands in the section."""
        return [word for word in self.ticked if word.split()[0] in ("make", "cargo") or "pytest" in word]

    @property
    def steps(self) -> list[int]:
        """The numbers of the section's steps."""
        return [int(number) for number in re.findall(r"^(\d+)\. ", self.text, re.M)]


def recipes(root: Path) -> dict[str, Recipe]:
    """The sections of CONTRIBUTING.md that begin with an article, by title."""
    parts = re.split(r"^## +(.+)\n", text_of(root / "CONTRIBUTING.md"), flags=re.M)[1:]
    sections = zip(parts[::2], parts[1::2], strict=True)
    return {title: Recipe(title, text) for title, text in sections if title.startswith(("A ", "An "))}


def missing_paths(root: Path, recipe: Recipe) -> list[str]:
    """Named paths that do not exist; for a new file, its folder must exist."""
    offences = []
    for word in recipe.paths:
        if NEW.search(word):
            folder = root / word.rsplit("/", 1)[0]
            if "/" in word and not folder.is_dir():
                offences.append(f"{recipe.title}: {word} has no folder")
        elif not (root / word).exists():
            offences.append(f"{recipe.title}: {word} does not exist")
    return offences


def missing_names(root: Path, recipe: Recipe) -> list[str]:
    """Named identifiers that occur in none of the recipe's files."""
    files = [root / word for word in recipe.paths if (root / word).is_file()]
    words = {word for file in files for word in re.findall(r"\w+", text_of(file))}
    return [
        f"{recipe.title}: none of its files names {name}"
        for name in recipe.names
        if not set(re.findall(r"\w+", name)) <= words
    ]


def missing_commands(root: Path, recipe: Recipe) -> list[str]:
    """Commands whose target, package or file does not exist."""
    targets = set(re.findall(r"^([\w-]+):", text_of(root / "Makefile"), re.M))
    offences = []
    for command in recipe.commands:
        words = command.split()
        is_known = {
            "make": lambda words: set(words[1:]) <= targets,
            "cargo": lambda words: words[words.index("-p") + 1].removeprefix("raycam-") in CRATES,
        }.get(words[0], lambda words: (root / words[-1]).exists())
        if not is_known(words):
            offences.append(f"{recipe.title}: `{command}` does nothing here")
    return offences


def files_with_every_variant(root: Path, enum: str) -> list[str]:
    """Files that define an enum, or match on it without a catch-all arm.

    These files must be changed for each new variant.
    """
    facts = rust_facts.files(root)
    return [name for name, file in facts.items() if enum in file["matched"] and rust_facts.is_source(name)]
