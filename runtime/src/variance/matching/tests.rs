use super::Matching;
use crate::mesh::TriangleMesh;
use crate::model::{Fineness, Model, Motion, Tessellation};
use crate::progress::Silent;
use crate::scan::{Scan, from_mesh};
use crate::simulate::{Scanner, scan};
use crate::variance::{
    Device, DistanceKind, DistanceTexture, MeasureOptions, Measurement, Reference, Resolution, Statistics, measure,
};
use glam::DVec3;
use gml_compiler::program::{Options, Program, compile};
use gml_compiler::source::{NoFiles, SourceFile};

fn program(parts: &str) -> Program {
    let text = format!(
        "use std.surface (revolve, disc, flip, cylinder)
        use std.frame (translate)
        model subject {{ {parts} }}"
    );
    let script = SourceFile { name: "subject.gml".to_owned(), text };
    compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program
}

fn box_of(width: f64, depth: f64, height: f64) -> Program {
    program(&format!("part body = box(width: {width}mm, depth: {depth}mm, height: {height}mm)"))
}

/// The model's triangles, with edges of at most a millimetre.
fn mesh(model: &Program) -> TriangleMesh {
    let fineness = Fineness { edge: 1.0, ..Fineness::default() };
    Tessellation::new(model, &*Model::instantiate(model, &[]).unwrap(), fineness).unwrap().mesh
}

fn measured(model: &Program, scan: &Scan, matching: Matching, distance: DistanceKind) -> Measurement {
    let reference = Reference::Model { model, x: &[], motion: Motion::IDENTITY };
    let options = MeasureOptions {
        resolution: Resolution::Side(512),
        matching,
        distance,
        device: Device::Cpu,
        // Deviations of form, which these tests do not use, take little time behind so long a filter.
        form_cutoff: Some(1e6),
        ..MeasureOptions::default()
    };
    measure(reference, scan, None, &options, &Silent).unwrap()
}

fn part<'a>(measured: &'a Measurement, name: &str) -> &'a Statistics {
    &measured.report.parts.iter().find(|part| part.name == name).expect("a part").statistics
}

/// A scan of a box at its true parameters, so that all deviations are noise.
#[test]
fn hits_on_neighbouring_walls_are_refused() {
    let model = box_of(60.0, 40.0, 30.0);
    let (noise, dropouts) = (0.3, 0.01);
    let scanner = Scanner { noise, dropouts, outliers: 0.0, random_pose: false, seed: 3, ..Scanner::default() };
    let scan = from_mesh(scan(&mesh(&model), &scanner, &Silent).unwrap().mesh, "box").unwrap();
    let all = measured(&model, &scan, Matching::All, DistanceKind::Normal);
    let mutual = measured(&model, &scan, Matching::Mutual, DistanceKind::Normal);
    let (mut wrong, mut remaining, mut good, mut lost) = (0.0, 0.0, 0.0, 0.0);
    for i in 0..all.deviations.texels.len() {
        let (before, after) = (all.deviations.signed(i), mutual.deviations.signed(i));
        let area = f64::from(all.deviations.texels.area[i]);
        if f64::from(before.abs()) > 5.0 * noise {
            wrong += area;
            remaining += if f64::from(after.abs()) > 5.0 * noise { area } else { 0.0 };
        } else if !before.is_nan() {
            good += area;
            lost += if after.is_nan() { area } else { 0.0 };
        }
    }
    assert!(wrong > 0.01 * good, "{wrong} of {good}");
    assert!(remaining < 0.01 * wrong, "{remaining} of {wrong}");
    assert!(lost < 0.004 * good, "{lost} of {good}");
    let (before, after) = (&all.report.overall, &mutual.report.overall);
    assert!(before.weighted.max > 5.0 && after.weighted.max < 1.5, "{} {}", before.weighted.max, after.weighted.max);
    assert!(before.weighted.rms > 0.4 && after.weighted.rms < 0.25, "{} {}", before.weighted.rms, after.weighted.rms);
    // Refused texels are a class of their own.
    assert_eq!(before.ambiguous_texels, 0);
    assert!(mutual.report.spikes < 2, "{}", mutual.report.spikes);
    assert!((before.measured_area - after.measured_area - after.ambiguous_area).abs() < 1e-6 * after.area);
    assert!((after.ambiguous_area / after.area - 0.02).abs() < 0.01, "{}", after.ambiguous_area / after.area);
    let texture = DistanceTexture::new(&mutual.deviations);
    for i in (0..mutual.deviations.texels.len()).filter(|i| mutual.deviations.is_ambiguous(*i)) {
        let at = 3 * mutual.deviations.texels.index[i] as usize;
        assert_eq!(texture.rgb[at..at + 3], [0, 0, 4]);
    }
}

