"""Keys: the client and the documentation have the same table."""

from __future__ import annotations

import re
from pathlib import Path

from raycam.viewer.bundle import client_file

ROW = re.compile(r'\{ keys: \[(.*?)\], command: "(.*?)", does: "(.*?)"(, live: true)? \}')
ROWS = ROW.findall(client_file("keys.js"))


def test_every_key_has_one_command() -> None:
    keys = [key for row in ROWS for key in re.findall(r'"(.*?)"', row[0])]
    assert len(ROWS) == client_file("keys.js").count("{ keys: [")
    assert len(keys) == len(set(keys)) > 30


def test_every_key_command_has_a_handler() -> None:
    known = client_file("commands.js") + client_file("live.js")
    for _, command, _, _ in ROWS:
        assert re.search(rf'^ +"?{re.escape(command.split()[0])}"?: (?:moving\()?\(', known, re.M), command


def test_documentation_contains_the_table_of_keys() -> None:
    text = (Path(__file__).parents[2] / "docs" / "view.md").read_text(encoding="utf-8")
    for keys, _, does, live in ROWS:
        shown = " ".join(f"`{key}`" for key in re.findall(r'"(.*?)"', keys))
        assert f"| {shown} | {does}{' (live)' if live else ''} |" in text
