"""Renders `path_scenes.py` with a renderer that is installed for another interpreter.

The two processes communicate through pipes.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from path_scenes import Array, Scene


@contextlib.contextmanager
def picture(
    renderer: str, python: str, scene: Scene, size: tuple[int, int], **settings: Any
) -> Iterator[Any]:
    """Yields a function that renders an image: (samples, seed) to (image, seconds).

    `path_RENDERER.py` renders the image in the interpreter `python`.
    """
    with tempfile.TemporaryDirectory() as folder:
        task = {"renderer": renderer, "scene": scene, "size": size, "settings": settings, "folder": folder}
        command = [python, __file__, json.dumps(task)]
        child = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        asked, answers = child.stdin, child.stdout
        assert asked is not None
        assert answers is not None

        def render(samples: int, seed: int) -> tuple[Array, float]:
            asked.write(f"{samples} {seed}\n")
            asked.flush()
            answer = answers.readline()
            if not answer:
                raise RuntimeError(f"{renderer} ended with {child.wait()}: {command[:2]}")
            return np.load(Path(folder) / "picture.npy"), float(answer)

        try:
            yield render
        finally:
            asked.close()
            child.wait()


def main() -> None:
    task = json.loads(sys.argv[1])
    # Answers use a separate stream, because renderers print to stdout.
    with os.fdopen(os.dup(1), "w") as answers:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        module = importlib.import_module(f"path_{task['renderer']}")
        render = module.picture(task["scene"], tuple(task["size"]), **task["settings"])
        for line in sys.stdin:
            image, seconds = render(*map(int, line.split()))
            np.save(Path(task["folder"]) / "picture.npy", image)
            print(seconds, file=answers, flush=True)


if __name__ == "__main__":
    main()
