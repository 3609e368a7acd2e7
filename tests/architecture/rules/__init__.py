"""Rules for the source tree: imports, boundaries, function lengths and recipes.

The rules are checked without building raycam. Python is parsed with `ast`, Rust with the tool `rust_facts`.
"""
