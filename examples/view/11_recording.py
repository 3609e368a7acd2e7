"""A checkbox records the view, and saves the recording as a page: tour.html.

The page plays the recording without a server.
"""

import raycam

world = raycam.World()
world.add_object("cone", radius=0.5, height=1)

with raycam.view(world, port=0, browser=False, block=False) as viewer:
    done = viewer.add_text("saved", "", editable=False)
    recordings = []

    @viewer.add_checkbox("record").on_change
    def record(control):
        if control.value:
            recordings.append(viewer.record(fps=20))
        else:
            recordings.pop().save("tour.html", size=(240, 160), samples=4)
            done.value = "tour.html"

    viewer.wait(exit_when_closed=True)
