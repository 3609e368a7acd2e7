"""A slider turns a box."""

import raycam

world = raycam.World()
world.add_object(box={"size": 1}, name="box", color="#d7263d")

with raycam.view(world, port=0, browser=False, block=False) as viewer:
    angle = viewer.add_slider("angle", min=-180, max=180, step=1, value=0)

    @angle.on_change
    def turn(control):
        turned = viewer.world
        turned.set_object("box", yaw=control.value)
        viewer.world = turned

    viewer.wait(exit_when_closed=True)