/// A dent of 4 mm in a wall of 1.5 mm lies beyond that wall's other side.
#[test]
fn dents_in_thin_walls_stay() {
    let model = program(
        "part outside = cylinder(40mm, 80mm)
        part inside = flip(cylinder(38.5mm, 78.5mm)).translate((0mm, 0mm, 1.5mm))
        part lip = revolve(|t| (mix(40mm, 38.5mm, t), 80mm))
        part bottom = flip(disc(40mm))
        part floor = disc(38.5mm).translate((0mm, 0mm, 1.5mm))",
    );
    let mut dented = mesh(&model);
    let centre = DVec3::new(40.0, 0.0, 40.0);
    for p in &mut dented.positions {
        p[0] -= 4.0 * (-DVec3::from(*p).distance_squared(centre) / (2.0 * 12.0 * 12.0)).exp();
    }
    dented.normals.clear();
    let scan = from_mesh(dented, "dented").unwrap();
    let all = measured(&model, &scan, Matching::All, DistanceKind::Normal);
    let mutual = measured(&model, &scan, Matching::Mutual, DistanceKind::Normal);
    for name in ["outside", "inside"] {
        let (before, after) = (part(&all, name), part(&mutual, name));
        assert!(after.ambiguous_area < 0.002 * after.area, "{name}: {}", after.ambiguous_area);
        assert!((after.weighted.max - 4.0).abs() < 0.1, "{name}: {}", after.weighted.max);
        assert!((before.weighted.rms / after.weighted.rms - 1.0).abs() < 0.01, "{name}: {}", after.weighted.rms);
    }
}

/// The upper face of a box is 4 mm too high or too low: beside its edges the scan is nearer to the planes of the sides.
#[test]
fn faces_that_moved_stay() {
    let model = box_of(60.0, 40.0, 30.0);
    for height in [26.0, 34.0] {
        let scan = from_mesh(mesh(&box_of(60.0, 40.0, height)), "moved").unwrap();
        let top = measured(&model, &scan, Matching::Mutual, DistanceKind::Normal);
        let top = part(&top, "body.top");
        assert!(top.coverage > 0.95, "{height}: {}", top.coverage);
        assert!((top.weighted.median - 4.0).abs() < 1e-3, "{height}: {}", top.weighted.median);
    }
}

/// Along averaged normals a scan that is smaller by the same everywhere is 1.4 times as far at the edges.
#[test]
fn averaged_normals_are_longer() {
    let model = box_of(60.0, 40.0, 30.0);
    let mut smaller = mesh(&box_of(59.0, 39.0, 29.0));
    smaller.positions.iter_mut().for_each(|p| p[2] += 0.5);
    let scan = from_mesh(smaller, "smaller").unwrap();
    let found = measured(&model, &scan, Matching::Mutual, DistanceKind::AveragedNormal).report.overall;
    assert!(found.coverage > 0.99, "{}", found.coverage);
    assert!(found.ambiguous_area < 0.005 * found.area, "{}", found.ambiguous_area);
}

/// A slanting shelf that was not scanned, above a floor that was: the closest places do not lie along its normal.
#[test]
fn the_closest_point_may_belong_elsewhere_too() {
    let floor = program("part floor = disc(30mm)");
    let model = program("part floor = disc(30mm)\n part shelf = flip(revolve(|t| (20mm * t, 3mm + 3mm * t)))");
    let scan = from_mesh(mesh(&floor), "floor").unwrap();
    for oriented in [true, false] {
        let scan = Scan { oriented, ..scan.clone() };
        for distance in [DistanceKind::Normal, DistanceKind::Closest] {
            let all = measured(&model, &scan, Matching::All, distance);
            let mutual = measured(&model, &scan, Matching::Mutual, distance);
            assert_eq!(part(&all, "shelf").coverage, 1.0, "{distance:?}");
            let shelf = part(&mutual, "shelf");
            // Where the sides are known the scan also shows that the shelf's place is empty.
            let refused = shelf.ambiguous_area + shelf.contradicted_area;
            assert_eq!((shelf.coverage, refused), (0.0, shelf.area), "{distance:?}");
            assert_eq!(shelf.ambiguous_area, if oriented { 0.0 } else { shelf.area }, "{distance:?}");
            assert_eq!(part(&mutual, "floor").coverage, 1.0, "{distance:?}");
        }
    }
}

