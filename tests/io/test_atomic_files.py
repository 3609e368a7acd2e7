"""Files appear under their final name only when complete."""

from __future__ import annotations

import errno
import fcntl
import os
import shutil
import stat
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest
import raycam
from raycam.io.atomic_files import atomic_path, check_writable, make_folder, write
from raycam.io.file_lock import hold_lock, try_lock
from support.raises import raises, warns


def test_atomic_path_appears_when_the_block_ends(tmp_path: Path) -> None:
    target = tmp_path / "a.png"
    with atomic_path(target) as temporary:
        assert temporary.parent == tmp_path
        assert temporary.suffix == ".png"
        assert temporary.name.startswith(".a.")
        temporary.write_bytes(b"new")
        assert not target.exists()
    assert target.read_bytes() == b"new"
    assert os.listdir(tmp_path) == ["a.png"]


def test_atomic_path_after_an_error_keeps_the_old_file(tmp_path: Path) -> None:
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
def test_atomic_path_removes_files_of_dead_processes_only(tmp_path: Path, program: str, whole: bool) -> None:
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
    assert (tmp_path / "a.mp4").read_bytes() == b"half"  # the content comes from the process that wrote last
    assert sorted(os.listdir(tmp_path)) == [mine.name, "a.mp4"]


@pytest.mark.parametrize("holds_it", [True, False])
def test_write_after_losing_its_temporary_file_creates_another(
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


def test_atomic_path_without_writing_raises_file_not_found(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError), atomic_path(tmp_path / "a"):
        pass
    assert os.listdir(tmp_path) == []


def test_atomic_path_disk_errors_name_the_file(tmp_path: Path) -> None:
    import av.error

    for fault in (OSError(errno.ENOSPC, "full"), av.error.OSError(errno.ENOSPC, "full")):
        with raises(OSError, code="file_unreadable") as told, atomic_path(tmp_path / "a.mp4"):
            raise fault
        assert (told.value.errno, told.value.filename) == (errno.ENOSPC, str(tmp_path / "a.mp4"))


def test_write_syncs_file_then_renames_then_syncs_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
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
def test_write_on_a_failing_disk_keeps_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    target = tmp_path / "a"
    target.write_bytes(b"old")

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, step, full)
    with raises(OSError, code="file_unreadable", mentions=[target.name]):
        write(target, b"new")
    monkeypatch.undo()
    assert target.read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["a"]


def test_write_beyond_the_file_size_limit_keeps_the_old_file(tmp_path: Path) -> None:
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


def test_write_keeps_the_mode_of_a_replaced_file(tmp_path: Path) -> None:
    target = tmp_path / "a"
    write(target, b"old")
    target.chmod(0o640)
    write(target, b"new")
    assert target.stat().st_mode & 0o777 == 0o640


def test_check_writable_raises_for_each_obstacle(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    check_writable(tmp_path / "new.png", 1000)
    with raises(FileNotFoundError, code="file_not_found") as missing:
        check_writable(tmp_path / "nowhere" / "a.png")
    assert missing.value.filename == str(tmp_path / "nowhere" / "a.png")
    with pytest.raises(IsADirectoryError):
        check_writable(tmp_path)
    with pytest.raises(IsADirectoryError):
        check_writable("/")
    (tmp_path / "file").write_bytes(b"")
    with raises(NotADirectoryError, code="file_unreadable", mentions=[tmp_path / "file"]):
        check_writable(tmp_path / "file" / "a.png")
    with raises(OSError, code="file_unreadable", mentions=["a.png"]) as full:
        check_writable(tmp_path / "a.png", shutil.disk_usage(tmp_path).free * 2)
    assert full.value.errno == errno.ENOSPC
    monkeypatch.setattr(os, "access", lambda *_: False)
    with raises(PermissionError, code="file_unreadable", mentions=[tmp_path]):
        check_writable(tmp_path / "a.png")


def test_write_accepts_relative_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write("a", b"1")
    assert Path("a").read_bytes() == b"1"


@pytest.mark.parametrize(
    "reason", [errno.ENOSYS, errno.ENOTSUP, errno.ENOLCK, errno.EINVAL, errno.EACCES, errno.EIO]
)
def test_write_on_a_file_system_without_locks_succeeds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reason: int
) -> None:
    def refuse(*_: object) -> None:
        raise OSError(reason, os.strerror(reason))

    monkeypatch.setattr(fcntl, "flock", refuse)
    other = tmp_path / ".a.01234567.png"  # a temporary file that may belong to a running process
    other.write_bytes(b"half")
    check_writable(tmp_path / "a.png")
    write(tmp_path / "a.png", b"whole")
    assert (tmp_path / "a.png").read_bytes() == b"whole"
    assert sorted(os.listdir(tmp_path)) == [other.name, "a.png"]
    with warns(raycam.Notice, code="missing_locks"), hold_lock(tmp_path / "lock", tmp_path):
        pass


