"""Keys: the client and the documentation have the same table."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from raycam.viewer.bundle import client_file
from raycam.viewer.server import Server
from support.chromium import Tab
from support.node_core import needs_node, run_module

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


@needs_node
def test_keys_are_labelled_as_on_the_keyboard() -> None:
    labels = run_module(
        "keys.js",
        "const german = new Map([['BracketLeft', 'ü'], ['KeyZ', 'y'], ['KeyQ', 'q']]);"
        "return ['[', 'Z', 'Ctrl+Z', 'ArrowUp', 'Q'].map((name) => keyLabel(name, german));",
    )
    assert labels == ["Ü", "Y", "Ctrl+Z", "Up", "Q"]


@pytest.mark.proof
@pytest.mark.parametrize(
    ("typed", "place", "step"),
    [("\u00fc", "BracketLeft", -1), ("\u044a", "BracketRight", 1), ("\u00e0", "Digit0", 0)],
)
def test_keys_of_other_layouts_are_matched_by_their_place(
    tab: Tab, server: Server, typed: str, place: str, step: int
) -> None:
    tab.open(server.url)
    tab.wait("document.getElementById('channel').value === 'color'")
    names = tab.evaluate("[...document.getElementById('channel').options].map((each) => each.value)")
    tab.evaluate("document.getElementById('picture').focus()")
    for kind in ("keyDown", "keyUp"):
        tab.call("Input.dispatchKeyEvent", type=kind, key=typed, code=place)
    tab.wait(f"document.getElementById('channel').value === '{names[step]}'")


@pytest.mark.proof
def test_every_key_command_has_a_button_in_the_help(tab: Tab, server: Server) -> None:
    tab.open(server.url)
    tab.evaluate("document.getElementById('help-button').click()")
    tab.wait("document.getElementById('help').open")
    buttons = tab.evaluate(
        "[...document.querySelectorAll('#key-rows button')].map((each) => each.textContent)"
    )
    assert buttons == [does for _, _, does, _ in ROWS]
    tab.evaluate(
        "[...document.querySelectorAll('#key-rows button')].find((each) => each.textContent === 'depth').click()"
    )
    tab.wait("document.getElementById('channel').value === 'depth' && !document.getElementById('help').open")
