"""Rewrites README.md for the package index, which does not contain the linked files.

    GITHUB_REPOSITORY=OWNER/NAME GITHUB_SHA=COMMIT python .ci/readme_of_index.py     rewrites README.md in place

Relative links become GitHub addresses of this commit or tag.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^()\s]+)\)")
"""An image or a link in Markdown, with the groups: exclamation mark, text, target."""
FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)


def absolute(text: str, repository: str, version: str, root: Path = ROOT) -> str:
    """Returns the text, in which relative links become addresses of a version on GitHub.

    Raises `ValueError` if a target does not exist in `root`.
    """

    def target(match: re.Match[str]) -> str:
        picture, words, where = match.groups()
        if re.match(r"[a-z]+:|#", where):
            return match[0]
        path = where.partition("#")[0]
        if not (root / path).exists():
            raise ValueError(f"README.md: {where}: file not found; links are relative to README.md")
        if picture:
            return f"![{words}](https://raw.githubusercontent.com/{repository}/{version}/{where})"
        kind = "tree" if (root / path).is_dir() else "blob"
        return f"[{words}](https://github.com/{repository}/{kind}/{version}/{where})"

    parts, end = [], 0
    for code in FENCE.finditer(text):
        parts += [LINK.sub(target, text[end : code.start()]), code[0]]
        end = code.end()
    return "".join([*parts, LINK.sub(target, text[end:])])


if __name__ == "__main__":
    tag = os.environ.get("GITHUB_REF_TYPE") == "tag"
    version = os.environ["GITHUB_REF_NAME"] if tag else os.environ["GITHUB_SHA"]
    readme = ROOT / "README.md"
    text = absolute(readme.read_text(encoding="utf-8"), os.environ["GITHUB_REPOSITORY"], version)
    readme.write_text(text, encoding="utf-8")
