"""Writes the corpora for fuzzing to fuzz/corpus/TARGET/.

The seeds are files of the tests, and files that examples/seeds.rs writes with raycam.
"""

from __future__ import annotations

import hashlib
import subprocess
from collections.abc import Callable
from pathlib import Path

FUZZ = Path(__file__).resolve().parent
DATA = FUZZ.parent / "crates" / "formats" / "tests" / "data"
MAX_SEED_BYTES = 1 << 16


def add(target: str, data: bytes) -> None:
    """Writes one seed, named after its content."""
    folder = FUZZ / "corpus" / target
    folder.mkdir(parents=True, exist_ok=True)
    if len(data) <= MAX_SEED_BYTES:
        (folder / hashlib.sha1(data).hexdigest()).write_bytes(data)


def records(path: Path, lengths: Callable[[list[str]], tuple[int, int]]) -> list[tuple[list[str], bytes]]:
    """Reads a file of cases: a line of words, the bytes whose size it gives, and expected bytes, which are skipped."""
    data = path.read_bytes()
    found = []
    while data:
        line, _, data = data.partition(b"\n")
        words = line.decode().split(" ")
        length, skip = lengths(words)
        found.append((words, data[:length]))
        data = data[length + skip :]
    return found


def image_lengths(words: list[str]) -> tuple[int, int]:
    """Returns the bytes of the file and of the texels that follow it."""
    _name, columns, rows, kind, length = words
    return int(length), 4 * int(columns) * int(rows) * {"u8": 1, "u16": 2, "f32": 4}[kind]


def meshopt_lengths(words: list[str]) -> tuple[int, int]:
    """Returns the bytes of the file and of the count times stride bytes that follow it."""
    return int(words[5]), int(words[3]) * int(words[4])


def draco_lengths(words: list[str]) -> tuple[int, int]:
    """Returns the bytes of the file and of the triangles and point attributes that follow it."""
    sizes = {"F32": 4, "U16": 2, "U8": 1, "I8": 1}
    attributes = [word.split(",") for word in words[4:]]
    bytes_per_point = sum(sizes[kind] * int(components) for _id, kind, components in attributes)
    return int(words[1]), 12 * int(words[2]) + int(words[3]) * bytes_per_point


def main() -> None:
    """Writes every corpus."""
    for path in DATA.rglob("*"):
        target = {".jpg": "jpeg"}.get(path.suffix, path.suffix[1:])
        if target in {"obj", "mtl", "ply", "stl", "off", "png", "jpeg", "exr"}:
            add(target, path.read_bytes())
    for words, data in records(DATA / "images.cases", image_lengths):
        add({"jpg": "jpeg"}.get(suffix := words[0].rpartition(".")[2], suffix), data)
    for _words, data in records(DATA / "draco" / "draco.cases", draco_lengths):
        add("draco", data)
    modes = ["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR", "TRIANGLES", "INDICES"]
    for words, data in records(DATA / "meshopt" / "meshopt.cases", meshopt_lengths):
        _name, mode, kind, count, stride, _length = words
        kind = kind if mode == "ATTRIBUTES" else mode
        head = bytes([modes.index(kind), int(stride) - 1, *int(count).to_bytes(2, "little")])
        add("meshopt", head + data)
    for path in [*FUZZ.parent.glob("examples/**/*.toml"), *FUZZ.parent.glob("docs/**/*.toml")]:
        add("world", path.read_bytes())
    for text in (FUZZ.parent / "docs" / "guide.md").read_text(encoding="utf-8").split("```toml\n")[1:]:
        add("world", text.partition("```")[0].encode())
    written = ["cargo", "run", "--release", "--manifest-path", str(FUZZ / "Cargo.toml"), "--example", "seeds"]
    subprocess.run(written, check=True)


if __name__ == "__main__":
    main()
