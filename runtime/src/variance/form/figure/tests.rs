//! Figures of noisy points of known surfaces, and their stated uncertainties against the scatter over seeds.

use super::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const NOISE: f64 = 0.1;
const ROUNDS: u64 = 60;

/// Points of a surface, moved along their normals by noise. `place` gives point and normal from two numbers in 0..1.
fn points(random: &mut ChaCha8Rng, noise: f64, place: impl Fn(f64, f64) -> (DVec3, DVec3)) -> Vec<DVec3> {
    let mut point = || {
        let (u, v) = (random.random_range(0.0..1.0), random.random_range(0.0..1.0));
        let (point, normal) = place(u, v);
        let off: f64 = StandardNormal.sample(random);
        point + noise * off * normal
    };
    (0..600).map(|_| point()).collect()
}

/// A plate of 30 mm by 20 mm at a height, tilted about x.
fn plate(height: f64, tilt: f64) -> impl Fn(f64, f64) -> (DVec3, DVec3) {
    let (sin, cos) = tilt.sin_cos();
    move |u, v| {
        let (x, y) = (30.0 * u - 15.0, 20.0 * v - 10.0);
        (DVec3::new(x, y * cos, height + y * sin), DVec3::new(0.0, -sin, cos))
    }
}

/// Three quarters of a cylinder of 12 mm radius and 25 mm height, whose axis is parallel to z.
fn cylinder(middle: f64) -> impl Fn(f64, f64) -> (DVec3, DVec3) {
    move |u, v| {
        let (sin, cos) = (1.5 * PI * u).sin_cos();
        (DVec3::new(middle + 12.0 * cos, 12.0 * sin, 25.0 * v), DVec3::new(cos, sin, 0.0))
    }
}

fn ball(middle: DVec3) -> impl Fn(f64, f64) -> (DVec3, DVec3) {
    move |u, v| {
        let z = 1.4 * v - 0.4;
        let (sin, cos) = (2.0 * PI * u).sin_cos();
        let normal = DVec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
        (middle + 9.0 * normal, normal)
    }
}

fn cone(u: f64, v: f64) -> (DVec3, DVec3) {
    let (sin, cos) = (2.0 * PI * u).sin_cos();
    let angle = 20f64.to_radians();
    let z = 30.0 * v;
    let radius = 5.0 + z * angle.tan();
    (DVec3::new(radius * cos, radius * sin, z), DVec3::new(cos * angle.cos(), sin * angle.cos(), -angle.sin()))
}

type Surface<'s> = (&'s dyn Fn(f64, f64) -> (DVec3, DVec3), Datum);

/// The mean and the scatter of a figure over seeds, and the mean of its stated standard uncertainty.
fn over_seeds(surfaces: &[Surface<'_>], unit: &str, truth: f64) -> (f64, f64, f64) {
    let found: Vec<Figure> = (0..ROUNDS)
        .map(|seed| {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let of = |random: &mut ChaCha8Rng, (place, datum): &Surface<'_>| {
                let (measured, exact) = (points(random, NOISE, place), points(random, 0.0, place));
                Associated::new(&measured, &exact, *datum).expect("enough points")
            };
            let parts: Vec<Associated> = surfaces.iter().map(|surface| of(&mut random, surface)).collect();
            figure(&parts, unit, truth).unwrap_or_else(|e| panic!("{e}"))
        })
        .collect();
    let mean = found.iter().map(|f| f.measured).sum::<f64>() / ROUNDS as f64;
    let scatter = (found.iter().map(|f| (f.measured - mean).powi(2)).sum::<f64>() / (ROUNDS - 1) as f64).sqrt();
    let stated = (found.iter().map(|f| f.variance).sum::<f64>() / ROUNDS as f64).sqrt();
    assert!(found.iter().all(|f| (f.model - truth).abs() < 1e-6), "the model's own figure");
    (mean, scatter, stated)
}

