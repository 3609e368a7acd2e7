"""Reconstructions of photogrammetry programs, compared with the documented formulas."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.errors import FormatError
from scipy.spatial.transform import Rotation
from support.camera_truth import OPENGL, brown, check, equidistant, four, intrinsics, picture, pose
from support.raises import Fault, fault, has_notice, notice_codes, raises

SIZE = (640, 480)


def text(values: Any) -> str:
    return " ".join(repr(float(v)) for v in np.asarray(values).ravel())


# Metashape ------------------------------------------------------------------------------------------------

TERMS = {"f": 500.0, "cx": 3.5, "cy": -2.5, "b1": 1.5, "b2": -0.7, "k1": -0.1, "k2": 0.03, "k3": 0.002}
TANGENTIAL = {"p1": 0.001, "p2": -0.002}
SCALE = 3.5


def metashape(
    terms: dict[str, float],
    *,
    kind: str = "frame",
    initial: bool = False,
    component: bool = False,
    chunk: bool = True,
    cameras: str = "",
) -> str:
    turn, shift = pose(20)
    world = (
        f'<transform><rotation locked="true">{text(turn)}</rotation><translation>{text(shift)}</translation>'
        f'<scale locked="true">{SCALE}</scale></transform>'
    )
    wrong = "<transform><rotation>0 -1 0 1 0 0 0 0 1</rotation><scale>9</scale></transform>"
    inside = "".join(f"<{name}>{value}</{name}>" for name, value in terms.items())
    size = '<resolution width="640" height="480"/>'
    adjusted = f'<calibration type="{kind}" class="adjusted">{size}{inside}</calibration>'
    start = f'<calibration type="{kind}" class="initial"><resolution width="640" height="480"/><f>99</f></calibration>'
    listed = "".join(
        f'<camera id="{i}" sensor_id="0" component_id="0" label="IMG_{i}"><transform>'
        f"{text(four(pose(i)[0].T, pose(i)[1]))}</transform></camera>"
        for i in range(2)
    )
    parts = f'<components><component id="0" label="a">{world}</component></components>' if component else ""
    placed = wrong if component else world if chunk else ""
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<document version="2.0.0"><chunk label="Chunk 1" enabled="true">\n'
        f'<sensors><sensor id="0" label="x" type="{kind}"><resolution width="640" height="480"/>'
        f"{start if initial else adjusted + start}</sensor></sensors>\n{parts}<cameras><group>{listed}</group>\n"
        f'<camera id="7" sensor_id="0" label="lost"/>{cameras}</cameras>\n{placed}</chunk></document>'
    )


def world_pose(seed: int) -> tuple[Any, Any]:
    R, C = pose(seed)
    turn, shift = pose(20)
    return R @ turn.T, SCALE * turn @ C + shift


def own_lens(x: Any) -> Any:
    # Metashape's p1 equals OpenCV's p2.
    return brown(x, (-0.1, 0.03, 0.002), (-0.002, 0.001))


K = intrinsics(501.5, 500.0, 323.5, 237.5, -0.7)


@pytest.mark.parametrize("component", [True, False])
def test_metashape_cameras_are_read(tmp_path: Path, component: bool) -> None:
    file = tmp_path / "cameras.xml"
    file.write_text(metashape({**TERMS, **TANGENTIAL}, component=component))
    cameras = raycam.load_cameras(file)
    assert list(cameras) == ["IMG_0", "IMG_1"]
    for i, camera in enumerate(cameras.values()):
        check(camera, K, *world_pose(i), own_lens)
    assert has_notice(cameras.notices, "ignored_element", "lost")


@pytest.mark.parametrize("tangential", [True, False])
def test_metashape_fisheye_is_read(tmp_path: Path, tangential: bool) -> None:
    file = tmp_path / "a.xml"
    terms = {**TERMS, **(TANGENTIAL if tangential else {}), "k4": 0.0003}
    file.write_text(metashape(terms, kind="fisheye", chunk=False))
    p = (-0.002, 0.001) if tangential else (0.0, 0.0)
    camera = raycam.load_cameras(file)["IMG_1"]
    check(camera, K, *pose(1), lambda x: brown(equidistant(x), (-0.1, 0.03, 0.002, 0.0003), p))


@pytest.mark.parametrize(
    ("terms", "options", "reason"),
    [
        ({"k4": 0.001}, {}, fault("syntax", "k4")),
        ({"p3": 0.001}, {}, fault("syntax", "p3")),
        ({"p4": 0.001}, {"kind": "fisheye"}, fault("syntax", "p4")),
        ({"k7": 0.001}, {}, fault("syntax", "k7")),
        ({}, {"kind": "equisolid_fisheye"}, fault("unsupported_feature", "a.xml:3", "<calibration>")),
        ({}, {"kind": "cylindrical"}, fault("unsupported_feature", "cylindrical")),
    ],
)
def test_unsupported_terms_of_metashape_are_refused_by_name(
    tmp_path: Path, terms: Any, options: Any, reason: Fault
) -> None:
    file = tmp_path / "a.xml"
    file.write_text(metashape({**TERMS, **terms}, **options))
    with raises(FormatError, **reason):
        raycam.load_cameras(file)


def test_ignored_parts_of_metashape_files_give_notices(tmp_path: Path) -> None:
    file = tmp_path / "a.xml"
    rolling = (
        f'<camera id="9" sensor_id="0" label="b" enabled="false"><transform>{text(np.eye(4))}</transform>'
    )
    rolling += "<rolling_shutter><rotation>1</rotation></rolling_shutter></camera>"
    document = metashape({}, initial=True, cameras=rolling)
    reference = "<reference>GEOGCS[&quot;WGS 84&quot;]</reference></chunk><chunk label='2'></chunk>"
    file.write_text(document.replace("</chunk>", reference))
    told = " ".join(map(str, raycam.load_cameras(file).notices))
    for word in (
        "2 chunks",
        "ECEF",
        "1 camera included, though disabled",
        "rolling shutter of 1",
        "initial calibration",
    ):
        assert word in told


def test_slave_cameras_of_metashape_are_placed_relative_to_their_master(tmp_path: Path) -> None:
    # The sensors' transforms are master_from_slave; the cameras of a sensor without a transform are omitted.
    (R, C), (turn, place) = pose(1), pose(5)
    size = '<resolution width="640" height="480"/>'
    calibration = f'<calibration type="frame" class="adjusted">{size}<f>500</f></calibration>'
    mount = f"<rotation>{text(turn)}</rotation><location>{text(place)}</location>"
    sensors = f'<sensor id="0" type="frame">{size}{calibration}</sensor>'
    sensors += f'<sensor id="1" type="frame" master_id="0">{size}{calibration}{mount}</sensor>'
    sensors += f'<sensor id="2" type="frame" master_id="0">{size}{calibration}</sensor>'
    cameras = f'<camera id="0" sensor_id="0" label="m"><transform>{text(four(R.T, C))}</transform></camera>'
    cameras += '<camera id="1" sensor_id="1" master_id="0" label="s"/>'
    cameras += '<camera id="2" sensor_id="2" master_id="0" label="unknown"/>'
    file = tmp_path / "cameras.xml"
    chunk = f'<chunk label="1"><sensors>{sensors}</sensors><cameras>{cameras}</cameras></chunk>'
    file.write_text(f'<document version="2.0.0">{chunk}</document>')
    found = raycam.load_cameras(file)
    plain = intrinsics(500, 500, 320, 240)
    moved = four(R.T, C) @ four(turn, place)
    check(found["m"], plain, R, C)
    check(found["s"], plain, moved[:3, :3].T, moved[:3, 3])
    said = " ".join(map(str, found.notices))
    assert "1 slave camera placed" in said
    assert has_notice(found.notices, "ignored_element", 'camera "unknown"')


def test_master_cameras_of_metashape_may_belong_to_any_sensor_of_the_rig(tmp_path: Path) -> None:
    # Sensor 1 is mounted on sensor 0, and sensor 2 on sensor 1; the master in the list of cameras belongs to sensor 1.
    (R, C), (turn, place), (turn2, place2) = pose(1), pose(5), pose(6)
    size = '<resolution width="640" height="480"/>'
    calibration = f'<calibration type="frame" class="adjusted">{size}<f>500</f></calibration>'
    body = f"{size}{calibration}"
    sensors = f'<sensor id="0" type="frame">{body}</sensor><sensor id="4" type="frame">{body}</sensor>'
    for own, master, r, c in (("1", "0", turn, place), ("2", "1", turn2, place2)):
        mount = f"<rotation>{text(r)}</rotation><location>{text(c)}</location>"
        sensors += f'<sensor id="{own}" type="frame" master_id="{master}">{body}{mount}</sensor>'
    cameras = f'<camera id="0" sensor_id="1" label="m"><transform>{text(four(R.T, C))}</transform></camera>'
    for label, own in (("a", "0"), ("b", "2"), ("same", "1"), ("other rig", "4")):
        cameras += f'<camera id="{label}" sensor_id="{own}" master_id="0" label="{label}"/>'
    file = tmp_path / "cameras.xml"

    def write(sensors: str) -> None:
        chunk = f'<chunk label="1"><sensors>{sensors}</sensors><cameras>{cameras}</cameras></chunk>'
        file.write_text(f'<document version="2.0.0">{chunk}</document>')

    write(sensors)
    found = raycam.load_cameras(file)
    assert list(found) == ["m", "a", "b", "same"]
    chunk_from_m = four(R.T, C)
    expected = {
        "m": chunk_from_m,
        "a": chunk_from_m @ np.linalg.inv(four(turn, place)),
        "b": chunk_from_m @ four(turn2, place2),
        "same": chunk_from_m,
    }
    for name, camera in found.items():
        check(camera, intrinsics(500, 500, 320, 240), expected[name][:3, :3].T, expected[name][:3, 3])
    assert notice_codes(found.notices).count("placed_cameras") == 2
    assert has_notice(found.notices, "ignored_element", "other rig")
    write(
        sensors.replace(
            '<sensor id="0" type="frame">',
            '<sensor id="0" type="frame" master_id="2"><location>0 0 1</location>',
        )
    )
    with raises(FormatError, code="syntax", mentions=["cameras.xml:1", "<sensor>"]):
        raycam.load_cameras(file)


def test_lens_file_of_an_old_metashape_version_is_read(tmp_path: Path) -> None:
    file = tmp_path / "lens.xml"
    terms = {
        "fx": 501.5,
        "fy": 500.0,
        "cx": 323.5,
        "cy": 237.5,
        "skew": -0.7,
        "k1": -0.1,
        "p1": 0.001,
        "p2": -0.002,
    }
    inside = "".join(f"<{name}>{value}</{name}>" for name, value in terms.items())
    file.write_text(
        f"<calibration><projection>frame</projection><width>640</width><height>480</height>{inside}</calibration>"
    )
    camera = raycam.load_cameras(file)["lens"]
    check(camera, K, np.eye(3), np.zeros(3), lambda x: brown(x, (-0.1,), (0.001, -0.002)))


# OpenSfM --------------------------------------------------------------------------------------------------

SFM: dict[str, Any] = {
    "perspective": ({"focal": 0.8, "k1": -0.1, "k2": 0.02}, lambda x: brown(x, (-0.1, 0.02))),
    "brown": (
        {
            "focal_x": 0.8,
            "focal_y": 0.8,
            "c_x": 0.01,
            "c_y": -0.02,
            "k1": -0.1,
            "k2": 0.02,
            "k3": 0.003,
            "p1": 0.001,
            "p2": 0.002,
        },
        lambda x: brown(x, (-0.1, 0.02, 0.003), (0.001, 0.002)),
    ),
    "simple_radial": (
        {"focal_x": 0.8, "focal_y": 0.8, "c_x": 0.01, "c_y": -0.02, "k1": -0.1},
        lambda x: brown(x, (-0.1,)),
    ),
    "fisheye": ({"focal": 0.8, "k1": -0.1, "k2": 0.02}, lambda x: brown(equidistant(x), (-0.1, 0.02))),
    "fisheye_opencv": (
        {
            "focal_x": 0.8,
            "focal_y": 0.8,
            "c_x": 0.01,
            "c_y": -0.02,
            "k1": 0.1,
            "k2": 0.02,
            "k3": 0.01,
            "k4": 0.002,
        },
        lambda x: brown(equidistant(x), (0.1, 0.02, 0.01, 0.002)),
    ),
    "fisheye62": (
        {
            "focal_x": 0.8,
            "focal_y": 0.8,
            "c_x": 0.01,
            "c_y": -0.02,
            "k1": 0.1,
            "k2": 0.02,
            "k5": 0.0,
            "p1": 0.001,
            "p2": 0.002,
        },
        lambda x: brown(equidistant(x), (0.1, 0.02), (0.001, 0.002)),
    ),
}


def open_sfm(kind: str, **terms: float) -> list[dict[str, Any]]:
    camera = {
        "projection_type": kind,
        "width": 640,
        "height": 480,
        **SFM.get(kind, ({"focal": 0.8}, 0))[0],
        **terms,
    }
    shots = {}
    for i in range(2):
        R, C = pose(i)
        vector = Rotation.from_matrix(R).as_rotvec().tolist()
        shots[f"{i}.jpg"] = {
            "rotation": vector,
            "translation": (-R @ C).tolist(),
            "camera": "v2 x",
            "orientation": 1,
        }
    lla = {"latitude": 47.0, "longitude": 8.0, "altitude": 400.0}
    return [{"cameras": {"v2 x": camera}, "shots": shots, "points": {}, "reference_lla": lla}]


@pytest.mark.parametrize("kind", SFM)
def test_opensfm_reconstructions_are_read(tmp_path: Path, kind: str) -> None:
    file = tmp_path / "reconstruction.json"
    file.write_text(json.dumps(open_sfm(kind)))
    cameras = raycam.load_cameras(tmp_path)
    off = [6.4, -12.8] if "c_x" in SFM[kind][0] else [0, 0]
    for i, camera in enumerate(cameras.values()):
        check(camera, intrinsics(512, 512, 319.5 + off[0], 239.5 + off[1]), *pose(i), SFM[kind][1])
    assert has_notice(cameras.notices[:1], "placed_cameras", "latitude 47", "longitude 8")
    models = tmp_path / "models.json"
    models.write_text(json.dumps(open_sfm(kind)[0]["cameras"]))
    assert list(raycam.load_cameras(models)) == ["v2 x"]


@pytest.mark.parametrize(
    ("kind", "terms", "reason"),
    [
        ("dual", {"transition": 0.5}, fault("unsupported_feature", "dual")),
        ("fisheye62", {"k5": 0.1}, fault("syntax", "k5")),
        ("brown", {"k4": 0.1}, fault("syntax", "k4")),
    ],
)
def test_unsupported_terms_of_opensfm_are_refused(
    tmp_path: Path, kind: str, terms: dict[str, float], reason: Fault
) -> None:
    file = tmp_path / "a.json"
    file.write_text(json.dumps(open_sfm(kind, **terms)))
    with raises(FormatError, **reason):
        raycam.load_cameras(file)


def test_several_reconstructions_give_a_notice(tmp_path: Path) -> None:
    file = tmp_path / "a.json"
    file.write_text(json.dumps(open_sfm("brown") * 2))
    assert has_notice(raycam.load_cameras(file).notices, "first_only", 2)


# RealityCapture -------------------------------------------------------------------------------------------


def reality_capture(path: Path, **terms: float) -> Path:
    names = [
        "name",
        "x",
        "y",
        "alt",
        "heading",
        "pitch",
        "roll",
        "f",
        "px",
        "py",
        "k1",
        "k2",
        "k3",
        "k4",
        "t1",
        "t2",
    ]
    lines = ["#cameras 2", "#" + ",".join(names)]
    for i in range(2):
        values = {
            "x": 1.0 + i,
            "y": 2.0,
            "alt": 3.0,
            "heading": 40.0,
            "pitch": 25.0,
            "roll": -10.0,
            "f": 30.0,
        }
        values |= {"px": 0.01, "py": -0.02, "k1": -0.1, "k2": 0.02, "k3": 0.001, **terms}
        lines.append(",".join([f"{i}.jpg", *(repr(values.get(name, 0.0)) for name in names[1:])]))
    path.write_text("\n".join(lines) + "\n")
    return path


def test_reality_capture_csv_is_read(tmp_path: Path) -> None:
    file = reality_capture(tmp_path / "a.csv", t1=0.001, t2=-0.002)
    with raises(FormatError, code="missing_argument", mentions=["a.csv"]):
        raycam.load_cameras(file)
    cameras = raycam.load_cameras(file, size=SIZE)
    turn = Rotation.from_euler("ZXY", [-40, 25, -10], degrees=True).as_matrix() @ OPENGL
    focal = 30 * 640 / 36
    for i, camera in enumerate(cameras.values()):
        K = intrinsics(focal, focal, 320 + 6.4, 240 - 12.8)
        check(
            camera,
            K,
            turn.T,
            np.array([1.0 + i, 2, 3]),
            lambda x: brown(x, (-0.1, 0.02, 0.001), (-0.002, 0.001)),
        )
    assert has_notice(cameras.notices, "ignored_feature", "t1", "t2")
    picture(tmp_path / "images/1.jpg")
    cameras = raycam.load_cameras(file)
    assert {camera.size for camera in cameras.values()} == {SIZE}
    assert has_notice(cameras.notices, "assumed_convention", "size=")
    picture(tmp_path / "0.jpg")
    picture(tmp_path / "1.jpg", (320, 240))
    assert raycam.load_cameras(file)["1.jpg"].size == (320, 240)
    with raises(FormatError, code="syntax", mentions=["a.csv:3", "k4"]):
        raycam.load_cameras(reality_capture(file, k4=0.1), size=SIZE)


def xmp(seed: int, elements: bool = False, **changes: str) -> str:
    R, C = pose(seed)
    values = {
        "Rotation": text(R),
        "Position": text(C),
        "FocalLength35mm": "30.0",
        "PrincipalPointU": "0.01",
        "PrincipalPointV": "-0.02",
        "Skew": "0.001",
        "AspectRatio": "1.01",
        "DistortionModel": "brown3",
        "DistortionCoeficients": "-0.1 0.02 0.001 0 0 0",
        "Coordinates": "absolute",
        **changes,
    }
    inside = ("Rotation", "Position", "DistortionCoeficients") if elements else ()
    attributes = " ".join(f'xcr:{key}="{value}"' for key, value in values.items() if key not in inside)
    children = "".join(f"<xcr:{key}>{values[key]}</xcr:{key}>" for key in inside)
    return (
        '<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">'
        f'<rdf:Description xmlns:xcr="http://www.capturingreality.com/ns/xcr/1.1#" {attributes}>{children}'
        "</rdf:Description></rdf:RDF></x:xmpmeta>"
    )


@pytest.mark.parametrize("elements", [True, False])
def test_xmp_files_of_reality_capture_are_read(tmp_path: Path, elements: bool) -> None:
    for i in range(3):
        (tmp_path / f"IMG_{i + 8}.xmp").write_text(xmp(i, elements))
        picture(tmp_path / f"IMG_{i + 8}.jpg")
    cameras = raycam.load_cameras(tmp_path)
    focal = 30 * 640 / 36
    assert list(cameras) == ["IMG_8", "IMG_9", "IMG_10"]
    for i, camera in enumerate(cameras.values()):
        K = intrinsics(focal, 1.01 * focal, 326.4, 227.2, 0.64)
        check(camera, K, *pose(i), lambda x: brown(x, (-0.1, 0.02, 0.001)))
    # The file contains an image that is not aligned, and an image that is missing on disk.
    (tmp_path / "IMG_11.xmp").write_text(re.sub(r'xcr:(?!Coordinates)[^ />]*="[^"]*"', "", xmp(0)))
    (tmp_path / "IMG_9.jpg").unlink()
    again = raycam.load_cameras(tmp_path)
    assert list(again) == list(cameras)
    assert has_notice(again.notices, "ignored_element", 1, "IMG_11")
    np.testing.assert_array_equal(again["IMG_9"].K, cameras["IMG_9"].K)


@pytest.mark.parametrize("model", ["division", "perspective"])
def test_xmp_with_an_unsupported_lens_is_refused(tmp_path: Path, model: str) -> None:
    (tmp_path / "a.xmp").write_text(xmp(0, DistortionModel=model))
    with raises(FormatError, code="unsupported_feature", mentions=[model]):
        raycam.load_cameras(tmp_path / "a.xmp", size=SIZE)


# AliceVision, openMVG, Bundler ----------------------------------------------------------------------------


def as_words(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: as_words(item) for key, item in value.items()}
    if isinstance(value, list):
        return [as_words(item) for item in value] or ""
    return str(value)


def alice_vision(version: str, rig: bool = False, **terms: Any) -> str:
    numbers = tuple(map(int, version.split(".")))
    intrinsic: dict[str, Any] = {"intrinsicId": 5, "width": 640, "height": 480, "serialNumber": "x"}
    if numbers < (1, 2, 2):
        intrinsic |= {"pxFocalLength": 520.0 if numbers < (1, 2, 0) else [520.0, 520.0]}
        intrinsic |= {"principalPoint": [323.0, 238.0] if numbers < (1, 2, 1) else [3.0, -2.0]}
    else:
        intrinsic |= {"focalLength": 26.0, "sensorWidth": 32.0, "sensorHeight": 24.0, "pixelRatio": 1.25}
        intrinsic |= {"principalPoint": [3.0, -2.0]}
    old = numbers < (1, 2, 8)
    intrinsic |= {"type": "brown"} if old else {"type": "pinhole", "distortionType": "brown"}
    intrinsic |= {"distortionParams": [-0.1, 0.02, 0.003, 0.001, -0.002], **terms}
    views, poses = [], []
    for i in range(3):
        own = {"rigId": 9, "subPoseId": i, "isPoseIndependant": "false"} if rig else {}
        views.append(
            {"viewId": 10 + i, "poseId": 0 if rig else i, "intrinsicId": 5, "path": f"/a/{i}.jpg", **own}
        )
        if i < 2:
            R, C = pose(i)
            poses.append(
                {"poseId": i, "pose": {"transform": {"rotation": R.T.ravel().tolist(), "center": C.tolist()}}}
            )
    table: dict[str, Any] = {
        "version": version.split("."),
        "views": views,
        "intrinsics": [intrinsic],
        "poses": poses,
    }
    if rig:
        subs = [{"status": "constant", "pose": sub(i)} for i in range(2)]
        table["rigs"] = [{"rigId": 9, "subPoses": [*subs, {"status": "uninitialized", "pose": sub(2)}]}]
    return json.dumps(as_words(table))


def sub(i: int) -> dict[str, Any]:
    R, C = pose(30 + i)
    return {"rotation": R.T.ravel().tolist(), "center": C.tolist()}


@pytest.mark.parametrize(
    ("version", "fx", "fy"),
    [
        ("1.0.0", 520, 520),
        ("1.2.0", 520, 520),
        ("1.2.1", 520, 520),
        ("1.2.3", 520, 416),
        ("1.2.6", 520, 650),
        ("1.2.11", 416, 520),
    ],
)
@pytest.mark.parametrize("rig", [True, False])
def test_alice_vision_cameras_are_read(tmp_path: Path, version: str, fx: float, fy: float, rig: bool) -> None:
    file = tmp_path / "cameras.sfm"
    file.write_text(alice_vision(version, rig))
    cameras = raycam.load_cameras(tmp_path)
    assert list(cameras) == ["0.jpg", "1.jpg"]
    assert has_notice(cameras.notices, "ignored_element", "2.jpg")
    for i, camera in enumerate(cameras.values()):
        R, C = pose(i)
        if rig:
            (R, C), (Rs, Cs) = pose(0), pose(30 + i)
            R, C = Rs @ R, C + R.T @ Cs
        check(
            camera,
            intrinsics(fx, fy, 323, 238),
            R,
            C,
            lambda x: brown(x, (-0.1, 0.02, 0.003), (0.001, -0.002)),
        )


@pytest.mark.parametrize(
    ("version", "terms", "reason"),
    [
        ("1.3.0", {}, fault("unsupported_feature", "1.3.0")),
        ("1.2.9", {"type": "equidistant"}, fault("unsupported_feature", "equidistant")),
        ("1.2.9", {"distortionType": "radialk3pt"}, fault("unsupported_feature", "radialk3pt")),
        ("1.2.9", {"distortionType": "3deanamorphic4"}, fault("unsupported_feature", "3deanamorphic4")),
        (
            "1.2.9",
            {"undistortionType": "3declassicld", "undistortionParams": [0.1]},
            fault("unsupported_feature", "3declassicld"),
        ),
        ("1.2.7", {"distortionParams": [0.1]}, fault("syntax", "a.sfm:1", "intrinsics[0]")),
    ],
)
def test_unsupported_parts_of_alice_vision_are_refused(
    tmp_path: Path, version: str, terms: dict[str, Any], reason: Fault
) -> None:
    file = tmp_path / "a.sfm"
    file.write_text(alice_vision(version, **terms))
    with raises(FormatError, **reason):
        raycam.load_cameras(file)


MVG: dict[str, Any] = {
    "pinhole": ({}, None),
    "pinhole_radial_k1": ({"disto_k1": [-0.1]}, lambda x: brown(x, (-0.1,))),
    "pinhole_radial_k3": ({"disto_k3": [-0.1, 0.02, 0.003]}, lambda x: brown(x, (-0.1, 0.02, 0.003))),
    "pinhole_brown_t2": (
        {"disto_t2": [-0.1, 0.02, 0.003, 0.001, -0.002]},
        lambda x: brown(x, (-0.1, 0.02, 0.003), (0.001, -0.002)),
    ),
    "fisheye": ({"fisheye": [0.1, 0.02, 0.01, 0.0]}, lambda x: brown(equidistant(x), (0.1, 0.02, 0.01))),
}


def open_mvg(nested: bool) -> dict[str, Any]:
    none = 4294967295
    views, cameras, poses = [], [], []
    for i in range(2 * len(MVG) + 1):
        data = {"local_path": "", "filename": f"{i}.jpg", "width": 640, "height": 480, "id_view": i}
        data |= {"id_intrinsic": i // 2 if i < 2 * len(MVG) else none, "id_pose": i}
        name = {"polymorphic_name": "view"} if i == 0 else {}
        value = {
            "polymorphic_id": 2147483649 if i == 0 else 1,
            **name,
            "ptr_wrapper": {"id": 2**31 + i, "data": data},
        }
        views.append({"key": i, "value": value})
        R, C = pose(i)
        poses.append({"key": i, "value": {"rotation": R.tolist(), "center": C.tolist()}})
    for i, (kind, (terms, _)) in enumerate(MVG.items()):
        base = {"width": 640, "height": 480, "focal_length": 520.0, "principal_point": [323.0, 238.0]}
        data = {"value0": base, **terms} if nested else {**base, **terms}
        value = {
            "polymorphic_id": 2**31 + 2 + i,
            "polymorphic_name": kind,
            "ptr_wrapper": {"id": 99 + i, "data": data},
        }
        cameras.append({"key": i, "value": value})
    return {
        "sfm_data_version": "0.3",
        "root_path": "/a",
        "views": views,
        "intrinsics": cameras,
        "extrinsics": poses,
    }


@pytest.mark.parametrize("nested", [True, False])
def test_open_mvg_cameras_are_read(tmp_path: Path, nested: bool) -> None:
    file = tmp_path / "sfm_data.json"
    file.write_text(json.dumps(open_mvg(nested)))
    cameras = raycam.load_cameras(tmp_path)
    assert len(cameras) == 10
    assert has_notice(cameras.notices, "ignored_element", 1, "10.jpg")
    for i, camera in enumerate(cameras.values()):
        check(camera, intrinsics(520, 520, 323, 238), *pose(i), list(MVG.values())[i // 2][1])


def test_bundler_cameras_are_read(tmp_path: Path) -> None:
    lines = ["# Bundle file v0.3", "3 1"]
    for i in range(3):
        R, C = pose(i)
        gl = OPENGL @ R
        lines += [f"{0 if i == 1 else 520.0} -0.1 {2e-2}", *(text(row) for row in gl), text(-gl @ C)]
    file = tmp_path / "bundle.out"
    file.write_text("\n".join([*lines, "0 0 1", "1 2 3", "0"]) + "\n")
    (tmp_path / "list.txt").write_text("images/a.jpg 0 500\nimages/b.jpg\nimages/c.jpg\n")
    for name in "abc":
        picture(tmp_path / f"images/{name}.jpg")
    cameras = raycam.load_cameras(tmp_path)
    assert list(cameras) == ["images/a.jpg", "images/c.jpg"]
    assert has_notice(cameras.notices, "ignored_element", 1, "focal length 0")
    for i, camera in zip((0, 2), cameras.values(), strict=True):
        check(camera, intrinsics(520, 520, 320, 240), *pose(i), lambda x: brown(x, (-0.1, 0.02)))
    (tmp_path / "images/a.jpg").rename(tmp_path / "images/d 1.jpg")
    (tmp_path / "images/c.jpg").unlink()
    (tmp_path / "list.txt").write_text("images/d 1.jpg 0 500\nimages/b.jpg\nimages/e 2.jpg\n")
    assert list(raycam.load_cameras(tmp_path)) == ["images/d 1.jpg", "images/e 2.jpg"]
    (tmp_path / "list.txt").unlink()
    assert list(raycam.load_cameras(file, size=SIZE)) == ["0", "2"]
    with raises(FormatError, code="missing_argument", mentions=["bundle.out"]):
        raycam.load_cameras(file)
