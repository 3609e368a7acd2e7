"""Imports: public names stay callable after any import."""

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


def test_public_names_stay_callable_after_every_submodule_is_imported() -> None:
    pytest.importorskip("distributed")
    pytest.importorskip("pxr")
    found = subprocess.run([sys.executable, "-c", EVERYTHING], capture_output=True, text=True)
    assert found.returncode == 0, found.stderr
    assert int(found.stdout) > 100


def test_raycam_render_is_the_function_and_its_package_can_be_imported() -> None:
    from raycam.render.frame import Frame

    assert callable(raycam.render)
    assert raycam.Frame is Frame


@pytest.mark.parametrize("package", ["raycam.jobs", "raycam.cluster"])
def test_packages_used_in_worker_threads_do_not_import_their_modules(package: str) -> None:
    program = f"import sys, {package}; print([name for name in sys.modules if name.startswith('{package}.')])"
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert found.stdout == "[]\n"
