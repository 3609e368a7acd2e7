"""One frame as one HTML file: every channel as numbers, offline, for any browser."""

from __future__ import annotations

import base64
import html
import os
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..arguments import flag, numbers, one_of, several, word
from ..errors import Notice, SettingsError
from ..notices import warn_all
from ..render.arguments import world_of
from ..render.frame import VIEWS, channel_form, is_channel
from .files.browser_folder import browser_folder
from .web.document import assembled, json_text, still_image
from .wire import DTYPES, data_url, pack

if TYPE_CHECKING:
    from ..render.frame import Frame
    from ..world import World

__all__ = ["Page", "page", "show", "write_page"]

NOTEBOOK_HEIGHT = 640  # height in CSS pixels of the page in a notebook cell
MOST_COMPONENTS = 4
HALF = ("color", "albedo")  # channels that `half` rounds
MOST_TOLD = 5  # maximum number of ids in a notice

Arrays = Mapping[str, npt.NDArray[Any]]


class Page(str):
    """The text of a page, which notebooks show in a separate frame."""

    picture: bytes = b""
    """The page's first image as JPEG, for notebooks that are not trusted, which do not show embedded pages."""

    def _repr_html_(self) -> str:
        """Returns the page in a sandbox.

        The page can run its script and save files, but cannot access the notebook.
        """
        size = f"width: 100%; height: {NOTEBOOK_HEIGHT}px"
        shown = (
            f'<img src="{data_url("image/jpeg", self.picture)}" alt="the frame" ' if self.picture else "<p "
        )
        return (
            f'<div style="position: relative; overflow: hidden; {size}">'
            f'{shown}style="max-width: 100%">'
            f'<iframe srcdoc="{html.escape(self)}" sandbox="allow-scripts allow-downloads" '
            'allow="clipboard-write" title="raycam frame" '
            f'style="position: absolute; left: 0; top: 0; {size}; border: 0"></iframe></div>'
        )

    def __repr__(self) -> str:
        """Returns the size of the page as text."""
        return f"Page of {len(self):,} bytes"


def page(
    frame: Frame,
    *,
    world: World | None = None,
    explain: Iterable[tuple[int, int]] | None = None,
    compare: Frame | None = None,
    arrays: Arrays | None = None,
    half: bool = False,
    exposure: float | None = None,
    view: str | None = None,
    title: str | None = None,
    live: bool = False,
    channel: str | None = None,
    compare_title: str | None = None,
) -> Page:
    """The frame as one HTML text: see `Frame.save`; `compare_title` names the second frame.

    Raises `SettingsError` if the parts do not match.
    """
    world = None if world is None else world_of(world)
    title = None if title is None else word("title", title)
    pixels = several("explain", () if explain is None else explain, "pixels (column, row)")
    if flag("live", live):
        from .web.live_page import live_page

        unused = {"explain": tuple(pixels), "compare": compare, "arrays": arrays, "half": half}
        return Page(
            live_page(frame, world, unused, exposure=exposure, view=view, title=title, channel=channel)
        )
    from ..render.options import check_option

    more = _arrays(frame, {} if arrays is None else arrays)
    _check_same(frame, compare)
    x, y, width, height = frame.region
    planes = {f"a-{name}": array for name, array in {**frame, **more}.items()}
    if compare is not None:
        planes |= {f"b-{name}": array for name, array in compare.items() if name in frame}
    packed = _packed(planes, flag("half", half))
    notices = list(frame.notices)
    if half:
        rounded = [name for name in HALF if name in frame]
        notices.append(Notice("values are rounded to float16 in this page", "rounded_values", rounded))
    doubts = [*_unlike(frame, compare), *_unnamed(frame, world)]
    warn_all(doubts)
    first = sorted([*frame, *more], key=lambda name: name != "color")
    document = {
        "title": title or f"raycam {width} x {height}",
        "channels": [{"name": name} for name in first],
        "channel": first[0] if channel is None else one_of("channel", channel, first),
        "planes": [{**header, "key": key} for key, (header, _) in packed.items()],
        "names": _names(world),
        "origin": [x, y],
        "exposure": check_option("exposure", frame.exposure if exposure is None else exposure),
        "view": one_of("view", frame.view if view is None else view, VIEWS),
        "about": _about(frame),
        "notices": [str(notice) for notice in (*notices, *doubts)],
        "explanations": _explanations(frame, world, pixels),
    }
    if compare is not None and compare_title is not None:
        document["compared"] = [title or "the first frame", word("compare_title", compare_title)]
    still = still_image(frame, exposure, view, title)
    return Page(_document(document, {key: data for key, (_, data) in packed.items()}, still))


