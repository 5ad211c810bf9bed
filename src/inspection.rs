//! What `gmlc inspect`, a batch and the package do with a fit: deviations from it, and everything in a folder of
//! results.

use crate::cli::VarianceControls;
use crate::error::CommandError;
use crate::{measure, outputs, record};
use gml_compiler::program::Program;
use gml_runtime::export::folder::ResultFolder;
use gml_runtime::export::measurement::{Extent, Extras};
use gml_runtime::fit::FitResult;
use gml_runtime::inspect::Inspection;
use gml_runtime::progress::Progress;
use gml_runtime::record::Record;
use gml_runtime::scan::Scan;
use gml_runtime::variance::MeasureOptions;

/// How the deviations of a scan are measured and documented.
pub(crate) struct Inspecting<'a> {
    /// That of the fit.
    pub(crate) program: &'a Program,
    pub(crate) scan: &'a Scan,
    pub(crate) options: &'a MeasureOptions,
    pub(crate) controls: &'a VarianceControls,
    pub(crate) extent: Extent,
    /// Where the result comes from.
    pub(crate) record: &'a Record,
}

impl Inspecting<'_> {
    /// Measures the deviations from a fitted model.
    pub(crate) fn measure(&self, fit: FitResult, progress: &dyn Progress) -> Result<Inspection, CommandError> {
        let mut inspection = Inspection::of_fit(self.program, fit, self.scan, self.options, progress)?;
        inspection.measurement.report.provenance = Some(self.record.clone());
        Ok(inspection)
    }

    /// Writes the documents into a folder; fit.json as well, unless the fit is read from there.
    pub(crate) fn write(
        &self,
        inspection: &Inspection,
        with_fit: bool,
        folder: &ResultFolder,
        progress: &dyn Progress,
    ) -> Result<(), CommandError> {
        let scripts = record::scripts(self.program);
        let extras = Extras { extent: self.extent, ..measure::extras(self.controls) };
        let written = if with_fit {
            inspection.write(folder.path(), self.scan, &scripts, extras, progress)
        } else {
            inspection.documents(&scripts).write(folder.path(), self.scan, extras, progress)
        };
        written.map_err(|error| outputs::failed(folder, error))
    }
}
