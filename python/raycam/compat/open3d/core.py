"""Tensors: NumPy arrays with methods of Open3D's tensors.

Scripts for rays and distances use these methods.
"""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from .absent import HintingType, Hints, raise_missing

__all__ = [
    "Device",
    "Dtype",
    "SizeVector",
    "Tensor",
    "append",
    "bool",
    "concatenate",
    "cuda",
    "float32",
    "float64",
    "int8",
    "int16",
    "int32",
    "int64",
    "matmul",
    "maximum",
    "minimum",
    "sycl",
    "uint8",
    "uint16",
    "uint32",
    "uint64",
]

NUMPY_INSTEAD = "raycam's tensors are NumPy arrays; use NumPy on tensor.numpy(), which shares the memory"

float32, float64 = np.dtype(np.float32), np.dtype(np.float64)
int8, int16, int32, int64 = (np.dtype(name) for name in ("int8", "int16", "int32", "int64"))
uint8, uint16, uint32, uint64 = (np.dtype(name) for name in ("uint8", "uint16", "uint32", "uint64"))
bool = np.dtype(np.bool_)

SizeVector = tuple[int, ...]
"""Shapes are tuples."""

cuda = SimpleNamespace(device_count=lambda: 0, is_available=lambda: False)
sycl = SimpleNamespace(get_available_devices=lambda: [], is_available=lambda: False)


class Dtype(Hints):
    """Types of numbers by Open3D's names."""

    _ALTERNATIVE = NUMPY_INSTEAD

    Float32, Float64 = float32, float64
    Int8, Int16, Int32, Int64 = int8, int16, int32, int64
    UInt8, UInt16, UInt32, UInt64 = uint8, uint16, uint32, uint64
    Bool = bool


class _DeviceType(Enum):
    """Kinds of devices; only the CPU exists."""

    CPU = "CPU"


class Device(Hints):
    """A device; only the CPU exists."""

    _ALTERNATIVE = "raycam works on the CPU"

    DeviceType = _DeviceType

    def __init__(self, name: Any = "CPU:0", index: int = 0) -> None:
        if isinstance(name, _DeviceType):
            name = name.value
        if not str(name).upper().startswith("CPU"):
            raise RuntimeError(f'device {name!r} is not supported; use "CPU:0"')
        self.name = "CPU:0"

    def get_type(self) -> _DeviceType:
        """The kind of device: the CPU."""
        return _DeviceType.CPU

    def get_id(self) -> int:
        """The device's index, 0."""
        return 0

    def __str__(self) -> str:
        """The device's name in Open3D's spelling."""
        return self.name

    def __repr__(self) -> str:
        """The constructor's call, as in Open3D."""
        return 'Device("CPU", 0)'

    def __eq__(self, other: object) -> Any:
        """Always True, because there is only one device."""
        return isinstance(other, Device) or NotImplemented

    def __hash__(self) -> int:
        """The hash of the name."""
        return hash(self.name)


