"""Messages of a client as a session receives them."""

from __future__ import annotations

import itertools
import json
import math
from typing import Any

import numpy as np
from raycam.viewer.messages import parse_message
from raycam.viewer.session import Session

SEQUENCE = itertools.count(1)


def receive(session: Session, message: dict[str, Any]) -> None:
    """Passes a message to a session through JSON, as the server does."""
    session.receive(parse_message(json.dumps(message)))


def orbited(camera: dict[str, Any], degrees: float) -> dict[str, Any]:
    """The client message `move` that turns a camera about the up axis through its pivot."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    if camera["up"] == [0, 1, 0]:
        turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    pivot = np.array(camera["pivot"])
    R = np.reshape(camera["R"], (3, 3)) @ turn.T
    C = pivot + turn @ (np.array(camera["C"]) - pivot)
    seq = next(SEQUENCE)
    return {
        "type": "move",
        "seq": seq,
        "R": R.ravel().tolist(),
        "C": C.tolist(),
        "fx": camera["K"][0],
        "pivot": camera["pivot"],
    }


def orbit(session: Session, degrees: float) -> None:
    """Turns a session's camera about its pivot."""
    receive(session, orbited(session.view.camera_message(0), degrees))
