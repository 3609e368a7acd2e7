"""Stand-ins for other libraries: their names and arguments, over the public interface of raycam."""
