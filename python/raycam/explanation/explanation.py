"""Explains one pixel: every step of the lecture with its numbers, light and search tree.

The numbers of the flat image come from :mod:`raycam.reference`: its functions are run for one ray over all
triangles. ``str(explanation)`` prints the steps, and :mod:`raycam.explanation.figure` draws the steps.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from .. import reference
from ..camera import Camera
from ..errors import SettingsError
from ..io import atomic_files
from ..reference.units import Floats, Units
from ..render.arguments import camera_of, world_of
from ..world import World
from . import figure, text
from .all_triangles import TriangleTests, intersect_all_triangles
from .lens import at_line, lens_steps, world_at_line
from .light_path import LightPath, light_path
from .lighting import Lighting, lighting
from .scene_figure import light_figure, tree_figure
from .steps import Candidate, PixelSteps
from .tree import TreeSearch, tree_search

Subject = Literal["ray", "light", "tree"]
SUBJECTS: tuple[Subject, ...] = ("ray", "light", "tree")
"""Subjects of an explanation: the ray and its triangle, the light, the tree."""


@dataclass(frozen=True)
class Explanation(PixelSteps):
    """Every number by which the lecture's procedure finds the colour of one pixel.

    Lengths are in world units and points relative to the world's origin, unless the world is tiny, huge, or far from
    its origin. In these cases, they are in the local `units`.
    """

    def __str__(self) -> str:
        """The lecture's steps with formulas and numbers, as text."""
        return text.text(self)

    def __repr__(self) -> str:
        """The pixel and the object it shows, in one line; `str` returns all steps."""
        seen = text.name(self.winner) if self.winner else "no triangle"
        return f"Explanation of pixel {self.pixel}, which shows {seen}; print() shows all steps"

    def _repr_svg_(self) -> str:
        """The figure that a notebook shows."""
        return self.svg()

    def lighting(self, samples: int = 256) -> Lighting:
        """Returns the light of the pixel: the terms of each light, and their sum.

        Each light has a shadow ray, a cosine, a diffuse term and a specular term. The light of suns, point
        lights and spots without an extent is computed in closed form. The light of other sources is the mean of
        `samples` samples.
        """
        return lighting(self, samples)

    def light_path(self, seed: int = 0, max_bounces: int = 5) -> LightPath:
        """Returns a light path through the pixel with at most `max_bounces` points.

        Each `seed` gives another path.
        """
        return light_path(self, seed, max_bounces)

    def tree(self) -> TreeSearch:
        """Returns the search for the closest triangle in a tree of boxes.

        The result contains the boxes that the ray enters, and counts.
        """
        return tree_search(self)

    def svg(self, of: Subject = "ray") -> str:
        """Returns a figure as SVG text.

        `of="ray"` shows the image with the marked pixel, ray and triangle in 3D, and the inside test. `of="light"`
        shows shadow rays and a light path in 3D. `of="tree"` shows the boxes that the ray enters. Raises SettingsError
        for any other value.
        """
        if of not in SUBJECTS:
            raise SettingsError(f"of={of!r}: expected {', '.join(SUBJECTS)}", code="invalid_value")
        if of == "light":
            return light_figure(self, self.lighting(), self.light_path())
        return tree_figure(self, self.tree()) if of == "tree" else figure.figure(self)

    def save_figure(self, path: str | os.PathLike[str], of: Subject = "ray") -> None:
        """Writes the figure `svg` to an .svg file atomically, or to a .png or .pdf with CairoSVG.

        An .html file is a page with the steps, whose figures are those of the lecture and the live view and can be
        rotated. Raises SettingsError for another extension and without CairoSVG, and OSError if the file cannot be
        written.
        """
        check_figure(path)
        suffix = Path(path).suffix.lower()
        if suffix == ".html":
            from ..viewer.explanation_page import explanation_page

            atomic_files.write(path, explanation_page(self, of).encode())
            return
        svg = self.svg(of).encode()
        atomic_files.write(path, svg if suffix == ".svg" else _converter(suffix)(bytestring=svg))


