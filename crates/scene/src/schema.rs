//! What people write: world files and Python dicts, unknown keys denied.
