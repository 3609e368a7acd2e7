"""Are pictures the same as Mitsuba 3's? See `radiance_agreement.py`; `--python` is a Python that has Mitsuba."""

from __future__ import annotations

from radiance_agreement import compare

if __name__ == "__main__":
    compare("mitsuba", "Mitsuba 3", __doc__, {"variant": "scalar_rgb"})
