"""Ratchets: how many offences of a kind are left. A number may only fall."""

DOC_OPENINGS = {"bvh": 128, "scene": 196, "formats": 176, "render": 436, "bindings": 24, "python": 13}
COMMENT_OPENINGS = {"bvh": 20, "scene": 4, "formats": 20, "render": 24, "bindings": 0}
BARE_NAMES = {"bvh": 36, "scene": 19, "formats": 34, "render": 55, "bindings": 5, "python": 9}
LONG_FUNCTIONS = {"bvh": 3, "scene": 4, "formats": 21, "render": 3, "bindings": 0, "python": 3}
CIRCLES = {"bvh": 5, "scene": 3, "formats": 5, "render": 4, "bindings": 1, "python": 0}
LINES_OF_CRATES = 74_216
