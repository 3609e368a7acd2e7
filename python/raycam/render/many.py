"""Rendering of many images in one call: many poses of objects, and many cameras."""

from __future__ import annotations

import base64
import copy
import inspect
import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import floats, whole
from ..camera import Camera
from ..errors import Notice, SettingsError, WorldError
from ..notices import warn_all
from ..render.arguments import camera_of, world_of
from ..world.robot_joints import follow_joints, joint_poses, mounted_camera
from .frame import Frame, channel_form
from .options import RenderOptions, given_options
from .render import CATCHER_NOTICE, render
from .request import DEFAULT_CHANNELS, channel_names, image_request

if TYPE_CHECKING:
    from ..robots import JointValues
    from ..world import World

__all__ = ["Frames", "render_many"]

Pixels = dict[str, npt.NDArray[Any]]


class Frames(Sequence[Frame]):
    """The images that `render_many` returns, all of one size.

    `frames["depth"]` is an array [n, h, w] or [n, h, w, c]; `frames[i]` is a `Frame` that shares the memory of these
    arrays.
    """

    def __init__(
        self,
        channels: Pixels,
        cameras: Sequence[Camera],
        *,
        region: tuple[int, int, int, int] | None,
        exposure: float,
        view: str,
        transparent: bool,
        notices: Sequence[Notice],
    ) -> None:
        self._channels = channels
        self._cameras = list(cameras)
        self._region = region
        self._look: dict[str, Any] = {"exposure": exposure, "view": view, "transparent": transparent}
        self.notices = list(notices)
        """Notices about the rendering, each once."""

    @property
    def channels(self) -> tuple[str, ...]:
        """The names of the channels."""
        return tuple(self._channels)

    def __len__(self) -> int:
        """The number of images."""
        return len(next(iter(self._channels.values())))

    def __getitem__(self, key: Any) -> Any:
        """Returns the array of a channel, a `Frame`, or a list of frames.

        A channel is selected by its name, a frame by its index, and a list of frames by a slice.

        Raises `KeyError` for a channel that was not rendered, and `IndexError` for an index out of range.
        """
        if isinstance(key, str):
            if key not in self._channels:
                raise KeyError(f"no channel {key}; channels: {', '.join(self._channels)}")
            return self._channels[key]
        if isinstance(key, slice):
            return [self[i] for i in range(*key.indices(len(self)))]
        number = range(len(self))[key]
        camera = self._cameras[number if len(self._cameras) > 1 else 0]
        planes = {name: array[number] for name, array in self._channels.items()}
        return Frame(
            planes, camera=camera, size=camera.size, region=self._region, notices=self.notices, **self._look
        )

    def __iter__(self) -> Iterator[Frame]:
        """Iterates over the images."""
        return (self[i] for i in range(len(self)))

    def _repr_html_(self) -> str:
        """The first eight images that a notebook shows: the colour, or else the first channel."""
        from html import escape  # imported here, so that `import raycam` is fast

        shown = []
        channel = "color" if "color" in self._channels else next(iter(self._channels))
        for frame in self[:8]:
            data = base64.b64encode(frame.to_png(channel=channel)).decode()
            shown.append(f'<img width="{min(240, frame.size[0])}" src="data:image/png;base64,{data}">')
        return f"<div><b>{escape(repr(self))}</b></div>" + "".join(shown)

    def __repr__(self) -> str:
        """Count, size and channels as text."""
        height, width = next(iter(self._channels.values())).shape[1:3]
        return f"{len(self)} Frames {width} x {height}: {', '.join(self._channels)}"


