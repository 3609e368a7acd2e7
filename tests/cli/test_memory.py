"""The process of the live view returns freed memory to the system."""

import subprocess
import sys

PROGRAM = """
import ctypes, sys
from raycam.io.system_calls import give_memory_back

class Counts(ctypes.Structure):
    _fields_ = [(name, ctypes.c_size_t) for name in "arena ordblks smblks hblks hblkhd".split()]
    _fields_ += [(f"rest{number}", ctypes.c_size_t) for number in range(5)]

library = ctypes.CDLL(None)
asked = give_memory_back() if "with" in sys.argv else False
bytearray(24 << 20)  # freed at once, which raises the bound of blocks that are mapped
before = library.mallinfo2
before.restype = Counts
mapped = before().hblkhd
kept = bytearray(16 << 20)
print(int(asked), int(before().hblkhd - mapped >= 16 << 20))
"""


def mapped(*arguments: str) -> str:
    found = subprocess.run(
        [sys.executable, "-c", PROGRAM, *arguments], capture_output=True, text=True, check=True
    )
    return found.stdout.strip()


def test_large_blocks_are_mapped_even_after_larger_blocks_were_freed() -> None:
    assert mapped("with") == "1 1"
    assert mapped() == "0 0"  # by default glibc takes the second block from the heap and keeps it
