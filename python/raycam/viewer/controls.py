"""Controls and drawings that a script adds to a live view.

A script can add sliders, buttons, checkboxes, texts, images, plots, labels and lines.
"""

from __future__ import annotations

import math
import re
import threading
import weakref
from collections.abc import Callable
from typing import Any, Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from ..arguments import as_number, floats, real
from ..errors import SettingsError
from ..explanation.scene_figure import Line
from ..render.channel_picture import encode_jpeg
from .callbacks import callback
from .wire import data_url

__all__ = ["Control", "Controls", "Folder", "Value"]

MAX_CONTROLS = 500
MAX_POINTS = 10_000
"""The largest number of points in a plot or a line."""
MAX_TEXT_LENGTH = 1000
DRAWN_KINDS = ("label", "lines")
"""Kinds that are drawn over the image instead of in the panel."""
CONTROL_COLOR = "#ffd60a"
COLOR = re.compile(r"#[0-9a-fA-F]{6}")

REQUIRED_VALUES = {
    "checkbox": "True or False",
    "text": f"a string of at most {MAX_TEXT_LENGTH} characters",
    "slider": "a number",
    "button": "a number",
}
"""The values of each kind of control."""

Value = bool | float | str
Callback = TypeVar("Callback", bound=Callable[["Control"], object])


class Listener(Protocol):
    """A session that shows the controls."""

    def show_controls(self) -> None:
        """Shows the current controls."""


class Control:
    """A control or drawing of a script, whose properties can be read and set from any thread."""

    def __init__(
        self, controls: Controls, number: int, kind: str, label: str, folder: str, **properties: Any
    ) -> None:
        self._controls = controls
        self._callbacks: list[Callable[..., object]] = []
        self.number = number
        self.kind = kind
        self.label = label
        self._folder = folder
        self._properties = properties

    @property
    def value(self) -> Value:
        """The value that the viewer or the script set last; the number of clicks of a button."""
        found: Value = self._properties["value"]
        return found

    @value.setter
    def value(self, value: Value) -> None:
        self._properties["value"] = self.checked(value)
        self._controls.changed()

    def checked(self, value: Any) -> Value:
        """Returns a value in the control's type; raises `SettingsError` if it is out of range."""
        if isinstance(value, np.generic):
            value = value.item()
        if self.kind == "checkbox" and isinstance(value, bool):
            return value
        if self.kind == "text" and isinstance(value, str) and len(value) <= MAX_TEXT_LENGTH:
            return value
        number = as_number(value)
        if self.kind in ("slider", "button") and number is not None:
            low, high = self._properties.get("min", 0), self._properties.get("max", math.inf)
            if low <= number <= high:
                return number
            raise SettingsError(
                f"{self.label}: {value!r} is out of range; expected {low:g} to {high:g}", code="out_of_range"
            )
        raise SettingsError(
            f"{self.label}: invalid value {value!r}; a {self.kind} requires {REQUIRED_VALUES[self.kind]}",
            code="invalid_value",
        )

    def set_range(self, low: float, high: float, value: float) -> None:
        """Sets the ends and the value of a slider."""
        self._properties |= {"min": low, "max": high}
        self.value = value

    def on_change(self, function: Callback) -> Callback:
        """Calls `function(control)` after each change in the browser.

        Returns `function`, so that `on_change` can be used as a decorator. Functions are called one after another on a
        thread of the view; coroutine functions run in the event loop in which `on_change` is called. An
        exception is printed and shown in the view. Raises `SettingsError` for a coroutine function if no
        event loop is running.
        """
        self._callbacks.append(callback(function))
        return function

    on_click = on_change

    def call(self) -> None:
        """Calls the callbacks in order; stops at the first exception, and raises it."""
        for function in self._callbacks:
            function(self)

    def update(self, **properties: Any) -> None:
        """Replaces properties of an image, a plot, a label or lines.

        The method accepts the arguments of the method that added the control.
        """
        made = self._controls.describe(self.kind, **properties)
        self._properties |= made
        self._controls.changed()

    def remove(self) -> None:
        """Removes the control from the view."""
        self._controls.remove(self)

    def describe(self) -> dict[str, Any]:
        """Returns the control's entry in the message `controls`."""
        own = {name: each for name, each in self._properties.items() if name != "points"}
        return {"id": self.number, "kind": self.kind, "label": self.label, "folder": self._folder, **own}

    def line(self) -> Line:
        """The polyline or the labelled point of the control, in world coordinates."""
        name = self._properties.get("text", "")
        return Line(name, self._properties.get("color", CONTROL_COLOR), self._properties["points"])

    def __repr__(self) -> str:
        """The kind and the label."""
        return f"Control({self.kind} {self.label!r})"


