"""Writes the command-line reference: the output of `--help` for every command."""

import argparse
from pathlib import Path

from raycam import cli


def write(folder: Path) -> None:
    """Writes `commands.md`."""
    parser = cli._parser()
    commands = next(action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    lines = ["```text", parser.format_help().rstrip(), "```", ""]
    for name, command in commands.choices.items():
        lines += [f"## raycam {name}", "", "```text", command.format_help().rstrip(), "```", ""]
    (folder / "commands.md").write_text("\n".join(lines), encoding="utf-8")
