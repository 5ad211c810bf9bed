//! Inference: uncertainty, least surface.

use super::correspond::REACH_SIGMAS;

// --------------------------------------------------------------------------------------------------------- Uncertainty

/// Blocks in which residuals depend on each other: edges that are tried, each half of the last one, from half the
/// scan's radius of gyration on; the fewest that estimate a variance.
pub(crate) const BLOCK_EDGES: i32 = 8;
pub(crate) const FEWEST_BLOCKS: usize = 40;
/// Residuals depend on each other where the ratio of block sums, 1 of independent ones, is above the first number by so
/// many of its standard deviations.
pub(crate) const BLOCK_CLEAR: f64 = 1.15;
pub(crate) const BLOCK_SIGNIFICANT: f64 = 4.0;
/// Cap on the correction for dependence across the borders of blocks: beyond it the extrapolation is not reliable.
pub(crate) const BLOCK_CORRECTION: f64 = 1.5;
/// Positions of the grid over which block sums are averaged: together they act like a triangular kernel (Bartlett's).
pub(crate) const BLOCK_GRIDS: usize = 4;
/// Numbers that may be kept for the leverages of blocks: 256 MB. Where there are so many blocks, none has any leverage
/// to speak of (0024).
pub(crate) const BLOCK_ROOM: usize = 1 << 25;
/// Cap on the leverage h in 1 / (1 - h): a residual is corrected by at most the factor 10.
pub(crate) const LEVERAGE_CAP: f64 = 0.9;
/// Largest excess of another patch's distance over that of a point's own one for a correspondence switch (sigma): as
/// far as searches look.
pub(crate) const SWITCH_REACH: f64 = REACH_SIGMAS;
/// Cap on the part of the curvature that switches take away in any direction: the rest is too uncertain to be divided
/// by.
pub(crate) const SWITCH_CAP: f64 = 0.8;
/// How often the covariance is computed with the switches that it suggests.
pub(crate) const SWITCH_ROUNDS: usize = 3;
/// A fit has converged where the step that Newton's method would still take is below the first number of standard
/// deviations in every coordinate: there a confidence interval does not tell the place from the optimum. Exact scans
/// have no deviations: steps below the second number (radii) are rounding.
pub(crate) const SETTLED_STEP: f64 = 0.05;
pub(crate) const SETTLED_ROUNDING: f64 = 1e-8;
/// Where nothing leads any farther, a step below so many standard deviations is put into these, which widens them by
/// 6 % at most. Of 532 fits of a stranger's 21, all right, stopped at 0.15 to 0.35, where points change their patches.
pub(crate) const HELD_STEP: f64 = 0.35;
/// Of millions of points standard deviations are so small that the jumps where points change their patches exceed them:
/// a step up to one standard deviation is put into these as well where it moves the surface by less than this part of
/// the noise. A cup with a million points at a noise of 0.035 mm stopped at 0.67, 0.0002 mm from the optimum.
pub(crate) const HELD_NOISE: f64 = 0.003;
/// Of so many points every way on takes tens of seconds: such a step is put into the standard deviations at once.
pub(crate) const MANY_POINTS: usize = 1_000_000;
/// Where the gradient jumps from one correspondence switch to the next: the pairs of places over which it is averaged,
/// and how far away they are at most (standard deviations).
pub(crate) const AVERAGED_PAIRS: usize = 8;
pub(crate) const AVERAGED_REACH: f64 = 0.25;
/// Objectives are equal that differ, relatively, by less than this over the effective points: as chi-squared of one
/// degree of freedom, two standard deviations of a parameter.
pub(crate) const EQUAL_FITS: f64 = 4.0;
/// A motion whose standard deviation is so many times the least one of all motions leaves the surface where it is.
pub(crate) const SYMMETRIC: f64 = 1e3;
/// A motion leaves a part of the model where it is if the part moves along its normals by less than this share of the
/// motion (root mean square over its surface). A motion that the scan does not determine is known to some
/// `1 / SYMMETRIC`; flutes of a twentieth of a millimetre around a vessel of 40 mm move by two hundredths.
pub(crate) const STAYS: f64 = 0.01;
/// The last step of a fit that is resumed, as a part of the step of a converged one.
pub(crate) const RESUMED_STEP: f64 = 0.2;
/// Coordinates that the warning of a stall names at most.
pub(crate) const STALLED_NAMED: usize = 3;
/// A coordinate is determined by the scan's ends whose standard deviation would be so many times larger without them.
pub(crate) const BY_ENDS: f64 = 5.0;
/// The standard deviation of the place of a scan's border, in spacings: that of anything up to one inside of the
/// surface's, 1 / sqrt(12).
pub(crate) const BORDER: f64 = 0.289;
/// The scan shows a patch of whose points so many are not at its ends: of a tray's base that was not scanned, at which
/// the points of both of its walls end, one in twenty; of one that was scanned, nearly all.
pub(crate) const SHOWN_SHARE: f64 = 0.2;
/// A bound decides on a coordinate whose standard deviation would be so many times larger without it.
pub(crate) const BY_BOUNDS: f64 = 4.0;
/// So does it on one that would move by so many of its standard deviations, to the optimum or by the bias of noise: a
/// bound that is the object's holds back what noise moves, one to two of them.
pub(crate) const MOVED_BY_BOUNDS: f64 = 3.0;
/// Coordinates with a larger component in an undetermined direction are not determined.
pub(crate) const DETERMINED: f64 = 1e-3;
/// A released fit is another one than that near the held values where chance explains the difference of their mean
/// losses with a probability below this.
pub(crate) const SIGNIFICANT: f64 = 0.05;
/// A part is observed of whose points more than this share are near nothing else, however badly the rest fits (0023).
pub(crate) const UNEXPLAINED_SHARE: f64 = 0.1;
/// Gauss-Newton steps of a drawn scan, which begins beside its optimum, and how exact feet are then (sigma).
pub(crate) const BOOTSTRAP_ITERATIONS: u32 = 10;
pub(crate) const BOOTSTRAP_TOLERANCE: f64 = 1e-4;
/// Pairs of simulated noise for the bias that it has, and the most points on which it is simulated: two of 20,000
/// find the bias of ten columns' flutes (2.7 to 13 random standard deviations) to 0.05 of one, in a fiftieth of a
/// fit's time.
pub(crate) const BIAS_PAIRS: usize = 2;
pub(crate) const BIAS_POINTS: usize = 20_000;
/// The part of a standard deviation that is bias above which a warning says so: the bias is then twice the random part.
pub(crate) const BIASED: f64 = 0.9;

