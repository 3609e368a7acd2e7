"""A label and a line show a helical path in 3D; a slider sets the path's number of turns."""

import numpy as np
import raycam

world = raycam.World()
world.add_object("cylinder", radius=0.3, height=2)


def helix(turns):
    angle = np.linspace(0, 2 * np.pi * turns, 200)
    return np.stack([0.6 * np.cos(angle), 0.6 * np.sin(angle), np.linspace(-1, 1, 200)], axis=1)


with raycam.view(world, port=0, browser=False, block=False) as viewer:
    path = viewer.add_lines(helix(3), color="#ff9f1a")
    viewer.add_label("start", helix(3)[0])
    turns = viewer.add_slider("turns", min=1, max=8, step=1, value=3)

    @turns.on_change
    def change(control):
        path.update(points=helix(control.value))

    viewer.wait(exit_when_closed=True)
