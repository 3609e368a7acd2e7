"""Files dropped on the page."""

from __future__ import annotations

import base64
import io
import zipfile
from pathlib import Path

import pytest
import raycam
from raycam.viewer.files import uploads
from raycam.viewer.files.uploads import Uploads

WORLD = b'[[object]]\nmesh = "a.obj"\n'
MESH = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def sent(to: Uploads, name: str, data: bytes, piece: int = 10) -> bool:
    whole = False
    for offset in range(0, len(data), piece):
        text = base64.b64encode(data[offset : offset + piece]).decode()
        whole = to.add(name, len(data), offset, text)
    return whole


def test_uploaded_world_and_mesh_are_opened_and_the_folder_removed() -> None:
    made = Uploads()
    assert sent(made, "a.obj", MESH)
    assert sent(made, "world.toml", WORLD)
    assert made.open("world.toml")[0].counts["triangles"] == 1
    folder = made._path()
    assert {path.name for path in folder.iterdir()} == {"a.obj", "world.toml"}
    made.close()
    assert not folder.exists()


@pytest.mark.parametrize(
    "name",
    [
        "../a.obj",
        "/etc/passwd.obj",
        "a/../../b.obj",
        "a.obj\0",
        "a\n.obj",
        "C:a.obj",
        "",
        "..\\a.obj",
        "é" * 200 + ".obj",
    ],
)
def test_names_that_leave_the_folder_are_refused(name: str) -> None:
    made = Uploads()
    with pytest.raises(raycam.SettingsError):
        made.add(name, 4, 0, "AAAA")
    with pytest.raises(raycam.SettingsError):
        made.open(name)
    assert made._folder is None


@pytest.mark.parametrize(
    "name",
    [
        "a b.obj",
        "a (1).obj",
        "Tür[2].obj",
        "模型.obj",
        "-x.obj",
        "a'\"&.OBJ",
        "parts/deep/a.obj",
        "x" * 200 + ".obj",
    ],
)
def test_files_with_unusual_names_are_opened(name: str) -> None:
    made = Uploads()
    assert sent(made, name, MESH)
    assert made.open(name)[0].counts["triangles"] == 1
    made.close()


def test_uploaded_files_of_unsupported_types_are_ignored() -> None:
    made = Uploads()
    assert not sent(made, "LICENSE", b"text")
    assert not sent(made, "run.sh", b"text")
    assert made._folder is None
    sent(made, "parts/a.obj", MESH)
    sent(made, "world.toml", WORLD.replace(b"a.obj", b"parts/a.obj"))
    assert made.open("world.toml")[0].counts["triangles"] == 1
    made.close()


def archive(files: dict[str, bytes]) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, content in files.items():
            packed.writestr(name, content)
    return data.getvalue()


def test_archive_with_a_folder_is_opened() -> None:
    files = {
        "model/world.toml": WORLD.replace(b"a.obj", b"parts/a.obj"),
        "model/parts/a.obj": MESH,
        "LICENSE": b"x",
    }
    made = Uploads()
    sent(made, "all.zip", archive(files), 1000)
    assert made.open("all.zip")[0].counts["triangles"] == 1
    made.close()


@pytest.mark.parametrize(
    "data",
    [
        b"PK\x03\x04 broken",
        archive({"../a.obj": MESH}),
        archive({"a.txt": b"x"}),
        archive({"a.obj": bytes(200_000)}),
    ],
    ids=["broken", "outside", "no world", "bomb"],
)
def test_bad_archives_are_refused(data: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(uploads, "MAX_BYTES", 100_000)
    made = Uploads()
    sent(made, "all.zip", data, 1000)
    with pytest.raises(raycam.Error):
        made.open("all.zip")
    assert sum(path.stat().st_size for path in made._path().rglob("*") if path.is_file()) < 100_000
    made.close()


def test_uploaded_world_reads_nothing_outside_of_its_folder(tmp_path: Path) -> None:
    secret = tmp_path / "secret.obj"
    secret.write_bytes(MESH)
    made = Uploads()
    for path in (str(secret), f"../{secret.name}", f"../../{secret.parent.name}/{secret.name}"):
        sent(made, "world.toml", f'[[object]]\nmesh = "{path}"\n'.encode())
        with pytest.raises((raycam.Error, OSError)):
            made.open("world.toml")
    made.close()


def test_upload_pieces_must_be_consecutive_and_match_the_size() -> None:
    made = Uploads()
    made.add("a.obj", 6, 0, "AAAA")
    with pytest.raises(raycam.SettingsError):
        made.add("a.obj", 6, 5, "AAAA")
    with pytest.raises(raycam.SettingsError):
        made.open("a.obj")
    with pytest.raises(raycam.SettingsError):
        made.add("b.obj", 2, 0, "AAAA")
    with pytest.raises(raycam.SettingsError):
        made.add("c.obj", 6, 3, "AAAA")
    assert list(made._path().iterdir()) == []
    made.close()


def test_total_upload_size_is_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(uploads, "MAX_BYTES", 64)
    made = Uploads()
    sent(made, "a.obj", MESH)
    with pytest.raises(raycam.SettingsError):
        made.add("b.obj", 40, 0, "AAAA")
    made.add("b.obj", 6, 0, "AAAA")
    made.close()


def test_opened_uploads_are_deleted_when_space_is_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(uploads, "MAX_BYTES", 64)
    made = Uploads()
    sent(made, "a.obj", MESH)
    assert made.open("a.obj")[0].up == "y"
    for name in ("b.obj", "c.obj"):  # both files have the size of the first file
        assert sent(made, name, MESH.ljust(40, b"\n"))
        made.open(name)
    assert [path.name for path in made._path().iterdir()] == ["c.obj"]
    made.close()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('[[object]]\nmesh = "no.ply"\n', "world.toml requires no.ply"),
        ('[[object]]\nmesh = "/etc/passwd"\n', "a dropped world can only use files dropped with it"),
        ("[[object]]\nbox = { siz = 1 }\n", 'world.toml:2: object[0].box.siz: unknown key "siz"'),
    ],
)
def test_errors_use_the_file_names_of_the_client(text: str, told: str) -> None:
    made = Uploads()
    sent(made, "world.toml", text.encode())
    with pytest.raises(raycam.Error) as failed:
        made.open("world.toml")
    assert told in str(failed.value)
    assert "raycam-view-" not in str(failed.value)
    made.close()
