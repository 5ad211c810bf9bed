//! Deviations as arrays.

use crate::arrays::{rows, vector};
use gmlc::embedded::Measured;
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Deviations at the texels of a model: arrays of one length, which hold what was computed without a copy.
#[pyclass(frozen)]
pub(crate) struct Deviations {
    /// Signed distance along the normal, positive where the scan lies outside; NaN without data. Millimetres.
    #[pyo3(get)]
    distance: Py<PyArray1<f32>>,
    /// How far the scan's triangle lies off the surface between its corners; NaN where that is not known. Millimetres.
    #[pyo3(get)]
    sag: Py<PyArray1<f32>>,
    /// The number of the part.
    #[pyo3(get)]
    part: Py<PyArray1<u32>>,
    /// Surface parameters, (n, 2).
    #[pyo3(get)]
    uv: Py<PyArray2<f64>>,
    /// Points of the fitted model, (n, 3). Millimetres.
    #[pyo3(get)]
    position: Py<PyArray2<f64>>,
    /// Unit normals there, (n, 3).
    #[pyo3(get)]
    normal: Py<PyArray2<f32>>,
    /// The area that a texel stands for. Square millimetres.
    #[pyo3(get)]
    area: Py<PyArray1<f32>>,
    /// The place of the texel on the texture, y * width + x.
    #[pyo3(get)]
    index: Py<PyArray1<u32>>,
    /// Width and height of the texture.
    #[pyo3(get)]
    resolution: (u32, u32),
    /// Names of the parts.
    #[pyo3(get)]
    part_names: Vec<String>,
    /// variance.json.
    #[pyo3(get)]
    report: String,
}

impl Deviations {
    pub(crate) fn new(py: Python<'_>, measured: Measured) -> PyResult<Self> {
        let Measured { measurement, uv } = measured;
        let report = serde_json::to_string(&measurement.report);
        let deviations = measurement.deviations;
        let distance: Vec<f32> = (0..deviations.texels.len()).map(|i| deviations.along(i)).collect();
        let mut sag = deviations.sag;
        sag.resize(distance.len(), f32::NAN);
        let texels = deviations.texels;
        Ok(Self {
            distance: vector(py, distance).unbind(),
            sag: vector(py, sag).unbind(),
            part: vector(py, texels.part).unbind(),
            uv: rows(py, uv)?.unbind(),
            position: rows(py, texels.position)?.unbind(),
            normal: rows(py, texels.normal)?.unbind(),
            area: vector(py, texels.area).unbind(),
            index: vector(py, texels.index).unbind(),
            resolution: (texels.width, texels.height),
            part_names: texels.part_names,
            report: report.map_err(|error| PyValueError::new_err(error.to_string()))?,
        })
    }
}
