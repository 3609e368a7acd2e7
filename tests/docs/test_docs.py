"""Code in the documentation.

Every block of every page runs, in order, in the page's own folder. `pycon` and `console` blocks are compared
with their printed output. `python` blocks are run. `toml` blocks are loaded; a first line that names a file
is its name, and other blocks may refer to missing files. `raycam` lines of `sh` blocks are run. To save time,
renders without `samples` use one sample per pixel, and the demo's video has a few frames.
"""

from __future__ import annotations

import doctest
import re
import shlex
import shutil
import sys
import tomllib
from collections.abc import Iterator
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path

import pytest
import raycam
from PIL import Image
from raycam import cli
from support.raises import raises
from support.subject_share import MIN_SHARE, SavedPictures, border_share, subject_share

ROOT = Path(__file__).resolve().parents[2]
MADE = {"_build", "_generated", "lab-notes", "reference"}
PAGES = [
    "README.md",
    *(
        str(path.relative_to(ROOT))
        for path in sorted((ROOT / "docs").rglob("*.md"))
        if not MADE & set(path.parts)
    ),
]
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.M | re.S)
# This page's images are written by `raycam demo`, which test_demo.py runs at full size.
MIN_SHARES = {"composite": 0.02}
"""Minimum share of the subject in images of small subjects, by the image's name."""
SAMPLES = re.compile(r"\bsamples=\d+")
SLOW = ("raycam demo",)


def blocks(page: str) -> Iterator[tuple[str, str, int]]:
    """Language, text and line of each fenced block of a page."""
    text = (ROOT / page).read_text(encoding="utf-8")
    for match in BLOCK.finditer(text):
        yield match[1], match[2], text.count("\n", 0, match.start()) + 1


def run_python(code: str, page: str, line: int, names: dict[str, object]) -> None:
    code = SAMPLES.sub("samples=1", code)
    exec(compile("\n" * line + code, page, "exec"), names)


def run_doctest(code: str, page: str, line: int, names: dict[str, object]) -> None:
    test = doctest.DocTestParser().get_doctest(code, names, page, page, line)
    said: list[str] = []
    doctest.DocTestRunner(verbose=False, optionflags=doctest.ELLIPSIS).run(
        test, out=said.append, clear_globs=False
    )
    assert not said, "".join(said)
    names |= test.globs


def write_world(text: str, page: str) -> None:
    named = re.match(r"# (\S+\.toml)\n", text)
    name = named[1] if named else "block.toml"
    Path(name).write_text(text, encoding="utf-8")
    assert tomllib.loads(text), page
    try:
        (raycam.Recipe if " uniform = " in text else raycam.load)(name)
    except FileNotFoundError:
        if named:
            raise  # other blocks are fragments that may name files of the reader


def type_commands(text: str, page: str) -> None:
    for line in text.replace("\\\n", " ").splitlines():
        words = shlex.split(line, comments=True)
        if words[:1] == ["raycam"] and not line.startswith(SLOW):
            if "--denoise" in words and find_spec("pyoidn") is None:
                continue  # the group `dev` does not install this extra
            words = [word if before != "--samples" else "1" for before, word in pairwise(words)]
            assert cli.main(words) == 0, f"{page}: {line}"


