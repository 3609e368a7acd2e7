"""The folder of pages for a browser.

Browsers that are installed as snap packages cannot read the folder of temporary files.
"""

from __future__ import annotations

from pathlib import Path

__all__ = ["browser_folder"]

SNAP_COMMANDS = Path("/snap/bin")
BROWSERS = ("firefox", "chromium", "brave", "opera")
NAME = "raycam-pages"


def browser_folder() -> Path | None:
    """Returns `raycam-pages` in the home folder if a browser is a snap package, otherwise None.

    Only the user can read this folder. Snap packages have a private `/tmp` and cannot read hidden folders. None means
    the system's folder of temporary files. The result is also None if the folder cannot be created.
    """
    if not any((SNAP_COMMANDS / name).exists() for name in BROWSERS):
        return None
    folder = Path.home() / NAME
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
    except OSError:
        return None
    return folder
