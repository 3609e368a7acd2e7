"""Rules for the source tree: imports, boundaries, function lengths and recipes, checked without building raycam.

Python is parsed with `ast`, Rust with the tool `rust_facts`.
"""
