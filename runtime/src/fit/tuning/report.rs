//! Warnings.

/// A model explains a scan of which at least this share is near it.
pub(crate) const EXPLAINED: f64 = 0.5;
/// A pattern of residuals above this many radii is not that of an object of the model's family with small faults.
pub(crate) const FOREIGN_RADIUS: f64 = 0.015;
/// Residuals have a pattern where neighbours' correlation is above the first number, and so many standard deviations of
/// that of independent ones. A box that is sheared by 5 % has 0.4, fits of the right model have 0.03 at most.
pub(crate) const CORRELATED: f64 = 0.2;
pub(crate) const CORRELATION_CLEAR: f64 = 5.0;
/// Cells (radii) of the walk in which neighbours are found, and the least pattern (radii) that is worth a warning: what
/// is smaller is that of facets and of rounding.
pub(crate) const WALK_STEP: f64 = 1e-3;
pub(crate) const LEAST_PATTERN: f64 = 1e-3;
/// Grids in which one residual of every cell counts, where a part of the object has few points: their cells are so many
/// times doubled. The coarsest are 0.13 radii: what is smaller than the spacing there is no pattern of the scan's.
pub(crate) const THINNED: [u32; 4] = [4, 5, 6, 7];
/// The residuals of a patch have a tail on one side where the difference of their mean and their median is above the
/// first number (standard deviations), and so many times what it is by chance. With a tenth of the points under 0.1 mm
/// of dust, of which they have 0.03 mm of noise, it is 0.12.
pub(crate) const LOPSIDED: f64 = 0.1;
pub(crate) const LOPSIDED_CLEAR: f64 = 5.0;
/// The fewest points of which this is said, and how many patches are named.
pub(crate) const LOPSIDED_POINTS: usize = 400;
pub(crate) const LOPSIDED_NAMED: usize = 3;
/// Correlations beyond this are worth a warning.
pub(crate) const INSEPARABLE: f64 = 0.999;
/// Coordinates of an undetermined direction are named that have this part of its largest one.
pub(crate) const NAMED: f64 = 0.05;
/// A length is hardly determined whose standard deviation is above this part of the radius or of its value, and a part
/// with fewer points hardly shown.
pub(crate) const HARDLY_DETERMINED: f64 = 0.1;
pub(crate) const HARDLY_ANY_POINTS: f64 = 10.0;
