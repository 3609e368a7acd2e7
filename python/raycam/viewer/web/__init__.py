"""Pages that render by themselves, by raycam compiled for WebAssembly."""
