//! Pool of frame buffers that Python no longer references. The buffers are reused, because the first access to new
//! memory takes longer than writing the pixels.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use numpy::{Element, IntoPyArray, PyArray1, PyArrayMethods, PyReadwriteArray1};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PySlice};
use raycam_render::{Channel, OutputPlane, PixelType, PlaneData, zeroed_huge};

use crate::arrays::DictResult;

/// Maximum number of bytes that the pool keeps.
const MAX_BYTES: usize = 256 << 20;
/// Number of consecutive renders that do not use an array, after which the array is freed.
const MAX_IDLE_RENDERS: u64 = 8;
/// Minimum size in bytes of a plane that is kept.
const MIN_BYTES: usize = 1 << 15;

/// Bytes per cache line: planes start at a cache line, and whole lines are written fastest.
const CACHE_LINE: usize = 64;

/// Memory for the values of one plane, plus one cache line so that the values can start at a cache line. Python holds
/// a view of the plane, which keeps the memory alive.
enum PooledArray {
    F32(Py<PyArray1<f32>>),
    F64(Py<PyArray1<f64>>),
    I32(Py<PyArray1<i32>>),
}

/// An array, the number of its plane's values, and the number of the render that last used the array.
struct PoolEntry {
    array: PooledArray,
    values: usize,
    render: u64,
}

#[derive(Default)]
struct BufferPool {
    entries: Vec<PoolEntry>,
    renders: u64,
}

/// Locked only while the GIL is held, and only briefly, so that a fork finds it unlocked. No Python objects are created
/// while it is locked: creating an object could run Python code (an import, the garbage collector), which lets other
/// threads run, and these threads would deadlock here.
static POOL: Mutex<Option<BufferPool>> = Mutex::new(None);

impl PooledArray {
    fn zeros(py: Python<'_>, kind: PixelType, values: usize) -> Self {
        let count = values + CACHE_LINE / bytes(kind, 1);
        match kind {
            PixelType::F32 => Self::F32(zeroed_huge(count).into_pyarray(py).unbind()),
            PixelType::F64 => Self::F64(zeroed_huge(count).into_pyarray(py).unbind()),
            PixelType::I32 => Self::I32(zeroed_huge(count).into_pyarray(py).unbind()),
        }
    }

    fn kind(&self) -> PixelType {
        match self {
            Self::F32(_) => PixelType::F32,
            Self::F64(_) => PixelType::F64,
            Self::I32(_) => PixelType::I32,
        }
    }

    /// True if nothing else references the array or a view of it.
    #[expect(deprecated, reason = "the function that replaces it is unsafe")]
    fn is_unreferenced(&self, py: Python<'_>) -> bool {
        let holders = match self {
            Self::F32(array) => array.get_refcnt(py),
            Self::F64(array) => array.get_refcnt(py),
            Self::I32(array) => array.get_refcnt(py),
        };
        holders == 1
    }

    fn clone_ref(&self, py: Python<'_>) -> Self {
        match self {
            Self::F32(array) => Self::F32(array.clone_ref(py)),
            Self::F64(array) => Self::F64(array.clone_ref(py)),
            Self::I32(array) => Self::I32(array.clone_ref(py)),
        }
    }
}

fn bytes(kind: PixelType, values: usize) -> usize {
    values * if kind == PixelType::F64 { 8 } else { 4 }
}

/// Range of a plane in its array, starting at a cache line.
fn aligned_range<T>(start: *const T, values: usize) -> Range<usize> {
    let first = start.align_offset(CACHE_LINE);
    first..first + values
}

/// Returns a view of a plane, in the shape of its channel.
fn view<'py, T: Element>(
    py: Python<'py>,
    array: &Py<PyArray1<T>>,
    values: usize,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    let array = array.bind(py);
    let Range { start, end } = aligned_range(array.data(), values);
    let part = PySlice::new(py, start.cast_signed(), end.cast_signed(), 1);
    Ok(array.get_item(part)?.cast_into::<PyArray1<T>>()?.reshape(shape)?.into_any())
}

impl BufferPool {
    /// Starts a render: removes and returns the arrays that have been idle for too many renders.
    fn begin_render(&mut self) -> Vec<PoolEntry> {
        self.renders += 1;
        let oldest = self.renders.saturating_sub(MAX_IDLE_RENDERS);
        let old = |entry: &mut PoolEntry| entry.render < oldest;
        self.entries.extract_if(.., old).collect()
    }

    /// Returns an idle array; `None` if there is none.
    fn acquire(&mut self, py: Python<'_>, kind: PixelType, values: usize) -> Option<PooledArray> {
        let fits =
            |entry: &PoolEntry| entry.values == values && entry.array.kind() == kind && entry.array.is_unreferenced(py);
        let at = self.entries.iter().position(fits)?;
        Some(self.entries.swap_remove(at).array)
    }

