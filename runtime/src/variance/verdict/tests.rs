use super::*;
use crate::bvh::Bvh;
use crate::mesh::TriangleMesh;
use crate::model::{PartSensitivities, Texels};
use crate::scan::Scan;
use crate::scan::ScanSource;
use crate::variance::form::{Shape, WithoutNoise, Zone};
use crate::variance::{Device, Facing, cast};
use gml_compiler::program::Quantity;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// Sheets of `n` x `n` texels with edges of `edge` mm: their heights, the directions of their normals along z, and
/// their deviations.
pub(in crate::variance) fn sheet(n: usize, edge: f64, sheets: &[(f64, f32, f32)]) -> Deviations {
    let one = |k: usize| (k % (n * n), sheets[k / (n * n)]);
    let count = n * n * sheets.len();
    let place = |k: usize| {
        let (k, (z, ..)) = one(k);
        [(k % n) as f64 * edge, (k / n) as f64 * edge, z]
    };
    let texels = Texels {
        width: n as u32,
        height: (n * sheets.len()) as u32,
        index: (0..count as u32).collect(),
        part: vec![0; count],
        position: (0..count).map(place).collect(),
        normal: (0..count).map(|k| [0.0, 0.0, one(k).1.1]).collect(),
        area: vec![(edge * edge) as f32; count],
        side: vec![edge as f32; count],
        part_names: vec!["plate".to_owned()],
    };
    Deviations::new(texels, 50.0, (0..count).map(|k| one(k).1.2).collect(), vec![f32::NAN; count])
}

/// One sheet, whose deviation is a function of the place.
pub(in crate::variance) fn plate(n: usize, edge: f64, deviation: impl Fn(f64, f64) -> f32) -> Deviations {
    let mut plate = sheet(n, edge, &[(0.0, 1.0, 0.0)]);
    for (i, [x, y, _]) in plate.texels.position.iter().enumerate() {
        let d = deviation(*x, *y);
        (plate.outward[i], plate.inward[i]) = if d < 0.0 { (f32::NAN, -d) } else { (d, f32::NAN) };
    }
    plate
}

/// Edge of the scanned plate in cells of a millimetre, and the standard deviation of its points.
const CELLS: usize = 60;
const NOISE: f64 = 0.1;

/// A scan of a plate at the heights of a function, with noise.
fn scanned(seed: u64, noise: f64, height: impl Fn(f64, f64) -> f64) -> Scan {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let normal = Normal::new(0.0, noise).unwrap();
    let n = CELLS + 1;
    let positions = (0..n * n).map(|k| {
        let [x, y] = [(k % n) as f64, (k / n) as f64];
        [x, y, height(x, y) + normal.sample(&mut random)]
    });
    let triangles = (0..CELLS * CELLS).flat_map(|k| {
        let corner = (k / CELLS * n + k % CELLS) as u32;
        let above = corner + n as u32;
        [[corner, corner + 1, above], [corner + 1, above + 1, above]]
    });
    let mesh =
        TriangleMesh { positions: positions.collect(), triangles: triangles.collect(), ..TriangleMesh::default() };
    Scan {
        mesh,
        attributes: Default::default(),
        source: ScanSource::default(),
        noise,
        warnings: Vec::new(),
        oriented: true,
    }
}

/// The deviations of a scan of the plate from a plane, at four texels for each of its points, with the scan's noise.
fn on_plate(bvh: &Bvh, noise: f64) -> Deviations {
    let edge = 0.5;
    let mut texels = plate(2 * CELLS, edge, |_, _| 0.0).texels;
    texels.position.iter_mut().for_each(|p| *p = [p[0] + 0.5 * edge, p[1] + 0.5 * edge, 0.0]);
    Deviations { noise, ..cast(texels, bvh, 10.0, Facing::Any, Device::Cpu).unwrap().deviations }
}

/// The report and the map of a scan of the plate, measured from a plane, with each of several tolerances.
fn assessed(scan: &Scan, options: VerdictOptions, tolerances: &[Tolerance]) -> Vec<(VarianceReport, Vec<f32>)> {
    let bvh = Bvh::build(&scan.mesh).unwrap();
    let deviations = on_plate(&bvh, scan.noise);
    let assess = |tolerance: &Tolerance| {
        let mut report = VarianceReport::new(&deviations, &scan.source, "cpu", &[Some(*tolerance)]);
        let grounds = Grounds {
            deviations: &deviations,
            scanned: Scanned::Triangles { mesh: &scan.mesh, bvh: &bvh },
            fit: None,
            options,
        };
        let map = grounds.assess(&mut report).unwrap();
        (report, map)
    };
    tolerances.iter().map(assess).collect()
}

