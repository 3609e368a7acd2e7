"""Computes red, green and blue optical constants of metals from measured spectra.

    python benchmarks/fold_metals.py

Prints the table of `crates/scene/src/material/metal.rs`. The reflectance of the published n and k, from 0 to 89
degrees, is weighted by the illuminant D65 and the CIE 1931 observer (C. Wyman, P.-P. Sloan and P. Shirley,
"Simple Analytic Approximations to the CIE XYZ Color Matching Functions", 2013) and converted to linear Rec.
709. The table contains, for each colour, the n and k whose reflectances are nearest to these values. Requires
SciPy.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

Array = npt.NDArray[np.float64]

# P. B. Johnson and R. W. Christy, Phys. Rev. B 6, 4370 (1972) and 9, 5056 (1974); aluminium: F. Cheng et al., ACS Nano
# 10, 9852 (2016). The values are those of the refractiveindex.info database, which is in the public domain (CC0). Rows:
# wavelengths in nm, n, k.
WAVELENGTHS = "381.5 397.4 413.3 430.5 450.9 471.4 495.9 520.9 548.6 582.1 616.8 659.5 704.5 756.0"
METALS = {
    "aluminium": (
        ".2893 .3052 .3334 .3578 .3930 .4290 .4771 .5240 .5844 .6700 .7791 .9572 1.172 1.551",
        "3.615 3.753 3.932 4.102 4.313 4.521 4.748 4.994 5.247 5.550 5.892 6.306 6.675 6.966",
    ),
    "chromium": (
        "1.92 2.00 2.08 2.19 2.33 2.51 2.75 2.94 3.18 3.22 3.17 3.09 3.05 3.08",
        "2.74 2.83 2.93 3.04 3.14 3.24 3.30 3.33 3.33 3.30 3.30 3.34 3.39 3.42",
    ),
    "copper": (
        "1.33 1.32 1.28 1.25 1.24 1.25 1.22 1.18 1.02 .70 .30 .22 .21 .24",
        "2.045 2.116 2.207 2.305 2.397 2.483 2.564 2.608 2.577 2.704 3.205 3.747 4.205 4.665",
    ),
    "gold": (
        "1.46 1.47 1.46 1.45 1.38 1.31 1.04 .62 .43 .29 .21 .14 .13 .14",
        "1.933 1.952 1.958 1.948 1.914 1.849 1.833 2.081 2.455 2.863 3.272 3.697 4.103 4.542",
    ),
    "iron": (
        "2.12 2.24 2.35 2.48 2.59 2.67 2.74 2.86 2.95 2.94 2.88 2.92 2.86 2.87",
        "2.50 2.58 2.65 2.71 2.77 2.82 2.88 2.91 2.93 2.99 3.05 3.10 3.19 3.28",
    ),
    "nickel": (
        "1.72 1.72 1.70 1.71 1.73 1.78 1.82 1.85 1.92 1.96 1.99 1.99 2.06 2.13",
        "2.48 2.57 2.69 2.82 2.95 3.09 3.25 3.42 3.61 3.80 4.02 4.26 4.50 4.73",
    ),
    "silver": (
        ".05 .05 .05 .04 .04 .05 .05 .05 .06 .05 .06 .05 .04 .03",
        "1.864 2.070 2.275 2.462 2.657 2.869 3.093 3.324 3.586 3.858 4.152 4.483 4.838 5.242",
    ),
    "titanium": (
        "1.99 2.08 2.14 2.21 2.27 2.32 2.36 2.44 2.54 2.60 2.67 2.76 2.86 3.00",
        "2.93 2.95 2.98 3.01 3.04 3.10 3.19 3.30 3.43 3.58 3.72 3.84 3.96 4.01",
    ),
}
RGB_FROM_XYZ = np.array(
    [
        [3.2404542, -1.5371385, -0.4985314],
        [-0.9692660, 1.8760108, 0.0415560],
        [0.0556434, -0.2040259, 1.0572252],
    ]
)
# The spectrum of the illuminant D65, with one value every 20 nm (CIE 15).
D65 = (
    np.arange(380, 781, 20),
    "49.98 82.75 93.43 104.9 117.8 115.9 109.4 104.8 104.4 100 95.79 90.01 87.70 83.70 80.21 78.28 78.28 71.61 69.89 "
    "75.09 63.38",
)


def numbers(text: str) -> Array:
    return np.array([float(word) for word in text.split()])


def reflectance(cosine: Array, n: Array, k: Array) -> Array:
    """Returns the reflectance of metal for unpolarised light, by Fresnel's equations."""
    eta = n + 1j * k
    inner = np.sqrt(1 - (1 - cosine**2) / eta**2)
    s = (cosine - eta * inner) / (cosine + eta * inner)
    p = (eta * cosine - inner) / (eta * cosine + inner)
    return (np.abs(s) ** 2 + np.abs(p) ** 2) / 2


def observer(nm: Array) -> Array:
    def lobe(scale: float, mean: float, below: float, above: float) -> Array:
        return scale * np.exp(-0.5 * ((nm - mean) * np.where(nm < mean, below, above)) ** 2)

    x = (
        lobe(0.362, 442.0, 0.0624, 0.0374)
        + lobe(1.056, 599.8, 0.0264, 0.0323)
        + lobe(-0.065, 501.1, 0.0490, 0.0382)
    )
    y = lobe(0.821, 568.8, 0.0213, 0.0247) + lobe(0.286, 530.9, 0.0613, 0.0322)
    z = lobe(1.217, 437.0, 0.0845, 0.0278) + lobe(0.681, 459.0, 0.0385, 0.0725)
    return np.stack([x, y, z])


def fold(n: Array, k: Array) -> tuple[Array, Array]:
    """Returns n and k per channel, and the reflectance at normal incidence."""
    nm = np.arange(382.0, 756.0)
    known = numbers(WAVELENGTHS)
    n, k = np.interp(nm, known, n), np.interp(nm, known, k)
    weights = RGB_FROM_XYZ @ (observer(nm) * np.interp(nm, D65[0], numbers(D65[1])))
    weights /= weights.sum(axis=1, keepdims=True)
    cosines = np.cos(np.radians(np.append(np.arange(0, 86, 5), [88, 89])))
    folded = np.array([weights @ reflectance(c, n, k) for c in cosines]).clip(0, 0.9999)

    def fit(channel: int) -> Array:
        def off(nk: Array) -> Array:
            return reflectance(cosines, nk[0], nk[1]) - folded[:, channel]

        return least_squares(off, [1.0, 3.0], bounds=([0.01, 0.01], [20, 20])).x

    return np.array([fit(channel) for channel in range(3)]).T, folded[0]


if __name__ == "__main__":
    for metal, (n, k) in METALS.items():
        (ior, extinction), normal = fold(numbers(n), numbers(k))
        rows = [", ".join(f"{v:.3f}" for v in row) for row in (ior, extinction, normal)]
        print(f'    metal("{metal}", [{rows[0]}], [{rows[1]}]), // {rows[2]}')
