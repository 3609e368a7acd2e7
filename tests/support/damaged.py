"""Damaged copies of files: flipped bits, removed and repeated parts, and unusual numbers."""

from __future__ import annotations

import random
from collections.abc import Iterator

NUMBERS = [
    b"1e308",
    b"-1",
    b"nan",
    b"4000000000",
    b"9" * 400,
    b"1e-320",
    b"null",
    b"0x10",
    b"1_0",
    b"\xd9\xa1",
]
PARTS = [
    b"",
    b"[" * 3000,
    b"{" * 3000,
    b'{"a":' * 3000,
    b"<px>" * 3000,
    b"\0",
    b"\xff\xfe",
    b"- ",
    b",",
    b"\n",
    b'"',
]


def damaged(data: bytes, count: int, seed: int) -> Iterator[bytes]:
    """Yields damaged copies: flipped bits, removed or repeated parts, and unusual numbers or fragments."""
    draw = random.Random(seed)
    for _ in range(count):
        found = bytearray(data)
        for _ in range(draw.choice([1, 1, 2, 8])):
            at = draw.randrange(len(found) + 1)
            end = min(len(found), at + draw.choice([1, 2, 5, 20, 200]))
            kind = draw.randrange(6)
            if kind == 0 and found:
                found[min(at, len(found) - 1)] ^= 1 << draw.randrange(8)
            elif kind == 1:
                del found[at:]
            elif kind == 2:
                found[at:at] = found[at:end] * draw.choice([1, 3, 50])
            elif kind == 3:
                del found[at:end]
            elif kind == 4:
                found[at:end] = draw.choice(PARTS)
            else:
                digits = [i for i, byte in enumerate(found) if 48 <= byte <= 57]
                first = draw.choice(digits) if digits else at
                last = first
                while last < len(found) and chr(found[last]) in "0123456789.eE+-":
                    last += 1
                found[first:last] = draw.choice(NUMBERS)
        yield bytes(found)
