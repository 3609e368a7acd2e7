"""The messages that a client sends, with one dataclass for each message.

The annotations contain the types and ranges of the fields.

`client/messages.d.ts` contains the same messages as TypeScript types; `python -m raycam.viewer.message_types` writes
it. To add a message, add a dataclass here and a method to `Session.ACTIONS`; CONTRIBUTING.md describes the steps.

The field `image` contains the number of the image in which the user chose a pixel. The camera may have moved since.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from ..render.frame import CHANNELS, VIEWS
from ..world.framing import DIRECTIONS
from .scene.floor_handle import FLOOR_HANDLE
from .scene.gizmo import HANDLES, TOOLS
from .scene.look import GROUNDS, LIGHTS
from .scene.material_edits import MATERIAL_KEYS
from .scene.textures import TEXTURE_KEYS

__all__ = [
    "MAX_IMAGE_SIZE",
    "MAX_PANES",
    "MESSAGES",
    "Base64",
    "Color",
    "Length",
    "Message",
    "OneOf",
    "Range",
]

MAX_IMAGE_SIZE = (2560, 1600)
"""The largest image that a client may request, in pixels."""
MAX_PANES = 4
"""Maximum number of cameras that are shown at once."""
MAX_CHUNK_LENGTH = 60_000
"""The longest piece of an upload, in characters of base64."""
MAX_MODELS = 100
"""Maximum number of models opened together."""
COLOR = re.compile(r"#[0-9a-fA-F]{6}")
BASE64 = re.compile(r"(?:[A-Za-z0-9+/]{4})*(?:[A-Za-z0-9+/]{2}==|[A-Za-z0-9+/]{3}=)?")


@dataclass(frozen=True)
class Range:
    """Limits of a number, or of each number in a list."""

    low: float
    high: float

    def accepts(self, value: Any) -> bool:
        """True for a number within the limits."""
        return bool(self.low <= value <= self.high)


@dataclass(frozen=True)
class Length:
    """Length limits of a text or a list."""

    high: int
    low: int = 0

    def accepts(self, value: Any) -> bool:
        """True for a text or list of an accepted length."""
        return self.low <= len(value) <= self.high


@dataclass(frozen=True)
class OneOf:
    """The allowed values of a text."""

    words: tuple[str, ...]

    def accepts(self, value: Any) -> bool:
        """True if the value is one of the words."""
        return value in self.words


@dataclass(frozen=True)
class Base64:
    """A text that encodes bytes."""

    def accepts(self, value: Any) -> bool:
        """True for base64 of an accepted length."""
        return len(value) <= MAX_CHUNK_LENGTH and BASE64.fullmatch(value) is not None


@dataclass(frozen=True)
class Color:
    """A colour as #rrggbb, or an empty text."""

    def accepts(self, value: Any) -> bool:
        """True for a colour or an empty text."""
        return not value or COLOR.fullmatch(value) is not None


Number = Annotated[int, Range(0, 2**53)]
"""A serial number that the client counts."""
Side = Annotated[int, Range(1, 10_000)]
"""A side of the client's window, CSS pixels."""
Ratio = Annotated[float, Range(0.1, 10)]
"""Device pixels per CSS pixel."""
Place = Annotated[float, Range(-1e4, 1e4)]
"""A coordinate in pixels from the image's top left corner; it may lie outside of the image."""
Point = Annotated[list[float], Length(3, 3), Range(-1e9, 1e9)]
"""A point of the world, metres."""
Rotation = Annotated[list[float], Length(9, 9), Range(-1.001, 1.001)]
"""The rotation camera_from_world, row by row."""
Slot = Annotated[int, Range(-1, 2**16 - 1)]
"""A material slot of an object; -1 for all slots."""
Name = Annotated[str, Length(1000)]
FileName = Annotated[str, Length(1000, 1)]


def chosen_slot(slot: int) -> int | None:
    """The value of a `Slot`; None for all slots."""
    return None if slot < 0 else slot


