"""Words of the documentation.

Pages contain few words about internal decisions, and technical terms are in the glossary.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs"
OTHERS = {"_build", "_generated", "api", "images", "lab-notes"}
OTHERS |= {"glossary.md", "design.md", "dependencies.md", "changelog.md"}
WORDS = [
    *("amodal", "anisotropy", "aperture", "attenuation", "baseline", "barycentric", "category",),
    *("clamp", "clearcoat", "crossings", "cylindrical", "denoise", "diffuse", "disparity",),
    *("dispersion", "distortion", "embree", "emission", "environment", "equirectangular",),
    *("exposure", "extrinsics", "fisheye", "hdri", "integrator", "intrinsics", "iridescence",),
    *("irradiance", "kalibr", "keypoint", "metallic", "metashape", "notice", "orthographic",),
    *("panoptic", "panorama", "pose", "premultiplied", "principled", "quaternion", "radiance",),
    *("recipe", "rectified", "refine", "rig", "roughness", "samples", "seed", "semantic", "shard",),
    *("sheen", "shininess", "shutter", "skin", "specular", "srgb", "studio", "sun", "trajectory",),
    *("transmission", "turntable", "udim", "uv", "variant", "wheel",),
]  # fmt: skip


def test_pages_contain_few_words_about_internal_decisions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(DOCS))
    import words  # type: ignore[import-not-found]

    assert words.share() < 0.10
    assert "words" in sys.modules


def test_glossary_defines_the_terms_of_the_pages() -> None:
    pages = [path for path in DOCS.rglob("*.md") if not OTHERS & set(path.relative_to(DOCS).parts)]
    text = " ".join(path.read_text(encoding="utf-8") for path in pages).lower()
    rows = re.findall(r"^\| (.+?) \|", (DOCS / "glossary.md").read_text(encoding="utf-8").lower(), re.M)
    heads = " ".join(rows)
    used = [word for word in WORDS if re.search(rf"\b{word}", text)]
    assert len(used) > 50
    assert [word for word in used if not re.search(rf"\b{word}", heads)] == []