def show(frame: Frame, **options: Any) -> Path | Page | None:
    """Shows the page in the notebook's cell, or in the browser; see `Frame.show`."""
    made = page(frame, **options)
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    marimo = sys.modules.get("marimo")
    is_in_cell = shell is not None and hasattr(shell, "kernel")
    is_in_marimo = marimo is not None and marimo.running_in_notebook()
    if is_in_cell or is_in_marimo:
        made.picture = _picture(frame, options.get("channel"), options.get("exposure"), options.get("view"))
    if is_in_cell:
        sys.modules["IPython.display"].display(made)
        return None
    return made if is_in_marimo else write_page(made)


def _picture(frame: Frame, channel: str | None, exposure: float | None, view: str | None) -> bytes:
    """The first image of a page as JPEG; empty for planes that are not channels of raycam."""
    shown = channel or ("color" if "color" in frame else next(iter(frame)))
    components = channel_form(shown)[1] if is_channel(shown) else 0
    known = components > 0 and frame[shown].shape[2:] == ((components,) if components > 1 else ())
    return frame.to_jpeg(exposure, view, shown) if known else b""


def write_page(made: Page, *, browser: bool = True) -> Path:
    """Writes the page to a temporary file; returns the path.

    With `browser`, the page is opened in the browser. See `browser_folder` for the folder.
    """
    file, name = tempfile.mkstemp(prefix="raycam-", suffix=".html", dir=browser_folder())
    with os.fdopen(file, "w", encoding="utf-8") as opened:
        opened.write(made)
    if browser:
        import webbrowser

        webbrowser.open(Path(name).as_uri())
    return Path(name)


def _arrays(frame: Frame, given: object) -> dict[str, npt.NDArray[Any]]:
    """Returns the arrays that are planes of this image, by name.

    Raises `SettingsError` for arrays of other shapes, and for invalid names.
    """
    _, _, width, height = frame.region
    if not isinstance(given, Mapping):
        raise SettingsError(
            f"arrays must map names to arrays, as in {{'flow': flow}}, not {type(given).__name__}",
            code="wrong_type",
        )
    arrays = {}
    for name, value in given.items():
        if name in frame:
            raise SettingsError(
                f"arrays[{name!r}]: the frame has a channel of this name; choose another name",
                code="duplicate_name",
            )
        if not (isinstance(name, str) and name.isidentifier()):
            raise SettingsError(
                f"arrays[{name!r}]: names must consist of letters, digits and _, as in 'flow'",
                code="invalid_value",
            )
        array = arrays[name] = numbers(f"arrays[{name!r}]", value)
        fits = array.shape[:2] == (height, width) and (
            array.ndim == 2 or (array.ndim == 3 and 1 <= array.shape[2] <= MOST_COMPONENTS)
        )
        if not fits:
            raise SettingsError(
                f"arrays[{name!r}] has the shape {list(array.shape)}; expected [{height}, {width}] or "
                f"[{height}, {width}, 1 to {MOST_COMPONENTS}]",
                code="wrong_shape",
            )
        if array.dtype.name not in DTYPES:
            raise SettingsError(
                f"arrays[{name!r}] has dtype {array.dtype.name}; expected {', '.join(DTYPES)}",
                code="wrong_type",
            )
    return arrays


def _check_same(frame: Frame, other: Frame | None) -> None:
    """Raises `SettingsError` unless the second frame can be compared with the first.

    The second frame must have the same width and height, and a common channel. None instead of a
    second frame is accepted.
    """
    if other is None:
        return
    if not isinstance(other, type(frame)):
        raise SettingsError(f"compare must be a raycam.Frame, not {type(other).__name__}", code="wrong_type")
    if other.region[2:] != frame.region[2:]:
        (_, _, width, height), (_, _, other_width, other_height) = frame.region, other.region
        raise SettingsError(
            f"compare has {other_width} x {other_height} pixels, but this frame has {width} x {height}; "
            "expected equal sizes",
            code="wrong_shape",
        )
    if not set(other) & set(frame):
        raise SettingsError(
            f"compare has the channels {', '.join(other)}, but this frame has {', '.join(frame)}; expected at "
            "least one common channel",
            code="conflicting_values",
        )


