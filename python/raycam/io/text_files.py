"""Decoding of text files in the encodings that editors write."""

from __future__ import annotations

import codecs

__all__ = ["decode_text"]


def decode_text(data: bytes, errors: str = "strict") -> str:
    """Decodes UTF-8 with or without a byte order mark, or UTF-16 with a byte order mark.

    Line ends become line feeds. `errors` is as in `bytes.decode`: "strict" raises `UnicodeDecodeError` for
    invalid bytes.
    """
    is_wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    text = data.decode("utf-16" if is_wide else "utf-8-sig", errors)
    return text.replace("\r\n", "\n").replace("\r", "\n")
