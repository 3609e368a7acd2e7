"""A job in a folder: its state, its results, and running it."""

from __future__ import annotations

import contextlib
import json
import math
import os
import shutil
from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import FormatError, JobError, Notice
from ..io import atomic_files
from ..io.file_lock import hold_lock, lock_holder
from ..notices import warn_all
from . import journal
from .description import mismatch_message, read_description
from .job_package import JobPackage
from .journal import Journal, JournalEntry
from .results import STATE, ResultStore
from .scheduler import FailedFrame, Pool, schedule
from .worker import FrameResult, FrameTask

__all__ = ["Job", "Status"]

NOT_DONE = -1
OFFSET_BITS = 44  # bits of the offset in a journal (at most 16 TiB); the bits above are the journal's index
OFFSET_MASK = (1 << OFFSET_BITS) - 1
MAX_KEPT_PACKAGE_BYTES = 1 << 20
"""The largest package that a finished job keeps, so that a later call with another world can report the differences."""
RELEASED = "package-released"
"""The file that shows that a finished job's package was removed."""

Progress = Callable[[int, int, int], object]
Shard = tuple[int, int]


@dataclass(frozen=True)
class Status:
    """The progress of a job."""

    frames: int
    """The number of frames."""
    finished: int
    """The number of finished frames."""
    failed: Mapping[int, str]
    """The errors of failed frames, by frame number."""
    damaged: Sequence[str] = ()
    """A message for each damaged line of a journal. Such lines are ignored, so the next run repeats their frames."""

    @property
    def notices(self) -> list[Notice]:
        """Notices about the damaged lines."""
        return [Notice(message, "damaged_results") for message in self.damaged]


