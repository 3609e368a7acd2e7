"""Writes tracks of objects over a video in MOTChallenge's format.

Each camera has its own sequence. Source: motchallenge.net; py-motmetrics.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from ...arguments import real
from ...errors import SettingsError
from ..plan import Format, Index, Made, Plan, Record

__all__ = ["FORMAT"]


def check(plan: Plan) -> None:
    """Raises `SettingsError` for invalid options.

    Images of different sizes in a sequence also raise `SettingsError`.
    """
    real("fps", plan.options["fps"], 0, above=True, what="a number of frames per second")
    sizes: dict[str, tuple[int, int]] = {}
    for number, view in enumerate(plan.shots):
        name = sequence(plan, number)[0]
        if sizes.setdefault(name, view.camera.size) != view.camera.size:
            raise SettingsError(
                f"view {number} has the size {view.camera.size}, but the first view in sequence {name!r} has "
                f"{sizes[name]}; expected equal sizes",
                code="unsupported_camera",
            )


def sequence(plan: Plan, number: int) -> tuple[str, int]:
    """Returns the name of a view's sequence, and the view's frame number in the sequence.

    Frame numbers start at 1. Each camera of a rig has its own sequence.
    """
    rig = plan.shots[number].rig
    name = plan.options["sequence"]
    if rig is None:
        return name, number + 1
    own = [view.rig[1] if view.rig else "" for view in plan.shots[: number + 1]]
    return f"{name}-{rig[1]}", own.count(rig[1])


def make(plan: Plan, number: int) -> Made:
    """Creates an image, and the image's rows of `gt.txt`.

    Boxes enclose whole objects, including hidden parts. Pixel coordinates start at 1.
    """
    shot = plan.shot(number)
    frame = shot.render(["color", "instance"])
    name, place = sequence(plan, number)
    rows = []
    for item in shot.labels(frame["instance"]):
        if item.truncated_fraction < 1.0:
            x, y, w, h = item.amodal_box
            values = (place, item.object + 1, x + 1, y + 1, w, h, 1, shot.category(item.object))
            rows.append(",".join(map(str, values)) + f",{item.visible_fraction:.6f}\n")
    return {f"{name}/img1/{place:06d}.png": frame.to_png()}, {"sequence": name, "rows": rows}


def index(plan: Plan, records: Callable[[], Iterator[Record]]) -> Index:
    """Creates `gt/gt.txt` and `seqinfo.ini` of each sequence, and the names of the classes."""
    names: dict[str, list[int]] = {}
    for number in range(len(plan.shots)):
        names.setdefault(sequence(plan, number)[0], []).append(number)
    for name, numbers in names.items():

        def rows(name: str = name) -> Iterator[bytes]:
            for record in records():
                if record["sequence"] == name:
                    yield "".join(record["rows"]).encode()

        width, height = plan.shots[numbers[0]].camera.size
        yield f"{name}/gt/gt.txt", rows()
        yield (
            f"{name}/seqinfo.ini",
            [
                f"[Sequence]\nname={name}\nimDir=img1\nframeRate={plan.options['fps']:g}\nseqLength={len(numbers)}\n"
                f"imWidth={width}\nimHeight={height}\nimExt=.png\n".encode()
            ],
        )
    classes = "".join(f"{number} {name}\n" for number, name in sorted(plan.categories.items()))
    yield "classes.txt", [classes.encode()]


FORMAT = Format(make, index, check, {"sequence": "seq01", "fps": 30.0})
