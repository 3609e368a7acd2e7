"""Known offences that are still there. A number may only fall; a crate that is not listed has none."""

LONG_FUNCTIONS = {"python": 2}
