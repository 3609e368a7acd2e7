"""The live view in a notebook cell.

The client is in a frame; its messages use the kernel's own connection.

The widget forwards messages without interpreting them. Each output that shows the widget is a view with its own
session.
"""

from __future__ import annotations

import base64
import hashlib
import os
import sys
from collections.abc import Callable, Sequence
from typing import Any

from ..errors import Error
from .answers import SLOW, Answers, probe
from .bundle import bundle, style_sheet
from .client_messages import Hello, Message, Probe, Size
from .messages import BadMessage, parse_message
from .scheduler import Scheduler
from .server import MOST_SESSIONS
from .session import Session
from .web.document import filled, title_text

__all__ = ["RELAY", "Views", "cell_page", "is_unattended", "make_widget"]

Say = Callable[[dict[str, Any], Sequence[bytes]], None]

RELAY = r"""
const PATIENCE = 5000; // ms that an answer may take

export default {
  render({ model, el }) {
    const view = Math.random().toString(36).slice(2);
    const frame = document.createElement("iframe");
    frame.setAttribute("sandbox", "allow-scripts allow-downloads");
    frame.setAttribute("allow", "clipboard-write");
    frame.title = "raycam";
    const size = `display: block; box-sizing: border-box; width: 100%; height: ${model.get("height")}px;`;
    frame.style.cssText = `${size} border: 1px solid #8888; border-radius: 6px`;
    frame.srcdoc = model.get("page");
    const last = document.createElement("figure");
    last.style.cssText = "display: none; margin: 0";
    const image = document.createElement("img");
    [image.src, image.alt] = [model.get("still"), "the view when the cell was run"];
    image.style.cssText = "max-width: 100%";
    last.append(image, document.createElement("figcaption"));
    last.lastChild.textContent =
      "No kernel answers: this image shows the view when the cell was run. Run the cell again to move it.";
    const show = (isLive) => {
      [frame.style.display, last.style.display] = isLive ? ["block", "none"] : ["none", "block"];
    };
    let [waits, answered] = [0, false];
    const silent = () => {
      waits = 0;
      const text = "The kernel does not answer: it is busy or has ended. If it has ended, run the cell again.";
      if (answered) frame.contentWindow?.postMessage({ message: { type: "notice", text }, buffers: [] }, "*");
      else if (model.get("still")) show(false);
    };
    const heard = ({ source, data }) => {
      if (source !== frame.contentWindow || typeof data !== "string") return;
      if (!waits && /^\{"type":"(hello|probe)"/.test(data)) waits = setTimeout(silent, PATIENCE);
      model.send({ view, said: data });
    };
    const told = (content, buffers) => {
      if (content.view !== view) return;
      clearTimeout(waits);
      if (!answered) show(true);
      [waits, answered] = [0, true];
      const copies = (buffers || []).map((each) => {
        const isView = ArrayBuffer.isView(each);
        return (isView ? new Uint8Array(each.buffer, each.byteOffset, each.byteLength) : new Uint8Array(each)).slice();
      });
      frame.contentWindow?.postMessage({ message: content.message, buffers: copies }, "*");
    };
    addEventListener("message", heard);
    model.on("msg:custom", told);
    el.append(frame, last);
    return () => {
      clearTimeout(waits);
      removeEventListener("message", heard);
      model.off("msg:custom", told);
      model.send({ view, said: null });
    };
  },
};
"""


def is_unattended() -> bool:
    """True if a program executes the notebook, as `jupyter nbconvert --execute` does.

    The kernel of such a program ends before a widget is shown, and a page with a widget is empty without a network.
    Such programs are recognised because they do not accept input for the cell. Voilà also executes notebooks, but keeps
    the kernel.
    """
    ipython = sys.modules.get("IPython")
    kernel = None if ipython is None else getattr(ipython.get_ipython(), "kernel", None)
    if kernel is None or os.environ.get("SERVER_SOFTWARE", "").startswith("voila"):
        return False
    return not kernel.get_parent().get("content", {}).get("allow_stdin", True)


