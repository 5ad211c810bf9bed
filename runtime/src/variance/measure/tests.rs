//! Where a measurement asks whether it is to end.

use super::*;
use crate::model::Fineness;
use crate::progress::tests::Until;
use crate::scan::from_mesh;
use gml_compiler::program::{Options, compile};
use gml_compiler::source::{NoFiles, SourceFile};

#[test]
fn a_measurement_ends_after_any_stage_and_never_with_half_a_result() {
    let text = "model ball { param r: length = 20mm\npart p = sphere(r) }".to_owned();
    let script = SourceFile { name: "ball.gml".to_owned(), text };
    let program = compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program;
    let instance = crate::model::Model::instantiate(&program, &[20.1]).unwrap();
    let fineness = Fineness { chord: 0.5, ..Fineness::default() };
    let scan = from_mesh(Tessellation::new(&program, &*instance, fineness).unwrap().mesh, "scan").unwrap();
    let options =
        MeasureOptions { resolution: crate::variance::Resolution::Side(32), device: Device::Cpu, ..Default::default() };
    let reference = Reference::Model { model: &program, x: &[20.0], motion: crate::model::Motion::IDENTITY };
    let run = |questions| measure(reference, &scan, None, &options, &Until::asked(questions));
    let questions = (0..100).take_while(|questions| match run(*questions) {
        Ok(_) => false,
        Err(error) => {
            assert_eq!(error, MeasureError::Interrupted);
            true
        }
    });
    assert!(questions.count() > 8, "a measurement asks too rarely");
}