fn verdict(report: &VarianceReport) -> &Verdict {
    report.parts[0].verdict.as_ref().unwrap()
}

/// Shares of parts that conform, do not conform and are undecided by many noisy scans, for each upper limit.
fn shares(seeds: u64, options: VerdictOptions, limits: &[f64], height: impl Fn(f64, f64) -> f64) -> Vec<[f64; 3]> {
    let tolerances: Vec<Tolerance> = limits.iter().map(|upper| Tolerance { lower: -2.0, upper: *upper }).collect();
    let mut counts = vec![[0.0; 3]; limits.len()];
    for seed in 0..seeds {
        let scan = scanned(seed, NOISE, &height);
        for (counts, (report, _)) in counts.iter_mut().zip(assessed(&scan, options, &tolerances)) {
            counts[verdict(&report).outcome as usize] += 1.0 / seeds as f64;
        }
    }
    counts
}

/// With one footprint, the shares are those of the normal distribution: at the limit 5 % conform and 5 % do not, a
/// guard band inside half conform, two of them 95 %.
#[test]
fn shares_are_those_of_the_normal_distribution() {
    let options = VerdictOptions { footprint: Some(CELLS as f64), ..VerdictOptions::default() };
    let sd = NOISE / CELLS as f64;
    let limits = [0.2, 0.2 + 1.65 * sd, 0.2 + 3.3 * sd, 0.2 - 1.65 * sd, 0.2 - 3.3 * sd];
    let found = shares(200, options, &limits, |_, _| 0.2);
    let expected: [[f64; 3]; 5] =
        [[0.05, 0.05, 0.9], [0.5, 0.0, 0.5], [0.95, 0.0, 0.05], [0.0, 0.5, 0.5], [0.0, 0.95, 0.05]];
    for ((limit, found), expected) in limits.iter().zip(found).zip(expected) {
        for (found, expected) in found.iter().zip(expected) {
            // Three standard deviations of such a share, and what the statement of the noise is off by.
            let most = 3.0 * (expected * (1.0 - expected) / 200.0).sqrt() + 0.02;
            assert!((found - expected).abs() < most, "{limit}: {found}, not {expected}");
        }
    }
}

/// Over the footprints of an even part the spread of the values is the uncertainty that is stated.
#[test]
fn the_noise_of_a_footprint_is_that_of_its_median() {
    let (mut squares, mut count) = (0.0, 0.0);
    for seed in 0..20 {
        let scan = scanned(1000 + seed, NOISE, |_, _| 0.0);
        let tolerance = Tolerance { lower: -2.0, upper: 2.0 };
        let (report, _) = assessed(&scan, VerdictOptions::default(), &[tolerance]).remove(0);
        let found = verdict(&report);
        assert!((found.points / 25.0 - 1.0).abs() < 0.15 && found.footprints.abs_diff(144) < 8, "{found:?}");
        let stated = found.noise;
        let bvh = Bvh::build(&scan.mesh).unwrap();
        let deviations = on_plate(&bvh, scan.noise);
        for footprint in footprints(&deviations, (0..deviations.texels.len() as u32).collect(), 25.0) {
            squares += (footprint.median / stated).powi(2);
            count += 1.0;
        }
    }
    let spread = f64::sqrt(squares / count);
    assert!((spread - 1.0).abs() < 0.1, "{spread}");
}

