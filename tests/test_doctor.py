"""The report of `raycam doctor`."""

from __future__ import annotations

import pytest
import raycam
from raycam import doctor


def test_it_names_what_matters_and_tests_itself() -> None:
    text = doctor.doctor()
    for part in (
        "raycam",
        raycam.__version__,
        "python",
        "numpy",
        "av",
        "processor",
        "instructions",
        "threads",
    ):
        assert part in text
    assert "6912 pixels as the reference has them" in text


def test_it_notices_a_wrong_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    def off_by_one(*args: object, **keys: object) -> raycam.Frame:
        frame = raycam.render(*args, **keys)  # type: ignore[arg-type]
        if keys["integrator"] == "flat":
            frame["triangle"][:] = frame["triangle"][:, ::-1].copy()
        return frame

    monkeypatch.setattr(doctor, "render", off_by_one)
    with pytest.raises(raycam.Error, match=r"self-test failed: .* pixels differ"):
        doctor.doctor()
