//! What Python holds: raycam._core.
