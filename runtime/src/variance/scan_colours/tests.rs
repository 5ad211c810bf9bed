//! Scans whose colours are a known function of place.

use super::*;
use crate::mesh::Bounds;
use crate::model::{Fineness, Model, Motion, Tessellation};
use crate::progress::Silent;
use crate::scan::{Scan, from_mesh};
use crate::simulate::{ExactSurface, Scanner, scan_exact};
use crate::variance::{Device, DistanceKind, MeasureOptions, Measurement, Reference, Resolution, measure};
use gml_compiler::program::{Options, Program, compile};
use gml_compiler::source::{NoFiles, SourceFile};

fn can() -> Program {
    let text = "use std.surface (cylinder, disc)\nmodel can {\n  param r: length = 20mm\n\
        part side = cylinder(r, 40mm)\n  part lid = |u, v| disc(r)(u, v) + (0mm, 0mm, 40mm)\n}";
    let script = SourceFile { name: "can.gml".to_owned(), text: text.to_owned() };
    compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program
}

/// A virtual scan of a can that is 0.1 mm wider than the model, with points 0.8 mm apart.
fn scanned(program: &Program) -> (TriangleMesh, Motion) {
    let instance = Model::instantiate(program, &[20.1]).unwrap();
    let tessellation = Tessellation::new(program, &*instance, Fineness { chord: 0.02, ..Fineness::default() }).unwrap();
    let surface = ExactSurface { tessellation: &tessellation, instance: &*instance, motion: Motion::IDENTITY };
    let scanner =
        Scanner { views: 6, spacing: 0.8, noise: 0.05, outliers: 0.0, dropouts: 0.0, seed: 3, ..Scanner::default() };
    let scan = scan_exact(surface, &scanner, &Silent).unwrap();
    (scan.mesh, scan.truth.pose)
}

fn measured(program: &Program, pose: Motion, scan: &Scan, distance: DistanceKind) -> Measurement {
    let options = MeasureOptions {
        resolution: Resolution::Side(128),
        max_distance: Some(3.0),
        device: Device::Cpu,
        distance,
        ..MeasureOptions::default()
    };
    measure(Reference::Model { model: program, x: &[20.0], motion: pose }, scan, None, &options, &Silent).unwrap()
}

/// Shares of a box, as levels from 0 to 255: 5 to 7 a millimetre.
fn levels(bounds: &Bounds, p: [f64; 3]) -> [f64; 3] {
    let share = (DVec3::from(p) - bounds.low) / bounds.size();
    (255.0 * share.clamp(DVec3::ZERO, DVec3::ONE)).into()
}

#[test]
fn colours_of_a_place_come_back_at_its_texel() {
    let program = can();
    let (mesh, pose) = scanned(&program);
    let bounds = mesh.bounds();
    let cloud = TriangleMesh { positions: mesh.positions.clone(), ..TriangleMesh::default() };
    let kinds = [DistanceKind::Normal, DistanceKind::AveragedNormal, DistanceKind::Closest];
    // Of a cloud all kinds have the same points.
    for (mesh, is_cloud, kinds) in [(mesh, false, &kinds[..]), (cloud, true, &kinds[..1])] {
        let mut scan = from_mesh(mesh, "can").unwrap();
        scan.attributes.colours =
            scan.mesh.positions.iter().map(|p| levels(&bounds, *p).map(|c| c.round() as u8)).collect();
        for kind in kinds {
            let found = measured(&program, pose, &scan, *kind);
            let (deviations, colours) = (&found.deviations, found.scan_colours.as_ref().unwrap());
            assert_eq!(found.report.colour, Some(ColourSummary { source: ColourSource::Colours, stretch: None }));
            let (mut sum, mut worst, mut count) = (0.0, 0.0_f64, 0.0);
            for i in 0..deviations.texels.len() {
                assert_eq!(colours.texels[i].is_some(), !deviations.along(i).is_nan(), "measured texels have a colour");
                let Some(colour) = colours.texels[i] else { continue };
                let expected = levels(&bounds, deviations.texels.position[i]);
                let off = (0..3).map(|k| (f64::from(colour[k]) - expected[k]).abs()).fold(0.0, f64::max);
                (sum, worst, count) = (sum + off, worst.max(off), count + 1.0);
            }
            println!("{is_cloud} {kind:?}: {} on average, {worst} at most, {count} texels", sum / count);
            // A ray goes on for 0.1 mm and the noise of 0.05 mm; a level is 0.15 mm, and bytes are rounded twice. The
            // middle of a cylinder's points is up to a spacing of 0.8 mm aside, 6 levels, where they are on one side.
            let (mean, most) = if is_cloud { (0.8, 6.0) } else { (0.8, 2.2) };
            assert!(sum / count < mean && worst < most, "{is_cloud} {kind:?}");
            assert!(count > 0.9 * deviations.texels.len() as f64);
        }
    }
}

