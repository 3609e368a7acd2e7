"""Following: one client leads, and other clients show its images.

The images are rendered once for all clients.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from ...errors import SettingsError
from ..client_messages import MESSAGES, Message
from .session import Session

__all__ = ["MOST_FOLLOWERS", "MOST_FREE", "Following"]

MOST_FREE = 8
"""Maximum number of sessions with their own images: the leader, and followers that look around independently."""
MOST_FOLLOWERS = 40
"""Maximum number of sessions that show the leader's images."""
BLOCKED = {
    change: tuple(kind for kind, message in MESSAGES.items() if change == message.CHANGES)
    for change in ("view", "world")
}
"""Types of messages that change the view, and types of messages that change the world or shared settings."""
REFUSALS = {
    "view": "You follow the leader: press Look around to move freely.",
    "world": "Only the leader can change the world, use controls of the script, open files and record videos.",
}


class Following:
    """The leader and its followers.

    Attached followers show the leader's view and share its images. Detached followers look around: they have a view of
    their own.
    """

    def __init__(self, leader: Session, token: str = "") -> None:
        """Starts without followers; `token` is the followers' token, a part of their address."""
        self.leader = leader
        """The session that leads, even while no client is connected to it."""
        self._token = token
        self._others: list[Session] = []
        self._may_lead = {leader.connection.id}
        self._held: tuple[int, int] | None = None
        leader.role.on_show = self._mirror
        leader.show(
            leader.view
        )  # starts the leader's images, which followers show even before the leader connects

    def may_lead(self, session: Session) -> bool:
        """True if the session's client may take the lead and change the world."""
        return session.connection.id in self._may_lead

    def join(self, session: Session, *, may_lead: bool) -> None:
        """Adds the session of a new client, which follows."""
        if may_lead:
            self._may_lead.add(session.connection.id)
        session.role.allows_open = session.role.allows_open and may_lead
        session.role.is_read_only = not may_lead
        session.mirror(self.leader, self._held)
        self._others.append(session)

    def announce(self, session: Session) -> None:
        """Sends a client its role, and the types of messages that it must not send."""
        message = {
            "type": "following",
            "leads": session is self.leader,
            "attached": session.role.is_attached,
            "may_lead": self.may_lead(session),
            "token": self._token if self.may_lead(session) else "",
            "followers": len(self.leader.connection.followers),
            "blocked": self._blocked(session),
        }
        session.connection.send(message)

    def connect(self, session: Session) -> None:
        """Sends the view to a client that has connected; an attached client gets the leader's view."""
        self.announce(session)
        session.greet()
        if session.role.is_attached:
            self._attach(session)
        self._update()

    def disconnect(self, session: Session) -> None:
        """Stops sending images to a client that has left; its session stays attached."""
        self._update()

    def remove(self, session: Session) -> None:
        """Forgets a session that has ended."""
        self._others = [each for each in self._others if each is not session]
        self._may_lead.discard(session.connection.id)

    def choose(self, session: Session, mode: Literal["attach", "detach", "lead"]) -> None:
        """Attaches or detaches a session, or makes it the leader.

        Raises `SettingsError` if too many sessions are attached or detached, or if the session does not have the right
        to lead.
        """
        count = sum(each.role.is_attached for each in self._others)
        if session is self.leader:
            return
        if mode == "lead":
            self._lead(session)
        elif mode == "detach" and session.role.is_attached:
            if 1 + len(self._others) - count >= MOST_FREE:
                raise SettingsError(
                    f"too many followers use Look around: the limit is {MOST_FREE - 1}", code="out_of_range"
                )
            session.look_around()
        elif mode == "attach" and not session.role.is_attached:
            if count >= MOST_FOLLOWERS:
                raise SettingsError(f"too many followers: the limit is {MOST_FOLLOWERS}", code="out_of_range")
            self._attach(session)
            self._update()
            return
        self._update()
        self.announce(session)

    def hold(self, session: Session, pixel: Sequence[int]) -> None:
        """Stores the pixel that the leader holds, and shows it to the followers."""
        if session is self.leader:
            self._held = (pixel[0], pixel[1]) if len(pixel) == 2 else None
            for each in self._others:
                if each.role.is_attached:
                    each.show_display(self._held)

    def refusal(self, session: Session, message: Message) -> str:
        """The reason why a message is not carried out, or an empty text."""
        return REFUSALS[message.CHANGES] if message.KIND in self._blocked(session) else ""

    def _lead(self, session: Session) -> None:
        if not self.may_lead(session):
            raise SettingsError(
                "the followers' address does not permit leading; open the leader's address, which raycam prints first "
                "(in Python: viewer.url)",
                code="read_only",
            )
        before = self.leader
        before.role.on_show, before.connection.followers = None, ()
        if session.role.is_attached:
            session.look_around()
        self._others = [before, *(each for each in self._others if each is not session)]
        self.leader, self._held = session, None
        session.role.on_show = self._mirror
        for each in self._others:
            if each.role.is_attached or each is before:
                self._attach(each)

    def _attach(self, session: Session) -> None:
        session.role.is_attached = True
        self.announce(session)
        session.mirror(self.leader, self._held, begins=True)
        self.leader.connection.send_latest(session.connection)

    def _update(self) -> None:
        """Sends the leader's images to the attached clients that are connected.

        The leader receives the number of these clients.
        """
        followers = [each.connection for each in self._others if each.role.is_attached]
        self.leader.connection.followers = tuple(each for each in followers if each.is_open)
        self.announce(self.leader)

    def _mirror(self) -> None:
        """Shows a change of the leader's view to its followers."""
        for each in self._others:
            if each.role.is_attached:
                each.mirror(self.leader, self._held)

    def _blocked(self, session: Session) -> tuple[str, ...]:
        """The types of messages that a client must not send."""
        if session.role.is_attached:
            return (*BLOCKED["view"], *BLOCKED["world"])
        return () if self.may_lead(session) else BLOCKED["world"]
