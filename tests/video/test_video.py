"""Videos, read back by FFmpeg (PyAV) and Pillow."""

import threading

import av
import numpy as np
import pytest
import raycam
from PIL import Image
from raycam.video import VideoPlan, frame_range, write_video
from raycam.video.codecs import CODECS, open_encoder
from support.bending_plate import bending_plate
from support.raises import fault, raises

SIZE = (64, 48)
FLAT = {"integrator": "flat", "samples": 4}


def moving_world(**video):
    world = raycam.World()
    world.add_object(box={"size": [1, 1, 1]}, name="box", color=[0.8, 0.1, 0.1])
    world.add_object(plane={"size": [6, 6]}, location=[0, 0, -0.5], color=[0.2, 0.5, 0.9])
    world.add_camera(raycam.Camera.look_at([3, -2, 2], [0, 0, 0], size=SIZE, fov=45))
    world.set_video(**({"fps": 10, "seconds": 0.8, "orbit": {"target": [0, 0, 0]}} | video))
    return world


def read(path):
    with av.open(str(path)) as file:
        stream = file.streams.video[0]
        return stream, [frame.to_ndarray(format="rgb24") for frame in file.decode(video=0)]


def boxes_of(path):
    """The names of the boxes of an MP4, in order (ISO/IEC 14496-12)."""
    data, names = path.read_bytes(), []
    while data:
        size = int.from_bytes(data[:4])
        names.append(data[4:8].decode())
        data = data[size:]
    return names


# Files


def test_mp4_uses_a_widely_supported_format_and_shows_the_frames(tmp_path):
    film = write_video(moving_world(), tmp_path / "a.mp4", **FLAT)
    with av.open(str(tmp_path / "a.mp4")) as file:
        stream = file.streams.video[0]
        codec = stream.codec_context
        assert (codec.name, codec.pix_fmt) == ("h264", "yuv420p")
        assert (codec.width, codec.height) == SIZE
        assert stream.average_rate == 10
        assert stream.frames == 8
        assert float(stream.duration * stream.time_base) == pytest.approx(0.8)
        # BT.709 primaries, sRGB curve, BT.709 matrix, limited range (ITU-T H.273)
        assert (codec.color_primaries, codec.color_trc, codec.colorspace, codec.color_range) == (1, 13, 1, 1)
        frames = [frame.to_ndarray(format="rgb24") for frame in file.decode(stream)]
    assert len(frames) == len(film) == 8
    names = boxes_of(tmp_path / "a.mp4")
    assert names.index("moov") < names.index("mdat")
    for number, frame in enumerate(frames):
        difference = np.abs(frame.astype(int) - film.frame(number).to_srgb8())
        assert difference.mean() < 4


def test_mp4_colors_equal_those_of_the_images(tmp_path):
    # A frame of one colour has no edges that chroma subsampling could blur.
    for color in ("#d02020", "#20a050", "#3050e0", "#ffffff", "#000000", "#808080"):
        world = raycam.World()
        world.add_object(plane={"size": [9, 9]}, color=color)
        world.add_camera(raycam.Camera.look_at([0, 0, 2], [0, 0, 0], [0, 1, 0], size=SIZE, fov=45))
        write_video(world, tmp_path / "c.mp4", frames=(0, 1), **FLAT)
        _, [frame] = read(tmp_path / "c.mp4")
        expected = [int(color[i : i + 2], 16) for i in (1, 3, 5)]
        assert np.abs(frame.astype(int) - expected).max() <= 3, color


def test_gif_loops_with_accurate_colors(tmp_path):
    film = write_video(moving_world(), tmp_path / "a.gif", **FLAT)
    with Image.open(tmp_path / "a.gif") as image:
        assert (image.n_frames, image.size, image.info["loop"]) == (8, SIZE, 0)
        for number in range(8):
            image.seek(number)
            assert image.info["duration"] == 100
            difference = np.abs(np.asarray(image.convert("RGB")).astype(int) - film.frame(number).to_srgb8())
            assert difference.mean() < 1.5


