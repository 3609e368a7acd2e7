"""The command line: one file per command.

The folder `options/` contains the options that several commands share. Start-up time is part of every
command's time, so a module that only one command needs is imported in that command's function.
"""

from __future__ import annotations

import argparse
import contextlib
import errno
import io
import itertools
import os
import re
import sys
import traceback
import warnings
from collections.abc import Sequence
from typing import Any, NoReturn

from .._core import __version__
from ..errors import Error, Notice, SettingsError, nearest
from ..notices import collected, distinct
from ..world.endings import MODEL_ENDINGS
from . import (
    bake,
    bench,
    cameras,
    completion,
    dataset,
    demo,
    depth,
    doctor,
    explain,
    info,
    learn,
    lidars,
    render,
    scan,
    selfcheck,
    status,
    texture,
    video,
    view,
    visible,
)
from .options.command import option_names
from .options.messages import (
    add_verbosity,
    as_typed,
    is_verbose,
    print_notices,
    reset_messages,
    set_verbosity,
)

__all__ = ["COMMANDS", "main"]

COMMANDS = {
    "render": render.COMMAND,
    "view": view.COMMAND,
    "video": video.COMMAND,
    "dataset": dataset.COMMAND,
    "scan": scan.COMMAND,
    "depth": depth.COMMAND,
    "visible": visible.COMMAND,
    "texture": texture.COMMAND,
    "bake": bake.COMMAND,
    "status": status.STATUS,
    "verify": status.VERIFY,
    "explain": explain.COMMAND,
    "info": info.COMMAND,
    "cameras": cameras.COMMAND,
    "lidars": lidars.COMMAND,
    "selfcheck": selfcheck.COMMAND,
    "doctor": doctor.COMMAND,
    "bench": bench.COMMAND,
    "demo": demo.COMMAND,
    "learn": learn.COMMAND,
    "completion": completion.COMMAND,
}
"""The commands by name, in the order of the help."""

LONG_USAGES = {"render": "WORLD [-o FILE]", "video": "WORLD [-o FILE]", "dataset": "WORLD -o FOLDER"}
"""The usage lines of commands that have too many options to list."""

SHORT_HELP = """raycam renders models: images, ground truth and videos, with any camera.

  raycam render model.glb                      an image, model.png
  raycam render model.glb --turntable          a video of a turn around the model, model.mp4
  raycam render model.glb --camera calib.yaml  with a calibrated camera
  raycam view model.glb                        show the model live in the browser
  raycam --help                                all commands; raycam COMMAND --help lists a command's options

The models spot.glb and spot.toml come with raycam. Run raycam demo DIR for a tour."""

INTERRUPTED_STATUS = 130
"""The exit status by which shells report Ctrl-C."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs a command and returns its exit status: 0, 1 for an error, 2 for a wrong command line."""
    words = sys.argv[1:] if arguments is None else list(arguments)
    reset_messages()
    _open_closed_streams()
    _write_utf8()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)  # commands print notices themselves
        return _main(words)


def _main(words: Sequence[str]) -> int:
    try:
        parser = _parser()
        if not words:
            print(SHORT_HELP)
            return 0
        if words[0] == "help":
            words = [*words[1:2], "--help"]
        if not words[0].startswith("-") and words[0] not in COMMANDS:
            is_model = words[0].lower().endswith(MODEL_ENDINGS)
            remedy = f"; to render a model: raycam render {words[0]}" if is_model else ""
            parser.error(f"{nearest('command', words[0], list(COMMANDS))}{remedy}")
        options, others = parser.parse_known_args(_join_values(words))
        if others:
            _refuse(options.commands(), options.command, others)
        set_verbosity(options.quiet, options.verbose)
        with collected() as notices:
            try:
                options.run(options)
            finally:
                # Commands have already printed the notices of results; notices with the same text are printed once.
                print_notices(distinct(notices))
        sys.stdout.flush()
        return 0
    except KeyboardInterrupt:
        print("raycam: stopped", file=sys.stderr)
        return INTERRUPTED_STATUS
    except BrokenPipeError:
        # The reader closed the pipe. Without this, Python would report another error at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except (Error, ValueError, OSError, MemoryError) as error:
        if is_verbose():
            traceback.print_exc()
        print(f"raycam: error: {as_typed(_message(error))}", file=sys.stderr)
        return 2 if isinstance(error, SettingsError) else 1


def _refuse(commands: dict[str, argparse.ArgumentParser], name: str, others: Sequence[str]) -> NoReturn:
    """Exits with an error message: the arguments that the command does not accept, and a remedy."""
    message = f"unrecognized arguments: {' '.join(others)}"
    option = next((word.partition("=")[0] for word in others if word.startswith("--")), "")
    having = [f"raycam {other}" for other, command in commands.items() if option in option_names(command)]
    if meant := _meant_option(option, option_names(commands[name])):
        message += f"; did you mean {meant}?"
    elif having:
        message += f"; {option} is an option of {', '.join(having)}"
    commands[name].error(message)


