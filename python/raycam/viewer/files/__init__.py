"""Files of a live view: those that are dropped on it, and films that it gives."""