def compare_answers(text: str, page: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Runs the commands after `$` and compares their output; `...` matches any text."""
    checker = doctest.OutputChecker()
    for part in re.split(r"^\$ ", text, flags=re.M)[1:]:
        command, _, answer = part.partition("\n")
        capsys.readouterr()
        type_commands(command, page)
        said = capsys.readouterr().out
        assert checker.check_output(answer, said, doctest.ELLIPSIS), f"{page}: {command}\n{said}"


@pytest.mark.parametrize("page", PAGES)
def test_every_code_block_of_a_page_runs(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(Path(raycam.__file__).parent / "assets", tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules["raycam.render.studio"].STUDIO_OPTIONS, "samples", 1)
    world = Path("spot.toml").read_text(encoding="utf-8")
    world = re.sub(
        r"^samples = .*", "samples = 1", world.replace("occlusion = true", "occlusion = false"), flags=re.M
    )
    if all(language != "console" for language, _, _ in blocks(page)):
        world = re.sub(r"^seconds = .*", "seconds = 0.1", world, flags=re.M)
    Path("spot.toml").write_text(world, encoding="utf-8")
    saved = SavedPictures(monkeypatch)
    names: dict[str, object] = {}
    for language, text, line in blocks(page):
        if language == "python":
            run_python(text, page, line, names)
        elif language == "pycon":
            run_doctest(text, page, line, names)
        elif language == "toml":
            write_world(text, page)
        elif language == "sh":
            type_commands(text, page)
        elif language == "console":
            compare_answers(text, page, capsys)
    check_subjects(page, saved)


def check_subjects(page: str, saved: SavedPictures) -> None:
    """Asserts that each image that the page shows and writes contains enough of its subject."""
    shown = re.findall(
        r"!\[[^]]*\]\((?:\.\./|docs/)?images/[\w-]+/([\w-]+)\.jpg\)", (ROOT / page).read_text("utf-8")
    )
    for name in shown:
        file = Path(f"{name}.png")
        if not file.is_file():
            continue  # the code of another page writes this image
        least = MIN_SHARES.get(name, MIN_SHARE)
        share = saved.shares.get(file.name)
        if share is not None:
            assert share >= least, f"{page}: {share:.1%} of {file} shows an object other than the ground"
        else:
            share = border_share(file)
            assert share >= least, f"{page}: {share:.1%} of {file} differs from its border"


@pytest.mark.parametrize(
    "picture", sorted((ROOT / "docs" / "images").rglob("*.jpg")), ids=lambda path: path.stem
)
def test_stored_image_is_not_almost_empty(picture: Path) -> None:
    share = border_share(picture)
    assert share >= MIN_SHARES.get(picture.stem, MIN_SHARE), (
        f"{share:.1%} of {picture.name} differs from its border"
    )


def test_empty_image_of_a_page_is_reported(tmp_path: Path) -> None:
    """The ground is so large that a camera which shows all of it does not show the model."""
    world = raycam.data.spot()
    far = raycam.Camera.look_at([0, -400, 60], [0, 0, 0], size=(64, 48), fov=30)
    assert (
        subject_share(world, far) < MIN_SHARE < subject_share(world, world.view_from("front", size=(64, 48)))
    )
    Image.new("RGB", (64, 48), "gray").save(tmp_path / "empty.png")
    assert border_share(tmp_path / "empty.png") == 0.0


def test_how_to_pages_show_an_image_or_output() -> None:
    pages = [path for path in (ROOT / "docs" / "howto").glob("*.md") if path.name != "index.md"]
    assert len(pages) > 20
    for page in pages:
        text = page.read_text(encoding="utf-8")
        assert re.search(r"!\[.+\]\(\.\./images/|^```console$|^```pycon$", text, re.M), (
            f"{page.name} shows nothing"
        )
    for page in (ROOT / "docs" / "coming-from").glob("[!i]*.md"):
        assert "](../images/" in page.read_text(encoding="utf-8"), f"{page.name} shows nothing"


def test_images_are_small_and_written_by_a_page_that_shows_them() -> None:
    """An image that several pages show is written by one of them."""
    texts = [(ROOT / page).read_text(encoding="utf-8") for page in PAGES]
    for folder in ("howto", "pages"):
        for picture in (ROOT / "docs" / "images" / folder).glob("*.*"):
            shown = [text for text in texts if f"images/{folder}/{picture.name}" in text]
            assert shown, f"no page shows {picture.name}"
            made = {".jpg": ".png", ".webp": ".gif"}.get(picture.suffix, picture.suffix)
            written = re.compile(rf"\b{picture.stem}{made}|cup_{{name}}{made}")
            assert any(written.search(text) for text in shown), f"no block makes {picture.stem}{made}"
            assert picture.stat().st_size < (90_000 if picture.suffix == ".svg" else 60_000), picture.name


def test_gallery_images_are_small_and_written_by_the_page() -> None:
    text = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    shown = re.findall(r"!\[\w+\]\((images/[\w/-]+\.jpg)\)", text)
    assert len(shown) == len(set(shown)) > 15
    for name in re.findall(r"images/gallery/([\w-]+)\.jpg", text):
        assert f'"{name}.png"' in text, f"no block makes {name}.png"
    films = re.findall(r"images/gallery/([\w-]+)\.webp", text)
    assert len(set(films)) == 4
    for name in films:
        assert re.search(rf"\b{name}\.gif", text), f"no block makes {name}.gif"
    pictures = [path for path in (ROOT / "docs" / "images").rglob("*") if path.is_file()]
    assert sum(path.stat().st_size for path in pictures) < 5_000_000


def test_doctest_with_a_wrong_result_fails() -> None:
    with raises(AssertionError, mentions=["Expected"]):
        run_doctest(">>> 1 + 1\n3\n", "page", 1, {})


@pytest.mark.parametrize("page", PAGES)
def test_python_code_does_not_load_bundled_files_from_the_current_folder(page: str) -> None:
    """Commands find raycam's own files by name; in Python, `raycam.data.path` returns their paths."""
    assets = [path.name for path in (Path(raycam.__file__).parent / "assets").iterdir()]
    own = re.compile(rf"""\bload(?:_\w+)?\(["'](?:{"|".join(map(re.escape, assets))})["']""")
    for language, text, line in blocks(page):
        if language in ("python", "pycon"):
            code = re.sub(r"#.*", "", text)
            assert not own.search(code), f"{page}:{line}"


def test_every_local_link_has_a_target() -> None:
    for page in [*PAGES, "CONTRIBUTING.md"]:
        text = (ROOT / page).read_text(encoding="utf-8")
        for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", text):
            if "://" not in target:
                assert ((ROOT / page).parent / target).exists(), f"{page} links to {target}"


def test_install_page_lists_every_extra() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"][
        "optional-dependencies"
    ]
    rows = dict(
        re.findall(r"^\| `(\w+)` \| (.*) \|$", (ROOT / "docs/install.md").read_text(encoding="utf-8"), re.M)
    )
    assert rows.keys() == extras.keys()
    (whole,) = extras["all"]
    assert set(re.findall(r"`(\w+)`", rows["all"])) == set(re.findall(r"\w+", whole.partition("[")[2]))
