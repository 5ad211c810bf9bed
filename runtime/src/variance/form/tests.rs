//! Deviations of form of deviations that are known.

mod scanned;

use super::linear::{Row, chebyshev};
use super::{FormDeviation, Roundness, ScanNoise, Shape, form_deviations, recognise};
use crate::model::{Atlas, Model, Motion, Texels};
use crate::variance::Deviations;
use gml_compiler::program::{Options, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const MODEL: &str = "use std.surface (cylinder, plane, revolve)\nmodel parts {\n\
    part plate = plane(40mm, 20mm)\n\
    part side = cylinder(20mm, 50mm)\n\
    part funnel = revolve(|t| (10mm + t * 5mm, t * 20mm))\n\
    part ball = revolve(|t| (15mm * sin(t * 150deg + 20deg), -15mm * cos(t * 150deg + 20deg)))\n\
    part vase = revolve(|t| (10mm + 3mm * sin(t * 180deg), t * 30mm))\n\
    part wavy = |u, v| (u * 10mm, v * 10mm, 1mm * sin(u * 300deg) * cos(v * 200deg))\n\
    part dish = revolve(|t| (10mm + t * 15mm, t * 7mm)) }";

/// Texels of the model, moved, with deviations that depend on the part and on the place before it was moved.
fn deviations(deviation: impl Fn(usize, [f64; 3]) -> f64) -> Deviations {
    let script = SourceFile { name: "parts.gml".to_owned(), text: MODEL.to_owned() };
    let program = compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program;
    let instance = Model::instantiate(&program, &[]).expect("it exists");
    let atlas = Atlas::new(&program, &*instance, 256).expect("it fits");
    let mut texels = Texels::of_model(&program, &*instance, &atlas).expect("it is finite");
    let signed: Vec<f32> =
        texels.position.iter().zip(&texels.part).map(|(p, part)| deviation(*part as usize, *p) as f32).collect();
    let (a, b) = (0.8f64.sin_cos(), 0.3f64.sin_cos());
    let rotation = [[a.1, -a.0 * b.1, a.0 * b.0], [a.0, a.1 * b.1, -a.1 * b.0], [0.0, b.0, b.1]];
    Motion { rotation, translation: [105.0, -30.0, 7.0] }.move_texels(&mut texels);
    let side = |sign: f32| signed.iter().map(move |d| if d * sign >= 0.0 { d * sign } else { f32::NAN }).collect();
    Deviations::new(texels, 5.0, side(1.0), side(-1.0))
}

/// A scan without noise, of more points than there are texels.
const EXACT: ScanNoise = ScanNoise { sd: 0.0, density: 1e3 };

/// Behind a filter that is hardly wider than texels.
fn forms(deviation: impl Fn(usize, [f64; 3]) -> f64) -> Vec<Option<FormDeviation>> {
    let deviations = deviations(deviation);
    form_deviations(&deviations, &recognise(&deviations.texels), EXACT, Some(1.0))
}

fn zone(forms: &[Option<FormDeviation>], part: usize) -> (f64, f64) {
    let zone = forms[part].as_ref().and_then(|f| f.zone.as_ref()).expect("a form");
    (zone.least_squares, zone.minimum_zone)
}

fn near(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{a}, not {b}");
}

#[test]
fn forms_are_recognised_wherever_they_are() {
    let shapes: Vec<Option<Shape>> =
        recognise(&deviations(|_, _| 0.0).texels).into_iter().map(|s| s.map(|s| s.shape)).collect();
    let expected = [
        Some(Shape::Plane),
        Some(Shape::Cylinder),
        Some(Shape::Cone),
        Some(Shape::Sphere),
        Some(Shape::Revolution),
        None,
        Some(Shape::Cone),
    ];
    assert_eq!(shapes, expected);
}

/// Shifts, tilts and other sizes are no deviations of form: what remains is the square of the change over the size.
#[test]
fn place_and_size_are_no_form() {
    let found = forms(|part, p| match part {
        0 => 0.1 + 0.01 * p[0] - 0.02 * p[1],
        1 | 2 => 0.2 + 0.01 * p[1].atan2(p[0]).cos(),
        3 => 0.3,
        _ => 0.1,
    });
    for part in 0..4 {
        let (least_squares, minimum_zone) = zone(&found, part);
        assert!(least_squares < 1e-4 && minimum_zone <= least_squares, "{part}: {least_squares} {minimum_zone}");
    }
    let vase = found[4].as_ref().expect("a form");
    assert!(vase.zone.is_none());
    // In its plane the same offset is longer where the profile is steeper, which varies within a section.
    let rounded = |r: &Roundness| r.minimum_zone < 1e-6 && r.in_plane[1] < 0.02 && r.sections == 24;
    assert!(vase.roundness.as_ref().is_some_and(rounded), "{vase:?}");
    assert_eq!(found[5], None);
}

/// Texels leave out the last half texel before each edge: extremes there are missed by the deviation's slope times
/// that.
#[test]
fn a_bent_plate_a_lobed_cylinder_and_a_lobed_cone() {
    let found = forms(|part, p| {
        let angle = p[1].atan2(p[0]);
        match part {
            // z = x^2 / 2000 over 40 mm.
            0 => p[0] * p[0] / 2000.0,
            1 => 0.1 * (3.0 * angle).cos(),
            2 => 0.05 * (5.0 * angle).cos(),
            4 => 0.08 * (2.0 * angle).cos(),
            _ => 0.0,
        }
    });
    for width in <[f64; 2]>::from(zone(&found, 0)) {
        near(width, 0.2, 0.006);
    }
    for width in <[f64; 2]>::from(zone(&found, 1)) {
        near(width, 0.2, 2e-3);
    }
    for width in <[f64; 2]>::from(zone(&found, 2)) {
        near(width, 0.1, 2e-3);
    }
    let ring = |part: usize| found[part].as_ref().and_then(|f| f.roundness).expect("sections");
    near(ring(1).least_squares, 0.2, 2e-3);
    near(ring(1).minimum_zone, 0.2, 2e-3);
    near(ring(1).median, 0.2, 2e-3);
    // Deviations along the normal of a cone are longer in the section's plane: by one over the cosine of its angle.
    near(ring(2).minimum_zone, 0.1, 2e-3);
    near(ring(2).in_plane[1], 0.1 / (0.25f64.atan()).cos(), 2e-3);
    assert!(ring(4).minimum_zone >= 0.16 - 1e-3 && ring(4).minimum_zone < 0.175, "{}", ring(4).minimum_zone);
}

/// A cone that opens by 65 degrees from its axis, with three lobes, shifted, and with noise: measured across the
/// surface the width is that of lobes and noise; in the section's plane both are 2.4 times as wide. The least sine of
/// the surface's slope is 7 / sqrt(7^2 + 15^2).
#[test]
fn noise_is_not_amplified_on_steep_surfaces() {
    let outward = 7.0 / 7f64.hypot(15.0);
    let wave = |p: [f64; 3], noise: f64| {
        let angle = p[1].atan2(p[0]);
        let hash = (p[0] * 917.13 + p[1] * 611.7 + p[2] * 331.9).sin() * 43758.5;
        0.05 * (3.0 * angle).cos() + 0.1 * outward * (angle - 0.3).cos() + noise * (hash - hash.floor() - 0.5)
    };
    let ring = |noise: f64| {
        let found = forms(|part, p| if part == 6 { wave(p, noise) } else { 0.0 });
        found[6].as_ref().and_then(|f| f.roundness).expect("sections")
    };
    let plain = ring(0.0);
    for (across, in_plane) in [(plain.least_squares, plain.in_plane[0]), (plain.minimum_zone, plain.in_plane[1])] {
        near(across, 0.1, 5e-4);
        near(in_plane, 0.1 / outward, 2e-3);
    }
    // White within +-0.02, of which the filter leaves less than half: by so much and no more is the ring wider.
    let noisy = ring(0.04);
    assert!((0.105..=0.13).contains(&noisy.minimum_zone), "{}", noisy.minimum_zone);
    near(noisy.in_plane[1], noisy.minimum_zone / outward, 2e-3);
}

/// Over a third-order bend the best plane is not that of least squares: 0.5 against 0.8 of the amplitude.
#[test]
fn the_minimum_zone_is_narrower_than_that_of_least_squares() {
    // The last texels' centres, half a texel from the ends: both widths grow with the third power of how far they
    // reach.
    let reach = std::cell::Cell::new(0.0f64);
    let found = forms(|part, p| {
        if part != 0 {
            return 0.0;
        }
        reach.set(reach.get().max(p[0]));
        0.1 * (p[0] / 20.0).powi(3)
    });
    let (least_squares, minimum_zone) = zone(&found, 0);
    let unit = 0.1 * (reach.get() / 20.0).powi(3);
    // The slope of least squares is 3/5 of the ends' (20 mm); some 60 texels stand for an integral, and for the
    // extremes between.
    near(least_squares / unit, 2.0 * (1.0 - 0.6 * (20.0 / reach.get()).powi(2)), 0.004);
    near(minimum_zone / unit, 0.5, 0.004);
}

/// A number from 0 to 1 by the place, with nothing in common between neighbours.
fn random(p: [f64; 3]) -> f64 {
    let seed = p.into_iter().fold(0, |bits: u64, x| bits.rotate_left(21) ^ x.to_bits());
    ChaCha8Rng::seed_from_u64(seed).random_range(0.0..1.0)
}

/// Single points far from their neighbours are no form; a bump is.
#[test]
fn stray_points_are_left_out_and_counted_and_a_bump_is_not() {
    let found = forms(|part, p| match part {
        // One in a hundred or so.
        1 if (p[0] * 917.13 + p[1] * 611.7 + p[2] * 331.9).sin() > 0.9995 => 3.0,
        1 => 0.1 * (3.0 * p[1].atan2(p[0])).cos(),
        0 if p[0].hypot(p[1]) < 4.0 => 0.5,
        _ => 0.0,
    });
    let side = found[1].as_ref().expect("a form");
    let zone = side.zone.as_ref().expect("a zone");
    near(zone.minimum_zone, 0.2, 2e-3);
    assert!(side.outlying > 20 && zone.unfiltered[1] > 1.0, "{side:?}");
    let plate = found[0].as_ref().and_then(|f| f.zone.as_ref()).expect("a zone");
    near(plate.minimum_zone, 0.5, 1e-3);
}

/// A dent that is narrower than the filter's cut-off is form as well, however far its points are from the filtered
/// surface: what of it is left behind the filter. A pit of three points is none.
#[test]
fn a_dent_that_is_narrower_than_the_cutoff_is_form() {
    let noise = |p: [f64; 3]| 0.02 * (random(p) - 0.5);
    let cap = |r: f64, radius: f64| -0.6 * (1.0 - (r / radius).powi(2)).max(0.0);
    let flatness = |radius: f64| {
        let deviations = deviations(|part, p| if part == 0 { cap(p[0].hypot(p[1]), radius) + noise(p) } else { 0.0 });
        let scan = ScanNoise { sd: 0.006, density: 6.25 };
        let found = form_deviations(&deviations, &recognise(&deviations.texels), scan, Some(5.0));
        let plate = found.into_iter().next().flatten().expect("a form");
        let zone = plate.zone.clone().expect("a zone");
        (zone.without_noise.corrected, plate.outlying)
    };
    let (dent, outlying) = flatness(1.5);
    // The filter's kernel is (2 - x) exp(-x) / c^2, for x = pi (r / c)^2 and c = 0.7309 cut-offs: -0.247 mm in the
    // middle, and 0.008 mm about it, less what cells of 0.6 mm blur.
    assert!((0.23..0.27).contains(&dent) && outlying < 20, "{dent} {outlying}");
    let (pit, outlying) = flatness(0.5);
    assert!(pit < 0.02 && outlying > 0, "{pit} {outlying}");
}

/// Perfect surfaces, a quarter of whose distances are a rounding off: none of these points is an outlier.
#[test]
fn rounding_is_no_outlier() {
    let rounded = |_: usize, p: [f64; 3]| if (p[0] * 917.13 + p[2] * 331.9).sin() > 0.7 { 3e-7 } else { 0.0 };
    let deviations = Deviations { precision: 1e-6, ..deviations(rounded) };
    let found = form_deviations(&deviations, &recognise(&deviations.texels), EXACT, Some(1.0));
    for part in 0..4 {
        let zone = found[part].as_ref().and_then(|f| f.zone.as_ref()).expect("a form");
        let form = found[part].as_ref().expect("a form");
        assert!(form.outlying == 0 && form.points > 1000 && zone.minimum_zone < 1e-6, "{part}: {form:?}");
    }
    // Those at the edges have no filtered values.
    assert!(found[1].as_ref().and_then(|f| f.roundness).is_some_and(|r| r.sections >= 22));
}

/// Against every choice of as many rows as there are unknowns and one more, the largest of whose errors is the answer.
#[test]
fn chebyshevs_approximation_agrees_with_all_references() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for round in 0..40 {
        let count = 1 + round % 3;
        let rows: Vec<Row> = (0..9)
            .map(|_| {
                let mut row = Row { value: rng.random_range(-1.0..1.0), ..Row::default() };
                row.factors[..count].fill_with(|| rng.random_range(-1.0..1.0));
                row
            })
            .collect();
        let largest = |x: &[f64]| {
            let error = |r: &Row| r.value - r.factors.iter().zip(x).map(|(f, x)| f * x).sum::<f64>();
            rows.iter().map(|r| error(r).abs()).fold(0.0, f64::max)
        };
        let found = largest(&chebyshev(&rows, count));
        // By random search from there no better one is found, at any scale.
        let mut best = chebyshev(&rows, count);
        for k in 0..20_000 {
            let reach = 0.3f64.powi(k % 12);
            let mut other = best;
            other[..count].iter_mut().for_each(|x| *x += rng.random_range(-reach..reach));
            if largest(&other) < largest(&best) {
                best = other;
            }
        }
        assert!(found <= largest(&best) * (1.0 + 1e-9), "{found} {}", largest(&best));
    }
    assert_eq!(chebyshev(&[], 3)[0], 0.0);
}