def explain(
    world: World | str | os.PathLike[str],
    camera: Camera | str | os.PathLike[str] | tuple[int, int] | None = None,
    pixel: tuple[int, int] | None = None,
) -> Explanation:
    """Explains the colour of one pixel of ``raycam.render(world, camera, integrator="flat")``.

    `world` and `camera` are as in `raycam.render`; ``explain(world, (320, 240))`` uses the default camera.
    `pixel` is (column, row), integers from (0, 0) at the top left; the ray passes through the pixel's centre.

    Cameras may have a lens or parallel rays: the explanation then contains the steps from the pixel through the
    undistortion to the direction in the world. Moving cameras, and moving worlds with a rolling shutter, are explained
    at the middle of the exposure of the pixel's line, like ground truth.

    Raises SettingsError for a pixel outside the image, and CameraError for a pixel for which the lens has no ray.
    """
    if pixel is None:  # called as explain(world, pixel)
        camera, pixel = (None, camera) if isinstance(camera, tuple | list) else (camera, None)
    if pixel is None:
        raise SettingsError(
            "pixel is missing; pass (column, row), whole numbers from (0, 0) at the top left",
            code="missing_value",
        )
    world = world_of(world)
    camera = camera_of(world, camera)
    column, row = pixel_of(camera, pixel)
    world = world_at_line(world, camera, np.array([column, row]) + camera.corner + 0.5)
    camera = at_line(camera, column, row)
    is_plain = camera.model == "pinhole" and not camera.is_parallel
    lens = None if is_plain else lens_steps(camera, column, row)
    matrix = camera.P if lens is None else lens.P
    world_corners = np.asarray(world.triangles(), dtype=np.float64)
    units = Units.for_world(world_corners.reshape(-1, 3), reference.camera_center(matrix))
    P = units.camera(matrix)
    center = reference.pixel_centers((1, 1), camera.pixel_center) + np.array([column, row])

    C = reference.camera_center(P)
    X = reference.points_on_lines(P, center)
    forward = reference.third_row_of_r(P)
    line = reference.lines(X, C)
    r = reference.pointed_forward(line, forward) if lens is None else lens.direction[None]

    found = intersect_all_triangles(world_corners, units.points, C, r[0])
    candidates = _candidates(world, found, units.points(world_corners[found.shown]), C, r[0])
    winner = candidates.get(found.nearest)
    distance = winner.t * float(reference.length(r[0])) * units.scale if winner else np.inf
    axis = forward if lens is None else lens.forward
    depth = winner.t * float(r[0] @ axis) * units.scale if winner else np.inf
    return Explanation(
        world=world,
        camera=camera,
        pixel=(column, row),
        units=units,
        P=P,
        x=np.append(center[0], 1.0),
        M=P[:, :3],
        det_M=float(np.linalg.det(P[:, :3])),
        C=C,
        X=X[0],
        X_prime=None if reference.at_infinity(X)[0] else X[0, :3] / X[0, 3],
        line=line[0],
        forward=forward,
        forward_dot_line=float(forward @ line[0]),
        r=r[0],
        triangles=found.triangles,
        without_area=found.without_area,
        parallel=found.parallel,
        behind=found.behind,
        outside=found.outside,
        candidates=tuple(candidates.values()),
        winner=winner,
        color=winner.color if winner else reference.background(world),
        depth=depth,
        distance=distance,
        lens=lens,
    )


def _candidates(
    world: World, found: TriangleTests, corners: Floats, C: Floats, r: Floats
) -> dict[int, Candidate]:
    """The details of the shown triangles by index; `corners` are their vertices."""
    ids, colors = world.triangle_ids()[found.shown], world.triangle_colors()[found.shown]
    n = reference.normals(corners)
    t = reference.plane_distances(n, corners[:, 0], C, r[None])[0]
    return {
        int(index): candidate(world, ids[i], colors[i], corners[i], n[i], C, r, float(t[i]))
        for i, index in enumerate(found.shown)
    }


FIGURES = (".svg", ".html", ".png", ".pdf")
"""Endings of figures."""


def _converter(suffix: str) -> Callable[..., bytes]:
    """Returns CairoSVG's function for a file extension.

    Raises `SettingsError` if CairoSVG is not installed.
    """
    try:
        import cairosvg
    except (ImportError, OSError) as error:  # OSError: the library cairo is missing
        raise SettingsError(
            f"{suffix} figures require CairoSVG ({error}); pip install 'raycam[figure]', or write .svg",
            code="missing_dependency",
        ) from None
    convert: Callable[..., bytes] = getattr(cairosvg, f"svg2{suffix[1:]}")
    return convert


def check_figure(path: str | os.PathLike[str]) -> None:
    """Checks that a figure can be written to `path`; raises the errors of `save_figure`."""
    suffix = Path(path).suffix.lower()
    if suffix not in FIGURES:
        raise SettingsError(
            f"{path}: unknown ending of a figure; expected .svg, .html (with rotatable figures), .png or .pdf",
            code="unknown_format",
        )
    if suffix in (".png", ".pdf"):
        _converter(suffix)
    atomic_files.check_writable(path)


def pixel_of(camera: Camera, pixel: tuple[int, int]) -> tuple[int, int]:
    """Returns `pixel` as two ints within the image; raises SettingsError for other values."""
    try:
        column, row = (number.__index__() for number in pixel)
    except (AttributeError, TypeError, ValueError):
        raise SettingsError(
            f"pixel must be two whole numbers, (column, row), not {pixel!r}", code="wrong_shape"
        ) from None
    width, height = camera.size
    if not (0 <= column < width and 0 <= row < height):
        raise SettingsError(
            f"pixel ({column}, {row}) is outside the image of {width} x {height}; columns are 0 to "
            f"{width - 1}, rows 0 to {height - 1}",
            code="out_of_range",
        )
    return column, row


def candidate(
    world: World,
    ids: npt.NDArray[np.int32],
    color: npt.NDArray[np.float32],
    corners: Floats,
    n: Floats,
    C: Floats,
    r: Floats,
    t: float,
) -> Candidate:
    """Returns the details of a triangle.

    The details include the ids of instance and triangle, the colour, and where the ray meets the triangle's
    plane.
    """
    f = C + t * r
    found = reference.crossings(corners, n, f, reference.edge_tolerance(corners, n, C, r, f))
    v1, v2, v3 = reference.edge_vectors(corners)
    instance, triangle = (int(number) for number in ids)
    return Candidate(
        instance=instance,
        triangle=triangle,
        object_name=world.objects[instance].name,
        color=np.asarray(color, dtype=np.float64),
        a=corners[0],
        b=corners[1],
        c=corners[2],
        n=n,
        n_dot_a_minus_C=float(n @ (corners[0] - C)),
        n_dot_r=float(n @ r),
        t=t,
        f=f,
        v1=v1,
        v2=v2,
        v3=v3,
        g=found.g,
        u=found.u,
        along_u=found.along_u,
        along_edge=found.along_edge,
        crossed=found.crossed,
        on_edge=found.on_edge,
    )
