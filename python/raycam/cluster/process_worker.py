"""Worker process of a `ProcessPool`: `python -m raycam.cluster.process_worker`."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import sys
import traceback
from collections.abc import Iterable
from typing import IO, Any

from ..io.system_calls import parent_watch
from ..io.temp_stream import Piece
from ..jobs.worker import FrameTask, render_frame

__all__ = ["serve"]


class _StreamedFile(bytes):
    """Placeholder for a file whose pieces have already been sent."""


def serve(tasks: IO[bytes], answers: IO[bytes]) -> None:
    """Renders tasks until the input ends, or the parent process dies."""
    parent_ended = parent_watch()

    def send(pieces: Iterable[Piece]) -> bytes:
        """Sends each piece as soon as it exists, so that only one piece is in memory."""
        begins = True
        for piece in pieces:
            answers.write(json.dumps({"piece": len(piece), "begins": begins}).encode() + b"\n")
            answers.write(piece)
            begins = False
        return _StreamedFile()

    def go_on(done: int, total: int) -> None:
        if parent_ended():  # the parent was killed; a resumed job needs the cores
            raise SystemExit(1)

    for line in tasks:
        files: list[bytes] = []
        try:
            made = render_frame(FrameTask(**json.loads(line)), go_on, gather=send)
            sizes: list[tuple[str, int | None]] = []
            for name, data in made.files.items():
                if isinstance(data, bytes) and not isinstance(data, _StreamedFile):
                    files.append(data)
                    sizes.append((name, len(data)))
                else:
                    sizes.append((name, None))
            answer: dict[str, Any] = {"files": sizes, "seconds": made.seconds}
            answer["notices"] = [notice.to_json() for notice in made.notices]
        except Exception as fault:
            answer = {"error": type(fault).__name__, "text": str(fault), "trace": traceback.format_exc()}
        answers.write(json.dumps(answer).encode() + b"\n")
        for data in files:
            answers.write(data)
        answers.flush()


def main() -> None:
    """Serves on the standard streams; other output is redirected to standard error."""
    # Ctrl-C reaches every process of the terminal; only the parent reacts.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with os.fdopen(os.dup(1), "wb") as answers:
        os.dup2(2, 1)
        with contextlib.suppress(BrokenPipeError):
            serve(sys.stdin.buffer, answers)


if __name__ == "__main__":
    main()
