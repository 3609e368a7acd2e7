"""Pictures of pyrender's scenes: exact rays of raycam, shaded as pyrender's default program does."""
