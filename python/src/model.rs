//! Compiled scripts.

use crate::arrays::{block, numbers, points, rows, vector};
use crate::errors::{raised, wrong};
use crate::processes::detached;
use gml_runtime::model::{EvaluationError, Fineness, Instance, Tessellation};
use gmlc::embedded::{Model, positive_length};
use numpy::{PyArray1, PyArray2, PyArray3, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;

/// A compiled script.
#[pyclass(frozen)]
pub(crate) struct Program {
    pub(crate) model: Arc<Model>,
    warnings: String,
}

/// Name, unit, default, lower bound, upper bound, documentation.
type Parameter = (String, String, f64, f64, f64, String);

#[pymethods]
impl Program {
    /// Compiles a file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf, words: Vec<String>) -> PyResult<Self> {
        let (model, warnings) = detached(py, || Model::load(&path, &words)).map_err(raised)?;
        Ok(Self { model: Arc::new(model), warnings })
    }

    /// Compiles the first of several named texts, which may use the others.
    #[staticmethod]
    fn from_texts(py: Python<'_>, texts: Vec<(String, String)>, words: Vec<String>) -> PyResult<Self> {
        let (model, warnings) = detached(py, || Model::from_texts(&texts, &words)).map_err(raised)?;
        Ok(Self { model: Arc::new(model), warnings })
    }

    #[getter]
    fn name(&self) -> &str {
        self.model.program().name()
    }

    #[getter]
    fn path(&self) -> PathBuf {
        self.model.path().clone()
    }

    #[getter]
    fn sha256(&self) -> &str {
        self.model.sha256()
    }

    #[getter]
    fn warnings(&self) -> &str {
        &self.warnings
    }

    /// The names and texts of the script and of what it uses.
    fn texts(&self) -> Vec<(String, String)> {
        self.model.texts()
    }

    fn parameters(&self) -> Vec<Parameter> {
        let program = self.model.program();
        let bounds = program.bounds(&program.defaults());
        let of = |(p, (low, high)): (&gml_compiler::program::Parameter, (f64, f64))| {
            (p.name.clone(), p.quantity.unit().to_owned(), p.default, low, high, p.doc.clone())
        };
        program.parameters().iter().zip(bounds).map(of).collect()
    }

    fn parts(&self) -> Vec<String> {
        self.model.program().parts().iter().map(|part| part.name.clone()).collect()
    }

    fn measures(&self) -> Vec<(String, String)> {
        self.model.program().measures().iter().map(|m| (m.name.clone(), m.unit.clone())).collect()
    }

    /// The values of all parameters: the defaults, but for those that are given as on the command line.
    fn values<'py>(&self, py: Python<'py>, given: Vec<(String, String)>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(vector(py, self.model.values(&given).map_err(raised)?))
    }

    /// Points of a part, of shape (n, 3).
    fn points<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArrayDyn<'py, f64>,
        part: usize,
        u: PyReadonlyArrayDyn<'py, f64>,
        v: PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let found = self.at_sites(py, [x, u, v], part, |instance, u, v| {
            let mut out = vec![[0.0; 3]; u.len()];
            instance.points(part, u, v, &mut out)?;
            Ok(out)
        })?;
        rows(py, found)
    }

    /// Derivatives of points by the parameters, of shape (n, 3, p).
    fn jacobian<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArrayDyn<'py, f64>,
        part: usize,
        u: PyReadonlyArrayDyn<'py, f64>,
        v: PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let (count, width) = (u.len(), x.len());
        let found = self.at_sites(py, [x, u, v], part, |instance, u, v| {
            let active: Vec<usize> = self.model.program().parts()[part].active.iter().map(|p| *p as usize).collect();
            let mut compact = vec![0.0; 3 * active.len() * count];
            instance.jacobian(part, u, v, &mut compact)?;
            // From (point, active parameter, axis) to (point, axis, parameter).
            let mut out = vec![0.0; 3 * width * count];
            for (i, row) in compact.chunks_exact((3 * active.len()).max(1)).enumerate().take(count) {
                for (a, p) in active.iter().enumerate() {
                    for axis in 0..3 {
                        out[(3 * i + axis) * width + p] = row[3 * a + axis];
                    }
                }
            }
            Ok(out)
        })?;
        block(py, found, [count, 3, width])
    }

    /// The sum over points of the products of cotangents and derivatives, of shape (p).
    fn pullback<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArrayDyn<'py, f64>,
        part: usize,
        u: PyReadonlyArrayDyn<'py, f64>,
        v: PyReadonlyArrayDyn<'py, f64>,
        cotangents: PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let cotangents = points(&cotangents, "cotangents")?;
        if cotangents.len() != u.len() {
            return Err(wrong(format!("{} cotangents for {} points", cotangents.len(), u.len())));
        }
        let width = x.len();
        let found = self.at_sites(py, [x, u, v], part, |instance, u, v| {
            let mut out = vec![0.0; width];
            instance.pullback(part, u, v, &cotangents, &mut out)?;
            Ok(out)
        })?;
        Ok(vector(py, found))
    }

    /// Vertices (n, 3), triangles (m, 3), and the part of each triangle (m); `chord` is the largest distance between
    /// mesh and surface, as on the command line.
    #[allow(clippy::type_complexity)]
    fn mesh<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArrayDyn<'py, f64>,
        chord: Option<&str>,
    ) -> PyResult<(Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<u32>>, Bound<'py, PyArray1<u32>>)> {
        let x = numbers(&x);
        let chord =
            chord.map(|text| positive_length(text).map_err(|e| wrong(format!("chord: '{text}' {e}")))).transpose()?;
        let mesh = detached(py, || {
            self.at(&x, 0, |instance| {
                let fineness = chord.map_or_else(Fineness::default, |chord| Fineness { chord, ..Fineness::default() });
                Ok(Tessellation::new(self.model.program(), instance, fineness)?.mesh)
            })
        })?;
        let mut parts = vec![0; mesh.triangles.len()];
        for (part, group) in mesh.groups.iter().enumerate() {
            parts[group.start..group.end].fill(part as u32);
        }
        Ok((rows(py, mesh.positions)?, rows(py, mesh.triangles)?, vector(py, parts)))
    }
}

impl Program {
    /// Does something with the model at `x`, u and v, without the interpreter's lock.
    fn at_sites<T: Send>(
        &self,
        py: Python<'_>,
        arguments: [PyReadonlyArrayDyn<'_, f64>; 3],
        part: usize,
        work: impl FnOnce(&dyn Instance, &[f64], &[f64]) -> Result<T, EvaluationError> + Send,
    ) -> PyResult<T> {
        let [x, u, v] = arguments.each_ref().map(numbers);
        detached(py, || self.at(&x, part, |instance| work(instance, &u, &v)))
    }

    /// Does something with the model at `x`.
    fn at<T>(
        &self,
        x: &[f64],
        part: usize,
        work: impl FnOnce(&dyn Instance) -> Result<T, EvaluationError>,
    ) -> PyResult<T> {
        let program = self.model.program();
        if x.len() != program.parameters().len() {
            return Err(wrong(format!("{} values for {} parameters", x.len(), program.parameters().len())));
        }
        if part >= program.parts().len() {
            return Err(wrong(format!("there is no part {part}")));
        }
        let instance = gml_runtime::model::Model::instantiate(program, x);
        instance
            .and_then(|instance| work(&*instance))
            .map_err(|error| crate::errors::FitError::new_err(error.to_string()))
    }
}
