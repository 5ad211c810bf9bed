//! Rotations.

use gml_runtime::scan::Scan;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// By rows.
pub(crate) type Matrix = [[f64; 3]; 3];

/// The scan turned evenly at random and shifted.
pub(crate) fn turn(scan: &Scan, random: &mut ChaCha8Rng) -> Scan {
    let mut scan = scan.clone();
    // Half of a turn's angles are not as likely as others: the density goes with the squared sine of half the angle.
    let angle = loop {
        let angle: f64 = random.random_range(0.0..std::f64::consts::TAU);
        if random.random::<f64>() < (angle / 2.0).sin().powi(2) {
            break angle;
        }
    };
    let rotation = about(unit(random), angle);
    let shift = [0; 3].map(|_| random.random_range(-300.0..300.0));
    for p in &mut scan.mesh.positions {
        let q = apply(&rotation, *p);
        *p = [q[0] + shift[0], q[1] + shift[1], q[2] + shift[2]];
    }
    for n in &mut scan.mesh.normals {
        *n = apply(&rotation, *n);
    }
    scan
}

/// A direction.
pub(crate) fn unit(random: &mut ChaCha8Rng) -> [f64; 3] {
    loop {
        let v = [0; 3].map(|_| random.random_range(-1.0..1.0));
        let length = v.iter().map(|c: &f64| c * c).sum::<f64>().sqrt();
        if length > 0.1 && length < 1.0 {
            return v.map(|c| c / length);
        }
    }
}

/// The rotation about a unit axis (Rodrigues).
pub(crate) fn about([x, y, z]: [f64; 3], angle: f64) -> Matrix {
    let (s, c) = angle.sin_cos();
    let t = 1.0 - c;
    [
        [c + t * x * x, t * x * y - s * z, t * x * z + s * y],
        [t * x * y + s * z, c + t * y * y, t * y * z - s * x],
        [t * x * z - s * y, t * y * z + s * x, c + t * z * z],
    ]
}

/// About x, then y, then z.
pub(crate) fn euler(alpha: f64, beta: f64, gamma: f64) -> Matrix {
    let turn = |axis, angle| about(axis, angle);
    multiply(&turn([0.0, 0.0, 1.0], gamma), &multiply(&turn([0.0, 1.0, 0.0], beta), &turn([1.0, 0.0, 0.0], alpha)))
}

/// The product.
pub(crate) fn multiply(a: &Matrix, b: &Matrix) -> Matrix {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

/// The image of a vector.
pub(crate) fn apply(m: &Matrix, p: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| (0..3).map(|k| m[i][k] * p[k]).sum())
}
