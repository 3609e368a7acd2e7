"""Tensors: NumPy arrays with the methods of Open3D's that scripts of rays and distances use."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = [
    "Device",
    "Dtype",
    "Tensor",
    "bool",
    "float32",
    "float64",
    "int32",
    "int64",
    "uint8",
    "uint32",
    "uint64",
]

float32, float64 = np.dtype(np.float32), np.dtype(np.float64)
int32, int64 = np.dtype(np.int32), np.dtype(np.int64)
uint8, uint32, uint64 = np.dtype(np.uint8), np.dtype(np.uint32), np.dtype(np.uint64)
bool = np.dtype(np.bool_)


class Dtype:
    """Types of numbers by Open3D's names."""

    Float32, Float64 = float32, float64
    Int32, Int64 = int32, int64
    UInt8, UInt32, UInt64 = uint8, uint32, uint64
    Bool = bool


class Device:
    """A device; there is the CPU alone."""

    def __init__(self, name: str = "CPU:0", index: int = 0) -> None:
        if not str(name).upper().startswith("CPU"):
            raise RuntimeError(f'device {name!r}: raycam works on the CPU, use "CPU:0"')
        self.name = "CPU:0"

    def __repr__(self) -> str:
        """The name as Open3D writes it."""
        return self.name


class Tensor(np.ndarray[Any, np.dtype[Any]]):
    """An array with Open3D's methods. Lists of floats are float64, of integers int64, as in Open3D."""

    def __new__(cls, data: Any, dtype: Any = None, device: Device | None = None) -> Tensor:
        """A copy of the data."""
        return np.array(data, dtype=dtype).view(cls)

    @classmethod
    def from_numpy(cls, array: npt.NDArray[Any]) -> Tensor:
        """A tensor that shares the memory of an array."""
        return np.asarray(array).view(cls)

    @classmethod
    def from_dlpack(cls, producer: Any) -> Tensor:
        """A tensor that shares the memory of a DLPack producer."""
        return np.from_dlpack(producer).view(cls)

    @classmethod
    def zeros(cls, shape: Any, dtype: Any = float32, device: Device | None = None) -> Tensor:
        """A tensor of zeros."""
        return np.zeros(shape, dtype).view(cls)

    @classmethod
    def ones(cls, shape: Any, dtype: Any = float32, device: Device | None = None) -> Tensor:
        """A tensor of ones."""
        return np.ones(shape, dtype).view(cls)

    def numpy(self) -> npt.NDArray[Any]:
        """The array itself, which shares the memory."""
        return self.view(np.ndarray)

    def cpu(self) -> Tensor:
        """The tensor itself."""
        return self

    def clone(self) -> Tensor:
        """A copy."""
        return self.copy().view(Tensor)

    def to(self, *options: Any, **keys: Any) -> Tensor:
        """The tensor with another dtype; a device is taken and means nothing."""
        for option in (*options, *keys.values()):
            if isinstance(option, np.dtype | type):
                return self.astype(option).view(Tensor)
        return self

    def isfinite(self) -> Tensor:
        """True for finite numbers."""
        return np.isfinite(self).view(Tensor)

    def isinf(self) -> Tensor:
        """True for infinities."""
        return np.isinf(self).view(Tensor)

    def isnan(self) -> Tensor:
        """True for NaN."""
        return np.isnan(self).view(Tensor)

    def num_elements(self) -> int:
        """The number of numbers."""
        return int(self.size)
