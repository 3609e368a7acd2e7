"""The command `raycam completion`: shell scripts that complete the command line.

The scripts complete commands, options and their values.
"""

from __future__ import annotations

import argparse
import textwrap
from collections.abc import Iterable, Iterator
from typing import get_args

from .options.command import Command, option_names

SHELLS = ("bash", "zsh", "fish")


def _add(command: argparse.ArgumentParser) -> None:
    command.add_argument("shell", choices=SHELLS, metavar="SHELL", help=f"shell: {', '.join(SHELLS)}")
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    parsers = options.commands()
    if options.shell == "fish":
        print("\n".join(_fish(parsers)))
        return
    if options.shell == "zsh":
        print("(( $+functions[compdef] )) || { autoload -U +X compinit && compinit -i }")
        print("autoload -U +X bashcompinit && bashcompinit")
    print("\n".join(_bash(parsers)))


def _actions(command: argparse.ArgumentParser) -> list[argparse.Action]:
    return [action for action in command._actions if action.option_strings]


def _values(name: str, action: argparse.Action) -> list[str]:
    """Returns the values of an option or argument with a closed set of values; else empty.

    `name` is the command.
    """
    if action.choices:
        return [str(choice) for choice in action.choices]
    lists = _lists()
    for option in action.option_strings:
        for key in (f"{name} {option}", option):
            if key in lists:
                return list(lists[key])
    return []


def _lists() -> dict[str, Iterable[str]]:
    """The values of options with a closed set of names, by option, or by command and option."""
    from ..calibration import FORMATS, WRITTEN_FORMATS
    from ..camera._arguments import Model
    from ..dataset.formats import FORMATS as DATA_SETS
    from ..explanation import SUBJECTS
    from ..render import FILTERS, INTEGRATORS, VIEWS, channel_names
    from ..render.arguments import SIDES

    return {
        "--axes": ("opencv", "opengl"),
        "--board": ("charuco", "checkerboard"),
        "--camera-format": FORMATS,
        "--channels": ("all", *channel_names("all")),
        "--direction": ("world_from_camera", "camera_from_world"),
        "--filter": FILTERS,
        "--format": FORMATS,
        "dataset --format": DATA_SETS,
        "--integrator": INTEGRATORS,
        "--lens": get_args(Model),
        "--of": SUBJECTS,
        "--to": WRITTEN_FORMATS,
        "--view": VIEWS,
        "--view-from": SIDES,
    }


def _bash(parsers: dict[str, argparse.ArgumentParser]) -> Iterator[str]:
    """The script for bash and zsh; words without a list of values are completed as file names."""
    yield "_raycam() {"
    yield '    local word="${COMP_WORDS[COMP_CWORD]}" last="${COMP_WORDS[COMP_CWORD-1]}" words=""'
    yield "    COMPREPLY=()"
    yield '    if [ "$COMP_CWORD" -eq 1 ]; then'
    yield f'        COMPREPLY=($(compgen -W "{" ".join(parsers)} --help --version" -- "$word"))'
    yield "        return"
    yield "    fi"
    yield '    case "${COMP_WORDS[1]} $last" in'
    several = []
    for name, command in parsers.items():
        for action in command._actions:
            if values := " ".join(_values(name, action)):
                places = [f'"{name} {option}"' for option in action.option_strings or [name]]
                line = f'        {"|".join(places)}) words="{values}" ;;'
                several += [line] if action.nargs == "+" else []
                yield line
    yield "    esac"
    # An option may have several values, so the last option before the word determines the suggestions.
    yield '    local option="" i'
    yield "    for ((i = COMP_CWORD - 1; i > 1; i--)); do"
    yield '        case "${COMP_WORDS[i]}" in -*) option="${COMP_WORDS[i]}"; break ;; esac'
    yield "    done"
    yield '    case "${COMP_WORDS[1]} $option" in'
    yield from several
    yield "    esac"
    yield '    if [ "${word#-}" != "$word" ]; then'
    yield '        case "${COMP_WORDS[1]}" in'
    for name, command in parsers.items():
        yield f'            {name}) words="{" ".join(option_names(command))}" ;;'
    yield "        esac"
    yield "    fi"
    yield '    if [ -n "$words" ]; then COMPREPLY=($(compgen -W "$words" -- "$word")); fi'
    yield "}"
    yield "complete -o default -o bashdefault -F _raycam raycam"


def _fish(parsers: dict[str, argparse.ArgumentParser]) -> Iterator[str]:
    """The script for fish."""
    yield from FISH_WITHIN
    for name, command in parsers.items():
        about = _quoted((command.description or "").rstrip("."))
        yield f"complete -c raycam -n __fish_use_subcommand -a {name} -d {about}"
        within = f"-n '__fish_seen_subcommand_from {name}'"
        for action in _actions(command):
            longs = [option[2:] for option in action.option_strings if option.startswith("--")]
            shorts = [option[1:] for option in action.option_strings if not option.startswith("--")]
            flags = [f"-l {long}" for long in longs] + [f"-s {short}" for short in shorts]
            found = _quoted(" ".join(_values(name, action)))
            values = f" -x -a {found}" if found != "''" else " -r" if action.nargs is None else ""
            about = _quoted(textwrap.shorten(action.help or "", 70, placeholder=" ..."))
            yield f"complete -c raycam {within} {' '.join(flags)}{values} -d {about}"
            if action.nargs == "+" and values.startswith(" -x"):
                option = action.option_strings[-1]
                yield f"complete -c raycam {within[:-1]}; and __raycam_within {option}' -f -a {found}"
        for action in command._get_positional_actions():
            if values := " ".join(_values(name, action)):
                yield f"complete -c raycam {within} -f -a {_quoted(values)}"


FISH_WITHIN = """function __raycam_within -d 'true if the last option before the cursor is the given option'
    for word in (commandline -opc)[-1..1]
        if string match -q -- '-*' $word
            test $word = $argv[1]
            return $status
        end
    end
    return 1
end""".splitlines()


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace("'", "\\'").replace("%%", "%")
    return f"'{escaped}'"


COMMAND = Command(
    _add,
    "print a script that completes raycam's commands and options in a shell",
    [
        'eval "$(raycam completion bash)"          in ~/.bashrc',
        'eval "$(raycam completion zsh)"           in ~/.zshrc',
        "raycam completion fish > ~/.config/fish/completions/raycam.fish",
    ],
)