class Folder:
    """A group of controls in the panel. All methods raise `SettingsError` for invalid arguments."""

    def __init__(self, controls: Controls, name: str) -> None:
        self._controls = controls
        self._name = name

    def _add(self, kind: str, label: str, **properties: Any) -> Control:
        return self._controls.add(kind, label, self._name, **properties)

    def add_slider(
        self,
        label: str,
        *,
        min: float = 0.0,
        max: float = 1.0,
        step: float | None = None,
        value: float | None = None,
    ) -> Control:
        """Adds a slider from `min` to `max` in steps of `step`, initially at `value` (or `min`)."""
        low, high = real("min", min, what="a number"), real("max", max, what="a number")
        if not low < high:
            raise SettingsError(f"{label}: min {low:g} must be less than max {high:g}", code="out_of_range")
        pace = (high - low) / 100 if step is None else real("step", step, 0, what="a number")
        return self._add("slider", label, min=low, max=high, step=pace, value=low if value is None else value)

    def add_button(self, label: str) -> Control:
        """Adds a button; `on_click` adds a callback."""
        return self._add("button", label, value=0)

    def add_checkbox(self, label: str, value: bool = False) -> Control:
        """Adds a checkbox with a `label`, which is checked at the start if `value`."""
        return self._add("checkbox", label, value=value)

    def add_text(self, label: str, value: str = "", *, editable: bool = True) -> Control:
        """Adds a text of at most 1000 characters, which viewers can edit if `editable`."""
        return self._add("text", label, value=value, editable=editable)

    def add_image(self, label: str, image: npt.ArrayLike) -> Control:
        """Adds an image [h, w, 3] of sRGB bytes; `update(image=...)` replaces the image."""
        return self._add("image", label, **self._controls.describe("image", image=image))

    def add_plot(self, label: str, x: npt.ArrayLike, y: npt.ArrayLike) -> Control:
        """Adds a line plot of `y` [n] over `x` [n], with at most 10,000 points.

        `update(x=..., y=...)` replaces the data.
        """
        return self._add("plot", label, **self._controls.describe("plot", x=x, y=y))