class Tensor(np.ndarray[Any, np.dtype[Any]], metaclass=HintingType):
    """An array with Open3D's methods.

    Lists of floats become float64, and lists of integers int64, as in Open3D. Elements and reductions are
    tensors of shape [], as in Open3D.
    """

    _ALTERNATIVE = NUMPY_INSTEAD

    def __new__(cls, data: Any, dtype: Any = None, device: Device | None = None) -> Tensor:
        """A copy of the data."""
        return _as_tensor(np.array(data, dtype=dtype))

    @classmethod
    def from_numpy(cls, array: npt.NDArray[Any]) -> Tensor:
        """A tensor that shares the memory of an array."""
        return cast(Tensor, array.view(cls))

    @classmethod
    def from_dlpack(cls, producer: Any) -> Tensor:
        """A tensor that shares the memory of a DLPack producer."""
        return _as_tensor(np.from_dlpack(producer))

    @classmethod
    def zeros(cls, shape: Any, dtype: Any = float32, device: Device | None = None) -> Tensor:
        """A tensor of zeros."""
        return _as_tensor(np.zeros(shape, dtype))

    @classmethod
    def ones(cls, shape: Any, dtype: Any = float32, device: Device | None = None) -> Tensor:
        """Returns a tensor filled with ones."""
        return _as_tensor(np.ones(shape, dtype))

    @classmethod
    def empty(cls, shape: Any, dtype: Any = float32, device: Device | None = None) -> Tensor:
        """A tensor with uninitialised values."""
        return _as_tensor(np.empty(shape, dtype))

    @classmethod
    def full(cls, shape: Any, fill_value: Any, dtype: Any = float32, device: Device | None = None) -> Tensor:
        """Returns a tensor filled with one number."""
        return _as_tensor(np.full(shape, fill_value, dtype))

    @classmethod
    def eye(cls, n: int, dtype: Any = float32, device: Device | None = None) -> Tensor:
        """The identity [n, n]."""
        return _as_tensor(np.eye(n, dtype=dtype))

    @classmethod
    def arange(cls, *limits: Any, dtype: Any = None, device: Device | None = None) -> Tensor:
        """Numbers of a range, as in `numpy.arange`."""
        return _as_tensor(np.arange(*limits, dtype=dtype))

    @property
    def device(self) -> Device:  # type: ignore[override]
        """The CPU."""
        return Device()

    @property
    def is_cpu(self) -> Any:
        """True: every tensor is on the CPU."""
        return True

    @property
    def is_cuda(self) -> Any:
        """False: every tensor is on the CPU."""
        return False

    def numpy(self) -> npt.NDArray[Any]:
        """The array itself, which shares the memory."""
        return self.view(np.ndarray)

    def cpu(self) -> Tensor:
        """The tensor itself."""
        return self

    def cuda(self, device_id: int = 0) -> Tensor:
        """Raises `RuntimeError`: only the CPU exists."""
        raise RuntimeError("Tensor.cuda: not supported; use cpu()")

    def clone(self) -> Tensor:
        """A copy."""
        return _as_tensor(self.copy())

    def contiguous(self) -> Tensor:
        """The tensor itself, or a contiguous copy."""
        return _as_tensor(np.ascontiguousarray(self).reshape(self.shape))

    def is_contiguous(self) -> Any:
        """True if the numbers are stored row by row without gaps."""
        return self.flags.c_contiguous

    def to(self, *options: Any, **keys: Any) -> Tensor:
        """The tensor with another dtype; a device has no effect."""
        for option in (*options, *keys.values()):
            if isinstance(option, np.dtype | type):
                return _as_tensor(self.astype(option))
        return self

    def num_elements(self) -> int:
        """The number of elements."""
        return int(self.size)

    def append(self, values: Any, axis: int | None = None) -> Tensor:
        """Returns the tensor followed by `values`, flattened or along `axis`."""
        return append(self, values, axis)

    def __getitem__(self, key: Any) -> Any:
        """Elements and parts; an element is a tensor of shape [] that shares the memory."""
        keys = key if isinstance(key, tuple) else (key,)
        if not any(one is Ellipsis for one in keys):
            keys = (*keys, Ellipsis)
        return super().__getitem__(keys)

    def __iter__(self) -> Iterator[Any]:
        """The parts along the first axis, as tensors."""
        return (self[index] for index in range(len(self)))

    def __array_wrap__(self, array: Any, context: Any = None, return_scalar: Any = False) -> Any:
        """Converts results of NumPy's functions to tensors, including results of shape []."""
        return _as_tensor(array)

    def __getattr__(self, name: str) -> Any:
        """Raises an `AttributeError` that names an alternative."""
        return raise_missing("Tensor", name, NUMPY_INSTEAD)


def _as_tensor(values: Any) -> Tensor:
    """Returns an array, or a single number, as a tensor that shares the memory."""
    return cast(Tensor, np.asarray(values).view(Tensor))


