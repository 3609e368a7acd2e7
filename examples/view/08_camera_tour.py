"""Buttons move the camera of all clients to the sides of the world."""

import raycam

world = raycam.World()
world.add_object("cone", radius=0.5, height=1)

with raycam.view(world, port=0, browser=False, block=False) as viewer:
    tour = viewer.add_folder("tour")

    def go(control):
        viewer.camera = world.view_from(control.label, size=(480, 320))

    for side in ("front", "right", "top"):
        tour.add_button(side).on_click(go)

    viewer.wait(exit_when_closed=True)
