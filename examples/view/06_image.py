"""An image in the panel shows the depth in grey, from the current view of the client."""

import numpy as np
import raycam

world = raycam.World()
world.add_object("torus", radius=0.5, tube=0.2)

with raycam.view(world, port=0, browser=False, block=False) as viewer:
    panel = viewer.add_image("depth", np.zeros((32, 48, 3), np.uint8))

    @viewer.add_button("update").on_click
    def update(control):
        depth = viewer.screenshot((48, 32), channels="depth")["depth"]
        near, far = np.percentile(depth[np.isfinite(depth)], [0, 100]) if np.isfinite(depth).any() else (0, 1)
        grey = np.where(np.isfinite(depth), 255 - 200 * (depth - near) / max(far - near, 1e-9), 0)
        panel.update(image=np.repeat(grey.astype(np.uint8)[..., None], 3, axis=2))

    viewer.wait(exit_when_closed=True)
