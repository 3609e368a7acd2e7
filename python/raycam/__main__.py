"""Entry point of `python -m raycam`, the same as the command `raycam`."""

from __future__ import annotations

import sys

from .cli import main

sys.exit(main())
