"""Array arguments."""

from __future__ import annotations

import numpy as np
import pytest
from raycam.arrays import floats, size_of, whole
from raycam.errors import CameraError, SettingsError


def test_floats_takes_what_is_a_number() -> None:
    for value in ([[1, 2]], np.array([[1, 2]], ">i2"), np.array([[1, 0, 2, 0]], np.float32)[:, ::2]):
        array = floats("a", value, ("n", 2))
        assert array.dtype == np.float64
        assert array.dtype.isnative
        assert array.flags.c_contiguous
        np.testing.assert_array_equal(array, [[1, 2]])
    assert floats("a", 3, ()).shape == ()
    assert floats("a", np.zeros((0, 3)), ("n", 3)).shape == (0, 3)


@pytest.mark.parametrize("value", [["1", "2", "3"], [1j, 0, 0], [True, False, True], None, {}, [[1], [2, 3]]])
def test_floats_refuses_the_rest(value: object) -> None:
    with pytest.raises(CameraError, match=r"^points must be numbers \[3\]"):
        floats("points", value, (3,), error=CameraError)  # type: ignore[arg-type]


def test_floats_names_all_shapes() -> None:
    with pytest.raises(SettingsError, match=r"must have the shape \[3\] or \[n, 3\], not \[2, 2\]"):
        floats("a", np.zeros((2, 2)), (3,), ("n", 3))


def test_whole() -> None:
    assert whole("a", np.int16(3), 0, 5) == 3
    for bad in (1.0, "1", True, None, np.float32(1)):
        with pytest.raises(SettingsError, match="a must be a whole number"):
            whole("a", bad, 0, 5)
    with pytest.raises(SettingsError, match="a is 6, expected 0 to 5"):
        whole("a", 6, 0, 5)


def test_size_of() -> None:
    assert size_of(np.array([640, 480])) == (640, 480)
    for bad in ((1, 2, 3), (1,), 5, (1.5, 2), (-1, 2)):
        with pytest.raises(SettingsError):
            size_of(bad)  # type: ignore[arg-type]


class Tensor:
    """A tensor that has DLPack alone."""

    def __init__(self, values: object) -> None:
        self.values = np.asarray(values, dtype=np.float32)

    def __dlpack__(self, **options: object) -> object:
        return self.values.__dlpack__()

    def __dlpack_device__(self) -> tuple[int, int]:
        return (1, 0)


class Elsewhere(Tensor):
    """A tensor on a graphics card."""

    device = "cuda:0"

    def __array__(self, *_: object, **__: object) -> object:
        raise TypeError("not on the CPU")


def test_worlds_and_cameras_take_tensors() -> None:
    import raycam

    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    pose = np.diag([2.0, 2, 2, 1])
    world = raycam.World()
    world.add_mesh(Tensor(corners), [[0, 1, 2]], name="a", matrix=Tensor(pose), color=Tensor([0.5, 0.25, 1]))
    assert world.triangles().tolist() == [(2 * np.array(corners)).tolist()]
    world.set_object("a", location=Tensor([1, 2, 3]), vertices=Tensor(2 * np.array(corners)))
    assert world.triangles()[0, 1].tolist() == [3, 2, 3]
    world.add_light("sun", direction=Tensor([0, 0, -1]), irradiance=Tensor([1, 2, 3]))
    lens = raycam.Camera.from_opencv(
        Tensor([[9, 0, 4], [0, 9, 4], [0, 0, 1]]), Tensor(np.eye(3)), [0, 0, 5], (8, 8)
    )
    assert np.asarray(lens.K)[0, 0] == 9
    before = world.to_bytes()
    for key in ("matrix", "vertices", "location", "color"):
        with pytest.raises(raycam.WorldError, match=rf"{key} is on cuda:0: .*pass {key}\.cpu\(\)"):
            world.set_object("a", **{key: Elsewhere(pose)})
    assert world.to_bytes() == before
