"""`python -m raycam` is `raycam`."""

from __future__ import annotations

import sys

from .cli import main

sys.exit(main())