def _unlike(frame: Frame, other: Frame | None) -> Iterator[Notice]:
    """Yields notices about channels of a second frame that cannot be compared with this frame."""
    if other is None:
        return
    if other.region[:2] != frame.region[:2]:
        message = (
            f"compare starts at pixel {other.region[:2]} of its image, but this frame at {frame.region[:2]}; "
            "pixels at different positions are compared"
        )
        yield Notice(message, "differing_frames")
    alone = [name for name in other if name not in frame]
    if alone:
        message = (
            f"compare: {', '.join(alone)} cannot be compared, because this frame has only {', '.join(frame)}"
        )
        yield Notice(message, "differing_frames")


def _unnamed(frame: Frame, world: World | None) -> Iterator[Notice]:
    """Yields a notice about object ids that the world does not contain.

    The frame of these ids belongs to another world.
    """
    if world is None or "instance" not in frame or frame["instance"].ndim != 2:
        return
    ids = np.unique(frame["instance"])
    strange = ids[(ids >= 0) & ~np.isin(ids, [each.id for each in world.objects])]
    if len(strange):
        more = ", ..." if len(strange) > MOST_TOLD else ""
        told = ", ".join(map(str, strange[:MOST_TOLD].tolist()))
        message = (
            f"world has no objects with the ids {told}{more} of this frame; pass the world that was rendered"
        )
        yield Notice(message, "differing_frames")


def _packed(planes: Arrays, half: bool) -> dict[str, tuple[dict[str, Any], bytes]]:
    """Packs planes in several threads (zlib releases the GIL); returns header and bytes by key."""

    def packed(key: str) -> tuple[dict[str, Any], bytes]:
        name, array = key[2:], planes[key]
        if half and name in HALF:
            with np.errstate(over="ignore"):
                array = array.astype(np.float16)
        return pack(name, array)

    with ThreadPoolExecutor(min(4, os.cpu_count() or 1)) as pool:
        return dict(zip(planes, pool.map(packed, planes), strict=True))


def _names(world: World | None) -> dict[str, dict[int, str]]:
    """The names of ids by channel."""
    if world is None:
        return {}
    return {"instance": {each.id: each.name for each in world.objects}, "category": world.categories}


def _about(frame: Frame) -> str:
    """The frame and its camera as text."""
    return f"{frame!r}\n\n{frame.camera!r}" if frame.camera is not None else repr(frame)


def _explanations(
    frame: Frame, world: World | None, pixels: Sequence[tuple[int, int]]
) -> list[dict[str, Any]]:
    """Text and figure of each pixel; positions count from the region's corner."""
    if not pixels:
        return []
    if world is None or frame.camera is None:
        raise SettingsError(
            "explain requires a frame with a camera, and the world: save(path, world=world, explain=[(320, 240)])",
            code="missing_value",
        )
    from ..explanation import explain
    from .probe import explanation_parts

    x, y, width, height = frame.region
    made = []
    for pixel in pixels:
        explanation = explain(world, frame.camera, pixel)
        column, row = explanation.pixel[0] - x, explanation.pixel[1] - y
        if not (0 <= column < width and 0 <= row < height):
            raise SettingsError(
                f"explain: pixel {pixel} is not in the region {frame.region} of this frame",
                code="out_of_range",
            )
        parts = explanation_parts(explanation)[0]
        for part in (parts, *parts["sections"]):
            part["figure"]["region"] = list(frame.region)
        made.append({"column": column, "row": row, **parts})
    return made


def _document(document: dict[str, Any], planes: Mapping[str, bytes], still: str) -> str:
    """The HTML text of the page; the page runs only its own script and sends no requests."""
    blocks = [still, f'<script type="application/json" id="document">{json_text(document)}</script>']
    # Element ids contain numbers instead of names, because names come from untrusted files.
    for number, data in enumerate(planes.values()):
        text = base64.b64encode(data).decode()
        blocks.append(f'<script type="text/plain" id="plane-{number}">{text}</script>')
    return assembled(str(document["title"]), blocks)
