"""The command line: one file per command, shared options in `_options.py`, `_job_options.py` and `options/`.

Start-up time is part of every command's time, so a module that only one command needs is imported in that command's
function.
"""

from __future__ import annotations

import argparse
import contextlib
import errno
import io
import os
import re
import sys
import traceback
import warnings
from collections.abc import Sequence
from typing import NoReturn

from .._core import __version__
from ..errors import Error, Notice, SettingsError, nearest
from . import (
    bench,
    cameras,
    completion,
    dataset,
    demo,
    doctor,
    explain,
    info,
    learn,
    render,
    selfcheck,
    status,
    video,
    view,
)
from ._options import LOUDNESS, TOLD, add_loudness, options_of, set_loudness

__all__ = ["COMMANDS", "main"]

COMMANDS = {
    "render": render.COMMAND,
    "view": view.COMMAND,
    "video": video.COMMAND,
    "dataset": dataset.COMMAND,
    "status": status.STATUS,
    "verify": status.VERIFY,
    "explain": explain.COMMAND,
    "info": info.COMMAND,
    "cameras": cameras.COMMAND,
    "selfcheck": selfcheck.COMMAND,
    "doctor": doctor.COMMAND,
    "bench": bench.COMMAND,
    "demo": demo.COMMAND,
    "learn": learn.COMMAND,
    "completion": completion.COMMAND,
}
"""The commands by name, in the order of the help."""

LONG = {"render": "WORLD [-o FILE]", "video": "WORLD [-o FILE]", "dataset": "WORLD -o FOLDER"}
"""The arguments of commands with more options than a usage line should list."""

SHORT_HELP = """raycam renders your model: pictures, ground truth, videos, through any camera.

  raycam render model.glb                      a picture, model.png
  raycam render model.glb --turntable          a video that turns around it, model.mp4
  raycam render model.glb --camera calib.yaml  through your calibrated camera
  raycam view model.glb                        look at it live in the browser
  raycam --help                                all commands; raycam COMMAND --help, their options

No model at hand? spot.glb and spot.toml come with raycam; raycam demo DIR shows what it can."""

STOPPED = 130  # the exit status by which shells report Ctrl-C


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs a command and returns its exit status: 0, 1 for an error, 2 for a wrong command line."""
    words = sys.argv[1:] if arguments is None else list(arguments)
    TOLD.clear()
    set_loudness(quiet=False, verbose=False)
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
        if words and not words[0].startswith("-") and words[0] not in COMMANDS:
            model = words[0].lower().endswith((".glb", ".gltf", ".obj", ".ply", ".stl", ".off", ".toml"))
            way = f"; a picture of a model: raycam render {words[0]}" if model else ""
            parser.error(f"{nearest('command', words[0], list(COMMANDS))}{way}")
        options, others = parser.parse_known_args(_joined(words))
        if others:
            _refuse(options.commands(), options.command, others)
        set_loudness(options.quiet, options.verbose)
        options.run(options)
        sys.stdout.flush()
        return 0
    except KeyboardInterrupt:
        print("raycam: stopped", file=sys.stderr)
        return STOPPED
    except BrokenPipeError:
        # The reader closed the pipe. Without this, Python would report another error at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except (Error, ValueError, OSError, MemoryError) as error:
        if LOUDNESS["verbose"]:
            traceback.print_exc()
        print(f"raycam: error: {_message(error)}", file=sys.stderr)
        return 2 if isinstance(error, SettingsError) else 1


def _refuse(commands: dict[str, argparse.ArgumentParser], name: str, others: Sequence[str]) -> NoReturn:
    """Exits with the words that a command does not know, and the nearest option or the commands that have it."""
    import difflib

    message = f"unrecognized arguments: {' '.join(others)}"
    option = next((word.partition("=")[0] for word in others if word.startswith("--")), "")
    having = [f"raycam {other}" for other, command in commands.items() if option in options_of(command)]
    if having:
        message += f"; {', '.join(having)} {'has' if len(having) == 1 else 'have'} {option}"
    elif near := difflib.get_close_matches(option, options_of(commands[name]), n=1, cutoff=0.75):
        message += f"; did you mean {near[0]}?"
    commands[name].error(message)


def _open_closed_streams() -> None:
    """Opens /dev/null for standard streams that the shell closed, so that no file of ours becomes one of them."""
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            with contextlib.suppress(OSError):
                os.fstat(number)
                continue  # a file has taken its place already
            null = os.open(os.devnull, os.O_RDWR)
            if null != number:
                os.dup2(null, number)
                os.close(null)
            setattr(sys, name, open(number, "r" if number == 0 else "w", closefd=False))  # noqa: SIM115
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115


def _write_utf8() -> None:
    """Makes pipes and files UTF-8 on Windows, where their encoding is that of old programs, without many letters."""
    if os.name == "nt":
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper) and not stream.isatty():
                stream.reconfigure(encoding="utf-8")


def _joined(words: Sequence[str]) -> list[str]:
    """Joins "--frames -4:" to "--frames=-4:", because argparse takes "-4:" and "-1,0,2" for options.

    Splits "--pixel 320,240".
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
            joined[-1] = f"--output={word}"  # -.npz and so on: the standard output
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
    """Argument parser that reports errors in one line."""

    def error(self, message: str) -> NoReturn:
        """Prints the message and exits with status 2."""
        self.exit(2, f"raycam: error: {message} (see {self.prog} --help)\n")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="raycam",
        description="Renders models and worlds on the CPU: pictures, exact ground truth, data sets and videos.",
        epilog="Begin with `raycam demo DIR`: a world, pictures and a video. `raycam COMMAND --help` shows more.",
    )
    made: dict[str, argparse.ArgumentParser] = {}
    parser.set_defaults(main=main, commands=lambda: made)  # for `demo`, which runs others, and `completion`
    parser.add_argument("--version", action="version", version=f"raycam {__version__}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True, dest="command", parser_class=_Parser)
    for name, (add, help_text, examples) in COMMANDS.items():
        command = commands.add_parser(
            name,
            help=help_text,
            usage=None if name not in LONG else f"raycam {name} {LONG[name]} [options]",
            description=f"{help_text[0].upper()}{help_text[1:]}.",
            epilog="examples:\n" + "\n".join(f"  {example}" for example in examples),
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        made[name] = command
        add(command)
        add_loudness(command)
    return parser