@dataclass(frozen=True)
class Message:
    """A message of a client."""

    KIND: ClassVar[str]
    """The message's `type` in JSON."""
    UNDO: ClassVar[Literal["no", "step", "group"]] = "no"
    """Whether a change of the view can be undone; "group": changes with short pauses are one step."""
    CHANGES: ClassVar[Literal["nothing", "view", "world"]] = "nothing"
    """The state that the message changes: "nothing" if other clients are not affected, the client's "view", or the
    "world" and other state that all clients share.

    With `follow=True`, followers cannot change the world, and cannot change the view while they show the leader's.
    """


@dataclass(frozen=True)
class Hello(Message):
    """Starts a session, or resumes the session with this id."""

    KIND = "hello"
    width: Side
    height: Side
    ratio: Ratio
    session: Annotated[str, Length(64)]


@dataclass(frozen=True)
class Size(Message):
    """The space for the image in the client's window."""

    KIND = "size"
    width: Side
    height: Side
    ratio: Ratio


@dataclass(frozen=True)
class Move(Message):
    """The new camera pose, which the client computed."""

    KIND = "move"
    UNDO = "group"
    CHANGES = "view"
    seq: Number
    R: Rotation
    C: Point
    fx: Annotated[float, Range(1e-9, 1e12)]
    """The scale of a camera with parallel rays, in image pixels per metre; unused for other cameras."""
    pivot: Point


@dataclass(frozen=True)
class Home(Message):
    """Returns to the camera that the view started with."""

    KIND = "home"
    UNDO = "step"
    CHANGES = "view"
    seq: Number


@dataclass(frozen=True)
class Locate(Message):
    """Requests the ray of an image position, and the hit point with its object's bounds."""

    KIND = "locate"
    id: Number
    image: Number
    u: Place
    v: Place


@dataclass(frozen=True)
class Ground(Message):
    """Requests the heights of two positions above the ground, for walking."""

    KIND = "ground"
    id: Number
    begin: Point
    end: Point
    foot: Annotated[float, Range(0, 1e9)]


@dataclass(frozen=True)
class LookThrough(Message):
    """Looks through a camera of the world; an empty name keeps the pose as a free camera."""

    KIND = "camera"
    UNDO = "step"
    CHANGES = "view"
    seq: Number
    name: Name


@dataclass(frozen=True)
class Panes(Message):
    """Shows several cameras of the world at once, or only the main view if the list is empty."""

    KIND = "panes"
    CHANGES = "view"
    names: Annotated[list[Name], Length(MAX_PANES)]
    """The names of the cameras; an empty name is the camera of the main view."""


@dataclass(frozen=True)
class Photograph(Message):
    """Requests the photograph of a camera of the world."""

    KIND = "photograph"
    name: Name


@dataclass(frozen=True)
class Time(Message):
    """Sets the world's time in seconds, and the animation (empty for the first animation)."""

    KIND = "time"
    CHANGES = "view"
    t: Annotated[float, Range(0, 1e6)]
    animation: Name


@dataclass(frozen=True)
class Variant(Message):
    """Chooses a material variant; empty for the file's own materials."""

    KIND = "variant"
    UNDO = "step"
    CHANGES = "view"
    name: Name


@dataclass(frozen=True)
class Framing(Message):
    """Frames the whole world from the present direction; a field of view of 0 degrees keeps the lens."""

    KIND = "framing"
    UNDO = "group"
    CHANGES = "view"
    seq: Number
    zoom: Annotated[float, Range(0.01, 100)]
    fov: Annotated[float, Range(0, 170)]


@dataclass(frozen=True)
class FromSide(Message):
    """Views the whole world from a side, with the camera's lens."""

    KIND = "side"
    UNDO = "step"
    CHANGES = "view"
    seq: Number
    name: Annotated[str, OneOf(tuple(DIRECTIONS))]


