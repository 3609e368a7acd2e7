"""Tokens by which the server recognises clients that may connect."""

from __future__ import annotations

import hmac
import secrets

__all__ = ["Tokens"]


class Tokens:
    """A server's own token, the followers' token, and tokens that are valid once."""

    def __init__(self, *, allows_followers: bool = False) -> None:
        self.own = _create_token()
        self.follower = _create_token()
        """The token of clients that follow the leader."""
        self._allows_followers = allows_followers
        self._invitations: set[str] = set()

    def invite(self) -> str:
        """Returns a new token that is valid once."""
        token = _create_token()
        self._invitations.add(token)
        return token

    def accept(self, token: str) -> bool:
        """True for the server's and the followers' token, and for an unused invitation.

        The invitation cannot be used again.
        """
        if _are_equal(token, self.own) or self.is_follower(token):
            return True
        used = [each for each in self._invitations if _are_equal(token, each)]
        self._invitations.difference_update(used)
        return bool(used)

    def is_follower(self, token: str) -> bool:
        """True for the followers' token, if clients can follow."""
        return self._allows_followers and _are_equal(token, self.follower)


def _create_token() -> str:
    return secrets.token_urlsafe(32)


def _are_equal(a: str, b: str) -> bool:
    """Compares in a time that does not depend on the texts."""
    return hmac.compare_digest(a.encode(), b.encode())