    /// Keeps the arrays of an image for later renders; removes and returns the oldest arrays if the pool exceeds its
    /// limit.
    fn retain(&mut self, py: Python<'_>, planes: &[ImagePlane]) -> Vec<PoolEntry> {
        let render = self.renders;
        self.entries.extend(planes.iter().filter_map(|plane| {
            let size = bytes(plane.array.kind(), plane.values);
            (size >= MIN_BYTES).then(|| PoolEntry { array: plane.array.clone_ref(py), values: plane.values, render })
        }));
        self.entries.sort_by_key(|entry| entry.render);
        let mut all: usize = self.entries.iter().map(PoolEntry::bytes).sum();
        let mut first = 0;
        while all > MAX_BYTES {
            all -= self.entries[first].bytes();
            first += 1;
        }
        self.entries.drain(..first).collect()
    }
}

impl PoolEntry {
    fn bytes(&self) -> usize {
        bytes(self.array.kind(), self.values)
    }
}

/// One channel's plane of an image; `zero` is true if the memory is new and therefore zero.
struct ImagePlane {
    channel: Channel,
    array: PooledArray,
    values: usize,
    zero: bool,
}

/// Planes that a render writes.
pub(crate) struct OutputPlanes(Vec<ImagePlane>);

impl OutputPlanes {
    /// Returns planes of `pixels` pixels, from the pool or new.
    pub fn new(py: Python<'_>, channels: &[Channel], pixels: usize) -> Self {
        let mut lock = POOL.lock().unwrap_or_else(PoisonError::into_inner);
        let pool = lock.get_or_insert_default();
        let dropped = pool.begin_render();
        let wanted = channels.iter().map(|&channel| {
            let (kind, values) = (channel.pixel_type(), pixels * channel.components());
            (channel, values, pool.acquire(py, kind, values))
        });
        let wanted: Vec<_> = wanted.collect();
        drop(lock);
        drop(dropped);
        let planes = wanted.into_iter().map(|(channel, values, used)| ImagePlane {
            channel,
            values,
            zero: used.is_none(),
            array: used.unwrap_or_else(|| PooledArray::zeros(py, channel.pixel_type(), values)),
        });
        Self(planes.collect())
    }

    /// Calls `write` with the memory of the planes, and returns its result.
    pub fn write<T>(&self, py: Python<'_>, write: impl FnOnce(Vec<OutputPlane<'_>>) -> PyResult<T>) -> PyResult<T> {
        enum PlaneGuard<'py> {
            F32(PyReadwriteArray1<'py, f32>),
            F64(PyReadwriteArray1<'py, f64>),
            I32(PyReadwriteArray1<'py, i32>),
        }
        fn open<'py, T: Element>(py: Python<'py>, array: &Py<PyArray1<T>>) -> PyResult<PyReadwriteArray1<'py, T>> {
            Ok(array.bind(py).try_readwrite()?)
        }
        fn part<'a, T: Element>(array: &'a mut PyReadwriteArray1<'_, T>, values: usize) -> PyResult<&'a mut [T]> {
            let all = array.as_slice_mut()?;
            let part = aligned_range(all.as_ptr(), values);
            Ok(&mut all[part])
        }
        let opened = self.0.iter().map(|plane| {
            Ok(match &plane.array {
                PooledArray::F32(array) => PlaneGuard::F32(open(py, array)?),
                PooledArray::F64(array) => PlaneGuard::F64(open(py, array)?),
                PooledArray::I32(array) => PlaneGuard::I32(open(py, array)?),
            })
        });
        let mut opened = opened.collect::<PyResult<Vec<_>>>()?;
        let targets = self.0.iter().zip(&mut opened).map(|(plane, open)| {
            Ok(OutputPlane {
                channel: plane.channel,
                values: match open {
                    PlaneGuard::F32(array) => PlaneData::F32(part(array, plane.values)?),
                    PlaneGuard::F64(array) => PlaneData::F64(part(array, plane.values)?),
                    PlaneGuard::I32(array) => PlaneData::I32(part(array, plane.values)?),
                },
                zero: plane.zero,
            })
        });
        write(targets.collect::<PyResult<_>>()?)
    }

    /// Returns the arrays for Python by name, [height, width] or [height, width, components]. Their memory is reused
    /// when Python no longer references them.
    pub fn into_arrays<'py>(self, py: Python<'py>, [height, width]: [usize; 2]) -> DictResult<'py> {
        let dict = PyDict::new(py);
        for plane in &self.0 {
            let shape = [height, width, plane.channel.components()];
            let shape = &shape[..if shape[2] == 1 { 2 } else { 3 }];
            let pixels = match &plane.array {
                PooledArray::F32(array) => view(py, array, plane.values, shape)?,
                PooledArray::F64(array) => view(py, array, plane.values, shape)?,
                PooledArray::I32(array) => view(py, array, plane.values, shape)?,
            };
            dict.set_item(plane.channel.name(), pixels)?;
        }
        let mut lock = POOL.lock().unwrap_or_else(PoisonError::into_inner);
        let dropped = lock.get_or_insert_default().retain(py, &self.0);
        drop(lock);
        drop(dropped);
        Ok(dict)
    }
}
