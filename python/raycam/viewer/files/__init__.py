"""Files of a live view: dropped files, snapshots and videos."""