#[test]
fn spikes_are_counted_and_not_measured() {
    let model = box_of(60.0, 40.0, 30.0);
    let scanner = Scanner { outliers: 0.002, random_pose: false, seed: 5, ..Scanner::default() };
    let made = scan(&mesh(&model), &scanner, &Silent).unwrap();
    let scan = from_mesh(made.mesh, "spikes").unwrap();
    let all = measured(&model, &scan, Matching::All, DistanceKind::Normal).report;
    let mutual = measured(&model, &scan, Matching::Mutual, DistanceKind::Normal).report;
    // Outliers are even within 20 mm: one in twelve stands out by less than 1.6 mm.
    let (outliers, spikes) = (made.truth.outliers as f64, mutual.spikes as f64);
    assert!(outliers > 20.0 && spikes > 0.8 * outliers && spikes < outliers + 2.0, "{spikes} of {outliers}");
    let (before, after) = (all.overall.weighted.max, mutual.overall.weighted.max);
    assert!(before > 7.0 && after < 2.0, "{before} {after}");
    // The paper's matching has none, and nothing is a spike where nothing is known of the noise.
    assert_eq!(all.spikes, 0);
    let unknown = Scan { noise: 0.0, ..scan };
    assert_eq!(measured(&model, &unknown, Matching::Mutual, DistanceKind::Normal).report.spikes, 0);
}

/// The scan of a block of 60 x 40 x 5 mm without its upper face, and a square piece of it that faces upwards inside of
/// the block, with `cells` x `cells` pairs of triangles and normals that need not be those of its triangles.
fn with_a_piece_inside(model: &Program, height: f64, cells: u32, normal: [f64; 3]) -> Scan {
    let mut mesh = mesh(model);
    let is_top = |mesh: &TriangleMesh, t: &[u32; 3]| t.iter().all(|v| mesh.positions[*v as usize][2] > 4.999);
    let kept: Vec<[u32; 3]> = mesh.triangles.iter().filter(|t| !is_top(&mesh, t)).copied().collect();
    let first = mesh.positions.len() as u32;
    let side = cells + 1;
    for k in 0..side * side {
        mesh.positions.push([f64::from(k % side), f64::from(k / side), height]);
        mesh.normals.push(normal);
    }
    mesh.triangles = kept;
    for k in (0..side * cells).filter(|k| k % side < cells).map(|k| first + k) {
        mesh.triangles.extend([[k, k + 1, k + side], [k + 1, k + side + 1, k + side]]);
    }
    (mesh.texcoords, mesh.groups) = (Vec::new(), Vec::new());
    from_mesh(mesh, "with a piece inside").unwrap()
}

/// What faces upwards beside the base, which faces downwards, is the upper face far below its place if there is enough
/// of it, and otherwise nothing.
#[test]
fn scraps_belong_to_what_they_lie_beside_whichever_way_they_face() {
    let model = box_of(60.0, 40.0, 5.0);
    for (cells, stays) in [(4, false), (5, true)] {
        let scan = with_a_piece_inside(&model, 0.5, cells, [0.0, 0.0, 1.0]);
        for distance in [DistanceKind::Normal, DistanceKind::Closest] {
            let all = measured(&model, &scan, Matching::All, distance);
            let mutual = measured(&model, &scan, Matching::Mutual, distance);
            let [all, mutual] = [&all, &mutual].map(|m| part(m, "body.top").measured_area);
            assert!(all > 0.8 * f64::from(cells * cells), "{distance:?}, {cells} cells: {all}");
            assert_eq!(mutual, if stays { all } else { 0.0 }, "{distance:?}, {cells} cells");
        }
    }
}

/// Noise turns single triangles of a steep wall so that they face a texel from which the wall faces away.
#[test]
fn what_faces_away_by_its_mean_normal_is_refused() {
    let model = box_of(60.0, 40.0, 5.0);
    // By more than 60 degrees these are the normals of no face of the block but one 20 mm away.
    for (normal, stays) in [([0.9, 0.0, 0.436], true), ([0.9, 0.0, -0.436], false)] {
        let scan = with_a_piece_inside(&model, 2.0, 8, normal);
        let mutual = measured(&model, &scan, Matching::Mutual, DistanceKind::Normal);
        let all = measured(&model, &scan, Matching::All, DistanceKind::Normal);
        let [all, mutual] = [&all, &mutual].map(|m| part(m, "body.top").measured_area);
        assert!(all > 50.0, "{all}");
        assert_eq!(mutual, if stays { all } else { 0.0 }, "{normal:?}");
    }
}