def _meant_option(option: str, options: list[str]) -> str | None:
    """Returns the likely option for an abbreviation, another program's term or a misspelling."""
    import difflib

    from .._core import names_for_foreign_term

    if not option:
        return None
    names = {each.removeprefix("--").replace("-", "_"): each for each in options}
    found = [each for each in options if each.startswith(option)]
    found += [names[name] for name in names_for_foreign_term(option.removeprefix("--"), list(names))]
    found += difflib.get_close_matches(option, options, n=1, cutoff=0.75)
    return found[0] if found else None


def _is_dashed_name(word: str) -> bool:
    """True for an argument that begins with a dash and looks like a file, not like an option."""
    if not word.startswith("-") or word == "-":
        return False
    return bool(os.path.splitext(word.lstrip("-"))[1]) or os.path.lexists(word)


def _open_closed_streams() -> None:
    """Opens /dev/null for standard streams that the shell closed.

    Otherwise, other files would get the streams' descriptors.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            with contextlib.suppress(OSError):
                os.fstat(number)
                continue  # the descriptor is open, but belongs to another file
            null = os.open(os.devnull, os.O_RDWR)
            if null != number:
                os.dup2(null, number)
                os.close(null)
            setattr(sys, name, open(number, "r" if number == 0 else "w", closefd=False))  # noqa: SIM115
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115


def _write_utf8() -> None:
    """Sets the encoding of pipes and files to UTF-8 on Windows.

    The default encoding of Windows lacks many characters.
    """
    if os.name == "nt":
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper) and not stream.isatty():
                stream.reconfigure(encoding="utf-8")


def _join_values(words: Sequence[str]) -> list[str]:
    """Joins "--frames -4:" to "--frames=-4:", and splits "--pixel 320,240".

    The words are joined because argparse reads "-4:" and "-1,0,2" as options.
    """
    joined: list[str] = []
    for word in words:
        if word.startswith("--pixel=") and "," in word:
            joined += ["--pixel", *word.removeprefix("--pixel=").split(",")]
            continue
        if joined and joined[-1] == "--pixel" and "," in word:
            joined += word.split(",")
            continue
        if joined and joined[-1] in ("-o", "--output") and word.startswith("-."):
            joined[-1] = f"--output={word}"  # `-.npz` and similar names mean the standard output
            continue
        after = joined and joined[-1].startswith("--") and "=" not in joined[-1]
        if after and re.fullmatch(r"-[\d.][\d.eE]*[:,][\d.eE,:+-]*", word):
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


def _message(error: BaseException) -> str:
    if isinstance(error, OSError) and error.strerror:
        if not error.filename:
            return error.strerror
        bare = error.strerror == os.strerror(errno.ENOENT) and isinstance(error.filename, str)
        return f"{error.filename}: {error.strerror}{_nearest_names(error.filename) if bare else ''}"
    if isinstance(error, MemoryError):
        return f"out of memory {error}".rstrip()
    return str(error)


def _nearest_names(path: str) -> str:
    from ..world.missing_files import nearest_names

    return nearest_names(path)


class _Parser(argparse.ArgumentParser):
    """Argument parser that accepts no abbreviations and reports errors in one line."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options, allow_abbrev=False)
        self.words: Sequence[str] = ()
        """The words that are parsed."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parses the command's words, and keeps the words for error messages."""
        self.words = list(sys.argv[1:] if args is None else args)
        return super().parse_known_args(args, namespace)

    def error(self, message: str) -> NoReturn:
        """Prints the message and exits with status 2."""
        if remedy := self._dash_remedy():
            message += f"; for a name that begins with a dash, write {remedy}"
        self.exit(2, f"raycam: error: {message} (see {self.prog} --help)\n")

    def _dash_remedy(self) -> str:
        """Returns the correct spelling of the first file name that begins with a dash.

        The result is empty if no file name begins with a dash.
        """
        takes_text = {
            name
            for action in self._actions
            if action.nargs != 0 and action.type in (None, str)
            for name in action.option_strings
        }
        for option, word in itertools.pairwise(["", *self.words]):
            if not word.startswith("-") or word.partition("=")[0] in option_names(self):
                continue
            if option in takes_text:
                return f"./{word} or {option}={word}"
            if _is_dashed_name(word):
                return f"./{word}"
        return ""


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="raycam",
        description="Renders models and worlds on the CPU: images, exact ground truth, data sets and videos.",
        epilog="To start, run `raycam demo DIR`. `raycam COMMAND --help` lists the options of a command.",
    )
    parsers: dict[str, argparse.ArgumentParser] = {}
    # `demo` calls `main` to run other commands, and `completion` lists `commands`.
    parser.set_defaults(main=main, commands=lambda: parsers)
    parser.add_argument("--version", action="version", version=f"raycam {__version__}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True, dest="command", parser_class=_Parser)
    for name, (add, help_text, examples) in COMMANDS.items():
        command = commands.add_parser(
            name,
            help=help_text,
            usage=None if name not in LONG_USAGES else f"raycam {name} {LONG_USAGES[name]} [options]",
            description=f"{help_text[0].upper()}{help_text[1:]}.",
            epilog="examples:\n" + "\n".join(f"  {example}" for example in examples),
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        parsers[name] = command
        add(command)
        add_verbosity(command)
    return parser
