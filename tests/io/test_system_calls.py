"""System calls that differ on Windows and macOS.

The variants of these systems are simulated on this system.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from raycam.io import file_lock, system_calls
from raycam.io.system_calls import parent_watch, read_at, sync, write_at


@pytest.mark.parametrize("positioned", [True, False])
def test_bytes_are_read_and_written_at_an_offset(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, positioned: bool
) -> None:
    if not positioned:  # Windows has no `pread` either
        monkeypatch.delattr(os, "pread")
        monkeypatch.delattr(os, "pwrite")
    file = os.open(tmp_path / "file", os.O_RDWR | os.O_CREAT)
    try:
        assert write_at(file, b"0123456789", 0) == 10
        assert write_at(file, b"ab", 4) == 2
        assert read_at(file, 4, 3) == b"3ab6"
        assert read_at(file, 9, 8) == b"89"
    finally:
        os.close(file)


def test_windows_lock_keeps_the_file_position(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise every written file would start with a MiB of zeros."""
    places = []
    fake = SimpleNamespace(
        LK_NBLCK=2, locking=lambda file, mode, count: places.append(os.lseek(file, 0, os.SEEK_CUR))
    )
    monkeypatch.setitem(sys.modules, "fcntl", None)
    monkeypatch.setitem(sys.modules, "msvcrt", fake)
    file = os.open(tmp_path / "file", os.O_RDWR | os.O_CREAT)
    try:
        os.write(file, b"begun")
        assert file_lock.try_lock(file)
        os.write(file, b", done")
    finally:
        os.close(file)
    assert places == [file_lock.LOCKED_BYTE]
    assert (tmp_path / "file").read_bytes() == b"begun, done"


def test_windows_syncs_files_open_for_writing_and_no_folders(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_bytes(b"x")
    opened: list[int] = []
    real = os.open
    monkeypatch.setattr(
        system_calls,
        "os",
        SimpleNamespace(
            name="nt",
            path=os.path,
            O_RDWR=os.O_RDWR,
            O_RDONLY=os.O_RDONLY,
            open=lambda path, flags: opened.append(flags) or real(path, flags),
            fsync=os.fsync,
            close=os.close,
        ),
    )
    sync(tmp_path / "file")
    sync(tmp_path)
    assert opened == [os.O_RDWR]


PARENT = """
import subprocess, sys
child = subprocess.Popen([sys.executable, "-c", sys.argv[1]], stdout=subprocess.PIPE, text=True)
print(child.stdout.readline(), flush=True)
sys.stdin.readline()
"""
CHILD = """
import sys, time
from raycam.io.system_calls import parent_watch
ended = parent_watch()
print(ended(), flush=True)
while not ended():
    time.sleep(0.01)
open(sys.argv[-1], "w").close()
"""


def test_end_of_the_parent_process_is_detected(tmp_path: Path) -> None:
    seen = tmp_path / "seen"
    child = CHILD.replace("sys.argv[-1]", repr(str(seen)))
    with subprocess.Popen(
        [sys.executable, "-c", PARENT, child], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as parent:
        assert parent.stdout is not None
        assert parent.stdout.readline().strip() == "False"
        assert not seen.exists()
        parent.kill()
    while not seen.exists():  # the test runner's time limit ends a test that hangs
        time.sleep(0.01)
    assert not parent_watch()()