def render_many(
    world: World | str | os.PathLike[str],
    cameras: Camera | str | Sequence[Camera | str] | None = None,
    *,
    poses: Mapping[str | int, npt.ArrayLike] | None = None,
    joints: Mapping[str, JointValues] | None = None,
    channels: Sequence[str] | str = DEFAULT_CHANNELS,
    frame: int = 0,
    surface: str = "first",
    region: Sequence[int] | None = None,
    transparent_background: bool = False,
    background: Any = None,
    catcher_truth: bool = False,
    out: Mapping[str, npt.NDArray[Any]] | None = None,
    progress: Callable[[int, int], object] | None = None,
    **options: Unpack[RenderOptions],
) -> Frames:
    """Renders many images of a world with different object poses and cameras.

    The world is not changed.

    `poses` maps objects, by name or number, to a matrix world_from_mesh: one for all images, [4, 4], or one for each
    image, [n, 4, 4]: `render_many(world, camera, poses={"cup": T}, channels="depth")`. `cameras` is one camera for all
    images, or a list with one camera for each image; all must have the same size. `joints` maps robots, by name, to
    joint values as in `World.set_joints`, or to one row for each image: `joints={"panda": q}` with q [n, k]. Cameras
    mounted on these robots (`Camera.mounted`) move with them.

    Image i has the same bytes as an image by `render` with the poses i, the camera i and `frame` + i, for any number of
    threads. Background photos (`Camera.background`) and shadows on shadow catchers are included. The other arguments
    are those of `render`, except `denoise` and `time_limit`.

    Returns `Frames`: `frames["depth"]` is [n, h, w], `frames[i]` a `Frame`. `out` maps channels to arrays that are
    filled instead of new ones: C-contiguous, of the channel's dtype, [n, h, w] or [n, h, w, c].
    `progress(done, total)` counts images; an exception that it raises stops the work, as Ctrl-C does.

    Raises `WorldError` for unknown objects and singular poses, `SettingsError` for wrong shapes, and `render`'s errors.
    """
    world = world_of(world)
    several = cameras if isinstance(cameras, Sequence) and not isinstance(cameras, str) else [cameras]
    seen = [camera_of(world, mounted_camera(world, camera)) for camera in several]
    if not seen:
        raise SettingsError(
            "cameras is empty; expected one camera, or one for each image", code="missing_value"
        )
    _check_sizes(seen)
    moved, seen = _by_joints(world, seen, poses, joints)
    count = _count({"cameras": len(seen)} | {f"poses[{which!r}]": len(found) for which, found in moved})
    _refuse_single(options)
    given = given_options({k: v for k, v in options.items() if k != "denoise"}, ARGUMENTS)
    names = channel_names(channels)
    if transparent_background and "color" in names and "alpha" not in names:
        names.append("alpha")
    behind = [background] if background is not None else [camera.background for camera in seen]
    if background is not None or _is_composed(world, names, behind, transparent_background):
        asked = {
            "background": background,
            "catcher_truth": catcher_truth,
            "surface": surface,
            "region": region,
        }
        asked |= {"channels": names, "transparent_background": transparent_background, **given}
        return _composed(world, seen, moved, count, frame, out, progress, asked)
    request, stops, view = image_request(
        world,
        given,
        names=names,
        surface=surface,
        frame=whole("frame", frame, 0, (1 << 32) - count),
        transparent_background=transparent_background,
        region=region,
    )
    width, height = seen[0].size if region is None else (int(region[2]), int(region[3]))
    arrays = _arrays(out, names, (count, height, width))
    world.prepare(threads=request["threads"])
    notices = _core.render_many(
        world._core, [camera._core for camera in seen], moved, request, count, list(arrays.items()), progress
    )
    notices += [CATCHER_NOTICE] if world._core.has_catchers and "color" in names else []
    warn_all(notices)
    area = None if region is None else tuple(request["region"])
    look: dict[str, Any] = {"exposure": stops, "view": view, "transparent": transparent_background}
    return Frames(arrays, seen, region=area, notices=notices, **look)


def _by_joints(
    world: World,
    cameras: list[Camera],
    poses: Mapping[str | int, npt.ArrayLike] | None,
    joints: Mapping[str, JointValues] | None,
) -> tuple[list[tuple[str | int, npt.NDArray[np.float64]]], list[Camera]]:
    """Returns the poses [n, 4, 4] including the robots' objects, and the cameras.

    Cameras that are mounted on robots are at the poses that follow from the joint values.
    """
    moved = [(which, _matrices(which, matrices)) for which, matrices in (poses or {}).items()]
    if joints is None:
        return moved, cameras
    moving = joint_poses(world, joints)
    twice = [which for which, _ in moved if which in moving]
    if twice:
        raise SettingsError(
            f"poses and joints both place {', '.join(map(repr, twice))}; use only one of them",
            code="conflicting_values",
        )
    return [*moved, *moving.items()], follow_joints(world, cameras, joints)


def _refuse_single(options: Mapping[str, Any]) -> None:
    """Raises `SettingsError` for options that only single images support."""
    for name in ("denoise", "time_limit"):
        if options.get(name):
            raise SettingsError(
                f"{name} is not supported by render_many; call render for each image",
                code="conflicting_values",
            )
    if options.get("integrator") == "reference":
        raise SettingsError(
            'integrator="reference" is not supported by render_many; call render for each image',
            code="conflicting_values",
        )


def _is_composed(world: World, names: Sequence[str], behind: Sequence[Any], transparent: bool) -> bool:
    """True if images are composed with background photos, or show shadows on shadow catchers."""
    photographs = any(one is not None for one in behind)
    over = photographs and "color" in names and not transparent
    return over or (world._core.has_catchers and (transparent or photographs))


