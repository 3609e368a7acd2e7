"""Are pictures the same as Mitsuba 3's? See `same_pictures.py`; `--python` is a Python that has Mitsuba."""

from __future__ import annotations

from same_pictures import compare

if __name__ == "__main__":
    compare("mitsuba", "Mitsuba 3", __doc__, {"variant": "scalar_rgb"})