@pytest.mark.parametrize("reason", [errno.EINVAL, errno.EIO, errno.ENOTSUP])
def test_write_ignores_folders_that_cannot_be_synced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reason: int
) -> None:
    fsync = os.fsync

    def refuse_folders(descriptor: int) -> None:
        if os.path.isdir(f"/proc/self/fd/{descriptor}"):
            raise OSError(reason, os.strerror(reason))
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", refuse_folders)
    write(tmp_path / "a", b"1")
    make_folder(tmp_path / "b" / "c")
    assert (tmp_path / "a").read_bytes() == b"1"


def test_write_on_a_file_system_that_never_grants_a_lock_succeeds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))

    monkeypatch.setattr(fcntl, "flock", refuse)
    check_writable(tmp_path / "a.png")
    write(tmp_path / "a.png", b"whole")
    assert (tmp_path / "a.png").read_bytes() == b"whole"
    assert os.listdir(tmp_path) == ["a.png"]


@pytest.mark.parametrize("reason", [errno.EINVAL, errno.ENOSYS, errno.ENOTSUP])
def test_write_on_a_file_system_without_sync_succeeds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reason: int
) -> None:
    def refuse(_: int) -> None:
        raise OSError(reason, os.strerror(reason))

    monkeypatch.setattr(os, "fsync", refuse)
    check_writable(tmp_path / "a")
    write(tmp_path / "a", b"1")
    assert (tmp_path / "a").read_bytes() == b"1"


def test_check_writable_detects_a_disk_with_errors(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_: int) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    monkeypatch.setattr(os, "fsync", fail)
    with raises(OSError, code="file_unreadable", mentions=["a.png"]):
        check_writable(tmp_path / "a.png")
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("reason", [errno.EPERM, errno.ENOSYS, errno.ENOTSUP, errno.EINVAL, errno.ESTALE])
def test_write_on_a_file_system_without_rename_copies(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reason: int
) -> None:
    def refuse(*_: object) -> None:
        raise OSError(reason, os.strerror(reason))

    (tmp_path / "a").write_bytes(b"old and longer")
    monkeypatch.setattr(os, "replace", refuse)
    write(tmp_path / "a", b"new")
    assert (tmp_path / "a").read_bytes() == b"new"
    assert os.listdir(tmp_path) == ["a"]


def test_write_on_a_file_system_that_cannot_remove_files_succeeds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.EBUSY, os.strerror(errno.EBUSY))

    monkeypatch.setattr(os, "unlink", refuse)
    check_writable(tmp_path / "a")
    write(tmp_path / "a", b"new")
    assert (tmp_path / "a").read_bytes() == b"new"


def test_write_that_can_neither_rename_nor_copy_raises_the_error_of_renaming(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        (tmp_path / "a").mkdir()
        raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))

    monkeypatch.setattr(os, "replace", refuse)
    with raises(OSError, mentions=[os.strerror(errno.EINVAL)]):
        write(tmp_path / "a", b"new")


def test_write_on_a_file_system_without_modes_succeeds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a").write_bytes(b"old")
    (tmp_path / "a").chmod(0o640)

    def refuse(*_: object) -> None:
        raise OSError(errno.ENOTSUP, os.strerror(errno.ENOTSUP))

    monkeypatch.setattr(os, "chmod", refuse)
    write(tmp_path / "a", b"new")
    assert (tmp_path / "a").read_bytes() == b"new"


@pytest.mark.parametrize("usage", [(0, 0, 0), OSError(errno.ENOSYS, "Function not implemented")])
def test_write_on_a_file_system_of_unknown_size_succeeds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, usage: tuple[int, int, int] | OSError
) -> None:
    def report(_: object) -> object:
        if isinstance(usage, OSError):
            raise usage
        return shutil._ntuple_diskusage(*usage)  # type: ignore[attr-defined]

    monkeypatch.setattr(shutil, "disk_usage", report)
    check_writable(tmp_path / "a", 1 << 40)
    write(tmp_path / "a", b"1")
    assert (tmp_path / "a").read_bytes() == b"1"


