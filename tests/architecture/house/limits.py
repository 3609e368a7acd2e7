"""Ratchets: how many offences of a kind are left. A number may only fall."""

DOC_OPENINGS = {
    "bvh": 0,
    "scene": 0,
    "formats": 0,
    "calibration": 0,
    "render": 0,
    "web": 0,
    "bindings": 0,
    "python": 0,
}
COMMENT_OPENINGS = {
    "bvh": 0,
    "scene": 0,
    "formats": 0,
    "calibration": 0,
    "render": 0,
    "web": 0,
    "bindings": 0,
}
BARE_NAMES = {
    "bvh": 0,
    "scene": 0,
    "formats": 0,
    "calibration": 0,
    "render": 0,
    "web": 0,
    "bindings": 0,
    "python": 3,
}
LONG_FUNCTIONS = {
    "bvh": 0,
    "scene": 0,
    "formats": 0,
    "calibration": 0,
    "render": 0,
    "web": 0,
    "bindings": 0,
    "python": 2,
}
CIRCLES = {
    "bvh": 0,
    "scene": 0,
    "formats": 0,
    "calibration": 0,
    "render": 0,
    "web": 0,
    "bindings": 0,
    "python": 0,
}
LINES_OF_CRATES = 95_000