/// Lobes under noise that is four times as large as a filter of nine spacings leaves: what noise adds is taken away
/// again, and perfect parts have no form. Noise is that of points a millimetre apart, and linear between them.
#[test]
fn widths_are_those_without_noise() {
    use rand_distr::Distribution;
    let normal = rand_distr::Normal::new(0.0_f64, 0.2).unwrap();
    let found = |lobe: f64, seed: u64| {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let points: Vec<f64> = (0..400 * 64).map(|_| normal.sample(&mut random)).collect();
        // Of a net on a cylinder of 20 mm, 126 by 50 points.
        let noise = |p: [f64; 3]| {
            let (u, v) = ((p[1].atan2(p[0]) + 3.2) * 20.0, p[2] + 1.0);
            let at = |i: f64, j: f64| points[i as usize * 64 + j as usize];
            let (i, j) = (u.floor(), v.floor());
            let (s, t) = (u - i, v - j);
            let along = |j: f64| (1.0 - s) * at(i, j) + s * at(i + 1.0, j);
            (1.0 - t) * along(j) + t * along(j + 1.0)
        };
        let deviation = |part: usize, p: [f64; 3]| {
            if part == 1 { lobe * (3.0 * p[1].atan2(p[0])).cos() + noise(p) } else { 0.0 }
        };
        let deviations = deviations(deviation);
        let scan = ScanNoise { sd: 0.2, density: 1.0 };
        let forms = form_deviations(&deviations, &recognise(&deviations.texels), scan, None);
        forms[1].clone().expect("a form")
    };
    for (seed, lobe) in [(1, 0.0), (2, 0.0), (3, 0.25), (4, 0.25), (5, 1.0)] {
        let form = found(lobe, seed);
        let allowed = 0.1 * 2.0 * lobe + 0.2 / 3.0;
        let [zone, roundness] = ["cylindricity", "roundness"]
            .map(|name| form.characteristics().find(|c| c.name == name).expect("it has one").without_noise);
        for width in [zone, roundness] {
            near(width.corrected, 2.0 * lobe, allowed);
            assert!(width.noise_alone > 0.05 && width.noise_alone < 0.3, "{width:?}");
            assert!((width.corrected - 2.0 * lobe).abs() < 3.0 * width.uncertainty, "{lobe}: {width:?}");
        }
        let raw = form.zone.as_ref().expect("a zone").unfiltered[1];
        assert!(raw > 2.0 * lobe + 0.4, "{raw}");
    }
}

/// A band around the cylinder was not scanned: no section is there, and none of the values.
#[test]
fn a_part_in_two_pieces_has_a_form() {
    let gap = |part: usize, p: [f64; 3]| if part == 1 && (15.0..35.0).contains(&p[2]) { f64::NAN } else { 0.0 };
    let side = forms(gap)[1].clone().expect("a form");
    let sections = side.roundness.expect("sections").sections;
    assert!((11..=16).contains(&sections) && side.straightness.is_none(), "{side:?}");
}
