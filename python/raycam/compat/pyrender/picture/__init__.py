"""Images of pyrender's scenes: exact rays of raycam, shaded like pyrender's default shader."""
