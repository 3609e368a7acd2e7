"""Options for the look: light, ground, background, sides, presets; and printed messages."""

from __future__ import annotations

import re
import shlex
import subprocess
from pathlib import Path

import numpy as np
import pytest
import raycam
import raycam.video
from PIL import Image, ImageOps
from raycam.cli import main
from support.gltf_document import variant_square

SMALL = "--size 64x48 --samples 2"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    world = raycam.World(up="y")
    world.add_object(sphere={"level": 4}, color="#b03020", name="ball")
    world.to_gltf(tmp_path / "ball.glb")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(command: str) -> int:
    return main(shlex.split(command))


def picture(name: str) -> np.ndarray:
    with Image.open(name) as image:
        return np.asarray(image)


def test_studio_image_of_a_model_equals_the_python_call(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("render ball.glb --samples 2 --size 64x48") == 0
    assert "studio" in capsys.readouterr().err
    world = raycam.load("ball.glb")
    camera = world.default_camera((64, 48))
    expected = raycam.render(
        world.in_studio(camera), camera, integrator="path", max_depth=6, samples=2, view="pbr_neutral"
    )
    np.testing.assert_array_equal(picture("ball.png"), expected.to_srgb8())


@pytest.mark.parametrize("irradiance", [2, 2000])
def test_model_with_a_sun_is_rendered_in_the_studio_room(
    folder: Path, capsys: pytest.CaptureFixture[str], irradiance: float
) -> None:
    world = raycam.load("ball.glb")
    world.add_light("sun", direction=[-1, -1, 0], irradiance=irradiance)
    world.to_gltf(folder / "lit.glb")
    assert run(f"render lit.glb {SMALL} --view-from front") == 0
    assert "--no-studio" in capsys.readouterr().err
    shown = picture("lit.png")[..., 0]
    assert 100 < shown[0].min() < 220  # the room
    left, right = shown[22:26, 15:19].mean(), shown[22:26, 45:49].mean()
    # The sun shines from the right, and the room fills its shadows.
    assert 80 < left < 0.85 * right < 0.85 * 230
    assert run(f"render lit.glb {SMALL} --no-studio") == 0
    assert "--no-studio" not in capsys.readouterr().err
    loaded = raycam.load("lit.glb")
    expected = raycam.render(loaded, loaded.default_camera((64, 48)), samples=2)
    np.testing.assert_array_equal(picture("lit.png"), expected.to_srgb8())


def test_mesh_without_materials_is_grey_in_the_studio(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("a.obj").write_text("v -1 -1 0\nv 1 -1 0\nv 0 2 0\nf 1 2 3\n")
    Path("b.obj").write_text("mtllib b.mtl\nusemtl m\n" + Path("a.obj").read_text())
    Path("b.mtl").write_text("newmtl m\nKd 0.8 0.8 0.8\n")
    shown = {}
    for name in ("a", "b"):
        assert run(f"render {name}.obj -o {name}.npz --channels color albedo instance {SMALL}") == 0
        assert ("no materials" in capsys.readouterr().err) == (name == "a")
        with np.load(f"{name}.npz") as read:
            mask = read["instance"] == 0
            shown[name] = float(read["color"][mask].mean()), float(read["albedo"][mask].mean())
    assert shown["a"][0] == pytest.approx(0.35 / 0.8 * shown["b"][0], rel=0.1)
    assert shown["a"][1] == shown["b"][1] == pytest.approx(0.8)


def test_light_of_a_world_file_is_rendered_as_it_is(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("a.toml").write_text(
        '[[object]]\nsphere = {}\n[[light]]\ntype = "sun"\ndirection = [-1, 1, -1]\nirradiance = 2\n'
    )
    assert run(f"render a.toml {SMALL}") == 0
    assert "studio" not in capsys.readouterr().err
    assert picture("a.png")[0].max() == 0


def test_variant_option_selects_a_material_variant(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    variant_square().save(folder / "v.glb")
    for option, color in (("", [0, 255, 0]), ("--variant red", [255, 0, 0])):
        assert run(f"render v.glb --integrator flat {SMALL} {option}") == 0
        assert (picture("v.png")[..., :3] == color).all(axis=-1).any()
    assert run("render v.glb --variant blue") == 1
    assert "unknown variant 'blue' (available: red)" in capsys.readouterr().err


def test_view_from_zoom_and_fov_options_place_the_camera(folder: Path) -> None:
    sizes = {}
    for options in ("", "--zoom 0.5", "--view-from top --fov 20", "--view-from 1,2,3"):
        command = f"render ball.glb -o a.npz --channels instance {SMALL} --integrator flat {options}"
        assert run(command) == 0
        with np.load("a.npz") as read:
            sizes[options] = int((read["instance"] >= 0).sum())
            if options.startswith("--view-from top"):
                np.testing.assert_allclose(read["R"][2], [0, -1, 0], atol=1e-12)
    assert sizes["--zoom 0.5"] == pytest.approx(sizes[""] / 4, rel=0.15)


def test_calibration_without_a_pose_frames_the_model(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    camera = raycam.data.fisheye().at_pose(np.eye(3), np.zeros(3))
    raycam.save_cameras("calib.yaml", {"eye": camera}, "opencv")
    command = (
        "render ball.glb -o a.npz --channels instance --camera calib.yaml --size 64x48 --integrator flat"
    )
    assert run(command) == 0
    assert "--view-from SIDE" in capsys.readouterr().err
    assert run(f"{command} --view-from front") == 0
    assert "--view-from SIDE" not in capsys.readouterr().err
    with np.load("a.npz") as read:
        seen = np.argwhere(read["instance"] == 0)
        small = camera.resized((64, 48))
        np.testing.assert_allclose(read["K"], small.K)
        np.testing.assert_allclose(read["R"][2], [0, 0, -1], atol=0.01)
    assert 0.85 * 48 <= np.ptp(seen[:, 0]) + 1 <= 0.92 * 48


def test_light_options_light_the_model(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sky = raycam.Frame({"color": np.full((8, 16, 3), [2, 0, 0], np.float32)}, camera=None, size=(16, 8))
    sky.save("red.hdr")
    for view in ("", "--view standard"):
        assert run(f"render ball.glb -o hdri.png --hdri red.hdr --hdri-rotation 30 {view} {SMALL}") == 0
        assert "studio" not in capsys.readouterr().err
        seen = picture("hdri.png").astype(int)
        assert (seen[0, 0, 0] == 255) == (view != ""), "what is beyond white is rolled off"
    assert (seen[..., 1:] == 0).all()
    for side, brighter in (("90", "right"), ("-90", "left")):
        assert (
            run(f"render ball.glb -o sun.npz --sun {side} 20 --view-from front {SMALL} --channels color") == 0
        )
        with np.load("sun.npz") as read:
            row = read["color"][24].mean(axis=1)
        assert (row[44] > row[20]) == (brighter == "right")
    assert run(f"render ball.glb -o g.npz --sun 0 80 --ground green {SMALL} --channels instance") == 0
    with np.load("g.npz") as read:
        assert (read["instance"] == 1).any()
    assert run("render spot.toml -o s.png --studio --size 48x30 --samples 1") == 0
    assert "2 lights" in capsys.readouterr().err


def test_ground_option_renders_shadows_on_a_transparent_background(folder: Path) -> None:
    for ground in ("", "--ground shadow"):
        assert run(f"render ball.glb -o clear.png --background transparent {ground} {SMALL}") == 0
        clear = picture("clear.png").astype(int)
        dark = (clear[..., 3] > 0) & (clear[..., 3] < 250) & (clear[..., :3].max(axis=2) < 40)
        assert (dark.sum() > 200) == (ground != ""), "the shadow is dark and half transparent"


def test_default_camera_shows_the_whole_motion(folder: Path) -> None:
    Path("moves.toml").write_text(
        """
        [[object]]
        name = "ball"
        sphere = { radius = 1 }
        [video]
        seconds = 1
        keyframe = [
            { time = 0, object = "ball", location = [0, 0, 0] },
            { time = 0.5, object = "ball", location = [4, 0, 3] },
            { time = 1, object = "ball", location = [-2, 1, 0] },
        ]
        """
    )
    film = raycam.video.VideoPlan("moves.toml")
    by_command = []
    for time in (0.0, 0.4, 0.5, 1.0):
        assert run(f"render moves.toml -o a.npz --at {time} {SMALL} --channels instance") == 0
        with np.load("a.npz") as read:
            seen = read["instance"] == 0
            by_command.append(read["C"])
        edge = np.concatenate([seen[0], seen[-1], seen[:, 0], seen[:, -1]])
        assert seen.any()
        assert not edge.any(), "nothing is cut off"
    np.testing.assert_allclose(by_command, [film.camera.location] * 4, atol=1e-9)


def test_negative_numbers_are_accepted_as_option_values(folder: Path) -> None:
    for given in ("--view-from -1,0.5,-2", "--view-from=-1,0.5,-2", "--view-from -.5,.25,-1e0"):
        assert run(f"render ball.glb -o side.npz {given} {SMALL} --channels position") == 0
        with np.load("side.npz") as read:
            to_camera = read["C"] / np.linalg.norm(read["C"])
        np.testing.assert_allclose(to_camera, np.array([-1, 0.5, -2]) / 5.25**0.5, atol=1e-3)


def test_ground_truth_channels_do_not_add_a_studio(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(f"render ball.glb -o truth.npz {SMALL} --channels depth") == 0
    assert capsys.readouterr().err == ""


def test_background_option_sets_the_background(folder: Path) -> None:
    assert run(f"render ball.glb -o clear.png --background transparent {SMALL}") == 0
    assert picture("clear.png").shape == (48, 64, 4)
    assert run(f"render ball.glb -o white.png --background white {SMALL}") == 0
    white = picture("white.png")
    np.testing.assert_array_equal(white[0, 0], 255)
    clear = picture("clear.png")
    below = white[40:, 34:60].mean(axis=2)[clear[40:, 34:60, 3] == 0]
    assert below.min() < 200, "the shadow falls on the background"
    Image.new("RGB", (30, 30), (10, 200, 30)).save("photo.png")
    assert run(f"render ball.glb -o photo_.png --background photo.png {SMALL}") == 0
    np.testing.assert_array_equal(picture("photo_.png")[0, 0], [10, 200, 30])


def test_video_without_an_output_name_is_named_after_its_world(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("video ball.glb --turntable --seconds 0.1 --size 32x24 --samples 1") == 0
    assert capsys.readouterr().out == "ball.mp4: 2 frames of 32 x 24, 24 a second\n"
    assert (folder / "ball.mp4").stat().st_size > 0


def test_turntable_option_equals_the_turntable_video(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("render ball.glb --turntable 0.25 --size 32x24 --samples 1 -o turn") == 0
    assert "turn: 6 frames of 32 x 24" in capsys.readouterr().out
    assert run("video ball.glb --turntable --seconds 0.25 --size 32x24 --samples 1 -o same") == 0
    for number in range(6):
        name = f"frame_{number:04d}.png"
        assert Path("turn", name).read_bytes() == Path("same", name).read_bytes()
    assert not np.array_equal(picture("turn/frame_0000.png"), picture("turn/frame_0002.png"))


def test_preset_option_sets_samples_unless_given(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("render ball.glb --preset draft --size 16x12 --verbose") == 0
    assert "samples=4" in capsys.readouterr().err
    assert run("render ball.glb --preset good --samples 3 --size 16x12 --verbose") == 0
    said = capsys.readouterr().err
    assert "samples=3" in said
    assert "integrator=path" in said


def test_quiet_option_prints_only_errors(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(f"render ball.glb --quiet {SMALL}") == 0
    said = capsys.readouterr()
    assert said.out == said.err == ""
    assert run("render ball.glb --quiet --samples 0") == 2
    assert "samples" in capsys.readouterr().err
    assert run("info ball.glb --quiet") == 0
    assert "triangles" in capsys.readouterr().out
    assert run("render ball.glb --verbose --samples 0") == 2
    assert "Traceback" in capsys.readouterr().err


def test_up_option_turns_an_obj_file(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 3 0\nf 1 2 3\n")
    command = f"render a.obj -o a.npz --channels depth {SMALL}"
    assert run(command) == 0
    assert "--up z" in capsys.readouterr().err
    with np.load("a.npz") as read:
        assert -read["R"][1][1] > 0.8
    assert run(f"{command} --up z") == 0
    assert "--up" not in capsys.readouterr().err
    with np.load("a.npz") as read:
        assert -read["R"][1][2] > 0.8


ERRORS = {
    "render ball.glb --hdri-rotation 3": "--hdri FILE",
    "render ball.glb --sun 1 2 --integrator flat": "--sun",
    "render ball.glb --background blu": "'blu'",
    "render ball.glb --background white --channels depth -o a.npz": "requested channels: depth",
    "render ball.glb --background white --workers 2": "--workers",
    "render ball.glb --camera camera.yaml --fov 20": "--camera",
    "render ball.glb --turntable -o a.png": ".mp4",
    "render ball.glb --turntable --region 0,0,1,1": "--turntable",
    "video ball.glb -o a.mp4 --background white": "transparent",
    "render spot.toml --up y": "at its top",
    "render bal.glb": "did you mean ball.glb",
}


@pytest.mark.parametrize("command", ERRORS)
def test_invalid_look_options_are_refused_without_output(
    folder: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    assert run(f"{command} --size 16x12") in (1, 2)
    assert ERRORS[command] in capsys.readouterr().err
    assert not [path for path in folder.iterdir() if path.name != "ball.glb"]


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (
            "render ball.glb --turntable --fps 12",
            r"--fps 12; .*raycam video \(see raycam render --help",
        ),
        ("render ball.glb --sampels 3", r"did you mean --samples\? \(see raycam render --help"),
        ("render ball.glb --sample 3", r"did you mean --samples\?"),
        ("render ball.glb --max 3", r"did you mean --max-depth\?"),
        ("render ball.glb --sample=3", r"did you mean --samples\?"),
        ("render ball.glb --spp 3", r"did you mean --samples\?"),
        ("render ball.glb --bounces 3", r"did you mean --max-depth\?"),
        ("video ball.glb --noise 1", r"did you mean --noise-threshold\?"),
        ("dataset a.toml -o x --hdri a.hdr", "--hdri .*raycam render, raycam view, raycam video"),
        ("info ball.glb other.glb", "unrecognized arguments: other.glb \\(see raycam info --help"),
    ],
)
def test_errors_about_unknown_options_suggest_an_option(
    folder: Path, capsys: pytest.CaptureFixture[str], command: str, said: str
) -> None:
    with pytest.raises(SystemExit) as ended:
        run(command)
    assert ended.value.code == 2
    assert re.search(said, capsys.readouterr().err)


@pytest.mark.parametrize(
    ("words", "completed"),
    [
        (["raycam", "rend"], ["render"]),
        (["raycam", "render", "a.glb", "--view-f"], ["--view-from"]),
        (["raycam", "render", "a.glb", "--preset", "b"], ["best"]),
        (["raycam", "completion", "f"], ["fish"]),
        (["raycam", "render", "a.glb", "--integrator", "pa"], ["path"]),
        (["raycam", "render", "a.glb", "--channels", "color", "dep"], ["depth"]),
        (["raycam", "render", "a.glb", "--channels", "color", "--integ"], ["--integrator"]),
        (["raycam", "render", "a.glb", "--view-from", "t"], ["top"]),
        (["raycam", "dataset", "a.glb", "--format", "coc"], ["coco"]),
        (["raycam", "cameras", "a.yaml", "--to", "ro"], ["ros"]),
        (["raycam", "render", "a"], []),
    ],
)
def test_bash_completion_lists_options_and_values(
    words: list[str], completed: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("completion bash") == 0
    script = capsys.readouterr().out
    ask = f"COMP_WORDS=({shlex.join(words)}); COMP_CWORD={len(words) - 1}; _raycam"
    ask += "; printf '%s\\n' \"${COMPREPLY[@]}\""
    done = subprocess.run(["bash", "-c", f"{script}\n{ask}"], capture_output=True, text=True, check=True)
    assert done.stdout.split() == completed


def test_completion_scripts_for_zsh_and_fish_are_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("completion zsh") == 0
    assert "bashcompinit" in capsys.readouterr().out
    assert run("completion fish") == 0
    out = capsys.readouterr().out
    assert "complete -c raycam" in out
    assert "-l integrator -x -a 'flat direct path" in out


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("-o a.png --channels color depth", "depth would be lost"),
        ("-o a.jpg --background transparent", "opacity"),
        ("-o a.hdr --transparent-background", "opacity"),
    ],
)
def test_unsupported_output_combinations_are_refused_before_rendering(
    folder: Path, capsys: pytest.CaptureFixture[str], options: str, words: str
) -> None:
    assert run(f"render ball.glb {options} {SMALL}") == 2
    assert words in capsys.readouterr().err
    assert sorted(path.suffix for path in folder.iterdir()) == [".glb"]


def test_orientation_option_rotates_the_background(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Pillow's `exif_transpose` defines the rotated photo."""
    monkeypatch.chdir(tmp_path)
    photo = Image.fromarray(np.arange(6 * 8 * 3, dtype=np.uint8).reshape(6, 8, 3))
    exif = photo.getexif()
    exif[0x112] = 3
    photo.save("photo.png", exif=exif)
    camera = "[camera]\nsize = [8, 6]\nfov = 40\nlocation = [0, -9, 0]\n"
    world = f"{camera}[[object]]\nbox = {{ size = 1 }}\nlocation = [0, -20, 0]\n"
    Path("world.toml").write_text(world)
    with Image.open("photo.png") as read:
        expected = {"apply": np.asarray(ImageOps.exif_transpose(read)), "ignore": np.asarray(photo)}
    for orientation, pixels in expected.items():
        command = (
            f"render world.toml -o a.png --background photo.png --orientation {orientation} --channels color"
        )
        assert main(command.split()) == 0
        with Image.open("a.png") as image:
            np.testing.assert_allclose(np.asarray(image).astype(int), pixels, atol=1)
    capsys.readouterr()
    assert main(["render", "world.toml", "-o", "a.png", "--background", "photo.png"]) == 0
    assert "--orientation apply" in capsys.readouterr().err
    assert main(["render", "world.toml", "-o", "a.png", "--orientation", "apply"]) == 2
