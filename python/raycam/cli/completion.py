"""The command `raycam completion`: what a shell needs to complete commands, options and their choices."""

from __future__ import annotations

import argparse
import textwrap
from collections.abc import Iterator

from ._options import Command

SHELLS = ("bash", "zsh", "fish")


def _add(command: argparse.ArgumentParser) -> None:
    command.add_argument("shell", choices=SHELLS, metavar="SHELL", help=f"one of {', '.join(SHELLS)}")
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    parsers = options.commands()
    if options.shell == "fish":
        print("\n".join(_fish(parsers)))
        return
    if options.shell == "zsh":
        print("autoload -U +X bashcompinit && bashcompinit")
    print("\n".join(_bash(parsers)))


def _actions(command: argparse.ArgumentParser) -> list[argparse.Action]:
    return [action for action in command._actions if action.option_strings]


def _choices(command: argparse.ArgumentParser) -> dict[str, list[str]]:
    """The values of options, and of the first argument under "", that have a fixed list."""
    return {
        option: [str(choice) for choice in action.choices]
        for action in command._actions
        if action.choices
        for option in action.option_strings or [""]
    }


def _bash(parsers: dict[str, argparse.ArgumentParser]) -> Iterator[str]:
    """The script for bash, which zsh understands too. File names complete everywhere else."""
    yield "_raycam() {"
    yield '    local word="${COMP_WORDS[COMP_CWORD]}" last="${COMP_WORDS[COMP_CWORD-1]}" words=""'
    yield "    COMPREPLY=()"
    yield '    if [ "$COMP_CWORD" -eq 1 ]; then'
    yield f'        COMPREPLY=($(compgen -W "{" ".join(parsers)} --help --version" -- "$word"))'
    yield "        return"
    yield "    fi"
    yield '    case "${COMP_WORDS[1]} $last" in'
    for name, command in parsers.items():
        for option, values in _choices(command).items():
            place = f"{name} {option}" if option else f"{name} {name}"
            yield f'        "{place}") words="{" ".join(values)}" ;;'
    yield "    esac"
    yield '    if [ -z "$words" ] && [ "${word#-}" != "$word" ]; then'
    yield '        case "${COMP_WORDS[1]}" in'
    for name, command in parsers.items():
        options = [option for action in _actions(command) for option in action.option_strings]
        yield f'            {name}) words="{" ".join(options)}" ;;'
    yield "        esac"
    yield "    fi"
    yield '    if [ -n "$words" ]; then COMPREPLY=($(compgen -W "$words" -- "$word")); fi'
    yield "}"
    yield "complete -o default -o bashdefault -F _raycam raycam"


def _fish(parsers: dict[str, argparse.ArgumentParser]) -> Iterator[str]:
    """The script for fish."""
    for name, command in parsers.items():
        about = _quoted((command.description or "").rstrip("."))
        yield f"complete -c raycam -n __fish_use_subcommand -a {name} -d {about}"
        within = f"-n '__fish_seen_subcommand_from {name}'"
        for action in _actions(command):
            longs = [option[2:] for option in action.option_strings if option.startswith("--")]
            shorts = [option[1:] for option in action.option_strings if not option.startswith("--")]
            flags = [f"-l {long}" for long in longs] + [f"-s {short}" for short in shorts]
            values = f" -x -a {_quoted(' '.join(map(str, action.choices)))}" if action.choices else ""
            about = _quoted(textwrap.shorten(action.help or "", 70, placeholder=" ..."))
            yield f"complete -c raycam {within} {' '.join(flags)}{values} -d {about}"


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace("'", "\\'").replace("%%", "%")
    return f"'{escaped}'"


COMMAND = Command(
    _add,
    "print what makes a shell complete raycam's commands and options",
    [
        'eval "$(raycam completion bash)"          in ~/.bashrc; zsh too',
        "raycam completion fish > ~/.config/fish/completions/raycam.fish",
    ],
)
