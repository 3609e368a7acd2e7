"""Attributes of USD lights, cameras and models that raycam ignores give notices."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import raycam
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux
from support.raises import has_notice
from support.usd_stages import square, stage, write_image


def sphere(made: Any) -> Any:
    return UsdLux.SphereLight.Define(made, "/light")


def profile(made: Any, _: Path) -> None:
    UsdLux.ShapingAPI.Apply(sphere(made).GetPrim()).CreateShapingIesFileAttr("a.ies")


def focus(made: Any, _: Path) -> None:
    UsdLux.ShapingAPI.Apply(sphere(made).GetPrim()).CreateShapingFocusAttr(5.0)


def cone(made: Any, _: Path) -> None:
    light = UsdLux.RectLight.Define(made, "/light")
    UsdLux.ShapingAPI.Apply(light.GetPrim()).CreateShapingConeAngleAttr(20.0)


def mesh_light(made: Any, _: Path) -> None:
    UsdLux.MeshLightAPI.Apply(made.GetPrimAtPath("/world/square"))


def diffuse(made: Any, _: Path) -> None:
    sphere(made).CreateDiffuseAttr(0.0)


def shadows(made: Any, _: Path) -> None:
    UsdLux.ShadowAPI.Apply(sphere(made).GetPrim()).CreateShadowEnableAttr(False)


def links(made: Any, _: Path) -> None:
    UsdLux.LightAPI(sphere(made).GetPrim()).GetLightLinkCollectionAPI().CreateExcludesRel().AddTarget(
        "/world"
    )


def light_filter(made: Any, _: Path) -> None:
    UsdLux.LightFilter.Define(made, "/filter")
    sphere(made).CreateFiltersRel().AddTarget("/filter")


def ball(made: Any, folder: Path) -> None:
    write_image(folder / "sky.png", [[[9, 9, 9]] * 8] * 4)
    light = UsdLux.DomeLight.Define(made, "/light")
    light.CreateTextureFileAttr("sky.png")
    light.CreateTextureFormatAttr("mirroredBall")


def old_words(made: Any, _: Path) -> None:
    sphere(made).GetPrim().CreateAttribute("intensity", Sdf.ValueTypeNames.Float).Set(500.0)


def exposure(made: Any, _: Path) -> None:
    UsdGeom.Camera.Define(made, "/camera").CreateExposureAttr(3.0)


def no_focus(made: Any, _: Path) -> None:
    UsdGeom.Camera.Define(made, "/camera").CreateFStopAttr(2.8)


def bounds(made: Any, _: Path) -> None:
    prim = made.GetPrimAtPath("/world")
    Usd.ModelAPI(prim).SetKind("component")
    UsdGeom.ModelAPI.Apply(prim).CreateModelDrawModeAttr("bounds")


def unknown(made: Any, _: Path) -> None:
    made.DefinePrim("/light", "PxrRectLight")


def newer(made: Any, _: Path) -> None:
    made.DefinePrim("/tube", "NurbsPatch")


CASES: dict[Callable[[Any, Path], None], tuple[str, str, str]] = {
    profile: ("ignored_key", "/light", "a.ies"),
    focus: ("ignored_key", "/light", "focus"),
    cone: ("ignored_key", "/light", "cone"),
    mesh_light: ("ignored_key", "/world/square", "MeshLightAPI"),
    diffuse: ("ignored_key", "/light", "diffuse"),
    shadows: ("ignored_key", "/light", "shadow"),
    links: ("ignored_key", "/light", "links"),
    light_filter: ("ignored_key", "/light", "filters"),
    ball: ("ignored_key", "/light", "mirroredBall"),
    old_words: ("ignored_key", "/light", "inputs:intensity"),
    exposure: ("ignored_key", "/camera", "exposure"),
    no_focus: ("ignored_key", "/camera", "focusDistance"),
    bounds: ("ignored_key", "/world", "bounds"),
    unknown: ("ignored_element", "PxrRectLight", "1"),
    newer: ("ignored_element", "NurbsPatch", "1"),
}


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.__name__)
def test_unused_attributes_give_notices(tmp_path: Path, case: Callable[[Any, Path], None]) -> None:
    made = stage(tmp_path / "a.usda", up="Y")
    square(made)
    case(made, tmp_path)
    made.Save()
    (notice,) = raycam.load(tmp_path / "a.usda").notices
    code, *facts = CASES[case]
    assert has_notice([notice], code, *facts)


def test_plain_lights_and_cameras_give_no_notices(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    square(made)
    UsdLux.ShapingAPI.Apply(sphere(made).GetPrim()).CreateShapingConeAngleAttr(30.0)
    UsdLux.RectLight.Define(made, "/window")
    UsdGeom.Camera.Define(made, "/camera").CreateClippingRangeAttr(Gf.Vec2f(1, 9))
    made.Save()
    assert not raycam.load(tmp_path / "a.usda").notices


@pytest.mark.parametrize(("length", "stop", "focus"), [(50.0, 2.0, 4.0), (24.0, 16.0, 0.5)])
def test_f_stop_determines_the_aperture(tmp_path: Path, length: float, stop: float, focus: float) -> None:
    made = stage(tmp_path / "a.usda")
    square(made)
    camera = UsdGeom.Camera.Define(made, "/camera")
    camera.CreateFocalLengthAttr(length)
    camera.CreateFStopAttr(stop)
    camera.CreateFocusDistanceAttr(focus)
    made.Save()
    world = raycam.load(tmp_path / "a.usda")
    aperture = world.cameras["camera"].aperture
    assert aperture is not None
    # The aperture's diameter is the focal length (in tenths of the unit) divided by the f-stop.
    assert aperture["radius"] == pytest.approx(length / 10 / stop / 2)
    assert aperture["focus"] == focus
    assert not world.notices
