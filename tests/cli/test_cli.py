"""The command line: its results, and errors in one line."""

from __future__ import annotations

import errno
import fcntl
import json
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest
import raycam
from PIL import Image
from raycam import dataset
from raycam.calibration import WRITTEN_FORMATS
from raycam.cli import COMMANDS, main
from raycam.render import RENDER_OPTIONS
from support.gltf_document import Document
from support.patience import PATIENCE
from support.raises import raises

BOX = """
[camera]
size = [64, 48]
fov = 40
location = [3, -4, 2]
target = [0, 0, 0]

[[object]]
name = "box"
box = { size = 1 }
color = "#c83c28"
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "box.toml").write_text(BOX)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(command: str) -> int:
    """Runs `raycam` with these words and returns its exit status."""
    return main(shlex.split(command))


def test_render_command_writes_the_image_of_the_python_call(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("render box.toml --integrator flat --samples 3 --seed 2") == 0
    assert capsys.readouterr().out == "box.png: 64 x 48, color\n"
    world = raycam.load("box.toml")
    expected = raycam.render(world, integrator="flat", samples=3, seed=2).to_srgb8()
    with Image.open("box.png") as image:
        np.testing.assert_array_equal(np.asarray(image), expected)


def test_render_options_reach_the_renderer(folder: Path) -> None:
    assert run("render box.toml -o a.npz --integrator flat --channels depth,normal color --size 128x96") == 0
    with np.load("a.npz") as read:
        assert read["depth"].shape == (96, 128)
        assert set(read) >= {"depth", "normal", "color", "K"}
        np.testing.assert_allclose(read["K"][0, 0], 2 * raycam.load("box.toml").default_camera().K[0, 0])
    assert (
        run("render box.toml -o b.npz --integrator flat --channels all --region 8,4,16,12 --threads 1") == 0
    )
    with np.load("b.npz") as read:
        assert read["instance"].shape == (12, 16)
        assert tuple(read["region"]) == (8, 4, 16, 12)
    assert (
        run("render box.toml -o c.png --bits 16 --exposure -1 --integrator flat --filter blackman-harris")
        == 0
    )
    assert run("render box.toml -o d.exr --half --ambient-occlusion 2 --samples 1") == 0
    assert run("render box.toml -o e.npz --integrator reference --size 16x12") == 0
    Path("dim.toml").write_text(
        BOX
        + "[[object]]\nplane = { size = 9 }\nlocation = [0, 0, -0.5]\n"
        + "[render]\nambient_occlusion = true\nsamples = 16\n"
    )
    assert run("render dim.toml -o dim.npz") == run("render dim.toml -o open.npz --no-ambient-occlusion") == 0
    with np.load("dim.npz") as dim, np.load("open.npz") as open_:
        # Ambient occlusion is a noisy estimate, so the means are compared instead of pixels.
        assert dim["color"].mean() < 0.99 * open_["color"].mean()
    assert sorted(os.listdir()) == [
        "a.npz",
        "b.npz",
        "box.toml",
        "c.png",
        "d.exr",
        "dim.npz",
        "dim.toml",
        "e.npz",
        "open.npz",
    ]


def test_mesh_without_cameras_and_lights_is_framed_and_lit(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("a.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 1\n3 0 1 2\n")
    assert run("render a.off --size 32x24 --samples 1") == 0
    assert "no lights" in capsys.readouterr().err
    with Image.open("a.png") as image:
        assert image.size == (32, 24)
        assert len(np.unique(np.asarray(image))) > 1


def test_camera_option_selects_a_camera_by_name(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    two = (
        BOX.replace("[camera]", '[[camera]]\nname = "front"')
        + '\n[[camera]]\nname = "top"\nfov = 30\nsize = [8, 6]'
    )
    Path("two.toml").write_text(two + "\nlocation = [0, 0, 5]\npitch = 90\n")
    assert run("render two.toml --camera top -o top.png --samples 1") == 0
    with Image.open("top.png") as image:
        assert image.size == (8, 6)
    assert run("render two.toml --camera fron -o x.png") == 1
    assert 'did you mean "front"' in capsys.readouterr().err


def test_view_without_a_file_reports_only_the_required_argument(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["view"])
    error = capsys.readouterr().err
    assert "WORLD|FRAME" in error
    assert "MODEL" not in error


def test_at_option_moves_an_animated_camera(folder: Path) -> None:
    document = Document()
    document.node(mesh=document.square(pbrMetallicRoughness={"baseColorFactor": [1, 0, 0, 1]}))
    lens = {"yfov": 1.0, "aspectRatio": 1.0, "znear": 0.1}
    camera = document.node(camera=document.add("cameras", type="perspective", perspective=lens))
    moves = {
        "input": document.accessor(np.float32([0, 2])),
        "output": document.accessor(np.float32([[0, 0, 3], [0, 0, 9]])),
    }
    channel = {"sampler": 0, "target": {"node": camera, "path": "translation"}}
    document.add("animations", samplers=[moves], channels=[channel])
    document.save(folder / "fly.glb")
    for time in (0, 1, 2):
        assert run(f"render fly.glb --at {time} --size 64x64 --samples 1 --integrator flat") == 0
        with Image.open("fly.png") as image:
            red, green, _ = np.moveaxis(np.asarray(image), -1, 0)
        # Expected width: 2 of 2 tan(0.5) z.
        width = 64 / (np.tan(0.5) * (3 + 3 * time))
        assert np.count_nonzero(red > green) ** 0.5 == pytest.approx(width, abs=1.5)


def test_info_command_prints_the_contents_of_a_world(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("info box.toml") == 0
    out = capsys.readouterr().out
    for part in (
        "objects    1",
        "triangles  12",
        "'box'",
        "64 x 48",
        "K ",
        "R ",
        "P ",
        "C  3 -4 2",
        "pitch",
        "notices",
    ):
        assert part in out


def test_explain_command_prints_steps_and_writes_a_figure(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("explain box.toml --pixel 32 24 --figure e.svg") == 0
    assert "n·r" in capsys.readouterr().out
    assert Path("e.svg").read_text().startswith("<svg")
    assert run("explain box.toml --pixel 64 0") == 2
    assert "pixel (64, 0)" in capsys.readouterr().err
    assert run("explain box.toml --pixel 3 3 --figure e.png") == 2


def test_video_command_writes_an_mp4_file(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    import av

    assert run("video box.toml -o a.mp4 --frames 0:3 --integrator flat --samples 1") == 0
    captured = capsys.readouterr()
    assert "a.mp4: 3 frames of 64 x 48, 24 a second" in captured.out
    assert "orbit" in captured.err
    with av.open("a.mp4") as container:
        assert len(list(container.decode(video=0))) == 3
    for part, count in (("-4:", 4), ("-4:-1", 3), ("=-2:", 2)):
        assert (
            run(
                f"video box.toml -o last --frames {part}".replace(" =", "=")
                + " --integrator flat --samples 1"
            )
            == 0
        )
        assert f"last: {count} frames" in capsys.readouterr().out


ERRORS = {
    "rendr box.toml": (2, ["rendr", "'render'"]),
    "render": (2, ["WORLD", "raycam render --help"]),
    "render box.toml --sampels 3": (2, ["--sampels"]),
    "render box.toml --samples many": (2, ["--samples", "many"]),
    "render box.toml --samples 0": (2, ["--samples", "0", "1 to 16777216"]),
    "render box.toml --size 640": (2, ["640", "WIDTHxHEIGHT"]),
    "render box.toml --size 64x64": (2, ["64x64", "64x48"]),
    "render box.toml --integrator falt": (2, ["--integrator", "falt", "flat, direct, path, ao, reference"]),
    "render box.toml --channels dept": (2, ["dept", "'depth'"]),
    "render box.toml --filter bx": (2, ["--filter", "bx", "box"]),
    "render box.toml --region 0,0,1": (2, ["region"]),
    "render box.toml -o a.png --channels depth uv": (2, ["a.png", "depth, uv"]),
    "render box.toml -o a.png --half": (2, ["half", ".png"]),
    "render box.toml -o a.jp2": (1, ["a.jp2", ".png, .jpg, .jpeg, .hdr, .exr, .npz"]),
    "render box.toml -o nowhere/a.png": (1, ["nowhere/a.png"]),
    "render nowhere.toml": (1, ["nowhere.toml", "No such file"]),
    "render box.obj": (1, ["box.obj", "No such file"]),
    "render .": (1, ["."]),
    "render bad.toml": (1, ["bad.toml:2", "colour", "color"]),
    "render box.toml --camera left": (1, ["left"]),
    "render box.toml --camera left.yaml": (2, ["left.yaml"]),
    "render box.toml --camera bax.toml": (2, ["did you mean", "box.toml"]),
    "render box.toml --rig bax.toml": (2, ["bax.toml", "did you mean", "box.toml"]),
    "render box.toml --hdri bax.toml": (1, ["No such file", "did you mean", "box.toml"]),
    "box.toml": (2, ["raycam render box.toml"]),
    "cameras box.toml --to colmp": (2, ["--to", "colmp", "'colmap'"]),
    "info nowhere.toml": (1, ["nowhere.toml"]),
    "video box.toml -o a.avi": (2, ["a.avi", ".mp4"]),
    "video box.toml -o a.mp4 --frames 9": (2, ["9", "START:STOP"]),
}


@pytest.mark.parametrize("command", ERRORS)
def test_errors_are_printed_in_one_line(
    folder: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    Path("bad.toml").write_text("[[object]]\ncolour = 1\nbox = {}\n")
    before = sorted(os.listdir())
    status, words = ERRORS[command]
    try:
        returned = run(command)
    except SystemExit as exit_:
        returned = exit_.code  # type: ignore[assignment]
    captured = capsys.readouterr()
    assert returned == status, captured.err
    errors = [line for line in captured.err.splitlines() if not line.startswith("raycam: notice: ")]
    assert [line[:15] for line in errors] == ["raycam: error: "]
    assert not [word for word in words if word not in captured.err], captured.err
    assert captured.out == ""
    assert sorted(os.listdir()) == before


@pytest.mark.parametrize(
    ("command", "remedies"),
    [
        ("render box.toml -o -dash.png", ["./-dash.png", "-o=-dash.png"]),
        ("render box.toml --output --dash.png", ["./--dash.png", "--output=--dash.png"]),
        ("render box.toml --camera -lens.yaml", ["./-lens.yaml", "--camera=-lens.yaml"]),
        ("dataset box.toml -o -out", ["./-out", "-o=-out"]),
        ("render -dash.toml", ["./-dash.toml"]),
        ("info -dash.toml", ["./-dash.toml"]),
    ],
)
def test_file_names_with_a_leading_dash_are_refused_with_two_alternatives(
    folder: Path, capsys: pytest.CaptureFixture[str], command: str, remedies: list[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        run(command)
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert not [remedy for remedy in remedies if remedy not in said], said
    assert said.count("\n") == 1


@pytest.mark.parametrize("output", ["./-dash.png", "-o=-dash.png", "--output=-dash.png"])
def test_file_names_with_a_leading_dash_are_written(folder: Path, output: str) -> None:
    option = output if output.startswith("-") else f"-o {output}"
    assert run(f"render box.toml {option} --integrator flat --samples 1") == 0
    assert Path("-dash.png").exists()
    assert run("info ./-dash.png") != 0  # the file is an image, not a world
    Path("-box.toml").write_text(BOX)
    assert run("render ./-box.toml -o a.png --integrator flat --samples 1") == 0


@pytest.mark.parametrize("command", ["", *COMMANDS])
def test_help_command_equals_the_help_option(capsys: pytest.CaptureFixture[str], command: str) -> None:
    printed = []
    for words in (f"{command} --help", f"help {command}"):
        with pytest.raises(SystemExit) as exit_:
            run(words)
        assert exit_.value.code == 0
        printed.append(capsys.readouterr().out)
    assert printed[0] == printed[1] != ""


@pytest.mark.parametrize("command", ["render", "video", "dataset"])
def test_every_render_option_is_a_command_line_option_with_help(
    capsys: pytest.CaptureFixture[str], command: str
) -> None:
    with pytest.raises(SystemExit):
        run(f"{command} --help")
    text = " ".join(capsys.readouterr().out.split())
    for option in RENDER_OPTIONS.values():
        assert f" --{option.name.replace('_', '-')} " in text
        first = option.help.split()[1:4]
        assert " ".join(first) in text, option.name


@pytest.mark.parametrize(
    ("words", "name"),
    [
        ("--samples 0", "samples"),
        ("--samples 16777217", "samples"),
        ("--max-depth 0", "max_depth"),
        ("--clamp -1", "clamp"),
        ("--noise-threshold 0", "noise_threshold"),
        ("--time-limit 0", "time_limit"),
        ("--exposure 101", "exposure"),
        ("--ambient-occlusion -1", "ambient_occlusion"),
        ("--seed -1", "seed"),
        ("--threads 2000", "threads"),
        ("--view agz", "view"),
    ],
)
def test_errors_about_invalid_render_options_name_the_option_as_typed(
    folder: Path, capsys: pytest.CaptureFixture[str], words: str, name: str
) -> None:
    option, value = words.split()
    assert run(f"render box.toml {option}={value}") == 2
    assert f"{option} {value.removesuffix('.0')}" in capsys.readouterr().err.replace(".0:", ":")
    assert sorted(os.listdir()) == ["box.toml"]
    given = int(value) if value.lstrip("-").isdecimal() else value
    with raises(raycam.SettingsError, code="invalid_settings", mentions=[name]):
        raycam.render("box.toml", **{name: given})  # type: ignore[arg-type]


@pytest.mark.parametrize("command", ["", *COMMANDS])
def test_help_contains_usage_and_examples(capsys: pytest.CaptureFixture[str], command: str) -> None:
    with pytest.raises(SystemExit) as exit_:
        run(f"{command} --help")
    assert exit_.value.code == 0
    out = capsys.readouterr().out
    assert "usage: raycam" in out
    assert f"raycam {command}" in out
    if command:
        assert "examples:" in out


def test_render_refuses_to_overwrite_a_texture_by_default(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Image.new("RGB", (2, 2), (9, 9, 9)).save("tex.png")
    before = Path("tex.png").read_bytes()
    Path("tex.toml").write_text(BOX + 'texture = "tex.png"\n')
    assert run("render tex.toml") == 2
    assert "-o" in capsys.readouterr().err
    assert Path("tex.png").read_bytes() == before


def shell(*command: str, **keys: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, **keys)  # type: ignore[call-overload,no-any-return]


def test_installed_command_and_module_print_the_same_version(folder: Path) -> None:
    script = Path(sys.executable).with_name("raycam")
    for command in ([str(script)], [sys.executable, "-m", "raycam"]):
        done = shell(*command, "--version")
        assert done.stdout == f"raycam {raycam.__version__}\n"
    done = shell(sys.executable, "-m", "raycam", "info", "nowhere.toml")
    assert done.returncode == 1
    assert "Traceback" not in done.stderr


def test_render_command_does_not_import_slow_modules(folder: Path) -> None:
    program = """