def _composed(
    world: World,
    cameras: Sequence[Camera],
    moved: Sequence[tuple[str | int, npt.NDArray[np.float64]]],
    count: int,
    first: int,
    out: Mapping[str, npt.NDArray[Any]] | None,
    progress: Callable[[int, int], object] | None,
    asked: dict[str, Any],
) -> Frames:
    """Returns the images with background photos or caught shadows.

    Each image is rendered by `render` with the options `asked`.
    """
    number = whole("frame", first, 0, (1 << 32) - count)
    copied = copy.copy(world)
    arrays: Pixels = {}
    found: list[Notice] = []
    for i in range(count):
        for which, matrices in moved:
            copied.set_object(which, matrix=matrices[i if len(matrices) > 1 else 0])
        camera = cameras[i if len(cameras) > 1 else 0]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Notice)
            made = render(copied, camera, frame=number + i, **asked)
        if not arrays:
            arrays = _arrays(out, list(made), (count, *next(iter(made.values())).shape[:2]))
        elif set(made) != set(arrays):
            raise SettingsError(
                f"some images have the channels {', '.join(arrays)}, others {', '.join(made)}; either all cameras or "
                "no cameras of a call must have backgrounds",
                code="conflicting_values",
            )
        for name, array in arrays.items():
            array[i] = made[name]
        found += made.notices
        if progress is not None:
            progress(i + 1, count)
    notices = list(dict.fromkeys(found))
    warn_all(notices)
    return Frames(
        arrays,
        cameras,
        region=made.region if asked["region"] is not None else None,
        exposure=made.exposure,
        view=made.view,
        transparent=made.transparent,
        notices=notices,
    )


def _matrices(which: str | int, given: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Matrices [n, 4, 4]; a single matrix becomes [1, 4, 4]."""
    found = floats(f"poses[{which!r}]", given, (4, 4), ("n", 4, 4), error=WorldError)
    if not (found[..., 3, :] == [0, 0, 0, 1]).all():
        raise WorldError(
            f"poses[{which!r}]: the last row of each matrix must be 0 0 0 1; check whether the matrices are transposed",
            code="invalid_matrix",
        )
    return found.reshape(-1, 4, 4)


def _check_sizes(cameras: Sequence[Camera]) -> None:
    """Raises `SettingsError` for cameras of different sizes."""
    if any(camera.size != cameras[0].size for camera in cameras):
        sizes = " and ".join(sorted({"{} x {}".format(*camera.size) for camera in cameras}))
        raise SettingsError(
            f"the cameras have different sizes: {sizes} pixels; all images of a call must have the same size",
            code="wrong_shape",
        )


def _count(lengths: dict[str, int]) -> int:
    """The number of images; raises `SettingsError` for lengths that do not match."""
    count = max(lengths.values())
    if 0 in lengths.values():
        empty = next(name for name, length in lengths.items() if length == 0)
        raise SettingsError(
            f"{empty} is empty; expected one entry, or one entry per image", code="missing_value"
        )
    if any(length not in (1, count) for length in lengths.values()):
        said = ", ".join(f"{length} {name}" for name, length in lengths.items() if length > 1)
        raise SettingsError(
            f"{said}; expected equal numbers, or one entry for all images", code="wrong_shape"
        )
    return count


def _arrays(
    out: Mapping[str, npt.NDArray[Any]] | None, names: list[str], shape: tuple[int, int, int]
) -> Pixels:
    """The output arrays: the given arrays, and new arrays for all other channels."""
    given = dict(out or {})
    arrays: Pixels = {}
    for name in names:
        dtype, components = channel_form(name)
        wanted = (*shape, components) if components > 1 else shape
        array = given.pop(name, None)
        if array is None:
            array = np.empty(wanted, dtype)
        elif not isinstance(array, np.ndarray) or array.dtype != dtype or array.shape != wanted:
            what = (
                f"{array.dtype} {list(array.shape)}"
                if isinstance(array, np.ndarray)
                else type(array).__name__
            )
            raise SettingsError(
                f"out[{name!r}] is {what}: expected an array of {dtype} {list(wanted)}", code="wrong_shape"
            )
        elif not (array.flags.c_contiguous and array.flags.writeable):
            raise SettingsError(f"out[{name!r}]: expected a writable, C-contiguous array", code="wrong_type")
        arrays[name] = array
    if given:
        raise SettingsError(
            f"out: unknown channels {', '.join(given)}; options: {', '.join(names)}",
            code="unknown_name",
        )
    return arrays


ARGUMENTS = [name for name in inspect.signature(render_many).parameters if name != "options"]
"""The arguments of `render_many` that are not render options."""