@dataclass(frozen=True)
class Look(Message):
    """Sets the light, the ground and the background; angles are in degrees."""

    KIND = "look"
    UNDO = "group"
    CHANGES = "view"
    light: Annotated[str, OneOf(LIGHTS)]
    rotation: Annotated[float, Range(-360, 360)]
    azimuth: Annotated[float, Range(-360, 360)]
    elevation: Annotated[float, Range(-90, 90)]
    ground: Annotated[str, OneOf((*GROUNDS, "color"))]
    ground_color: Annotated[str, Color()]
    """The colour of the ground "color"."""
    backdrop: Annotated[str, OneOf(("light", "color", "image"))]
    """The background: that of the light, such as its sky; a colour; or the current image."""
    background: Annotated[str, Color()]
    """The colour of the backdrop "color"."""


@dataclass(frozen=True)
class LookImage(Message):
    """Uses an uploaded image as the environment that lights the world, or as the background."""

    KIND = "look_image"
    UNDO = "step"
    CHANGES = "view"
    use: Annotated[str, OneOf(("light", "background"))]
    file: FileName


@dataclass(frozen=True)
class RestoreLook(Message):
    """Restores the light, the ground and the background of the view's start."""

    KIND = "restore_look"
    UNDO = "step"
    CHANGES = "view"


@dataclass(frozen=True)
class TurnUp(Message):
    """Sets the world's up axis, and shows the whole world from the first camera's side."""

    KIND = "up"
    CHANGES = "world"
    axis: Annotated[str, OneOf(("z", "y"))]


@dataclass(frozen=True)
class Lens(Message):
    """Sets the intrinsics, in the camera's own pixels, and the lens model's coefficients."""

    KIND = "lens"
    UNDO = "group"
    CHANGES = "view"
    fx: Annotated[float, Range(1e-3, 1e7)]
    fy: Annotated[float, Range(1e-3, 1e7)]
    cx: Annotated[float, Range(-1e7, 1e7)]
    cy: Annotated[float, Range(-1e7, 1e7)]
    distortion: Annotated[list[float], Length(32), Range(-1e6, 1e6)]


@dataclass(frozen=True)
class Pose(Message):
    """Sets the camera's location in metres and its angles in degrees."""

    KIND = "pose"
    UNDO = "group"
    CHANGES = "view"
    location: Point
    roll: Annotated[float, Range(-1e4, 1e4)]
    pitch: Annotated[float, Range(-1e4, 1e4)]
    yaw: Annotated[float, Range(-1e4, 1e4)]


@dataclass(frozen=True)
class Overlay(Message):
    """Chooses the lines that are drawn over the image."""

    KIND = "overlay"
    CHANGES = "view"
    cameras: bool
    explained: bool
    grid: bool


@dataclass(frozen=True)
class Scan(Message):
    """Draws the points of one of the world's lidars over the image; an empty name hides them."""

    KIND = "scan"
    CHANGES = "view"
    lidar: Name


@dataclass(frozen=True)
class Edit(Message):
    """Changes one property of an object or a light."""

    KIND = "edit"
    CHANGES = "world"
    kind: Annotated[str, OneOf(("object", "light"))]
    number: Annotated[int, Range(0, 10**6)]
    key: Annotated[
        str,
        OneOf(
            (
                "visible",
                "color",
                "move",
                "turn",
                "scale",
                "strength",
                "isolate",
                "place",
                "level",
                "position",
                "direction",
                "add",
                "remove",
            ),
        ),
    ]
    value: (
        bool
        | Annotated[float, Range(-1e9, 1e9)]
        | Annotated[str, Length(64)]
        | Annotated[list[float], Length(4), Range(-1e9, 1e9)]
    )


@dataclass(frozen=True)
class EditMaterial(Message):
    """Changes one value of the material in one slot, or in all slots, of an object."""

    KIND = "edit_material"
    CHANGES = "world"
    number: Annotated[int, Range(0, 10**6)]
    slot: Slot
    key: Annotated[str, OneOf(MATERIAL_KEYS)]
    value: Annotated[float, Range(-1e9, 1e9)] | Annotated[str, Length(64)]