def _reduction(name: str) -> Any:
    """Returns a method that reduces along `dim` (Open3D) or `axis` (NumPy).

    Without `dim` and `axis`, the method reduces over all numbers.
    """
    function = getattr(np, name)

    def reduce(
        self: Tensor,
        dim: Any = None,
        keepdim: Any = False,
        *,
        axis: Any = None,
        keepdims: Any = False,
        **keys: Any,
    ) -> Any:
        along = axis if dim is None else dim
        if along is not None and not isinstance(along, int | np.integer):
            along = tuple(along)
            if name in ("argmax", "argmin") and len(along) == 1:
                along = along[0]
        keys = {key: value for key, value in keys.items() if value is not None}
        found = function(self.view(np.ndarray), axis=along, keepdims=keepdim or keepdims, **keys)
        return _as_tensor(found)

    reduce.__name__ = name
    reduce.__doc__ = f"`numpy.{name}` over all numbers, or along the axes `dim`."
    return reduce


def _elementwise(name: str, function: Any) -> Any:
    """Returns a method that applies a NumPy function to the tensor and further arguments."""

    def apply(self: Tensor, *others: Any, **keys: Any) -> Any:
        return _as_tensor(function(self.view(np.ndarray), *others, **keys))

    apply.__name__ = name
    apply.__doc__ = f"`numpy.{function.__name__}`, as a tensor."
    return apply


for _name in ("sum", "mean", "prod", "min", "max", "argmin", "argmax", "all", "any"):
    setattr(Tensor, _name, _reduction(_name))

_ELEMENTWISE = {
    "add": np.add,
    "sub": np.subtract,
    "mul": np.multiply,
    "div": np.divide,
    "neg": np.negative,
    "abs": np.abs,
    "sqrt": np.sqrt,
    "exp": np.exp,
    "sin": np.sin,
    "cos": np.cos,
    "floor": np.floor,
    "ceil": np.ceil,
    "trunc": np.trunc,
    "eq": np.equal,
    "ne": np.not_equal,
    "lt": np.less,
    "le": np.less_equal,
    "gt": np.greater,
    "ge": np.greater_equal,
    "logical_and": np.logical_and,
    "logical_or": np.logical_or,
    "logical_xor": np.logical_xor,
    "logical_not": np.logical_not,
    "isfinite": np.isfinite,
    "isinf": np.isinf,
    "isnan": np.isnan,
    "isclose": np.isclose,
    "matmul": np.matmul,
    "T": np.transpose,
    "inv": np.linalg.inv,
}
for _name, _function in _ELEMENTWISE.items():
    setattr(Tensor, _name, _elementwise(_name, _function))


def concatenate(tensors: Any, axis: int | None = 0) -> Tensor:
    """Concatenates tensors along an axis."""
    return _as_tensor(np.concatenate([np.asarray(tensor) for tensor in tensors], axis=axis))


def append(self: Any, values: Any, axis: int | None = None) -> Tensor:
    """Returns a tensor followed by another tensor, flattened or along `axis`."""
    return _as_tensor(np.append(np.asarray(self), np.asarray(values), axis=axis))


def maximum(input: Any, other: Any) -> Tensor:
    """Returns the larger of the two tensors' numbers at each position."""
    return _as_tensor(np.maximum(input, other))


def minimum(input: Any, other: Any) -> Tensor:
    """Returns the smaller of the two tensors' numbers at each position."""
    return _as_tensor(np.minimum(input, other))


def matmul(A: Any, B: Any) -> Tensor:
    """The product of two matrices."""
    return _as_tensor(np.matmul(np.asarray(A), np.asarray(B)))


def __getattr__(name: str) -> Any:
    """Raises an `AttributeError` that names an alternative."""
    return raise_missing("open3d.core", name, NUMPY_INSTEAD)
