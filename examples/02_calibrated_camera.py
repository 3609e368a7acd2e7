"""Renders through a camera that was calibrated with OpenCV: K, rvec and tvec.

Every point appears at the pixel to which cv2.projectPoints projects it. Requires `pip install
opencv-python-headless`. Writes overlay.png.
"""

import cv2
import numpy as np
import raycam

# The results of cv2.calibrateCamera and cv2.solvePnP; the principal point may differ from the image's centre.
K = np.array([[812.3, 0, 333.1], [0, 809.7, 251.8], [0, 0, 1]])
rvec = np.array([1.85, -0.62, 0.48])
tvec = np.array([-0.1, 0.05, 3.6])

world = raycam.World()
world.add_object(box={"size": 1}, color="#d98c2b")
world.add_object(plane={"size": [3, 3]}, location=[0, 0, -0.5], color="#557a95")
world.add_light({"type": "sun", "direction": [-1, 2, -3], "irradiance": [3, 3, 3]})
world.add_light({"type": "sky", "radiance": [0.3, 0.35, 0.45]})

camera = raycam.Camera.from_opencv(K, rvec, tvec, (640, 480))
frame = raycam.render(world, camera)

corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
expected = cv2.projectPoints(corners, rvec, tvec, K, None)[0][:, 0]
pixels, _ = camera.project(corners)
print(f"largest difference to cv2.projectPoints: {np.abs(pixels - expected).max():.1e} px")
assert np.abs(pixels - expected).max() < 1e-9

picture = np.ascontiguousarray(frame.to_srgb8()[..., ::-1])  # OpenCV expects the order blue, green, red
for u, v in expected:
    cv2.circle(picture, (round(u * 16), round(v * 16)), 6 * 16, (255, 255, 255), 1, cv2.LINE_AA, shift=4)
cv2.imwrite("overlay.png", picture)
