//! Eigenvalues and eigenvectors of small symmetric matrices, by Jacobi's rotations (Golub and Van Loan 2013, section
//! 8.5). They end always, and what they find is exact to rounding; decision 0042 says why nalgebra's are not used.

use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, Dim, OMatrix, OVector};

/// Eigenvalues in no particular order, and eigenvectors of unit length as columns in the same one.
#[derive(Clone, Debug)]
pub(crate) struct Eigen<D: Dim>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    pub(crate) eigenvalues: OVector<f64, D>,
    pub(crate) eigenvectors: OMatrix<f64, D, D>,
}

/// Sweeps over all pairs of axes. They converge quadratically: 6 to 10 are enough.
const SWEEPS: u32 = 40;

/// The eigenvalues and eigenvectors of a symmetric matrix. They are no numbers where its elements are none.
pub(crate) fn symmetric<D: Dim>(mut matrix: OMatrix<f64, D, D>) -> Eigen<D>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    let (rows, columns) = matrix.shape_generic();
    let n = matrix.nrows();
    let mut vectors = OMatrix::identity_generic(rows, columns);
    for _ in 0..SWEEPS {
        let mut rotated = false;
        for p in 0..n {
            for q in p + 1..n {
                let off = matrix[(p, q)];
                let size = (matrix[(p, p)] * matrix[(q, q)]).abs().sqrt();
                // Also relative to the two elements themselves, so that small eigenvalues keep their digits.
                if off == 0.0 || off.abs() <= f64::EPSILON * size {
                    continue;
                }
                rotated = true;
                let theta = (matrix[(q, q)] - matrix[(p, p)]) / (2.0 * off);
                let tangent = theta.signum() / (theta.abs() + theta.hypot(1.0));
                let cosine = tangent.hypot(1.0).recip();
                let sine = tangent * cosine;
                for k in 0..n {
                    let (a, b) = (matrix[(k, p)], matrix[(k, q)]);
                    (matrix[(k, p)], matrix[(k, q)]) = (cosine * a - sine * b, sine * a + cosine * b);
                }
                for k in 0..n {
                    let (a, b) = (matrix[(p, k)], matrix[(q, k)]);
                    (matrix[(p, k)], matrix[(q, k)]) = (cosine * a - sine * b, sine * a + cosine * b);
                    let (a, b) = (vectors[(k, p)], vectors[(k, q)]);
                    (vectors[(k, p)], vectors[(k, q)]) = (cosine * a - sine * b, sine * a + cosine * b);
                }
                (matrix[(p, q)], matrix[(q, p)]) = (0.0, 0.0);
            }
        }
        if !rotated {
            break;
        }
    }
    Eigen { eigenvalues: matrix.diagonal(), eigenvectors: vectors }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, Matrix3, Matrix4};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// The largest error of A V = V L and of V^T V = 1, relative to the largest element of A.
    fn error(a: &DMatrix<f64>) -> f64 {
        let Eigen { eigenvalues, eigenvectors: v } = symmetric(a.clone());
        let product = (a * &v - &v * DMatrix::from_diagonal(&eigenvalues)).amax() / a.amax().max(f64::MIN_POSITIVE);
        product.max((v.tr_mul(&v) - DMatrix::identity(a.nrows(), a.nrows())).amax())
    }

    #[test]
    fn matrices_are_put_together_again() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for n in 1..20 {
            for rank in 0..=n {
                let factor = DMatrix::from_fn(rank, n, |_, _| random.random_range(-1.0..1.0));
                let a = factor.tr_mul(&factor) * 10_f64.powi(random.random_range(-8..8));
                assert!(error(&a) < 1e-13, "{n} {rank}: {}", error(&a));
            }
        }
    }

    #[test]
    fn matrices_on_which_others_have_failed() {
        // The covariance of half of a pipe, and the matrix of nalgebra's issue 1109.
        let pipe = Matrix3::new(506.343, 0.349, -0.956, 0.349, 518.105, -3.595, -0.956, -3.595, 325.865);
        let swapped = Matrix4::new(
            -19884.07, -10.07188, 11.277279, -188560.63, -10.07188, 12.518197, 1.3770627, -102.97504, 11.277279,
            1.3770627, 14.587362, 113.26099, -188560.63, -102.97504, 113.26099, -1788112.3,
        );
        for a in
            [DMatrix::from_column_slice(3, 3, pipe.as_slice()), DMatrix::from_column_slice(4, 4, swapped.as_slice())]
        {
            assert!(error(&a) < 1e-13, "{}", error(&a));
        }
        assert!(symmetric(pipe).eigenvalues.iter().all(|e| *e > 325.0 && *e < 519.0));
        assert_eq!(error(&DMatrix::zeros(5, 5)), 0.0);
    }

    #[test]
    fn no_numbers_end_too() {
        let eigen = symmetric(Matrix3::from_element(f64::NAN));
        assert!(eigen.eigenvalues.iter().all(|e| e.is_nan()));
    }
}
