"""Links with a world's text: packing, unpacking, and the limits of both lengths, run by Node."""

from __future__ import annotations

import base64
import json
import zlib

import pytest
from support.node_core import needs_node, run_module

pytestmark = needs_node
LONGEST_LINK, LONGEST_TEXT = 32 * 1024, 2**20


def link_of(text: bytes) -> str:
    packer = zlib.compressobj(9, wbits=-15)
    return base64.urlsafe_b64encode(packer.compress(text) + packer.flush()).decode().rstrip("=")


def unpacked(link: str) -> str | None:
    """The text of a link; None if the module refuses the link."""
    script = f"return textOfLink({json.dumps(link)}).catch(() => null)"
    found: str | None = run_module("core/world_link.js", script)
    return found


@pytest.mark.parametrize("text", ["", "[[object]]\nbox = 1\n", "# \u00fc </script> \U0001f404\n" * 50])
def test_packed_text_is_restored(text: str) -> None:
    link = run_module("core/world_link.js", f"return linkOfText({json.dumps(text)})")
    assert set("+/=") & set(link) == set()
    assert unpacked(link) == text
    assert unpacked(link_of(text.encode())) == text


def test_links_are_unpacked_up_to_the_longest_text() -> None:
    longest = link_of(b"\n" * LONGEST_TEXT)
    assert len(longest) < 2000
    assert unpacked(longest) == "\n" * LONGEST_TEXT
    assert unpacked(link_of(b"\n" * (LONGEST_TEXT + 1))) is None
    assert unpacked(link_of(b"\n" * 20_000_000)) is None


def test_links_above_the_longest_link_are_refused() -> None:
    assert unpacked("A" * (LONGEST_LINK + 1)) is None
    assert unpacked("AAAA") is None