@dataclass(frozen=True)
class Select(Message):
    """Selects an object and its material slot; `tool` determines whether its outline and handles are shown."""

    KIND = "select"
    CHANGES = "view"
    number: Annotated[int, Range(0, 10**6)]
    slot: Slot
    tool: Annotated[str, OneOf(("none", "outline", *TOOLS))]


@dataclass(frozen=True)
class SelectLight(Message):
    """Selects a light, and shows handles that move it."""

    KIND = "select_light"
    CHANGES = "view"
    number: Annotated[int, Range(0, 10**6)]


@dataclass(frozen=True)
class Texture(Message):
    """Replaces a texture of a material by an uploaded image, or removes it if `file` is empty."""

    KIND = "texture"
    CHANGES = "world"
    number: Annotated[int, Range(0, 10**6)]
    slot: Slot
    texture: Annotated[str, OneOf(TEXTURE_KEYS)]
    file: Name


@dataclass(frozen=True)
class Thumbnails(Message):
    """Requests small images of the textures of a material."""

    KIND = "thumbnails"
    number: Annotated[int, Range(0, 10**6)]
    slot: Slot


@dataclass(frozen=True)
class KeepCamera(Message):
    """Adds the present camera to the world, under a name (empty: "view")."""

    KIND = "keep_camera"
    CHANGES = "world"
    name: Name


@dataclass(frozen=True)
class RemoveCamera(Message):
    """Removes a camera of the world."""

    KIND = "remove_camera"
    CHANGES = "world"
    name: FileName


@dataclass(frozen=True)
class Gizmo(Message):
    """A drag of a handle between two image positions; one drag is one undo step."""

    KIND = "gizmo"
    CHANGES = "world"
    handle: Annotated[str, OneOf((*HANDLES, FLOOR_HANDLE))]
    stroke: Number
    begin: Annotated[list[float], Length(2, 2), Range(-1e4, 1e4)]
    end: Annotated[list[float], Length(2, 2), Range(-1e4, 1e4)]


@dataclass(frozen=True)
class Undo(Message):
    """Undoes the last edit."""

    KIND = "undo"
    CHANGES = "world"


@dataclass(frozen=True)
class Redo(Message):
    """Repeats the last undone edit."""

    KIND = "redo"
    CHANGES = "world"


@dataclass(frozen=True)
class Channel(Message):
    """Chooses the channel that is shown."""

    KIND = "channel"
    CHANGES = "view"
    name: Annotated[str, OneOf(tuple(CHANNELS))]


@dataclass(frozen=True)
class Display(Message):
    """Sets exposure (stops) and view transform of the saved and the moving images."""

    KIND = "display"
    CHANGES = "view"
    exposure: Annotated[float, Range(-100, 100)]
    view: Annotated[str, OneOf(tuple(VIEWS))]


@dataclass(frozen=True)
class Quality(Message):
    """Chooses the integrator of the still image."""

    KIND = "quality"
    UNDO = "step"
    CHANGES = "view"
    integrator: Literal["direct", "path"]


@dataclass(frozen=True)
class Probe(Message):
    """Requests the values of a pixel.

    If the image is out of date and its view is no longer stored, the request is not answered: the client repeats it
    with the next image.
    """

    KIND = "probe"
    id: Number
    image: Number
    u: Annotated[int, Range(0, MAX_IMAGE_SIZE[0] - 1)]
    v: Annotated[int, Range(0, MAX_IMAGE_SIZE[1] - 1)]


@dataclass(frozen=True)
class Tile(Message):
    """Requests the exact numbers of a part of the shown channel, of at most 65,536 pixels."""

    KIND = "tile"
    id: Number
    image: Number
    u: Annotated[int, Range(0, MAX_IMAGE_SIZE[0] - 1)]
    v: Annotated[int, Range(0, MAX_IMAGE_SIZE[1] - 1)]
    width: Annotated[int, Range(1, 256)]
    height: Annotated[int, Range(1, 256)]


