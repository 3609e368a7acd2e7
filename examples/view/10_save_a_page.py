"""A button saves the current view as a page with all ground truth: shot.html.

The page works offline.
"""

import raycam

world = raycam.World()
world.add_object("sphere", radius=0.5, name="ball")

with raycam.view(world, port=0, browser=False, block=False) as viewer:
    done = viewer.add_text("saved", "", editable=False)

    @viewer.add_button("save the page").on_click
    def save(control):
        viewer.screenshot((96, 64), samples=16, channels="all").save("shot.html", world=viewer.world)
        done.value = "shot.html"

    viewer.wait(exit_when_closed=True)