def test_png_folder_contains_the_exact_frames(tmp_path):
    film = write_video(moving_world(), tmp_path / "frames", frames=(5, None), **FLAT)
    assert sorted(path.name for path in (tmp_path / "frames").iterdir()) == [
        "frame_0005.png",
        "frame_0006.png",
        "frame_0007.png",
    ]
    for number in (5, 6, 7):
        with Image.open(tmp_path / "frames" / f"frame_000{number}.png") as image:
            picture = np.asarray(image)
        np.testing.assert_array_equal(picture, film.frame(number).to_srgb8())


@pytest.mark.parametrize("name", ["a.mp4", "a.gif"])
def test_equal_calls_write_equal_video_files(tmp_path, name):
    for folder, threads in (("one", 1), ("two", 2)):
        (tmp_path / folder).mkdir()
        write_video(moving_world(), tmp_path / folder / name, threads=threads, **FLAT)
    assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


def test_encoder_is_deterministic(tmp_path):
    rng = np.random.default_rng(1)
    pictures = [np.roll(rng.integers(0, 255, (48, 64, 3), np.uint8) // 4, 3 * i, axis=1) for i in range(6)]
    made = set()
    for _ in range(30):
        with open_encoder(tmp_path / "a.mp4", SIZE, 10, CODECS[".mp4", False, False]) as add:
            for number, picture in enumerate(pictures):
                add(number, picture)
        made.add((tmp_path / "a.mp4").read_bytes())
    assert len(made) == 1


# Time


def test_frames_show_the_world_and_the_camera_at_their_times():
    world = moving_world(
        orbit=None,
        keyframe=[
            {"time": 0, "object": "box", "location": [-1, 0, 0]},
            {"time": 0.8, "object": "box", "location": [1, 0, 0]},
            {"time": 0, "location": [3, -2, 2], "target": [0, 0, 0]},
            {"time": 0.8, "location": [2, -3, 1], "target": [0, 0, 0]},
        ],
    )
    film = VideoPlan(world, **FLAT)
    assert len(film) == 8
    for number in (0, 3, 7):
        frame = film.frame(number)
        camera = world.camera_at(world.default_camera(), number / 10)
        assert frame.camera == camera
        expected = raycam.render(world.at(number / 10), camera, frame=number, **FLAT)
        np.testing.assert_array_equal(frame["color"], expected["color"])
    assert (film.frame(0)["color"] != film.frame(4)["color"]).any()


def test_fps_and_seconds_change_only_the_sampling_of_the_motion():
    world = moving_world()
    film = VideoPlan(world, fps=5, seconds=1.6, **FLAT)
    assert (len(film), film.fps, film.seconds) == (8, 5, 1.6)
    assert [film.time(number) for number in range(8)] == pytest.approx(np.arange(8) / 10)
    np.testing.assert_array_equal(film.frame(3)["color"], VideoPlan(world, **FLAT).frame(3)["color"])


def test_world_without_a_video_is_orbited_with_a_notice():
    world = raycam.World()
    world.add_object(box={"size": [1, 1, 1]}, location=[5, 0, 0])
    film = VideoPlan(world, integrator="flat", samples=1)
    assert (len(film), film.fps, film.seconds) == (96, 24, 4)
    assert [notice.code for notice in film.notices] == ["default_video"]
    assert world.video is None
    still = world.default_camera()
    first, half = film.frame(0).camera, film.frame(48).camera
    np.testing.assert_allclose(first.C, still.C)
    np.testing.assert_allclose((first.C + half.C)[:2] / 2, [5, 0], atol=1e-9)
    assert VideoPlan(moving_world()).notices == []
    assert [notice.code for notice in VideoPlan(moving_world(), time_limit=1.0).notices] == [
        "varying_samples"
    ]


def test_static_objects_are_built_once(tmp_path):
    world = moving_world(
        orbit=None,
        keyframe=[{"time": t, "object": "box", "location": [t, 0, 0]} for t in (0, 1)],
    )
    film = VideoPlan(world, **FLAT)
    film.frame(0)
    for moment in (world.at(0.5), world.at(1.0)):
        assert moment._core.objects_shared_with(world._core) == 2
    # The world itself need not be prepared first: the first world to be prepared builds the trees of all worlds.
    fresh = moving_world()
    moment = fresh.at(0.5)
    assert moment._core.objects_shared_with(fresh._core) == 2
    # A deforming mesh has its own tree; all other structures are shared.
    bending = bending_plate(tmp_path)
    for number in range(3):
        bending.add_object(box={"size": 0.1}, name=f"box {number}", location=[number, 0, 0])
    bending.prepare()
    film = VideoPlan(bending, bending.default_camera(), **FLAT)
    for number in (0, 5, 20):
        moment = bending.at(film.time(number), 0).prepare()
        assert moment._core.objects_shared_with(bending._core) == 3 + (number == 0)
    # An additional object is built separately.
    grown = world.at(0.0)
    grown.add_object(box={"size": [2, 1, 1]})
    assert grown._core.objects_shared_with(world._core) == 2


def test_frame_ranges_follow_python_slices(tmp_path):
    for frames, numbers in (((2, 4), [2, 3]), ((None, 1), [0]), ((-1, None), [7]), ((6, 99), [6, 7])):
        out = tmp_path / "-".join(map(str, numbers))
        write_video(moving_world(), out, frames=frames, **FLAT)
        assert sorted(path.name for path in out.iterdir()) == [f"frame_{number:04}.png" for number in numbers]
    assert frame_range("2:4") == (2, 4)
    assert frame_range(":-1") == (None, -1)
    assert frame_range(":") == (None, None)


# Opacity


@pytest.mark.parametrize("integrator", ["flat", "direct", "path", "ao"])
def test_transparent_images_over_the_sky_equal_opaque_images(integrator):
    world = moving_world()
    sky = np.float32([0.25, 0.5, 0.75])
    world.add_light({"type": "sky", "radiance": sky.tolist()})
    world.add_object(box={"size": 1}, name="veil", location=[0, 1, 1], opacity=0.5)
    options = {"integrator": integrator, "samples": 16, "filter": "blackman-harris"}
    whole = raycam.render(world, **options)
    clear = raycam.render(world, **options, transparent_background=True)
    assert whole.channels == ("color", "depth", "instance", "triangle")
    assert clear.channels == (*whole.channels, "alpha")
    alpha = clear["alpha"][..., None]
    assert 0 < (alpha == 0).mean() < 1
    assert ((alpha > 0) & (alpha < 1)).any()
    # Only these two integrators let light through.
    if integrator in ("direct", "path"):
        veil = alpha[clear["instance"] == 2]
        assert 0.3 < np.median(veil) < 0.9
    behind = 1.0 if integrator == "ao" else sky
    np.testing.assert_allclose(clear["color"] + (1 - alpha) * behind, whole["color"], atol=2e-6)
    assert (clear["color"][alpha[..., 0] == 0] == 0).all()


def test_images_and_videos_contain_opacity(tmp_path):
    film = write_video(
        moving_world(), tmp_path / "frames", transparent_background=True, frames=(2, 4), **FLAT
    )
    frame = film.frame(2)
    with Image.open(tmp_path / "frames/frame_0002.png") as image:
        pixels = np.asarray(image)
    assert pixels.shape == (48, 64, 4)
    np.testing.assert_array_equal(pixels, frame.to_srgba8())
    np.testing.assert_array_equal(pixels[..., 3], np.round(frame["alpha"] * 255))
    edge = (pixels[..., 3] > 0) & (pixels[..., 3] < 255)
    assert edge.any()
    # At edges to the sky, colours of the box and the plane are not darkened: half of each is 188.
    assert pixels[edge][:, :3].max(axis=1).min() >= 188
    write_video(moving_world(), tmp_path / "a.mkv", transparent_background=True, frames=(2, 4), **FLAT)
    with av.open(str(tmp_path / "a.mkv")) as file:
        first = next(file.decode(video=0)).to_ndarray(format="rgba")
    np.testing.assert_array_equal(first, pixels)
    with raises(raycam.SettingsError, code="cannot_write", mentions=[".mp4"]):
        write_video(moving_world(), tmp_path / "a.mp4", transparent_background=True, **FLAT)
    with raises(raycam.SettingsError, code="missing_value", mentions=["transparent_background=True"]):
        VideoPlan(moving_world(), **FLAT).frame(0).to_srgba8()


# Faults


def test_interrupted_video_leaves_no_files(tmp_path):
    def stop(done, total):
        assert total == 8
        if done == 3:
            raise KeyboardInterrupt

    for name in ("a.mp4", "a.gif"):
        (tmp_path / name).write_bytes(b"the one before")
        with pytest.raises(KeyboardInterrupt):
            write_video(moving_world(), tmp_path / name, progress=stop, **FLAT)
        assert (tmp_path / name).read_bytes() == b"the one before"
    with pytest.raises(KeyboardInterrupt):
        write_video(moving_world(), tmp_path / "b.mp4", progress=stop, **FLAT)
    with pytest.raises(KeyboardInterrupt):
        write_video(moving_world(), tmp_path / "frames", progress=stop, **FLAT)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.gif", "a.mp4", "frames"]
    for path in (tmp_path / "frames").iterdir():
        with Image.open(path) as image:
            image.load()


def test_encoder_errors_are_raised(tmp_path, monkeypatch):
    # Images are encoded in a separate thread while the next one is rendered.
    threads = set()
    real = raycam.Frame.to_srgb8

    def fail(frame):
        threads.add(threading.current_thread().name)
        if len(calls) == 4:
            raise OSError("no room")
        calls.append(frame)
        return real(frame)

    monkeypatch.setattr(raycam.Frame, "to_srgb8", fail)
    for name in ("a.mp4", "a.gif"):
        calls = []
        with pytest.raises(OSError, match="no room"):
            write_video(moving_world(), tmp_path / name, **FLAT)
        assert len(calls) == 4
    assert list(tmp_path.iterdir()) == []
    assert threads.isdisjoint({threading.current_thread().name})


def test_progress_counts_every_frame(tmp_path):
    calls = []
    write_video(moving_world(), tmp_path / "a.gif", progress=lambda *call: calls.append(call), **FLAT)
    assert calls == [(done, 8) for done in range(9)]


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        (
            "a.avi",
            {},
            fault("unknown_format", "a.avi", "'.avi'", ".mp4", ".mov", ".mkv", ".webm", ".gif"),
        ),
        ("a.mp4", {"frames": (8, 9)}, fault("out_of_range", "8:9")),
        ("a.gif", {"fps": 60}, fault("out_of_range", "GIF", "50", "60")),
        ("a.mp4", {"fps": 0}, fault("out_of_range")),
        ("a.mp4", {"seconds": float("nan")}, fault("out_of_range")),
        ("a.mp4", {"fps": 1e9}, fault("too_large", "1000000")),
        ("a.mp4", {"integrator": "fast"}, fault("invalid_settings", "integrator", "fast")),
    ],
)
def test_invalid_video_options_are_refused(tmp_path, name, options, message):
    with raises(raycam.SettingsError, **message):
        write_video(moving_world(), tmp_path / name, **options)
    assert list(tmp_path.iterdir()) == []


