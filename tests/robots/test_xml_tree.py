"""XML documents: budgets, entities and malformed text."""

from __future__ import annotations

import pytest
import raycam
from raycam.robots.xml_tree import XmlLimits, check_xml, parse_xml

LAUGHS = b"""<?xml version="1.0"?>
<!DOCTYPE robot [
<!ENTITY a "ha">
<!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">
]>
<robot name="&b;"/>"""
EXTERNAL = b"""<!DOCTYPE robot [<!ENTITY secret SYSTEM "file:///etc/hostname">]>
<robot>&secret;</robot>"""
DTD = b'<!DOCTYPE robot SYSTEM "http://example.com/robot.dtd"><robot/>'

BAD = {
    "billion laughs": (LAUGHS, ":3: .*entity 'a'"),
    "external entity": (EXTERNAL, ":1: .*entity 'secret'"),
    "parameter entity": (b'<!DOCTYPE r [<!ENTITY % x SYSTEM "x">]><r/>', "entity 'x'"),
    "external type": (DTD, "robot.dtd"),
    "million elements": (b"<r>" + b"<link/>" * 1_000_000 + b"</r>", "too many XML elements"),
    "depth": (b"<a>" * 200 + b"</a>" * 200, "nested too deeply"),
    "cut": (b"<robot>\n<link", ":2: invalid XML"),
    "empty": (b"", "invalid XML"),
    "binary": (bytes(range(256)), "invalid XML"),
}


@pytest.mark.parametrize("case", BAD)
@pytest.mark.parametrize("read", [parse_xml, check_xml])
def test_refused_documents_raise(case: str, read: object) -> None:
    data, expected = BAD[case]
    with pytest.raises(raycam.FormatError, match=rf"^x\.xml.*{expected}"):
        read(data, "x.xml")  # type: ignore[operator]


def test_large_documents_are_refused_before_parsing() -> None:
    with pytest.raises(raycam.FormatError, match="limit is 10"):
        parse_xml(b"<robot>          </robot>", "x.xml", XmlLimits(bytes=10))


def test_tree_has_lines_texts_and_tags_without_prefixes() -> None:
    root = parse_xml(b'<x:a xmlns:x="u">\n<b k="1">te<c/>xt</b></x:a>', "x.xml")
    assert root.tag == "a"
    (b,) = root.children
    assert (b.line, b.text, b.attributes, [child.tag for child in b.children]) == (
        2,
        "text",
        {"k": "1"},
        ["c"],
    )
