"""A plot shows how the noise of an image decreases with the number of samples."""

import numpy as np
import raycam

world = raycam.World()
world.add_object("sphere", radius=0.5)
world.add_object(plane={"size": [6, 6]}, location=[0, 0, -0.5])
world.add_light("sun", direction=[1, 2, -3], irradiance=3)
camera = world.view_from("iso", size=(48, 32))

with raycam.view(world, port=0, browser=False, block=False) as viewer:
    plot = viewer.add_plot("error over log2(samples)", [0, 1], [0.0, 0.0])

    @viewer.add_button("measure").on_click
    def measure(control):
        images = [raycam.render(world, camera, samples=2**k, seed=k)["color"] for k in range(7)]
        errors = [float(np.sqrt(np.mean((image - images[-1]) ** 2))) for image in images[:-1]]
        plot.update(x=list(range(6)), y=errors)

    viewer.wait(exit_when_closed=True)