class Job:
    """A job in a folder, new or resumed.

    `package` defines the job; None opens an existing job. A missing folder is created. If the folder contains the same
    job, finished frames are kept. With `resume=False` the job starts again, and the files of the old job are removed
    first.

    Raises `JobError` if the folder contains another job (the message lists every difference), or if it contains no job
    and no package is given, and `OSError` from the disk.
    """

    def __init__(
        self, folder: str | os.PathLike[str], package: JobPackage | None = None, *, resume: bool = True
    ) -> None:
        self.folder = Path(folder)
        """The folder of the results."""
        self._state = self.folder / STATE
        self._results = ResultStore(self.folder)
        there = read_description(self._state / "job.json")
        if package is None:
            if there is None:
                raise JobError(
                    f"{self.folder}: no job found ({STATE}/job.json is missing)", code="file_not_found"
                )
        elif there is not None and not resume:
            Job(self.folder)._remove()
            there = None
        elif there is not None and there["job"] != package.id:
            raise JobError(
                mismatch_message(self.folder, there, self._state / "package", package), code="changed_input"
            )
        self._package = package
        if package is not None:
            self._create(package)
            there = {"job": package.id, **package.describe()}
        assert there is not None
        self.description: dict[str, Any] = there
        """The contents of `job.json`: `job` (the package's id), `raycam`, `kind`, `frames`, `world`, `settings`."""
        self._journals: list[Path] = []
        self._offsets = array("q", [NOT_DONE]) * self.description["frames"]
        self._failed: dict[int, str] = {}
        self._damaged: list[tuple[Path, int]] = []
        self._read()

    # State ----------------------------------------------------------------------------------------------------

    @property
    def package(self) -> JobPackage:
        """The complete package.

        Raises `FormatError` if its file is damaged, and `JobError` if it was removed by `release_package`.
        """
        if self._package is None:
            path = self._state / "package"
            if self._is_released():
                raise JobError(
                    f"{self.folder}: the input of this job was removed when all its frames were finished; repeat the "
                    "command or the call that created the job",
                    code="missing_value",
                )
            self._package = JobPackage.from_bytes(path.read_bytes(), str(path), self.description["job"])
        return self._package

    def release_package(self) -> None:
        """Removes a large package from the folder once all frames are finished.

        A package is large if it has more than `MAX_KEPT_PACKAGE_BYTES`. The call that created the job can
        still resume the job, and writes the package again if a frame must be repeated.
        """
        path = self._state / "package"
        with contextlib.suppress(FileNotFoundError):
            if path.stat().st_size > MAX_KEPT_PACKAGE_BYTES and all(map(self.has, range(len(self._offsets)))):
                atomic_files.write(self._state / RELEASED, b"")
                path.unlink()

    def _is_released(self) -> bool:
        """True if `release_package` removed the package."""
        return (self._state / RELEASED).exists() and not (self._state / "package").exists()

    def status(self) -> Status:
        """Returns the progress known to this object; other processes may have finished more frames."""
        done = sum(place != NOT_DONE for place in self._offsets)
        damaged = tuple(
            f"{path}: the line at byte {place} is damaged and ignored; its frame is rendered again"
            for path, place in self._damaged
        )
        return Status(len(self._offsets), done, dict(sorted(self._failed.items())), damaged)

    def running_processes(self) -> list[str]:
        """Returns the processes on this machine that are running the job.

        The list is empty if no process is running the job.
        """
        who = (lock_holder(path) for path in sorted(self._state.glob("lock*")))
        return [one for one in who if one is not None]

    def has(self, frame: int) -> bool:
        """True if a frame is finished."""
        return bool(self._offsets[frame] != NOT_DONE)

    def read(self, frame: int) -> dict[str, bytes]:
        """Returns the files of a finished frame, by name.

        Raises `JobError` if a file differs from its journal entry, and `KeyError` if the frame is not finished.
        """
        return {name: self._results.read(name, stamp) for name, stamp in self._entry(frame).files.items()}

    def finished(self) -> Iterator[tuple[int, dict[str, bytes]]]:
        """Iterates over the finished frames in order, each with its files as in `read`."""
        for frame in range(len(self._offsets)):
            if self.has(frame):
                yield frame, self.read(frame)

    def verify(self) -> dict[str, str]:
        """Compares each result's hash with the journal; returns a message for each damaged file.

        A damaged file gets the ending `.damaged`, if possible. The next run repeats its frame. The package of the job
        is checked and restored in the same way, and damaged lines of journals are listed too.
        """
        self._read()
        told = zip(self._damaged, self.status().damaged, strict=True)
        wrong = {f"{STATE}/{path.name} at {place}": text for (path, place), text in told}
        package = self._state / "package"
        try:
            JobPackage.check(package.read_bytes(), str(package), self.description["job"])
        except FileNotFoundError:
            if not self._is_released():
                wrong[f"{STATE}/package"] = f"{package}: the file is missing"
        except FormatError as fault:
            wrong[f"{STATE}/package"] = str(fault)
            with contextlib.suppress(OSError):
                package.replace(f"{package}.damaged")
        made = {entry.frame: place for place, entry in self._entries() if entry and entry.error is None}
        for frame, place in sorted(made.items()):
            for name, stamp in self._entry_at(place).files.items():
                try:
                    self._results.check(name, stamp)
                except JobError as fault:
                    wrong[name] = str(fault)
                    self._results.quarantine(name)
                    self._offsets[frame] = NOT_DONE
        return wrong | self._results.check_assembled()

    def mark_assembled(self, names: Iterable[str]) -> None:
        """Records files that were assembled from all frames, for `verify`.

        `names` are the files' names relative to the folder.
        """
        with self._scratch("-join") as scratch:
            self._results.mark_assembled(names, scratch)

    # Running --------------------------------------------------------------------------------------------------

    def run(
        self,
        pool: Pool,
        *,
        frames: Iterable[int] | None = None,
        shard: Shard | None = None,
        retry_failed: bool = False,
        progress: Progress | None = None,
        finished: Callable[[FrameResult], object] | None = None,
    ) -> None:
        """Renders the unfinished frames of `frames` (default: all), in any order.

        `shard` (i, n) renders only every n-th frame, from the i-th (counted from 1): n such runs, on any machines with
        access to the folder, render all frames. Frames that failed before are skipped, unless `retry_failed`.
        `progress(done, total, failed)` counts the selected frames; `finished(result)` is called for each new frame. The
        frames' notices are issued at the end, each one once.

        Raises `JobError` if another process runs the same frames, if the workers are lost, and at the end if any
        selected frame failed; `OSError` from the disk. Finished frames are kept after any error, and if the process is
        killed.
        """
        tell = progress or (lambda *_: None)
        asked = _selected_frames(frames, shard, len(self._offsets))
        name = "" if shard is None else f"-{shard[0]}-of-{shard[1]}"
        with hold_lock(self._state / f"lock{name}", self.folder), self._scratch(name) as scratch:
            self._read()
            if retry_failed:
                self._failed.clear()
            notices: dict[Notice, None] = {}
            todo = [frame for frame in asked if not self.has(frame) and frame not in self._failed]
            failed = sum(frame in self._failed for frame in asked)
            done = len(asked) - len(todo) - failed
            path = self._state / f"journal{name}.jsonl"
            package = str((self._state / "package").resolve())
            if todo:
                if self._package is not None and self._is_released():
                    self._write_package(self._package, scratch)
                pool.open(self.package, package)
            job, count = self.description["job"], len(todo)
            tasks = (FrameTask(job, package, frame, pool.threads(count - i)) for i, frame in enumerate(todo))
            self._erase_damaged(path)
            with Journal(path) as book, contextlib.closing(schedule(pool, tasks)) as outcomes:
                if path not in self._journals:
                    self._journals.append(path)
                tell(done, len(asked), failed)
                for outcome in outcomes:
                    if isinstance(outcome, FailedFrame):
                        self._mark_failed(outcome, book, scratch)
                        failed += 1
                    else:
                        stamps = self._results.store(outcome.files, scratch)
                        place = book.add(JournalEntry(outcome.frame, stamps, seconds=outcome.seconds))
                        self._offsets[outcome.frame] = self._journals.index(path) << OFFSET_BITS | place
                        done += 1
                        notices.update(dict.fromkeys(outcome.notices))
                        if finished is not None:
                            finished(outcome)
                    tell(done, len(asked), failed)
                    del outcome  # frees the files while the next frame is rendered
        warn_all(notices)
        self._check(asked)

    @contextlib.contextmanager
    def assembling(self) -> Iterator[bool]:
        """Returns a context for assembling a file from all frames.

        On entry, the job reads the progress of all shards. If several shards end at the same time, one shard
        enters and the other shards wait. Yields False if another shard has assembled the file and removed the
        job, and otherwise True.
        """
        with contextlib.ExitStack() as held:
            with contextlib.suppress(FileNotFoundError):
                held.enter_context(hold_lock(self._state / "lock-join", self.folder, patience=math.inf))
            there = (self._state / "job.json").exists()
            if there:
                self._read()
            yield there
        if not (self._state / "job.json").exists():
            self._remove_locks()

    def remove(self) -> None:
        """Removes all files of the job, and the folder if nothing else is in it."""
        with hold_lock(self._state / "lock", self.folder):
            self._remove()
        self._remove_locks()
        with contextlib.suppress(OSError):
            self.folder.rmdir()

    # Internals ------------------------------------------------------------------------------------------------

    def _create(self, package: JobPackage) -> None:
        """Writes the missing files of the job.

        `job.json` is written last, so the file exists only next to a complete package.
        """
        path, description = self._state / "package", self._state / "job.json"
        # This folder exists while a process creates the job, or after the process was killed.
        begun = self._state / "scratch-begin"
        whole = package.exists_in(path) or self._is_released()
        if description.exists() and whole and not begun.exists():
            return
        self._state.mkdir(parents=True, exist_ok=True)
        # Many shards may start at the same time: one writes, the others wait.
        with (
            hold_lock(self._state / "lock-begin", self.folder, patience=60),
            self._scratch("-begin") as scratch,
        ):
            there = read_description(description)
            if there is not None and there["job"] != package.id:
                raise JobError(
                    mismatch_message(self.folder, there, self._state / "package", package),
                    code="changed_input",
                )
            if not package.exists_in(path) and not (there is not None and self._is_released()):
                if there is None:  # journals of an earlier job in this folder are not used
                    for book in self._state.glob("journal*.jsonl"):
                        book.unlink()
                self._write_package(package, scratch)
            if there is None:
                text = json.dumps({"job": package.id, **package.describe()}, indent=2) + "\n"
                atomic_files.write(description, text.encode(), scratch)
                atomic_files.sync_folder(self.folder)

    def _write_package(self, package: JobPackage, scratch: Path) -> None:
        """Removes the file `RELEASED` if it exists, and then writes the package.

        Without the file `RELEASED`, a missing package counts as a fault.
        """
        (self._state / RELEASED).unlink(missing_ok=True)
        atomic_files.write(self._state / "package", package.to_file(), scratch)

    def _read(self) -> None:
        """Reads the journals; an entry counts only if its files exist."""
        self._journals = sorted(self._state.glob("journal*.jsonl"))
        for index in range(len(self._offsets)):
            self._offsets[index] = NOT_DONE
        self._failed.clear()
        self._damaged.clear()
        for place, entry in self._entries():
            if entry is None:
                self._damaged.append((self._journals[place >> OFFSET_BITS], place & OFFSET_MASK))
            elif entry.error is not None:
                self._failed[entry.frame] = entry.error
            elif all(self._results.has(name, size) for name, (size, _) in entry.files.items()):
                self._offsets[entry.frame] = place
        self._failed = {frame: error for frame, error in self._failed.items() if not self.has(frame)}

    def _erase_damaged(self, own: Path) -> None:
        """Erases the damaged lines of the journal `own`, and of journals without a writing process."""
        for path, place in self._damaged:
            with contextlib.ExitStack() as held, contextlib.suppress(JobError):
                if path != own:
                    lock = path.with_name(path.stem.replace("journal", "lock"))
                    held.enter_context(hold_lock(lock, self.folder, patience=0.0))
                journal.erase_line(path, place)

    def _entries(self) -> Iterator[tuple[int, JournalEntry | None]]:
        """Yields the entries of the journals with their positions, oldest first.

        The entry of a damaged line is None.
        """
        for number, path in enumerate(self._journals):
            for place, entry in journal.read(path):
                if entry is not None and not 0 <= entry.frame < len(self._offsets):
                    raise JobError(
                        f"{path}: the entry at byte {place} names frame {entry.frame}, but the job has the frames 0 to "
                        f"{len(self._offsets) - 1}; remove this file, and run the job again",
                        code="damaged_job",
                    )
                yield number << OFFSET_BITS | place, entry

    def _entry(self, frame: int) -> JournalEntry:
        place = self._offsets[frame]
        if place == NOT_DONE:
            raise KeyError(frame)
        return self._entry_at(place)

    def _entry_at(self, place: int) -> JournalEntry:
        return journal.read_entry(self._journals[place >> OFFSET_BITS], place & OFFSET_MASK)

    def _mark_failed(self, failed: FailedFrame, book: Journal, scratch: Path) -> None:
        path = self.log(failed.frame)
        if not path.parent.is_dir():
            atomic_files.make_folder(path.parent)
        atomic_files.write(path, f"frame {failed.frame}: {failed.error}\n\n{failed.log}".encode(), scratch)
        book.add(JournalEntry(failed.frame, error=failed.error))
        self._failed[failed.frame] = failed.error

    def log(self, frame: int) -> Path:
        """The path of a failed frame's log."""
        return self._state / "failed" / f"frame_{frame:04}.log"

    def _check(self, asked: Iterable[int]) -> None:
        wanted = set(asked)
        failed = [frame for frame in sorted(self._failed) if frame in wanted]
        if failed:
            first = failed[0]
            many = (
                f"frame {first} failed"
                if len(failed) == 1
                else f"{len(failed)} frames failed, first: frame {first}"
            )
            raise JobError(
                f"{self.folder}: {many}: {self._failed[first]} (log: {self.log(first)}); all other "
                "frames are finished; retry_failed=True retries failed frames",
                code="failed_frames",
            )

    @contextlib.contextmanager
    def _scratch(self, name: str) -> Iterator[Path]:
        """Context with an empty folder for temporary files; leftovers of a killed run are removed."""
        path = self._state / f"scratch{name}"
        shutil.rmtree(path, ignore_errors=True)
        path.mkdir(exist_ok=True)
        yield path
        shutil.rmtree(path, ignore_errors=True)

    def _remove(self) -> None:
        """Removes the results, then the state.

        If the process is killed in between, a job with fewer finished frames remains.
        """
        done = (frame for frame in range(len(self._offsets)) if self.has(frame))
        self._results.remove(name for frame in done for name in self._entry(frame).files)
        with contextlib.suppress(JobError):
            self._results.remove(name for name in self._results.assembled() if not name.startswith(".."))
        (self._state / "job.json").unlink(missing_ok=True)
        if os.name != "nt":
            shutil.rmtree(self._state)
            return
        for path in self._state.iterdir():  # Windows cannot remove a lock that is open
            if path.is_dir():
                shutil.rmtree(path)
            elif not path.name.startswith("lock"):
                path.unlink()

    def _remove_locks(self) -> None:
        """Removes the closed locks of a removed job, and its folders if nothing else is in them.

        On systems other than Windows, this method does nothing.
        """
        if os.name != "nt":
            return
        # Another process may still hold a lock; the last process removes the files.
        with contextlib.suppress(OSError):
            for path in self._state.glob("lock*"):
                path.unlink()
            self._state.rmdir()
            self.folder.rmdir()


def _selected_frames(frames: Iterable[int] | None, shard: Shard | None, count: int) -> list[int]:
    """The frame numbers of a run."""
    asked = sorted(set(range(count) if frames is None else frames))
    if asked and not (asked[0] >= 0 and asked[-1] < count):
        raise JobError(
            f"frames {asked[0]} to {asked[-1]} are outside the job's frames 0 to {count - 1}",
            code="index_out_of_range",
        )
    if shard is not None:
        i, n = shard
        if not 1 <= i <= n:
            raise JobError(f"shard {i}/{n}: expected I/N with I from 1 to N", code="out_of_range")
        asked = [frame for frame in asked if frame % n == i - 1]
    return asked
