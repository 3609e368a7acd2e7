//! Subdivision of coarse meshes: Loop (1987) with sharp boundaries, and midpoint.
