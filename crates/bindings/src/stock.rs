//! Memory of pictures that nobody holds any more, for those to come: memory that is touched for the first time costs more
//! than what is written to it.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use numpy::{Element, IntoPyArray, PyArray1, PyArrayMethods, PyReadwriteArray1};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PySlice};
use raycam_render::{Channel, OutputPlane, PixelType, PlaneData, zeroed_huge};

/// The most bytes that are kept.
const MOST: usize = 256 << 20;
/// What none of so many pictures in a row has needed is given back.
const PICTURES: u64 = 8;
/// Planes of fewer bytes are not worth it.
const LEAST: usize = 1 << 15;

/// Bytes of a line of the cache: planes begin with one, and whole lines are written fastest.
const LINE: usize = 64;

/// The values of a plane, in a row, and a line more. What Python holds is a view of it, which keeps it.
enum Owner {
    F32(Py<PyArray1<f32>>),
    F64(Py<PyArray1<f64>>),
    I32(Py<PyArray1<i32>>),
}

/// An array, and when it was last used.
struct Kept {
    owner: Owner,
    values: usize,
    picture: u64,
}

#[derive(Default)]
struct Stock {
    kept: Vec<Kept>,
    pictures: u64,
}

/// Locked only while the GIL is held, and never for long: a fork finds it free. Nothing is made meanwhile that Python owns:
/// that may run its code (an import, a garbage collector), which lets other threads run, and these would wait here for ever.
static STOCK: Mutex<Option<Stock>> = Mutex::new(None);

