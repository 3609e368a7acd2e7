"""Runs the self-check at full size.

The result is the difference between OpenCV's calibration and the camera that rendered the images.
"""

from __future__ import annotations

import argparse
import time

import report


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--views", type=int, default=20)
    parser.add_argument("--samples", type=int, default=16)
    options = parser.parse_args()
    import raycam

    start = time.perf_counter()
    found = raycam.selfcheck(views=options.views, samples=options.samples)
    seconds = time.perf_counter() - start
    print(found)
    width, height = found.camera.size
    notes = [
        f"A ChArUco board of 9 x 7 squares through a camera of {width} x {height} pixels with"
        f" five coefficients; {found.views} views, {options.samples} rays per pixel, {found.corners} corners;"
        f" {seconds:.0f} s. The remaining error is caused by the {found.cause}.",
    ]
    rows = [
        [name, unit.format(one(found.detected)), unit.format(one(found.exact))]
        for name, unit, one in (
            ("OpenCV's RMS", "{:.2g} px", lambda c: c.rms),
            ("error of the focal length", "{:.2g} %", lambda c: c.focal_error * 100),
            ("error of the principal point", "{:.2g} px", lambda c: c.center_error),
            ("largest error of a ray", "{:.2g} px", lambda c: c.picture_error),
        )
    ]
    rows += [
        ["error of detected corners, RMS", f"{found.detector_rms:.2g} px", "0"],
        ["error of detected corners, mean", f"{found.detector_bias:.2g} px", "0"],
        ["largest error of the image", f"{found.picture_largest:.2g} px", "0"],
    ]
    report.write("selfcheck", "Self-check", notes, ["what", "found corners", "exact projections"], rows)


if __name__ == "__main__":
    main()
