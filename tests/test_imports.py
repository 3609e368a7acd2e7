"""Imports: public names stay callable whatever is imported, and former module names still work."""

from __future__ import annotations

import subprocess
import sys

import pytest
import raycam

EVERYTHING = """
import importlib, pkgutil
import raycam
names = [module.name for module in pkgutil.walk_packages(raycam.__path__, "raycam.")]
for name in names:
    if not name.endswith(".__main__"):
        importlib.import_module(name)
for name in raycam.__all__:
    value = getattr(raycam, name)
    assert not isinstance(value, type(raycam)), name
    assert callable(value) or name in ("FORMATS", "__version__"), name
print(len(names))
"""
FORMER = {
    "raycam.cluster": ["pool_of"],
    "raycam.dask_worker": ["dask_setup"],
    "raycam.dataset": ["FORMATS", "DatasetResult", "views", "write"],
    "raycam.explain_pixel": ["Candidate", "Explanation", "explain"],
    "raycam.jobs": ["Job"],
    "raycam.sample_view": ["see"],
    "raycam.video": ["VideoPlan", "write_video"],
    "raycam.video_job": ["job_folder", "make_video"],
}


def test_public_names_stay_callable_after_every_submodule_is_imported() -> None:
    pytest.importorskip("distributed")
    pytest.importorskip("pxr")
    found = subprocess.run([sys.executable, "-c", EVERYTHING], capture_output=True, text=True)
    assert found.returncode == 0, found.stderr
    assert int(found.stdout) > 100


def test_render_is_the_function_and_its_package_can_be_imported() -> None:
    from raycam.render.frame import Frame

    assert callable(raycam.render)
    assert raycam.Frame is Frame


@pytest.mark.parametrize("module", FORMER)
def test_former_names_still_work(module: str) -> None:
    if module == "raycam.dask_worker":
        pytest.importorskip("distributed")
    names = ", ".join(FORMER[module])
    subprocess.run([sys.executable, "-c", f"from {module} import {names}"], check=True)


def test_the_former_usd_worker_runs(tmp_path: object) -> None:
    pytest.importorskip("pxr")
    limits = '{"memory": 8589934592, "bytes": 1000, "seconds": 10, "triangles": 10, "folder": "/"}'
    outputs = [
        subprocess.run(
            [sys.executable, "-m", module, f"{tmp_path}/none.usda", str(tmp_path), limits],
            capture_output=True,
            text=True,
        )
        for module in ("raycam.usd.worker", "raycam.usd_worker")
    ]
    assert outputs[0].returncode == outputs[1].returncode == 0, outputs
    assert "RuntimeWarning" not in outputs[0].stderr + outputs[1].stderr


@pytest.mark.parametrize("package", ["raycam.jobs", "raycam.cluster"])
def test_packages_that_workers_import_in_threads_import_none_of_their_modules(package: str) -> None:
    program = f"import sys, {package}; print([name for name in sys.modules if name.startswith('{package}.')])"
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert found.stdout == "[]\n"