class Controls(Folder):
    """All controls of a view, which its sessions share."""

    def __init__(self) -> None:
        super().__init__(self, "")
        self._all: dict[int, Control] = {}
        self._count = 0
        self._lock = threading.RLock()
        self._listeners: weakref.WeakSet[Any] = weakref.WeakSet()

    def listen(self, listener: Listener) -> None:
        """Reports each change to `listener` until it is garbage-collected."""
        with self._lock:
            self._listeners.add(listener)

    def add_folder(self, name: str) -> Folder:
        """Adds a group of controls."""
        return Folder(self, str(name))

    def add_label(self, text: str, position: npt.ArrayLike, *, color: str = CONTROL_COLOR) -> Control:
        """Adds a text at a point [3] of the world."""
        return self._add("label", text, **self.describe("label", text=text, position=position, color=color))

    def add_lines(self, points: npt.ArrayLike, *, color: str = CONTROL_COLOR) -> Control:
        """Adds a line through points [n, 3] of the world, which is drawn over the image."""
        return self._add("lines", "", **self.describe("lines", points=points, color=color))

    def add(self, kind: str, label: str, folder: str, **properties: Any) -> Control:
        """Adds a control. Raises `SettingsError` for invalid properties, and for too many controls."""
        with self._lock:
            if len(self._all) >= MAX_CONTROLS:
                raise SettingsError(
                    f"too many controls: the limit is {MAX_CONTROLS}; remove some first",
                    code="budget_exceeded",
                )
            self._count += 1
            made = Control(self, self._count, kind, str(label), folder, **properties)
            if "value" in properties:
                made._properties["value"] = made.checked(made.value)
            self._all[made.number] = made
        self.changed()
        return made

    def remove(self, control: Control) -> None:
        """Removes a control; has no effect if the control is already removed."""
        with self._lock:
            self._all.pop(control.number, None)
        self.changed()

    def changed(self) -> None:
        """Reports a change to the sessions."""
        with self._lock:
            listeners = list(self._listeners)
        for listener in listeners:
            listener.show_controls()

    def message(self) -> dict[str, Any]:
        """The message `controls` of the server, which describes all controls."""
        listed = [each.describe() for each in list(self._all.values()) if each.kind not in DRAWN_KINDS]
        return {"type": "controls", "controls": listed}

    def lines(self) -> list[Line]:
        """The labels and lines that are drawn over the image."""
        return [each.line() for each in list(self._all.values()) if each.kind in DRAWN_KINDS]

    def set_from_client(self, number: int, value: Value) -> Control:
        """Sets the value of a control that a client changed.

        Raises `SettingsError` for a removed control, a text that cannot be edited, and an invalid value.
        """
        control = self._all.get(number)
        if control is None or "value" not in control.describe():
            raise SettingsError("control not found: the script has removed it", code="unknown_name")
        if control.describe().get("editable") is False:
            raise SettingsError(f"{control.label}: this text cannot be edited", code="conflicting_values")
        control.value = float(control.value) + 1 if control.kind == "button" else value
        return control

    @staticmethod
    def describe(kind: str, **properties: Any) -> dict[str, Any]:
        """Checks new values of an image, plot, label or lines, and returns them in the form that the page expects.

        Raises `SettingsError` for invalid values, other kinds and unknown properties.
        """
        if kind == "image" and set(properties) == {"image"}:
            image = np.asarray(properties["image"])
            if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8 or not image.size:
                raise SettingsError(
                    f"image: expected bytes [h, w, 3], got {image.dtype} {list(image.shape)}",
                    code="wrong_shape",
                )
            return {"image": data_url("image/jpeg", encode_jpeg(image))}
        if kind == "plot" and set(properties) == {"x", "y"}:
            x, y = (np.asarray(properties[name], float).ravel() for name in ("x", "y"))
            if len(x) != len(y) or not 2 <= len(x) <= MAX_POINTS or not np.isfinite([x, y]).all():
                raise SettingsError(
                    f"plot: expected x and y of equal length, with 2 to {MAX_POINTS} finite numbers each; got {len(x)} "
                    f"and {len(y)} numbers",
                    code="wrong_shape",
                )
            return {"x": x.tolist(), "y": y.tolist()}
        if kind == "label" and {"text", "position"} <= set(properties):
            point = floats("position", properties["position"], (3,), error=SettingsError)
            color = properties.get("color", CONTROL_COLOR)
            return {
                "text": str(properties["text"]),
                "points": np.stack([point, point]),
                "color": _color(color),
            }
        if kind == "lines" and "points" in properties:
            points = np.asarray(properties["points"], float)
            if points.ndim != 2 or points.shape[1] != 3 or not 2 <= len(points) <= MAX_POINTS:
                raise SettingsError(
                    f"points: expected [n, 3] with n from 2 to {MAX_POINTS}, got {list(points.shape)}",
                    code="wrong_shape",
                )
            return {"points": points, "color": _color(properties.get("color", CONTROL_COLOR))}
        raise SettingsError(
            f"{kind}: cannot be updated with {', '.join(properties)}; use the arguments with which it was created",
            code="unknown_name",
        )


def _color(text: str) -> str:
    """Returns a colour #rrggbb; raises `SettingsError` for other values."""
    if not isinstance(text, str) or not COLOR.fullmatch(text):
        raise SettingsError(f"color: expected #rrggbb, got {text!r}", code="invalid_value")
    return text
