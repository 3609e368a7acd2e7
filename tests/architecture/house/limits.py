"""Ratchets: how many offences of a kind are left. A number may only fall."""

LONG_FUNCTIONS = {"bvh": 0, "scene": 0, "formats": 0, "render": 0, "web": 0, "bindings": 0, "python": 2}
CIRCLES = {"bvh": 0, "scene": 0, "formats": 0, "render": 0, "web": 0, "bindings": 0, "python": 0}
