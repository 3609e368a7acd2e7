"""The report of `raycam doctor`."""

from __future__ import annotations

import pytest
import raycam
from raycam import doctor
from support.raises import raises


def test_doctor_reports_versions_and_runs_a_self_test() -> None:
    text = doctor.doctor()
    for part in (
        "raycam",
        raycam.__version__,
        "python",
        "numpy",
        "av",
        "wheel",
        "processor",
        "instructions",
        "threads",
    ):
        assert part in text
    assert "6912 pixels equal the reference" in text


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("processor\t: 0\nmodel name\t: A: B 7\nprocessor\t: 1\nmodel name\t: C\n", "A: B 7"),
        ("processor\t: 0\nCPU implementer\t: 0x41\nCPU part\t: 0xd0c\n", "Neoverse N1"),
        ("CPU implementer\t: 0x99\nCPU part\t: 0x001\n", "implementer 0x99, part 0x001"),
    ],
)
def test_doctor_finds_the_processor_name(text: str, name: str) -> None:
    assert name in (doctor.processor_in(text) or "")


def test_doctor_lists_the_use_of_a_missing_package(monkeypatch: pytest.MonkeyPatch) -> None:
    real = doctor.metadata.version

    def version(name: str) -> str:
        if name == "av":
            raise doctor.metadata.PackageNotFoundError
        return real(name)

    monkeypatch.setattr(doctor.metadata, "version", version)
    assert "missing; for video files: pip install 'raycam[video]'" in doctor.doctor()


def test_doctor_fails_on_a_wrong_image(monkeypatch: pytest.MonkeyPatch) -> None:
    def off_by_one(*args: object, **keys: object) -> raycam.Frame:
        frame = raycam.render(*args, **keys)  # type: ignore[arg-type]
        if keys["integrator"] == "flat":
            frame["triangle"][:] = frame["triangle"][:, ::-1].copy()
        return frame

    monkeypatch.setattr(doctor, "render", off_by_one)
    with raises(raycam.Error, code="failed_selftest", mentions=["6912"]):
        doctor.doctor()