/// A part at its limit everywhere, or at one place: a little more, and it must not pass; any less, and it must not
/// fail. Either mistake is as rare as stated, at most. Well inside and well outside there is no doubt.
#[test]
fn risks_are_not_larger_than_stated() {
    const SEEDS: u64 = 60;
    let limits = [0.2, 0.2 + 1.5 * NOISE, 0.2 - 1.5 * NOISE];
    let even = |_: f64, _: f64| 0.2;
    let bump = |x: f64, y: f64| -> f64 { if (x - 20.0).abs() < 8.0 && (y - 40.0).abs() < 8.0 { 0.2 } else { 0.0 } };
    let weak = |x: f64, y: f64| bump(x, y).max(0.2 - 0.8 * NOISE);
    let shares = [
        shares(SEEDS, VerdictOptions::default(), &limits, even),
        shares(SEEDS, VerdictOptions::default(), &limits, bump),
        shares(SEEDS, VerdictOptions::default(), &limits, weak),
    ];
    for shares in shares {
        let [at, inside, outside] = shares[..] else { panic!() };
        // 5 %, and three standard deviations of it.
        assert!(at[0] < 0.135 && at[1] < 0.135, "{at:?}");
        assert!(inside[0] > 0.95 && outside[1] > 0.95, "{inside:?} {outside:?}");
    }
}

#[test]
fn one_texel_is_no_verdict() {
    let scan = scanned(1, 0.0, |_, _| 0.0);
    let bvh = Bvh::build(&scan.mesh).unwrap();
    let mut deviations = on_plate(&bvh, 0.136);
    (deviations.outward[7000], deviations.inward[7000]) = (f32::NAN, 0.5023);
    let tolerance = Tolerance { lower: -0.5, upper: 0.5 };
    let mut report = VarianceReport::new(&deviations, &scan.source, "cpu", &[Some(tolerance)]);
    let options = VerdictOptions::default();
    let map = Grounds {
        deviations: &deviations,
        scanned: Scanned::Triangles { mesh: &scan.mesh, bvh: &bvh },
        fit: None,
        options,
    }
    .assess(&mut report);
    assert_eq!(report.parts[0].statistics.tolerance.unwrap().texels_below, 1);
    assert_eq!(verdict(&report).outcome, Outcome::Conforms);
    assert_eq!(report.verdict.unwrap().outcome, Outcome::Conforms);
    // By itself the texel says little: Phi(-0.0023 / 0.136), and the others Phi(0.5 / 0.136) on both sides.
    let map = map.unwrap();
    assert!((map[7000] - 0.493_25).abs() < 1e-4, "{}", map[7000]);
    assert!((map[7001] - 0.999_763).abs() < 1e-5, "{}", map[7001]);
}

/// A place that is certainly beyond its limit decides, even if another is known so little that it may be worse.
#[test]
fn what_is_certain_is_not_hidden_by_what_is_doubtful() {
    let scan = scanned(1, 0.01, |_, _| 0.0);
    let bvh = Bvh::build(&scan.mesh).unwrap();
    let mut deviations = on_plate(&bvh, scan.noise);
    let positions = deviations.texels.position.clone();
    for (i, [x, y, _]) in positions.iter().enumerate() {
        if *x > 45.0 && *y > 45.0 {
            (deviations.outward[i], deviations.inward[i]) = (0.3, f32::NAN);
        }
    }
    let count = deviations.texels.len();
    // The surface is known by 0.2 mm at the other corner, and exactly elsewhere.
    let variance = |i: usize| if positions[i][0] < 15.0 && positions[i][1] < 15.0 { 0.2 } else { 0.0 };
    let part = PartSensitivities {
        texels: (0..count).collect(),
        active: vec![0],
        normals: vec![[0.0, 0.0, 1.0]; count],
        derivatives: (0..count).map(|i| [0.0, 0.0, variance(i)]).collect(),
    };
    let sensitivities = Sensitivities { parts: vec![part], parameters: vec![("a".to_owned(), Quantity::Length)] };
    let (parameters, matrix) = (["a".to_owned()], [vec![1.0]]);
    let fit = Some((&sensitivities, ParameterCovariance { parameters: &parameters, matrix: &matrix, centre: None }));
    let options = VerdictOptions::default();
    let assess = |upper: f64| {
        let tolerance = Tolerance { lower: -1.0, upper };
        let mut report = VarianceReport::new(&deviations, &scan.source, "cpu", &[Some(tolerance)]);
        Grounds { deviations: &deviations, scanned: Scanned::Triangles { mesh: &scan.mesh, bvh: &bvh }, fit, options }
            .assess(&mut report)
            .unwrap();
        verdict(&report).clone()
    };
    let beyond = assess(0.2);
    assert_eq!(beyond.outcome, Outcome::DoesNotConform);
    assert!(
        (beyond.value - 0.3).abs() < 0.01 && beyond.place[0] > 45.0 && beyond.highest_probability < 1e-6,
        "{beyond:?}"
    );
    // Within 0.31 mm the doubtful place is the one that matters.
    let within = assess(0.31);
    assert_eq!(within.outcome, Outcome::Undecided);
    assert!(within.place[0] < 15.0 && (within.fit - 0.2).abs() < 1e-9 && within.probability < 0.95, "{within:?}");
}

