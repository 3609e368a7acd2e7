//! Beams, returned light and echoes of lidars. Python has already made the arrays C-contiguous.

use numpy::PyReadonlyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use raycam_render::lidar::beam::{Beams, beam_rays};
use raycam_render::lidar::echoes::{Returns, find_echoes};
use raycam_render::lidar::energy::{LidarHits, LidarMaterial, returned_light};

use crate::arrays::{DictResult, Floats, NewArray, array, flat, rows};
use crate::error::{OrRaise, settings_error};

/// Beams from a dict; see [`Beams`].
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct BeamArguments<'py> {
    origins: Floats<'py>,
    directions: Floats<'py>,
    turns: Floats<'py>,
    rotations: Floats<'py>,
    samples: Floats<'py>,
    width: [f64; 2],
    half_tangents: [f64; 2],
    threads: Option<usize>,
}

/// Returns the rays of beams: origins relative to the sensor, and directions, \[n, k, 3] each, in world axes.
#[pyfunction]
pub(crate) fn lidar_beam_rays<'py>(
    py: Python<'py>,
    query: BeamArguments<'py>,
) -> PyResult<(NewArray<'py, f64>, NewArray<'py, f64>)> {
    let rotation_rows = rows::<f64, 3>(&query.rotations, "rotations")?;
    let beams = Beams {
        origins: rows(&query.origins, "origins")?,
        directions: rows(&query.directions, "directions")?,
        turns: flat(&query.turns, "turns")?,
        rotations: rotation_rows.as_chunks().0,
        samples: rows(&query.samples, "samples")?,
        width: query.width,
        half_tangents: query.half_tangents,
    };
    let shape = [beams.origins.len(), beams.samples.len(), 3];
    let (starts, ways) = py.detach(|| beam_rays(&beams, query.threads)).or_raise()?;
    Ok((array(py, starts.into_flattened(), &shape)?, array(py, ways.into_flattened(), &shape)?))
}

/// A material from a dict; see [`LidarMaterial`].
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct MaterialArguments {
    diffuse: f64,
    phong: [f64; 2],
    alpha: f64,
    f0: f64,
    metallic: f64,
    opacity: f64,
    reflectance: f64,
    retroreflection: f64,
    retroreflection_table: Vec<[f64; 2]>,
}

impl From<MaterialArguments> for LidarMaterial {
    fn from(given: MaterialArguments) -> Self {
        Self {
            diffuse: given.diffuse,
            phong: given.phong,
            alpha: given.alpha,
            f0: given.f0,
            metallic: given.metallic,
            opacity: given.opacity,
            reflectance: given.reflectance,
            retroreflection: given.retroreflection,
            retroreflection_table: given.retroreflection_table,
        }
    }
}

/// Hits from a dict; see [`LidarHits`].
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct HitArguments<'py> {
    directions: Floats<'py>,
    normals: Floats<'py>,
    albedos: PyReadonlyArrayDyn<'py, f32>,
    reflectances: Option<PyReadonlyArrayDyn<'py, f32>>,
    materials: PyReadonlyArrayDyn<'py, i64>,
    lengths: Floats<'py>,
    shares: Floats<'py>,
    threads: Option<usize>,
}

/// Returns the cosine of the incidence angle, the incidence angle and the returned energy of each hit, \[n] each.
#[pyfunction]
pub(crate) fn lidar_returned_light<'py>(
    py: Python<'py>,
    query: HitArguments<'py>,
    materials: Vec<MaterialArguments>,
) -> PyResult<(NewArray<'py, f64>, NewArray<'py, f32>, NewArray<'py, f64>)> {
    let hits = LidarHits {
        directions: rows(&query.directions, "directions")?,
        normals: rows(&query.normals, "normals")?,
        albedos: rows(&query.albedos, "albedos")?,
        reflectances: query.reflectances.as_ref().map(|values| flat(values, "reflectances")).transpose()?,
        materials: flat(&query.materials, "materials")?,
        lengths: flat(&query.lengths, "lengths")?,
        shares: flat(&query.shares, "shares")?,
    };
    let materials: Vec<LidarMaterial> = materials.into_iter().map(Into::into).collect();
    let n = hits.directions.len();
    let found = py.detach(|| returned_light(&hits, &materials, query.threads)).or_raise()?;
    Ok((array(py, found.cosines, &[n])?, array(py, found.incidences, &[n])?, array(py, found.energies, &[n])?))
}

/// Surfaces that return light, from a dict; see [`Returns`].
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct ReturnArguments<'py> {
    pulses: PyReadonlyArrayDyn<'py, i64>,
    lengths: Floats<'py>,
    energies: Floats<'py>,
    instances: PyReadonlyArrayDyn<'py, i32>,
    bounces: PyReadonlyArrayDyn<'py, i32>,
    threads: Option<usize>,
}

/// Returns the echoes of all pulses as arrays by name: `pulse`, `length`, `energy`, `main` and `purity`; `sigma` is
/// the standard deviation of a pulse in metres.
#[pyfunction]
pub(crate) fn lidar_echoes<'py>(py: Python<'py>, query: ReturnArguments<'py>, sigma: f64) -> DictResult<'py> {
    if !(sigma.is_finite() && sigma >= 0.0) {
        return Err(settings_error(format!("sigma: {sigma}; expected a finite number of metres >= 0")));
    }
    let returns = Returns {
        pulses: flat(&query.pulses, "pulses")?,
        lengths: flat(&query.lengths, "lengths")?,
        energies: flat(&query.energies, "energies")?,
        instances: flat(&query.instances, "instances")?,
        bounces: flat(&query.bounces, "bounces")?,
    };
    let found = py.detach(|| find_echoes(&returns, sigma, query.threads)).or_raise()?;
    let (dict, n) = (PyDict::new(py), found.pulses.len());
    dict.set_item("pulse", array(py, found.pulses, &[n])?)?;
    dict.set_item("length", array(py, found.lengths, &[n])?)?;
    dict.set_item("energy", array(py, found.energies, &[n])?)?;
    dict.set_item("main", array(py, found.mains, &[n])?)?;
    dict.set_item("purity", array(py, found.purities, &[n])?)?;
    Ok(dict)
}