#[test]
fn intensities_are_greys_between_percentiles() {
    let program = can();
    let (mesh, pose) = scanned(&program);
    let mut scan = from_mesh(mesh, "can").unwrap();
    let bounds = scan.mesh.bounds();
    // From 1000 to 1255 along x; two points are mirrors, and some have no intensity.
    let intensity = |p: &[f64; 3]| 1000.0 + levels(&bounds, *p)[0] as f32;
    scan.attributes.intensities = scan.mesh.positions.iter().map(intensity).collect();
    scan.attributes.intensities[..2].fill(1e6);
    let found = measured(&program, pose, &scan, DistanceKind::Normal);
    let ColourSummary { source, stretch } = found.report.colour.clone().unwrap();
    let Stretch { percentiles, black, white } = stretch.unwrap();
    assert_eq!((source, percentiles), (ColourSource::Intensities, PERCENTILES));
    // However the can is turned, more than a hundredth of its surface lies within a tenth of its width, 25 levels.
    assert!((1000.0..1025.0).contains(&black) && (1230.0..1256.0).contains(&white), "{black} {white}");
    let (deviations, colours) = (&found.deviations, found.scan_colours.as_ref().unwrap());
    let mut off = 0;
    for i in (0..deviations.texels.len()).filter(|i| colours.texels[*i].is_some()) {
        let [r, g, b] = colours.texels[i].unwrap();
        let expected = Stretch { percentiles, black, white }.grey(f64::from(intensity(&deviations.texels.position[i])));
        off += usize::from(r.abs_diff(expected) > 3);
        assert!(r == g && g == b);
    }
    // Some texels are beside the mirrors.
    assert!(off < 100, "{off}");
}

#[test]
fn colours_go_before_intensities_and_fields_that_nobody_filled_are_none() {
    let of = |colours: &[[u8; 3]], intensities: &[f32]| {
        let attributes =
            Attributes { colours: colours.to_vec(), intensities: intensities.to_vec(), ..Attributes::default() };
        Tints::of(&attributes).map(|tints| matches!(tints, Tints::Colours(_)))
    };
    assert_eq!(of(&[], &[]), None);
    assert_eq!(of(&[[7; 3]; 2], &[0.0; 2]), None);
    assert_eq!(of(&[[7; 3]; 2], &[f32::NAN; 2]), None);
    assert_eq!(of(&[[7; 3]; 2], &[0.0, 1.0]), Some(false));
    assert_eq!(of(&[[7; 3], [8; 3]], &[0.0, 1.0]), Some(true));
}

#[test]
fn points_without_an_intensity_count_for_nothing() {
    let intensities = [1.0, f32::NAN, 3.0];
    let attributes = Attributes { intensities: intensities.to_vec(), ..Attributes::default() };
    let tints = Tints::of(&attributes).unwrap();
    assert_eq!(tints.mean([(0, 0.25), (1, 0.5), (2, 0.25)].into_iter()), [2.0; 3]);
    assert!(tints.mean([(1, 1.0)].into_iter())[0].is_nan());
    let stretch = Stretch::of([5.0, f32::NAN, 5.0].into_iter()).unwrap();
    assert_eq!(stretch.grey(5.0), GREY);
    assert!(Stretch::of([f32::NAN].into_iter()).is_none());
}
