"""XML documents: budgets, entities and malformed text."""

from __future__ import annotations

import pytest
import raycam
from raycam.robots.xml_tree import XmlLimits, check_xml, parse_xml
from support.raises import fault, raises

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
    "billion laughs": (LAUGHS, fault("unsupported_feature", "x.xml:3:", "'a'")),
    "external entity": (EXTERNAL, fault("unsupported_feature", "x.xml:1:", "'secret'")),
    "parameter entity": (
        b'<!DOCTYPE r [<!ENTITY % x SYSTEM "x">]><r/>',
        fault("unsupported_feature", "x.xml:", "'x'"),
    ),
    "external type": (DTD, fault("outside_root", "x.xml:", "robot.dtd")),
    "million elements": (
        b"<r>" + b"<link/>" * 1_000_000 + b"</r>",
        fault("budget_exceeded", "x.xml:", "300000"),
    ),
    "depth": (b"<a>" * 200 + b"</a>" * 200, fault("budget_exceeded", "x.xml:", "100")),
    "cut": (b"<robot>\n<link", fault("syntax", "x.xml:2:")),
    "empty": (b"", fault("syntax", "x.xml:1:")),
    "binary": (bytes(range(256)), fault("syntax", "x.xml:")),
}


@pytest.mark.parametrize("case", BAD)
@pytest.mark.parametrize("read", [parse_xml, check_xml])
def test_unsupported_xml_documents_raise(case: str, read: object) -> None:
    data, expected = BAD[case]
    with raises(raycam.FormatError, **expected):
        read(data, "x.xml")  # type: ignore[operator]


def test_large_documents_are_refused_before_parsing() -> None:
    with raises(raycam.FormatError, code="budget_exceeded", mentions=["10"]):
        parse_xml(b"<robot>          </robot>", "x.xml", XmlLimits(bytes=10))


def test_xml_elements_have_their_line_text_and_tag_without_prefix() -> None:
    root = parse_xml(b'<x:a xmlns:x="u">\n<b k="1">te<c/>xt</b></x:a>', "x.xml")
    assert root.tag == "a"
    (b,) = root.children
    assert (b.line, b.text, b.attributes, [child.tag for child in b.children]) == (
        2,
        "text",
        {"k": "1"},
        ["c"],
    )
