"""A click on the image shows the name and distance of the clicked object."""

import raycam

world = raycam.World()
world.add_object(box={"size": 1}, name="box")
world.add_object(plane={"size": [6, 6]}, location=[0, 0, -0.5], name="floor")

with raycam.view(world, port=0, browser=False, block=False) as viewer:
    picked = viewer.add_text("picked", "click an object", editable=False)

    @viewer.on_pick
    def name(pixel):
        number = int(pixel["instance"])
        picked.value = "nothing" if number < 0 else f"{world.objects[number].name}, {pixel['distance']:.3f} m"

    viewer.wait(exit_when_closed=True)
