//! Scans: read from files, made of arrays, or of the virtual scanner.

use crate::arrays::{points, rows};
use crate::errors::{raised, wrong};
use crate::model::Program;
use crate::processes::detached;
use crate::work::with_progress;
use gml_runtime::mesh::TriangleMesh;
use gmlc::embedded;
use numpy::{PyArray2, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use std::path::PathBuf;

/// A scan, cleaned: a mesh or a cloud of points.
#[pyclass(frozen)]
pub(crate) struct Scan {
    pub(crate) scan: gml_runtime::scan::Scan,
}

#[pymethods]
impl Scan {
    /// Reads a file.
    #[staticmethod]
    #[pyo3(signature = (path, words, progress=None))]
    fn read(py: Python<'_>, path: PathBuf, words: Vec<String>, progress: Option<Py<PyAny>>) -> PyResult<Self> {
        let scan = with_progress(py, progress, move |progress| embedded::read_scan(&path, &words, progress))?;
        Ok(Self { scan })
    }

    /// A scan of points (n, 3), with normals (n, 3) and triangles (m, 3) if there are any. Millimetres.
    #[staticmethod]
    #[pyo3(signature = (positions, normals=None, triangles=None, name="array"))]
    fn from_points(
        py: Python<'_>,
        positions: PyReadonlyArrayDyn<'_, f64>,
        normals: Option<PyReadonlyArrayDyn<'_, f64>>,
        triangles: Option<PyReadonlyArrayDyn<'_, i64>>,
        name: &str,
    ) -> PyResult<Self> {
        let positions = points(&positions, "points")?;
        let normals = normals.map(|n| points(&n, "normals")).transpose()?.unwrap_or_default();
        if !normals.is_empty() && normals.len() != positions.len() {
            return Err(wrong(format!("{} normals for {} points", normals.len(), positions.len())));
        }
        let triangles = triangles.map(|t| corners(&t, positions.len())).transpose()?.unwrap_or_default();
        let mesh = TriangleMesh { positions, normals, triangles, ..TriangleMesh::default() };
        let scan = detached(py, || embedded::scan_of_points(mesh, name)).map_err(raised)?;
        Ok(Self { scan })
    }

    /// Points (n, 3). Millimetres.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        rows(py, self.scan.mesh.positions.clone())
    }

    /// Unit normals (n, 3).
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        rows(py, self.scan.mesh.normals.clone())
    }

    /// Triangles (m, 3): numbers of points.
    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        rows(py, self.scan.mesh.triangles.clone())
    }

    /// Standard deviation of the noise. Millimetres.
    #[getter]
    fn noise(&self) -> f64 {
        self.scan.noise
    }

    /// The file.
    #[getter]
    fn path(&self) -> &str {
        &self.scan.source.path
    }

    /// Sentences on faults of the file.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.scan.warnings.clone()
    }
}

/// Triangles of an array of shape (m, 3).
fn corners(array: &PyReadonlyArrayDyn<'_, i64>, count: usize) -> PyResult<Vec<[u32; 3]>> {
    let [_, 3] = array.shape() else {
        return Err(wrong(format!("triangles have the shape {:?}; expected (m, 3)", array.shape())));
    };
    let corner = |index: &i64| {
        let known = u32::try_from(*index).ok().filter(|i| (*i as usize) < count);
        known.ok_or_else(|| wrong(format!("a triangle has the corner {index}, and there are {count} points")))
    };
    let flat = array.as_array().iter().map(corner).collect::<PyResult<Vec<u32>>>()?;
    Ok(flat.as_chunks().0.to_vec())
}

/// Scans a program with the virtual scanner, into a file if there is one; returns the scan and truth.json.
#[pyfunction]
#[pyo3(signature = (program, x, words, output=None, progress=None))]
pub(crate) fn virtual_scan(
    py: Python<'_>,
    program: &Program,
    x: PyReadonlyArrayDyn<'_, f64>,
    words: Vec<String>,
    output: Option<PathBuf>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Scan, String)> {
    let (model, x) = (program.model.clone(), crate::arrays::numbers(&x));
    let made = with_progress(py, progress, move |progress| {
        let made = embedded::virtual_scan(&model, &x, &words, output.as_deref(), progress)?;
        let scan = match &output {
            Some(path) => embedded::read_scan(path, &[], progress)?,
            None => embedded::scan_of_points(made.mesh.clone(), "virtual scan")?,
        };
        Ok((scan, embedded::truth_of_scan(&made)?))
    })?;
    Ok((Scan { scan: made.0 }, made.1))
}
