"""Files: atomic writes, locks, temporary streams, GLB, and memory limits."""