def cell_page(title: str) -> str:
    """The HTML text of the page in a cell, which runs only its own script and sends no requests."""
    script, style = f"\n{bundle()}", f"\n{style_sheet()}"

    def hashed(text: str) -> str:
        return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"

    policy = (
        f"default-src 'none'; script-src {hashed(script)}; style-src {hashed(style)}; img-src blob: data:; "
        "base-uri 'none'; form-action 'none'"
    )
    return filled(
        {
            "head": f'<meta http-equiv="Content-Security-Policy" content="{policy}">',
            "title": title_text(title),
            "style": f"<style>{style}</style>",
            "data": '<meta id="in-a-cell">',
            "script": f"<script>{script}</script>",
        }
    )


class Views:
    """The sessions of a widget: one session for each output that shows the widget."""

    def __init__(self, make_session: Callable[[], Session], say: Say) -> None:
        self.sessions: dict[str, Session] = {}
        self._make_session = make_session
        self._say = say
        self._answers = Answers()
        self.scheduler: Scheduler | None = None
        self.owner: object = None
        """The viewer, which is kept alive from its first display until its last output is removed."""

    def hear(self, content: Any) -> None:
        """Executes the message `content["said"]` of the view `content["view"]`.

        If the message is None, the view is closed. Malformed messages are answered with an error; content without a
        view is ignored.
        """
        if not isinstance(content, dict) or not isinstance(content.get("view"), str):
            return
        view, said = content["view"][:64], content.get("said")
        session = self.sessions.get(view)
        if said is None:
            if session is not None:
                self.sessions.pop(view).connection.close()
                self._answers.forget(session)
                if not self.sessions:
                    self._rest()
            return
        try:
            message = parse_message(said)
            if isinstance(message, Hello):
                session = self._greet(view, message)
            elif session is not None:
                self._do(session, message)
            if self.scheduler is not None:
                self.scheduler.wake()
        except (BadMessage, Error) as error:
            self._tell(view, {"type": "error", "text": str(error)})

    def _greet(self, view: str, hello: Hello) -> Session:
        if view not in self.sessions and len(self.sessions) >= MOST_SESSIONS:
            self.sessions.pop(next(iter(self.sessions))).connection.close()  # close the oldest session
        session = self.sessions[view] = self._make_session()
        if self.scheduler is None:
            self.scheduler = Scheduler(lambda: list(self.sessions.values()))
            self.scheduler.start()
        session.connection.open(lambda message, buffers: self._tell(view, message, buffers))
        session.greet()
        session.receive(Size(hello.width, hello.height, hello.ratio))
        return session

    def _do(self, session: Session, message: Message) -> None:
        if isinstance(message, Probe):
            probe(session, message)
        elif not isinstance(message, SLOW):
            session.receive(message)
        else:
            self._answers.queue_message(session, message)

    def _tell(self, view: str, message: dict[str, Any], buffers: Sequence[bytes] = ()) -> None:
        self._say({"view": view, "message": message}, list(buffers))

    def close(self) -> None:
        """Ends the rendering."""
        for view in list(self.sessions):
            self._tell(view, {"type": "closing", "text": "The view was closed."})
        self.sessions.clear()
        self._rest()
        self._answers.close()

    def _rest(self) -> None:
        """Ends the render thread, and releases the viewer; another output starts a new thread."""
        self.owner = None
        if self.scheduler is not None:
            self.scheduler.end()
            self.scheduler.join()
            self.scheduler = None


def make_widget(make_session: Callable[[], Session], title: str, height: int) -> Any:
    """Returns the widget of a world; its `views` are the sessions.

    Raises `ImportError` without anywidget. The image `still` of the widget, a data URL, is shown if no kernel is
    running, as in notebooks that are only read.
    """
    import anywidget
    import traitlets

    class LiveView(anywidget.AnyWidget):  # type: ignore[misc]
        """A live view of a world."""

        _esm = RELAY
        page = traitlets.Unicode().tag(sync=True)
        height = traitlets.Int().tag(sync=True)
        still = traitlets.Unicode().tag(sync=True)

        def __init__(self) -> None:
            super().__init__(page=cell_page(title), height=height)
            self.views = Views(make_session, lambda content, buffers: self.send(content, buffers))
            self.on_msg(lambda widget, content, buffers: self.views.hear(content))

        def close(self) -> None:
            """Stops the rendering and removes the widget."""
            self.views.close()
            super().close()

    return LiveView()
