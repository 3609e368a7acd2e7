"""Strips and fans of Collada as separate triangles."""

from __future__ import annotations

from xml.etree import ElementTree

import pytest
from raycam.robots.collada_strips import expand_strips


def expand(tag: str, *strips: str, offsets: tuple[int, ...] = (0,)) -> list[list[int]]:
    """The indices of each triangle."""
    inputs = "".join(f'<input semantic="VERTEX" source="#v" offset="{offset}"/>' for offset in offsets)
    parts = "".join(f"<p>{text}</p>" for text in strips)
    node = ElementTree.fromstring(f'<{tag} count="1" material="m">{inputs}{parts}</{tag}>')
    expand_strips(node)
    width = 3 * (1 + max(offsets))
    indices = [int(text) for text in (node.findtext("p") or "").split()]
    assert node.tag == "triangles"
    assert len(node.findall("p")) == 1
    assert int(node.get("count", "")) == len(indices) // width
    return [indices[first : first + width] for first in range(0, len(indices), width)]


def test_triangles_of_a_strip_have_the_same_orientation() -> None:
    assert expand("tristrips", "0 1 2 3 4") == [[0, 1, 2], [2, 1, 3], [2, 3, 4]]


def test_triangles_of_a_fan_share_the_first_corner() -> None:
    assert expand("trifans", "5 1 2 3") == [[5, 1, 2], [5, 2, 3]]


def test_several_strips_with_several_inputs_are_joined() -> None:
    found = expand("tristrips", "0 7 1 8 2 9", "3 7 4 8 5 9", offsets=(0, 1))
    assert found == [[0, 7, 1, 8, 2, 9], [3, 7, 4, 8, 5, 9]]


def test_repeated_corners_and_short_strips_have_no_triangles() -> None:
    assert expand("tristrips", "0 1 2 2 3 3 4 5", "", "6 7") == [[0, 1, 2], [4, 3, 5]]


@pytest.mark.parametrize("text", ["0 1 x", "0 1.5 2", "0 1 2"])
def test_faulty_indices_raise(text: str) -> None:
    with pytest.raises(ValueError, match="indices"):
        expand("tristrips", text, offsets=(0, 1))
