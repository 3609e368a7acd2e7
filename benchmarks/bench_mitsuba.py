"""Compares radiance with Mitsuba 3 (see `radiance_agreement.py`).

`--python` names an interpreter with Mitsuba.
"""

from __future__ import annotations

from radiance_agreement import compare

if __name__ == "__main__":
    compare("mitsuba", "Mitsuba 3", __doc__, {"variant": "scalar_rgb"})