def test_write_follows_symbolic_links(tmp_path: Path) -> None:
    real, links = tmp_path / "real", tmp_path / "links"
    real.mkdir()
    links.mkdir()
    (links / "first.png").symlink_to("second.png")
    (links / "second.png").symlink_to("../real/a.png")  # the link's target does not exist yet
    for data in (b"new", b"newer"):
        check_writable(links / "first.png")
        write(links / "first.png", data)
        assert (real / "a.png").read_bytes() == data
    assert (links / "first.png").is_symlink()
    assert (links / "second.png").is_symlink()
    assert (os.listdir(real), sorted(os.listdir(links))) == (["a.png"], ["first.png", "second.png"])
    (links / "round.png").symlink_to("round.png")
    with raises(OSError, code="file_unreadable", mentions=["round.png"]) as caught:
        check_writable(links / "round.png")
    assert caught.value.errno == errno.ELOOP


def test_write_to_a_pipe_writes_into_it(tmp_path: Path) -> None:
    pipe = tmp_path / "a.png"
    os.mkfifo(pipe)
    (tmp_path / "link.png").symlink_to(pipe)
    for name in ("a.png", "link.png"):
        with subprocess.Popen(["cat", str(pipe)], stdout=subprocess.PIPE) as reader:
            check_writable(tmp_path / name)
            write(tmp_path / name, b"data")
            assert reader.communicate()[0] == b"data"
    assert stat.S_ISFIFO(os.stat(pipe).st_mode)
    assert sorted(os.listdir(tmp_path)) == ["a.png", "link.png"]


def test_write_to_a_link_to_the_standard_output_keeps_the_redirection(tmp_path: Path) -> None:
    (tmp_path / "out.png").symlink_to("/dev/stdout")
    program = f"from raycam.io.atomic_files import write; write({str(tmp_path / 'out.png')!r}, b'data')"
    with open(tmp_path / "redirected", "wb") as into:
        subprocess.run([sys.executable, "-c", program], stdout=into, check=True)
    assert (tmp_path / "redirected").read_bytes() == b"data"
    piped = subprocess.run([sys.executable, "-c", program], stdout=subprocess.PIPE, check=True)
    assert piped.stdout == b"data"


@pytest.mark.parametrize("reason", [errno.EBUSY, errno.EXDEV])
def test_write_to_a_mounted_file_writes_in_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reason: int
) -> None:
    target = tmp_path / "a.png"
    target.write_bytes(b"a longer old text")
    number = target.stat().st_ino

    def busy(*_: object) -> None:
        raise OSError(reason, os.strerror(reason))

    monkeypatch.setattr(os, "replace", busy)
    write(target, b"new")
    assert target.read_bytes() == b"new"
    assert target.stat().st_ino == number
    assert os.listdir(tmp_path) == ["a.png"]


def test_write_in_a_protected_folder_writes_an_existing_file_in_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "a.png"
    target.write_bytes(b"old")
    access = os.access
    monkeypatch.setattr(
        os, "access", lambda path, mode: access(path, mode) and not (mode & os.W_OK and os.path.isdir(path))
    )
    check_writable(target)
    write(target, b"new")
    assert target.read_bytes() == b"new"
    assert os.listdir(tmp_path) == ["a.png"]
    with pytest.raises(PermissionError):
        check_writable(tmp_path / "b.png")


def test_write_protected_files_are_refused_and_kept(tmp_path: Path) -> None:
    target, link = tmp_path / "a.png", tmp_path / "link.png"
    target.write_bytes(b"old")
    target.chmod(0o444)
    link.symlink_to(target)
    for path in (target, link):
        with pytest.raises(PermissionError) as refused:
            check_writable(path)
        assert refused.value.filename == str(path)
        with pytest.raises(PermissionError):
            write(path, b"new")
    assert target.read_bytes() == b"old"


@pytest.mark.parametrize(
    "name", ["n" * 251 + ".png", "ü" * 125 + ".png", "a." + "e" * 250, "n" * 255, "." + "n" * 254]
)
def test_write_accepts_names_of_up_to_255_bytes(tmp_path: Path, name: str) -> None:
    check_writable(tmp_path / name)
    write(tmp_path / name, b"1")
    with atomic_path(tmp_path / name) as temporary:
        temporary.write_bytes(b"2")
    assert (tmp_path / name).read_bytes() == b"2"
    assert os.listdir(tmp_path) == [name]
    with raises(OSError) as caught:
        check_writable(tmp_path / (name + "x" * 12))
    assert caught.value.errno == errno.ENAMETOOLONG