/// What was not measured conforms to nothing, and neither does it fail.
#[test]
fn what_was_hardly_measured_is_undecided() {
    let scan = scanned(1, 0.01, |_, _| 0.0);
    let bvh = Bvh::build(&scan.mesh).unwrap();
    let whole = on_plate(&bvh, scan.noise);
    let assess = |unmeasured: usize, lower: f64| {
        let mut deviations = whole.clone();
        deviations.outward[..unmeasured].fill(f32::NAN);
        deviations.inward[..unmeasured].fill(f32::NAN);
        let tolerance = Tolerance { lower, upper: 0.1 };
        let mut report = VarianceReport::new(&deviations, &scan.source, "cpu", &[Some(tolerance)]);
        let options = VerdictOptions::default();
        Grounds {
            deviations: &deviations,
            scanned: Scanned::Triangles { mesh: &scan.mesh, bvh: &bvh },
            fit: None,
            options,
        }
        .assess(&mut report)
        .unwrap();
        report
    };
    let count = whole.texels.len();
    assert_eq!(verdict(&assess(count / 10, -0.1)).outcome, Outcome::Conforms);
    let hardly = assess(count / 4, -0.1);
    assert_eq!(verdict(&hardly).outcome, Outcome::Undecided);
    assert_eq!(verdict(&hardly).reasons, ["only 75.0 % of it was measured, 80 % are required (--min-coverage)"]);
    let mut hole = whole.clone();
    hole.outward[..200].fill(f32::NAN);
    hole.inward[..200].fill(f32::NAN);
    hole.contradicted = (0..count).map(|i| i < 200).collect();
    let tolerance = Tolerance { lower: -0.1, upper: 0.1 };
    let mut report = VarianceReport::new(&hole, &scan.source, "cpu", &[Some(tolerance)]);
    let options = VerdictOptions::default();
    Grounds { deviations: &hole, scanned: Scanned::Triangles { mesh: &scan.mesh, bvh: &bvh }, fit: None, options }
        .assess(&mut report)
        .unwrap();
    assert_eq!(verdict(&report).reasons, ["the scan shows empty space on 50.0 mm2 of it"]);
    // What is beyond its limits is, however little of it was measured.
    assert_eq!(verdict(&assess(count / 4, 0.05)).outcome, Outcome::DoesNotConform);
    let nothing = assess(count, -0.1);
    let found = verdict(&nothing);
    assert!(found.outcome == Outcome::Undecided && found.value.is_nan() && found.footprints == 0, "{found:?}");
    assert!(!nothing.parts[0].statistics.tolerance.unwrap().within);
    let mut doubted = assess(0, -0.1);
    doubted.doubt_verdicts("the fit cannot be relied on");
    assert_eq!(doubted.verdict.as_ref().unwrap().outcome, Outcome::Undecided);
    assert_eq!(verdict(&doubted).reasons, ["the fit cannot be relied on"]);
}

