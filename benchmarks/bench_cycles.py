"""Are pictures the same as those of Cycles? See `same_pictures.py`; `--python` is a Python that has `bpy`."""

from __future__ import annotations

from same_pictures import compare

if __name__ == "__main__":
    compare("cycles", "Cycles", __doc__, {})
