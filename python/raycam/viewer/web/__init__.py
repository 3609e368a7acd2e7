"""Live pages, which render with raycam compiled for WebAssembly."""