@dataclass(frozen=True)
class Pick(Message):
    """Reports a clicked pixel to the callbacks of `Viewer.on_pick`."""

    KIND = "pick"
    CHANGES = "world"
    image: Number
    u: Annotated[int, Range(0, MAX_IMAGE_SIZE[0] - 1)]
    v: Annotated[int, Range(0, MAX_IMAGE_SIZE[1] - 1)]


@dataclass(frozen=True)
class Hold(Message):
    """Reports the held pixel, which followers show; an empty list if no pixel is held."""

    KIND = "hold"
    pixel: Annotated[list[int], Length(2), Range(0, max(MAX_IMAGE_SIZE) - 1)]


@dataclass(frozen=True)
class Follow(Message):
    """Shows the leader's view, looks around independently, or takes the lead."""

    KIND = "follow"
    mode: Literal["attach", "detach", "lead"]


@dataclass(frozen=True)
class Explain(Message):
    """Requests the explanation of a pixel."""

    KIND = "explain"
    id: Number
    image: Number
    u: Annotated[int, Range(0, MAX_IMAGE_SIZE[0] - 1)]
    v: Annotated[int, Range(0, MAX_IMAGE_SIZE[1] - 1)]


@dataclass(frozen=True)
class Forget(Message):
    """Removes the rays of the explained pixel from the image."""

    KIND = "forget"
    CHANGES = "view"


@dataclass(frozen=True)
class Snapshot(Message):
    """Requests a file of the still image or of the world."""

    KIND = "snapshot"
    format: Literal["png", "html", "npz", "glb", "toml"]


@dataclass(frozen=True)
class Film(Message):
    """Requests a video: a turn around the pivot, or the world's own movement for 0 degrees."""

    KIND = "film"
    CHANGES = "world"
    seconds: Annotated[float, Range(0.1, 60)]
    degrees: Annotated[float, Range(-720, 720)]


@dataclass(frozen=True)
class Stop(Message):
    """Stops the video that is being rendered."""

    KIND = "stop"
    CHANGES = "world"


@dataclass(frozen=True)
class Upload(Message):
    """A piece of a dropped file; the pieces of a file come in order."""

    KIND = "upload"
    CHANGES = "world"
    name: FileName
    bytes: Annotated[int, Range(1, 2**28)]
    offset: Annotated[int, Range(0, 2**28)]
    data: Annotated[str, Base64()]


@dataclass(frozen=True)
class Open(Message):
    """Opens an uploaded file as the world; `others` are models that are shown in the same world."""

    KIND = "open"
    CHANGES = "world"
    name: FileName
    others: Annotated[list[FileName], Length(MAX_MODELS)]


@dataclass(frozen=True)
class Copy(Message):
    """Requests the camera as text, or the command that renders the image."""

    KIND = "copy"
    format: Literal["python", "toml", "command", "opencv", "colmap"]


@dataclass(frozen=True)
class Acknowledge(Message):
    """Confirms that an image arrived."""

    KIND = "ack"
    picture: Number


@dataclass(frozen=True)
class Control(Message):
    """Reports a new value of a control that the script added; the value of a button is ignored."""

    KIND = "control"
    CHANGES = "world"
    id: Number
    value: bool | Annotated[float, Range(-1e12, 1e12)] | Annotated[str, Length(1000)]


@dataclass(frozen=True)
class Planes(Message):
    """Chooses whether still images are sent as exact numbers or only for display."""

    KIND = "planes"
    CHANGES = "view"
    wanted: bool
    """True for exact numbers, which comparisons and ranges require."""


@dataclass(frozen=True)
class Visible(Message):
    """Reports whether the page is visible; hidden pages receive no images."""

    KIND = "visible"
    visible: bool


MESSAGES: dict[str, type[Message]] = {each.KIND: each for each in Message.__subclasses__()}
"""The message classes by the `type` of their JSON."""
