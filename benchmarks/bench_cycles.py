"""Are pictures the same as those of Cycles? See `radiance_agreement.py`; `--python` is a Python that has `bpy`."""

from __future__ import annotations

from radiance_agreement import compare

if __name__ == "__main__":
    compare("cycles", "Cycles", __doc__, {})
