"""Writes NumPy's .npz files with bytes that depend only on the arrays.

Source: PKWARE's APPNOTE.TXT, `numpy.lib.format`.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any

import numpy as np

__all__ = ["npz_bytes"]


def npz_bytes(arrays: Mapping[str, Any], *, compressed: bool = False) -> bytes:
    """Returns the bytes of a .npz file with the arrays, in their order, for `numpy.load`.

    Uncompressed files are equal on every system and Python version, because their times, system and file attributes
    are constant. Compressed files also depend on the zlib library.
    """
    import zipfile  # imported here, so that `import raycam` is fast

    buffer = io.BytesIO()
    kind = zipfile.ZIP_DEFLATED if compressed else zipfile.ZIP_STORED
    with zipfile.ZipFile(buffer, "w", kind) as archive:
        for name, array in arrays.items():
            data = io.BytesIO()
            np.lib.format.write_array(data, np.asanyarray(array), version=(1, 0), allow_pickle=False)
            member = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
            member.create_system = 3
            member.external_attr = 0o644 << 16
            member.compress_type = kind
            archive.writestr(member, data.getvalue())
    return buffer.getvalue()
