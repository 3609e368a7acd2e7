"""The client's modules as one script, which pages and the server send to the browser.

The bundled modules share one scope. This is safe because `bundle` accepts only a restricted syntax: imports of names
from relative paths, named exports of declarations, and no duplicate top-level names.
"""

from __future__ import annotations

import functools
import posixpath
import re
from importlib.resources import files

__all__ = ["beside", "bundle", "client_file", "modules", "style_sheet"]

IMPORT = re.compile(r'^import \{ ([\w, ]+) \} from "(\.\.?/(?:\w+/)?\w+\.js)";\n', re.M)
EXPORT = re.compile(r"^export (?=(?:async )?function |const |class )", re.M)
DECLARATION = re.compile(r"^(?:export )?(?:async )?(?:function|const|let|class) (\[.*?\]|\w+)", re.M)
CONSTANTS = re.compile(r"^(?:export )?const [A-Z_\d]+ = .*$", re.M)
NEXT_CONSTANT = re.compile(r", ([A-Z_\d]+) = ")


@functools.cache
def client_file(name: str) -> str:
    """The text of a client file, given by its path in the client's folder."""
    return (files(__package__) / "client" / name).read_text(encoding="utf-8")


def style_sheet(folder: str = "") -> str:
    """The design tokens, the style of a folder of the client, and the style of figures."""
    return client_file("tokens.css") + client_file(f"{folder}style.css") + client_file("figure.css")


def beside(name: str, source: str) -> str:
    """The path of the module that the module `name` imports as `source`."""
    return posixpath.normpath(posixpath.join(posixpath.dirname(name), source))


@functools.cache
def modules(entry: str = "main.js") -> tuple[str, ...]:
    """Returns the module `entry` and all its imports, each after its own imports.

    Raises `ValueError` for an import cycle.
    """
    ordered: list[str] = []
    entered: list[str] = []

    def enter(name: str) -> None:
        if name in entered:
            raise ValueError(
                f"{' -> '.join([*entered, name])}: modules of the client import each other in a circle"
            )
        entered.append(name)
        for _, source in IMPORT.findall(client_file(name)):
            imported = beside(name, source)
            if imported not in ordered:
                enter(imported)
        entered.pop()
        ordered.append(name)

    enter(entry)
    return tuple(ordered)


@functools.cache
def bundle(entry: str = "main.js") -> str:
    """Returns the module `entry` and its imports as one classic script.

    Raises `ValueError` for unsupported syntax.
    """
    owner: dict[str, str] = {}
    parts = []
    for name in modules(entry):
        text = client_file(name)
        more = [each for line in CONSTANTS.findall(text) for each in NEXT_CONSTANT.findall(line)]
        for declared in [*DECLARATION.findall(text), *more]:
            for word in re.findall(r"\w+", declared):
                if word in owner:
                    raise ValueError(f"{name}: {word} is declared in {owner[word]} too")
                owner[word] = name
        for imported, source in IMPORT.findall(text):
            for word in imported.split(", "):
                if owner.get(word) != beside(name, source):
                    raise ValueError(f"{name} imports {word}, which {beside(name, source)} does not declare")
        body = EXPORT.sub("", IMPORT.sub("", text))
        if re.search(r"^(?:import|export)\b", body, re.M):
            raise ValueError(f"{name}: unsupported form of import or export")
        parts.append(f"// {name}\n{body}")
    script = '"use strict";\n{\n' + "\n".join(parts) + "}\n"
    if "</script" in script.lower() or "<!--" in script:
        raise ValueError("the client's text contains the end of a script element, </script")
    return script