#[test]
fn uncertainties_are_the_scatter_over_seeds() {
    let (low, high, tilted) = (plate(0.0, 0.0), plate(14.0, 0.0), plate(14.0, 0.3));
    let (one, other) = (cylinder(0.0), cylinder(40.0));
    let (near, far) = (ball(DVec3::ZERO), ball(DVec3::new(20.0, 15.0, 0.0)));
    let flat = |height: f64| Datum::plane(DVec3::new(0.0, 0.0, height), DVec3::Z);
    let leaning = Datum::plane(DVec3::new(0.0, 0.0, 14.0), DVec3::new(0.0, -0.3f64.sin(), 0.3f64.cos()));
    let about = |x: f64| Datum::about(DVec3::new(x, 0.0, 5.0), DVec3::Z, 0.0, 12.0, false);
    let round = |middle: DVec3| Datum::sphere(middle, 9.0);
    let conical = Datum::about(DVec3::ZERO, DVec3::Z, 20f64.to_radians(), 5.0, true);
    let cases: [(&str, Vec<Surface<'_>>, &str, f64); 8] = [
        ("diameter of a cylinder", vec![(&one, about(0.0))], "mm", 24.0),
        ("radius of a sphere", vec![(&near, round(DVec3::ZERO))], "mm", 9.0),
        ("distance of planes", vec![(&low, flat(0.0)), (&high, flat(14.0))], "mm", 14.0),
        ("distance of axes", vec![(&one, about(0.0)), (&other, about(40.0))], "mm", 40.0),
        (
            "distance of spheres",
            vec![(&near, round(DVec3::ZERO)), (&far, round(DVec3::new(20.0, 15.0, 0.0)))],
            "mm",
            25.0,
        ),
        ("angle of planes", vec![(&low, flat(0.0)), (&tilted, leaning)], "rad", 0.3),
        ("angle of a plane and an axis", vec![(&tilted, leaning), (&one, about(0.0))], "rad", FRAC_PI_2 - 0.3),
        ("opening angle", vec![(&cone, conical)], "rad", 40f64.to_radians()),
    ];
    for (name, surfaces, unit, truth) in cases {
        let (mean, scatter, stated) = over_seeds(&surfaces, unit, truth);
        println!("{name}: {mean:.5} of {truth:.5}, scatter {scatter:.5}, stated {stated:.5}");
        // 60 rounds know a scatter to 9 %, and a mean to 13 % of it.
        assert!((stated / scatter - 1.0).abs() < 0.3, "{name}: {stated} is stated, {scatter} is found");
        assert!((mean - truth).abs() < 0.5 * scatter, "{name}: {mean}, not {truth}");
    }
}

#[test]
fn what_is_no_figure_of_the_parts_is_said() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut part = |place: &dyn Fn(f64, f64) -> (DVec3, DVec3), datum| {
        let (measured, exact) = (points(&mut random, NOISE, place), points(&mut random, 0.0, place));
        Associated::new(&measured, &exact, datum).expect("enough points")
    };
    let flat = part(&plate(0.0, 0.0), Datum::plane(DVec3::ZERO, DVec3::Z));
    let tube = part(&cylinder(0.0), Datum::about(DVec3::ZERO, DVec3::Z, 0.0, 12.0, false));
    let refused = |parts: &[Associated], unit: &str, value: f64| figure(parts, unit, value).err().expect("a reason");
    let several = [tube];
    assert_eq!(refused(&several, "mm", 30.0), "the diameter in the model is another: 24.0000 mm");
    assert_eq!(refused(&several, "rad", 0.1), "parts of this form have no figure of this kind");
    assert_eq!(refused(&[flat], "mm", 24.0), "parts of this form have no figure of this kind");
    assert!(Associated::new(&[DVec3::ZERO; 10], &[], Datum::sphere(DVec3::ZERO, 1.0)).is_none());
}

/// Points far from a surface are no part of it.
#[test]
fn outliers_are_left_out() {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let place = cylinder(0.0);
    let (mut measured, exact) = (points(&mut random, NOISE, &place), points(&mut random, 0.0, &place));
    measured.iter_mut().take(20).for_each(|p| *p += DVec3::new(3.0, 0.0, 0.0));
    let datum = Datum::about(DVec3::ZERO, DVec3::Z, 0.0, 12.0, false);
    let part = Associated::new(&measured, &exact, datum).expect("enough points");
    let Ok(found) = figure(&[part], "mm", 24.0) else { panic!("it has a diameter") };
    assert!((found.measured - 24.0).abs() < 4.0 * found.variance.sqrt() && found.variance.sqrt() < 0.02);
}
