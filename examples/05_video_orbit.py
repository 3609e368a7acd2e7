"""A video: a camera that orbits a world once in two seconds, and a ball that moves by keyframes meanwhile.

Writes orbit.mp4.
"""
