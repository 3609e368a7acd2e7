"""Tests full, read-only and write-protected disks during a video.

Requires root on Linux, because the script mounts its own disks. In each case, the command must report the
cause with exit status 1 and keep complete frames. After the repair, the same command must finish with the
bytes of an undisturbed run.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

import report
from support.cluster_faults import WORLD
from support.job_frames import check_intact, results

FRAMES = 40
# The super-user ignores file permissions, so the process gives up this capability.
HELD_TO_PERMISSIONS = ["setpriv", "--bounding-set=-dac_override", "--inh-caps=-dac_override"]


def start(folder: Path, name: str, before: list[str] | None = None) -> subprocess.Popen[str]:
    command = [*(before or []), sys.executable, "-m", "raycam", "video", str(folder / "box.toml"), "-o"]
    command += [str(folder / name), "--samples", "4"]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def trouble(
    disk: Path,
    folder: Path,
    whole: dict[str, bytes],
    run: subprocess.Popen[str],
    cause: Callable[[], object],
    repair: Callable[[], object],
) -> tuple[int, str]:
    """Causes a fault during a run, repairs it, and checks that the same command finishes.

    Returns the number of frames that were complete after the failed run, and the last line of the run's
    output.
    """
    while len(list(disk.glob("*.png"))) < 5 and run.poll() is None:
        time.sleep(0.005)
    cause()
    _, said = run.communicate(timeout=120)
    assert run.returncode == 1, (run.returncode, said)
    assert "Traceback" not in said, said
    finished = check_intact(disk, whole)
    assert finished < FRAMES
    repair()
    again = start(folder, f"{disk.relative_to(folder)}")
    _, error = again.communicate(timeout=300)
    assert again.returncode == 0, error
    assert results(disk) == whole
    return finished, said.strip().splitlines()[-1].replace(str(folder), "")


@contextmanager
def mounted(path: Path, size: str) -> Iterator[Path]:
    path.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", path], check=True)
    try:
        yield path
    finally:
        subprocess.run(["umount", "-l", path], check=True)


def remount(path: Path, option: str) -> None:
    subprocess.run(["mount", "-o", f"remount,{option}", path], check=True)


def full(folder: Path, whole: dict[str, bytes]) -> tuple[int, str]:
    """Tests a disk that is too small for all frames."""
    pages = sum(-(-len(data) // 4096) for data in whole.values())
    with mounted(folder / "full", f"{4 * (pages // 2 + 16)}k") as disk:
        run = start(folder, "full/frames")
        return trouble(disk / "frames", folder, whole, run, lambda: None, lambda: remount(disk, "size=64m"))


def filled(folder: Path, whole: dict[str, bytes]) -> tuple[int, str]:
    """Tests a disk that another program fills during the run."""
    with mounted(folder / "filled", "8m") as disk:
        other = disk / "other"

        def fill() -> None:
            with other.open("wb", buffering=0) as file:
                try:
                    while True:
                        file.write(bytes(4096))
                except OSError:
                    pass

        run = start(folder, "filled/frames")
        return trouble(disk / "frames", folder, whole, run, fill, other.unlink)


def read_only(folder: Path, whole: dict[str, bytes]) -> tuple[int, str]:
    """Tests a run that is stopped and resumed on a disk that has become read-only."""
    with mounted(folder / "read-only", "64m") as disk:
        first = start(folder, "read-only/frames")
        while len(list((disk / "frames").glob("*.png"))) < 5:
            time.sleep(0.005)
        first.kill()
        first.communicate()
        remount(disk, "ro")
        run = start(folder, "read-only/frames")
        return trouble(disk / "frames", folder, whole, run, lambda: None, lambda: remount(disk, "rw"))


def forbidden(folder: Path, whole: dict[str, bytes]) -> tuple[int, str]:
    """Tests a folder whose write permission is removed during the run."""
    disk = folder / "forbidden"
    run = start(folder, "forbidden", HELD_TO_PERMISSIONS)
    return trouble(disk, folder, whole, run, lambda: disk.chmod(0o555), lambda: disk.chmod(0o755))


def main() -> None:
    argparse.ArgumentParser(description=__doc__).parse_args()
    if os.geteuid() != 0:
        sys.exit("only root may mount a disk")
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "box.toml").write_text(WORLD.format(fps=FRAMES))
        clean = start(folder, "one")
        assert clean.wait() == 0
        whole = results(folder / "one")
        for what, fault in (
            ("a disk with space for half of the frames", full),
            ("a disk that another program fills during the job", filled),
            ("a disk that is read-only when the job is resumed", read_only),
            ("write permission that is removed during the job", forbidden),
        ):
            finished, said = fault(folder, whole)
            rows.append([what, f"{finished} of {FRAMES}, whole", f"`{said}`"])
            print(rows[-1], file=sys.stderr)
    notes = [
        "The exit status is always 1. After the repair, the same command resumes: 0 bytes differ from an "
        "undisturbed run."
    ]
    report.write(
        "faults", "Faults of disks", notes, ["what", "finished frames", "what the command prints"], rows
    )


if __name__ == "__main__":
    main()