/// The noise is averaged over the footprint; what the scanner and the fit are off by is not.
#[test]
fn what_is_common_is_not_averaged() {
    let scan = scanned(1, NOISE, |_, _| 0.0);
    let bvh = Bvh::build(&scan.mesh).unwrap();
    let deviations = on_plate(&bvh, scan.noise);
    let count = deviations.texels.len();
    // The surface turns about the middle of one edge: it moves by x for a radian.
    let turn = PartSensitivities {
        texels: (0..count).step_by(7).collect(),
        active: vec![0],
        normals: vec![[0.0, 0.0, 1.0]; count.div_ceil(7)],
        derivatives: (0..count).step_by(7).map(|i| [0.0, 0.0, deviations.texels.position[i][0]]).collect(),
    };
    let sensitivities = Sensitivities { parts: vec![turn], parameters: vec![("a".to_owned(), Quantity::Angle)] };
    let (parameters, matrix) = (["a".to_owned()], [vec![1e-6]]);
    let covariance = ParameterCovariance { parameters: &parameters, matrix: &matrix, centre: None };
    let tolerance = Tolerance { lower: -0.5, upper: 0.5 };
    let mut report = VarianceReport::new(&deviations, &scan.source, "cpu", &[Some(tolerance)]);
    let options = VerdictOptions { device_uncertainty: 0.03, ..VerdictOptions::default() };
    let fit = Some((&sensitivities, covariance));
    Grounds { deviations: &deviations, scanned: Scanned::Triangles { mesh: &scan.mesh, bvh: &bvh }, fit, options }
        .assess(&mut report)
        .unwrap();
    let found = verdict(&report);
    assert!((found.noise / (NOISE / found.points.sqrt()) - 1.0).abs() < 1e-9, "{found:?}");
    assert!((found.fit - 1e-3 * found.place[0]).abs() < 1e-3, "{found:?}");
    assert_eq!(found.device, 0.03);
    let squares = found.noise.powi(2) + found.fit.powi(2) + found.device.powi(2);
    assert!((found.uncertainty.powi(2) - squares).abs() < 1e-12, "{found:?}");
}

/// A rim along an edge, 0.5 mm high and 1.5 mm wide, of which no footprint of 5 mm is the half, and one point that is
/// off as much: the part passed with certainty.
#[test]
fn a_strip_along_an_edge_is_seen() {
    let tolerances = [Tolerance { lower: -0.3, upper: 0.3 }];
    let of = |height: &dyn Fn(f64, f64) -> f64, options| {
        let scan = scanned(1, 0.02, height);
        verdict(&assessed(&scan, options, &tolerances)[0].0).clone()
    };
    let rim = |x: f64, _: f64| if x < 1.5 { 0.5 } else { 0.0 };
    let found = of(&rim, VerdictOptions::default());
    assert_eq!(found.outcome, Outcome::Undecided, "{found:?}");
    let [reason] = &found.reasons[..] else { panic!("{found:?}") };
    assert!(reason.contains("a strip that is narrower than footprints of 25.0 mm2"), "{reason}");
    let fine = of(&rim, VerdictOptions { footprint: Some(1.5), ..VerdictOptions::default() });
    assert_eq!(fine.outcome, Outcome::DoesNotConform, "{fine:?}");
    let point = |x: f64, y: f64| if (x, y) == (20.0, 20.0) { 2.0 } else { 0.0 };
    assert_eq!(of(&point, VerdictOptions::default()).outcome, Outcome::Conforms);
    let row = |x: f64, _: f64| if x < 0.5 { 0.5 } else { 0.0 };
    assert_eq!(of(&row, VerdictOptions::default()).outcome, Outcome::Conforms, "points of edges lie between surfaces");
}

/// A form that is wider than a tolerance is beyond it wherever the part lies; one that may be narrower is not.
#[test]
fn a_form_that_is_wider_than_a_tolerance_is_a_doubt() {
    let form = |corrected: f64, uncertainty: f64| {
        let without_noise = WithoutNoise { noise_alone: 0.01, corrected, uncertainty };
        let zone = Zone {
            characteristic: "flatness".to_owned(),
            least_squares: corrected,
            minimum_zone: corrected,
            without_noise,
            at: [[0.0; 3]; 2],
            lower_limit: true,
            unfiltered: [corrected; 2],
        };
        FormDeviation {
            shape: Shape::Plane,
            cutoff: 5.0,
            points: 1000,
            outlying: 0,
            zone: Some(zone),
            roundness: None,
            straightness: None,
        }
    };
    let tolerance = Tolerance { lower: -0.1, upper: 0.2 };
    let sentence = "its flatness of 0.354 mm is more than the 0.300 mm of its tolerance: what deviates is narrower than \
                    half a footprint of 7.7 mm2, and a smaller --footprint judges it";
    assert_eq!(wider(&form(0.354, 0.007), tolerance, 7.71).as_deref(), Some(sentence));
    assert_eq!(wider(&form(0.354, 0.03), tolerance, 7.71), None);
    assert_eq!(wider(&form(0.25, 0.007), tolerance, 7.71), None);
}
