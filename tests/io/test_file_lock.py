"""Locks on folders."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

from raycam.errors import JobError
from raycam.io.file_lock import hold_lock, lock_holder
from support.raises import raises

PROGRAM = """
import sys, pathlib
from raycam.io.file_lock import hold_lock
with hold_lock(pathlib.Path(sys.argv[1]), pathlib.Path("there")):
    print("held", flush=True)
    sys.stdin.read()
"""


def test_hold_lock_admits_one_process_until_it_ends(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    assert lock_holder(path) is None
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"held\n"
        who = lock_holder(path)
        assert who is not None
        assert f"process {process.pid} on" in who
        with (
            raises(JobError, code="folder_in_use", mentions=["there", process.pid]),
            hold_lock(path, Path("there")),
        ):
            pass
        os.kill(process.pid, signal.SIGKILL)
    assert lock_holder(path) is None
    for _ in range(2):
        with hold_lock(path, tmp_path):
            assert lock_holder(path) is not None
