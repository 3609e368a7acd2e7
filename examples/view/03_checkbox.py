"""A checkbox hides an object; edits by viewers are kept."""

import raycam

world = raycam.World()
world.add_object(box={"size": 1}, name="box")
world.add_object("sphere", radius=0.4, location=[1, 0, 0], name="ball")

with raycam.view(world, port=0, browser=False, block=False) as viewer:
    shown = viewer.add_checkbox("show the ball", True)

    @shown.on_change
    def show(control):
        changed = viewer.world
        changed.set_object("ball", visible=control.value)
        viewer.world = changed

    viewer.wait(exit_when_closed=True)
