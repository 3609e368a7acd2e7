"""A final name means a complete file."""

from __future__ import annotations

import errno
import os
import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest
from raycam.io.atomic_files import atomic_path, check_writable, write
from raycam.io.file_lock import try_lock


def test_the_file_appears_when_the_block_ends(tmp_path: Path) -> None:
    target = tmp_path / "a.png"
    with atomic_path(target) as temporary:
        assert temporary.parent == tmp_path
        assert temporary.suffix == ".png"
        assert temporary.name.startswith(".a.")
        temporary.write_bytes(b"new")
        assert not target.exists()
    assert target.read_bytes() == b"new"
    assert os.listdir(tmp_path) == ["a.png"]


def test_an_error_leaves_nothing_and_keeps_what_was_there(tmp_path: Path) -> None:
    target = tmp_path / "a.png"
    write(target, b"old")

    def write_half(fault: type[BaseException]) -> None:
        with atomic_path(target) as temporary:
            temporary.write_bytes(b"half")
            raise fault

    for fault in (ValueError, KeyboardInterrupt):
        with pytest.raises(fault):
            write_half(fault)
    assert target.read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["a.png"]


IN_PIECES = """
import sys
from raycam.io.atomic_files import atomic_path
with atomic_path({path!r}) as temporary:
    temporary.write_bytes(b"half")
    print(temporary, flush=True)
    sys.stdin.read()
"""
AT_ONCE = """
import os, sys
from raycam.io.atomic_files import write
sync = os.fsync
def wait(file):
    os.fsync = sync
    print(os.readlink(f"/proc/self/fd/{{file}}"), flush=True)
    sys.stdin.read()
os.fsync = wait
write({path!r}, b"half")
"""


@pytest.mark.parametrize(("program", "whole"), [(IN_PIECES, False), (IN_PIECES, True), (AT_ONCE, True)])
def test_what_a_killed_process_has_left_is_removed_and_what_a_living_one_writes_is_not(
    tmp_path: Path, program: str, whole: bool
) -> None:
    program = program.format(path=str(tmp_path / "a.mp4"))
    mine = tmp_path / ".a.0123.mp4"
    mine.write_bytes(b"")
    start = partial(
        subprocess.Popen,
        [sys.executable, "-c", program],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    with start() as living, start() as dead:
        assert living.stdout is not None
        assert dead.stdout is not None
        left, kept = dead.stdout.readline().strip(), living.stdout.readline().strip()
        dead.kill()
        dead.wait()
        assert {str(path) for path in tmp_path.iterdir()} == {left, kept, str(mine)}
        if whole:
            write(tmp_path / "a.mp4", b"whole")
        else:
            with atomic_path(tmp_path / "a.mp4") as temporary:
                temporary.write_bytes(b"whole")
        assert {path.name for path in tmp_path.iterdir()} == {"a.mp4", Path(kept).name, mine.name}
        living.communicate("")
    assert (tmp_path / "a.mp4").read_bytes() == b"half"  # the last one to write
    assert sorted(os.listdir(tmp_path)) == [mine.name, "a.mp4"]


@pytest.mark.parametrize("holds_it", [True, False])
def test_a_temporary_file_that_another_process_takes_for_stale_is_made_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, holds_it: bool
) -> None:
    opened = os.open
    others: list[int] = []

    def open_and_lose(path: str, flags: int, *mode: int) -> int:
        file = opened(path, flags, *mode)
        if flags & os.O_EXCL and not others:
            others.append(opened(path, os.O_RDWR))
            assert try_lock(others[0])
            os.unlink(path)
            if not holds_it:
                os.close(others[0])
        return file

    monkeypatch.setattr(os, "open", open_and_lose)
    write(tmp_path / "a.mp4", b"whole")
    assert len(others) == 1
    assert (tmp_path / "a.mp4").read_bytes() == b"whole"
    assert os.listdir(tmp_path) == ["a.mp4"]
    if holds_it:
        os.close(others[0])


def test_a_block_that_writes_nothing_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError), atomic_path(tmp_path / "a"):
        pass
    assert os.listdir(tmp_path) == []


def test_errors_of_the_disk_are_of_the_file_whoever_meets_them(tmp_path: Path) -> None:
    import av.error

    for fault in (OSError(errno.ENOSPC, "full"), av.error.OSError(errno.ENOSPC, "full")):
        with pytest.raises(OSError, match="full") as told, atomic_path(tmp_path / "a.mp4"):
            raise fault
        assert (told.value.errno, told.value.filename) == (errno.ENOSPC, str(tmp_path / "a.mp4"))


def test_file_and_folder_are_synced_in_order(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target, steps = tmp_path / "a", []
    fsync, replace = os.fsync, os.replace

    def watched_fsync(descriptor: int) -> None:
        steps.append("folder" if os.path.isdir(f"/proc/self/fd/{descriptor}") else "file")
        fsync(descriptor)

    def watched_replace(source: object, destination: object) -> None:
        steps.append("rename")
        replace(source, destination)  # type: ignore[arg-type]

    monkeypatch.setattr(os, "fsync", watched_fsync)
    monkeypatch.setattr(os, "replace", watched_replace)
    write(target, b"x")
    assert steps == ["file", "rename", "folder"]


@pytest.mark.parametrize("step", ["fsync", "replace"])
def test_a_disk_that_fails_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    target = tmp_path / "a"
    target.write_bytes(b"old")

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, step, full)
    with pytest.raises(OSError, match="No space left"):
        write(target, b"new")
    monkeypatch.undo()
    assert target.read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["a"]


def test_a_write_that_hits_a_real_limit_leaves_the_old_file(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"old")
    program = """
import resource, sys
from raycam.io.atomic_files import write
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
try:
    write("a", bytes(100_000))
except OSError as error:
    sys.exit(f"stopped: {error.strerror}")
"""
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True)
    assert "stopped: File too large" in done.stderr
    assert (tmp_path / "a").read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["a"]


def test_the_mode_of_a_replaced_file_stays(tmp_path: Path) -> None:
    target = tmp_path / "a"
    write(target, b"old")
    target.chmod(0o640)
    write(target, b"new")
    assert target.stat().st_mode & 0o777 == 0o640


def test_check_writable_says_what_is_wrong(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    check_writable(tmp_path / "new.png", 1000)
    with pytest.raises(FileNotFoundError, match="no folder") as missing:
        check_writable(tmp_path / "nowhere" / "a.png")
    assert missing.value.filename == str(tmp_path / "nowhere" / "a.png")
    with pytest.raises(IsADirectoryError):
        check_writable(tmp_path)
    with pytest.raises(IsADirectoryError):
        check_writable("/")
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(NotADirectoryError, match="is a file, not a folder"):
        check_writable(tmp_path / "file" / "a.png")
    with pytest.raises(OSError, match="bytes free") as full:
        check_writable(tmp_path / "a.png", shutil.disk_usage(tmp_path).free * 2)
    assert full.value.errno == errno.ENOSPC
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(PermissionError, match="may not be written"):
        check_writable(tmp_path / "a.png")


def test_relative_names_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write("a", b"1")
    assert Path("a").read_bytes() == b"1"