def test_odd_size_is_refused_with_the_nearest_even_size(tmp_path):
    camera = raycam.Camera.look_at([3, -2, 2], [0, 0, 0], size=(33, 21))
    with raises(raycam.SettingsError, code="out_of_range", mentions=["33 x 21", "34 x 22"]):
        write_video(moving_world(), tmp_path / "a.mp4", camera=camera)
    write_video(moving_world(), tmp_path / "a.gif", camera=camera, frames=(0, 2), **FLAT)
    with Image.open(tmp_path / "a.gif") as image:
        assert image.size == (33, 21)


def test_unwritable_outputs_are_refused_before_rendering(tmp_path):
    def never(*_):
        raise AssertionError

    (tmp_path / "file").write_text("x")
    for name, error in (
        ("nowhere/a.mp4", FileNotFoundError),
        ("nowhere/frames", FileNotFoundError),
        ("file", NotADirectoryError),
    ):
        with pytest.raises(error):
            write_video(moving_world(), tmp_path / name, progress=never, **FLAT)


@pytest.mark.parametrize("text", ["5", "a:b", "1:2:3", "1.5:"])
def test_invalid_frame_ranges_are_refused(text):
    with raises(raycam.SettingsError, code="invalid_value", mentions=["START", "STOP"]):
        frame_range(text)