import json, sys
from raycam.cli import main
main(["render", "box.toml", "-o", "a.png", "--integrator", "flat", "--samples", "1"])
print(json.dumps([m for m in ("av", "raycam.reference", "raycam.video", "difflib") if m in sys.modules]))
"""
    done = shell(sys.executable, "-c", program)
    assert json.loads(done.stdout.splitlines()[-1]) == []


def test_closed_output_pipe_prints_no_traceback(folder: Path) -> None:
    command = f"{sys.executable} -m raycam info box.toml | true"
    done = shell("bash", "-c", f"set -o pipefail; {command}")
    assert "Traceback" not in done.stderr
    assert "BrokenPipe" not in done.stderr


CAR = """
[[object]]
name = "wall"
box = { size = [0.1, 6, 4] }
location = [4, 0, 0]
[[light]]
type = "sky"
radiance = [1, 1, 1]
[[rig]]
name = "stereo"
[[rig.camera]]
name = "left"
size = [32, 24]
focal = 30
location = [0, 0.1, 0]
[[rig.camera]]
name = "right"
size = [32, 24]
focal = 30
location = [0, -0.1, 0]
[video]
seconds = 2
fps = 1
interpolation = "linear"
keyframe = [{ time = 0, rig = "stereo", location = [0, 0, 0] }, { time = 2, rig = "stereo", location = [2, 0, 0] }]
"""


def test_size_is_accepted_with_a_cross_or_a_comma(folder: Path) -> None:
    for size in ("24x18", "24,18", "24X18"):
        assert run(f"render box.toml -o a.png --samples 1 --size {size}") == 0
        with Image.open("a.png") as image:
            assert image.size == (24, 18)


def test_render_command_writes_an_image_per_rig_camera(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("car.toml").write_text(CAR)
    assert run("render car.toml --rig stereo -o car.npz --channels depth,disparity --samples 1") == 0
    assert "car_left.npz: 32 x 24, depth, disparity" in capsys.readouterr().out
    for name in ("left", "right"):
        with np.load(f"car_{name}.npz") as read:
            np.testing.assert_allclose(read["disparity"], 30 * 0.2 / read["depth"], rtol=1e-5)
    assert run("render car.toml --rig stereo --at 1 -o later.npz --channels depth --samples 1") == 0
    with np.load("later_left.npz") as later, np.load("car_left.npz") as first:
        np.testing.assert_allclose(later["depth"], first["depth"] - 1.0, rtol=1e-5)
    assert run("info car.toml") == 0
    assert "from the first 0.2 0 0, turned by 0 degrees" in capsys.readouterr().out
    assert run("cameras car.toml") == 0
    assert "rig 'stereo'" in capsys.readouterr().out
    assert run("cameras car.toml --to kalibr -o chain.yaml") == run("info chain.yaml") == 0
    assert "from the first 0.2 0 0" in capsys.readouterr().out
    assert run("cameras chain.yaml:cam1 --to ros -o right.yaml") == 0
    (right,) = raycam.load_cameras("right.yaml").values()
    np.testing.assert_array_equal(right.K, raycam.load_cameras("chain.yaml")["cam1"].K)
    capsys.readouterr()
    assert run("cameras chain.yaml:cam9 --to ros -o right.yaml") == 1
    assert "unknown camera 'cam9'" in capsys.readouterr().err
    assert run("render box.toml --rig chain.yaml -o own.png --integrator flat --samples 1") == 0
    assert Path("own_cam1.png").exists()
    Path("body.tum").write_text("0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n")
    command = (
        "dataset car.toml -o d --rig stereo --poses body.tum --format colmap --samples 1 --option points=50"
    )
    assert run(command) == 0
    assert len(raycam.load_cameras("d/sparse/0").rigs) == 2
    assert run("dataset car.toml -o k --rig stereo --format kitti --samples 1") == 0
    command = "dataset box.toml -o c --rig chain.yaml --poses body.tum --format colmap --samples 1"
    assert run(f"{command} --camera-format kalibr --option points=50") == 0
    assert len(raycam.load_cameras("c/sparse/0").rigs) == 2
    assert run(f"{command} --camera-format ros") == 1
    assert len(list(Path("k/scene_flow/training/disp_occ_0").iterdir())) == 2
    assert run("render car.toml --rig stero -o x.png") == 2
    assert "stereo" in capsys.readouterr().err


def test_times_of_a_trajectory_move_the_world(folder: Path) -> None:
    # A bar moves past a static camera; the times are clock times, and one quaternion has the opposite sign.
    bar = """
        [[object]]
        name = "bar"
        box = { size = 0.5 }
        location = [-1, 0, 4]
        [video]
        seconds = 1
        interpolation = "linear"
        keyframe = [
            { time = 0, object = "bar", location = [-1, 0, 4] },
            { time = 1, object = "bar", location = [1, 0, 4] },
        ]
    """
    Path("bar.toml").write_text(bar)
    world = raycam.load("bar.toml")
    camera = raycam.Camera.from_pose([0, 0, 0], focal=40, size=(32, 24))
    raycam.save_cameras("k.yaml", {"k": camera}, "opencv")
    rows = ["0.125000 0 0 0 0 0 0 1", "0.750001 0 0 0 0 0 0 -1"]
    Path("clock.tum").write_text("\n".join(rows) + "\n")
    command = "dataset bar.toml -o bars --format tum --cameras clock.tum --intrinsics k.yaml --samples 1"
    assert run(command) == 0
    found = raycam.load_cameras("bars/groundtruth.txt", intrinsics=camera)
    assert list(found.times.values()) == [0.125, 0.750001]
    for name, pose in found.items():
        np.testing.assert_array_equal(pose.R, np.eye(3))
        moment = world.at(found.times[name])
        expected = raycam.render(moment, pose, channels="depth", samples=1)["depth"]
        depth = np.asarray(Image.open(f"bars/depth/{name}.png")) / 5000
        assert np.isfinite(expected).any()
        np.testing.assert_allclose(depth, np.where(np.isfinite(expected), expected, 0), atol=1.01e-4)


def test_video_command_writes_a_folder_per_rig_camera(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("car.toml").write_text(CAR)
    assert run("video car.toml --rig stereo -o drive --integrator direct --samples 1") == 0
    assert "drive_right: 2 frames of 32 x 24" in capsys.readouterr().out
    for name in ("left", "right"):
        for number in range(2):
            still = f"render car.toml --rig stereo --at {number} -o at.png --integrator direct --samples 1"
            assert run(still) == 0
            with (
                Image.open(f"drive_{name}/frame_{number:04d}.png") as film,
                Image.open(f"at_{name}.png") as one,
            ):
                assert np.array_equal(film, one)
    assert run("video car.toml --rig stereo -o drive.mp4 --integrator direct --samples 1 --keep-frames") == 0
    assert Path("drive_left.mp4").exists()
    assert Path("drive_right.mp4.job/frame_0001.png").exists()
    capsys.readouterr()
    assert run("video car.toml --rig stereo --camera left -o x.mp4") == 2
    assert "--camera" in capsys.readouterr().err


def test_cameras_command_reads_a_world_file(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("cameras box.toml") == 0
    out = capsys.readouterr().out
    assert "cameras    1" in out
    assert "64 x 48" in out
    assert run("cameras box.toml --to opencv -o box.yaml") == 0
    (camera,) = raycam.load_cameras("box.yaml").values()
    np.testing.assert_allclose(camera.P, raycam.load("box.toml").default_camera().P, atol=1e-12)


@pytest.mark.parametrize(
    ("command", "option", "formats"),
    [("cameras", "--to FORMAT", WRITTEN_FORMATS), ("dataset", "--format NAME", dataset.FORMATS)],
)
def test_help_names_every_format(
    command: str, option: str, formats: Iterable[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main([command, "--help"])
    help_text = capsys.readouterr().out.rpartition(option)[2].partition("\n  -")[0]
    help_text = re.sub(r"-\n\s+", "-", help_text)  # the help breaks lines at hyphens
    assert [word for word in re.findall(r"[\w-]+", help_text) if word in formats] == list(formats)


def test_dataset_help_lists_all_formats(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["dataset", "--help"])
    words = set(re.findall(r"[\w-]+", capsys.readouterr().out))
    assert set(dataset.FORMATS) <= words


def test_dataset_command_prints_notices_of_file_systems_without_locks(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", refuse)
    assert run("dataset box.toml -o set --samples 1") == 0
    printed = capsys.readouterr().err.splitlines()
    assert sum("notice: set:" in line for line in printed) == 1
    assert len(printed) == len(set(printed))
