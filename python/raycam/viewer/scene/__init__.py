"""The world as it is seen: how one moves in it, what is changed in it, and the lines over it."""