// -------------------------------------------------------------------------------------------- Agreement of several
// scans

/// The probability of such a difference between the shape of one scan and that of the others, divided by the number of
/// scans, below which it is said.
pub(crate) const OTHER_OBJECT: f64 = 1e-3;
/// A scan is fitted afresh, without the shape of all, where that leaves more than this share of its points unexplained:
/// noise leaves 0.003, edges and corners another 0.003.
pub(crate) const WORTH_A_SEARCH: f64 = 0.01;
/// What it finds counts where its mean loss is below so much of that of the shape which the fit of all leads to. Of
/// noise alone that loss is 0.08, and a hundredth of the points that are unexplained adds 0.01.
pub(crate) const BETTER_ALONE: f64 = 0.9;
/// A scan does not agree with the shape of all if that explains a share of its points which is smaller by this, and by
/// so many standard deviations, than that of a shape of its own.
pub(crate) const LEFT_BY_ALL: f64 = 0.015;
pub(crate) const LEFT_CLEAR: f64 = 4.0;
/// Parameters are named that differ by more than so many standard deviations of the difference.
pub(crate) const DIFFERENT: f64 = 3.0;
pub(crate) const DIFFERENCES_NAMED: usize = 4;
/// Parameters take part whose standard deviations move the surface by less than this share of the scan's radius.
pub(crate) const UNCERTAIN: f64 = 0.05;

// ------------------------------------------------------------------------------------------------------- Least surface

/// Points by which the scan protests against less surface.
pub(crate) const LEAST_POINTS: usize = 60_000;
/// Twice the logarithm of a likelihood ratio at which it does: a standard deviation.
pub(crate) const LEAST_PROTEST: f64 = 1.0;
/// The first step and the last one (radii), the relative gain of area below which a step is none, and the rounds.
pub(crate) const LEAST_FIRST_STEP: f64 = 0.1;
pub(crate) const LEAST_LAST_STEP: f64 = 1e-3;
pub(crate) const LEAST_AREA_GAIN: f64 = 1e-9;
pub(crate) const LEAST_ROUNDS: u32 = 6;
/// Mixtures of several directions that are tried in a round.
pub(crate) const LEAST_MIXTURES: u32 = 12;
/// Blocks of dependent residuals are looked at as a field from this edge on (radii of gyration): blocks that are
/// smaller are so many that their sums say it all.
pub(crate) const FIELD_BLOCKS: f64 = 0.12;
/// Points of which a field is found: factors of their covariance take 3 ms, and a scan's faces have a hundred each.
pub(crate) const FIELD_POINTS: usize = 500;
/// Samples of so many points over which likelihoods are averaged: one of them is off by 1 and more.
pub(crate) const FIELD_SAMPLES: usize = 3;
/// Lengths of a field that are tried: from this many spacings of the points on, each so many times the last one.
pub(crate) const FIELD_STEP: f64 = 1.5;
/// Shares of a field in the variance that are tried.
pub(crate) const FIELD_SHARES: [f64; 8] = [0.02, 0.06, 0.15, 0.3, 0.5, 0.7, 0.85, 0.97];
/// A field is as probable as independent residuals if its likelihood is so much larger (logarithm; a chi-squared of
/// three degrees of freedom, L, q and the kernel, is above twice this in one case of 2,500).
pub(crate) const FIELD_CLEAR: f64 = 9.0;
/// What a field does is said where it raises a standard deviation by so much.
pub(crate) const FIELD_TOLD: f64 = 1.5;