impl Owner {
    fn zeros(py: Python<'_>, kind: PixelType, values: usize) -> Self {
        let count = values + LINE / bytes(kind, 1);
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

    /// Whether nobody else has it, nor a view of it.
    #[expect(deprecated, reason = "what is to take its place is unsafe")]
    fn is_idle(&self, py: Python<'_>) -> bool {
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

/// Where a plane of so many values lies in its array.
fn within<T>(start: *const T, values: usize) -> Range<usize> {
    let first = start.align_offset(LINE);
    first..first + values
}

/// A plane in the shape that Python knows.
fn view<'py, T: Element>(
    py: Python<'py>,
    array: &Py<PyArray1<T>>,
    values: usize,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    let array = array.bind(py);
    let Range { start, end } = within(array.data(), values);
    let part = PySlice::new(py, start.cast_signed(), end.cast_signed(), 1);
    let plane = array.get_item(part)?.cast_into::<PyArray1<T>>()?;
    Ok(plane.reshape(shape)?.into_any())
}

impl Stock {
    /// Begins a picture; returns what is not kept any longer.
    fn begin(&mut self) -> Vec<Kept> {
        self.pictures += 1;
        let oldest = self.pictures.saturating_sub(PICTURES);
        let old = |kept: &mut Kept| kept.picture < oldest;
        self.kept.extract_if(.., old).collect()
    }

    /// An idle array, if there is one.
    fn take(&mut self, py: Python<'_>, kind: PixelType, values: usize) -> Option<Owner> {
        let fits = |kept: &Kept| {
            kept.values == values && kept.owner.kind() == kind && kept.owner.is_idle(py)
        };
        let at = self.kept.iter().position(fits)?;
        Some(self.kept.swap_remove(at).owner)
    }

    /// Keeps the arrays of a picture; returns what is too much, the oldest first.
    fn keep(&mut self, py: Python<'_>, planes: &[ImagePlane]) -> Vec<Kept> {
        let picture = self.pictures;
        self.kept.extend(planes.iter().filter_map(|plane| {
            let size = bytes(plane.owner.kind(), plane.values);
            (size >= LEAST).then(|| Kept {
                owner: plane.owner.clone_ref(py),
                values: plane.values,
                picture,
            })
        }));
        self.kept.sort_by_key(|kept| kept.picture);
        let mut all: usize = self.kept.iter().map(Kept::bytes).sum();
        let mut first = 0;
        while all > MOST {
            all -= self.kept[first].bytes();
            first += 1;
        }
        self.kept.drain(..first).collect()
    }
}

impl Kept {
    fn bytes(&self) -> usize {
        bytes(self.owner.kind(), self.values)
    }
}

/// A plane that is to be written.
struct ImagePlane {
    channel: Channel,
    owner: Owner,
    values: usize,
    zero: bool,
}

/// The planes of a picture that is to be rendered.
pub(crate) struct Planes(Vec<ImagePlane>);

impl Planes {
    /// Planes of so many pixels: used ones, where there are some, or new ones.
    pub fn new(py: Python<'_>, channels: &[Channel], pixels: usize) -> Self {
        let mut lock = STOCK.lock().unwrap_or_else(PoisonError::into_inner);
        let stock = lock.get_or_insert_default();
        let dropped = stock.begin();
        let wanted = channels.iter().map(|&channel| {
            let (kind, values) = (channel.pixel_type(), pixels * channel.components());
            (channel, values, stock.take(py, kind, values))
        });
        let wanted: Vec<_> = wanted.collect();
        drop(lock);
        drop(dropped);
        let planes = wanted
            .into_iter()
            .map(|(channel, values, used)| ImagePlane {
                channel,
                values,
                zero: used.is_none(),
                owner: used.unwrap_or_else(|| Owner::zeros(py, channel.pixel_type(), values)),
            });
        Self(planes.collect())
    }

    /// Lets them be written.
    pub fn write<T>(
        &self,
        py: Python<'_>,
        write: impl FnOnce(Vec<OutputPlane<'_>>) -> PyResult<T>,
    ) -> PyResult<T> {
        enum Open<'py> {
            F32(PyReadwriteArray1<'py, f32>),
            F64(PyReadwriteArray1<'py, f64>),
            I32(PyReadwriteArray1<'py, i32>),
        }
        fn open<'py, T: Element>(
            py: Python<'py>,
            array: &Py<PyArray1<T>>,
        ) -> PyResult<PyReadwriteArray1<'py, T>> {
            Ok(array.bind(py).try_readwrite()?)
        }
        fn part<'a, T: Element>(
            array: &'a mut PyReadwriteArray1<'_, T>,
            values: usize,
        ) -> PyResult<&'a mut [T]> {
            let all = array.as_slice_mut()?;
            let part = within(all.as_ptr(), values);
            Ok(&mut all[part])
        }
        let opened = self.0.iter().map(|plane| {
            Ok(match &plane.owner {
                Owner::F32(array) => Open::F32(open(py, array)?),
                Owner::F64(array) => Open::F64(open(py, array)?),
                Owner::I32(array) => Open::I32(open(py, array)?),
            })
        });
        let mut opened = opened.collect::<PyResult<Vec<_>>>()?;
        let targets = self.0.iter().zip(&mut opened).map(|(plane, open)| {
            Ok(OutputPlane {
                channel: plane.channel,
                values: match open {
                    Open::F32(array) => PlaneData::F32(part(array, plane.values)?),
                    Open::F64(array) => PlaneData::F64(part(array, plane.values)?),
                    Open::I32(array) => PlaneData::I32(part(array, plane.values)?),
                },
                zero: plane.zero,
            })
        });
        write(targets.collect::<PyResult<_>>()?)
    }

    /// What Python gets: arrays [height, width] or [height, width, components] by name. Once nobody holds them any more,
    /// others get their memory.
    pub fn give<'py>(
        self,
        py: Python<'py>,
        [height, width]: [usize; 2],
    ) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for plane in &self.0 {
            let shape = [height, width, plane.channel.components()];
            let shape = &shape[..if shape[2] == 1 { 2 } else { 3 }];
            let pixels = match &plane.owner {
                Owner::F32(array) => view(py, array, plane.values, shape)?,
                Owner::F64(array) => view(py, array, plane.values, shape)?,
                Owner::I32(array) => view(py, array, plane.values, shape)?,
            };
            dict.set_item(plane.channel.name(), pixels)?;
        }
        let mut lock = STOCK.lock().unwrap_or_else(PoisonError::into_inner);
        let dropped = lock.get_or_insert_default().keep(py, &self.0);
        drop(lock);
        drop(dropped);
        Ok(dict)
    }
}
