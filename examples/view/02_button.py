"""A button counts its clicks in a text that only the script can change."""

import raycam

world = raycam.World()
world.add_object("sphere", radius=0.5)

with raycam.view(world, port=0, browser=False, block=False) as viewer:
    count = viewer.add_text("clicks", "0", editable=False)

    @viewer.add_button("click").on_click
    def click(control):
        count.value = str(int(count.value) + 1)

    viewer.wait(exit_when_closed=True)
