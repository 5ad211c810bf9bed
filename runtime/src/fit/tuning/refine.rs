//! Refinement: annealing and the final scale, several scans, pose parameters, second searches.

use super::FINE;

// ------------------------------------------------------------------------------------------------- From coarse to fine

/// Feet of points are exact to this (sigma) in the registration and in the annealing, and at the final scale.
pub(crate) const ROUGH_TOLERANCE: f64 = 1e-3;
pub(crate) const FOOT_TOLERANCE: f64 = 1e-5;
/// Annealing: points, the first scale (radii), levels at most, Gauss-Newton steps at a level, and the last step
/// (sigma).
pub(crate) const ANNEALING_POINTS: usize = 2000;
pub(crate) const ANNEALING_START: f64 = 0.05;
pub(crate) const ANNEALING_LEVELS: usize = 6;
pub(crate) const ANNEALING_ITERATIONS: u32 = 12;
pub(crate) const ANNEALING_STEP: f64 = 1e-3;
/// A part with fewer points than this among those of the annealing gets up to as many more, from a search of so many.
/// Of a pan's scan 27 of 14,265 points lie in the hole of the handle, 4 of 2,000: from there its radius of 6 mm went to
/// its bound of 3 mm, although the objective over all points is 0.8 % larger there.
pub(crate) const SMALL_PART_POINTS: usize = 20;
pub(crate) const SMALL_PART_SEARCHED: usize = 50_000;
/// The largest distance (radii) of an inlier that noise alone makes: beyond it whole parts are inliers or outliers.
pub(crate) const WIDEST_NOISE: f64 = 0.2;
/// A scale is final if the next one is larger than this part of it; no level goes down farther than by the second
/// factor.
pub(crate) const SCALE_SETTLED: f64 = 0.9;
pub(crate) const SCALE_FASTEST: f64 = 0.35;
/// The least spread of residuals (radii): that of scans without any noise.
pub(crate) const LEAST_SPREAD: f64 = 1e-6;
/// At the final scale: Gauss-Newton steps, and the last step (sigma): single points that change patches move the
/// optimum by as much (0017).
pub(crate) const POLISH_ITERATIONS: u32 = 30;
pub(crate) const POLISH_STEP: f64 = 2e-4;
/// Exactness of feet and the last step (radii) of least squares, which is for those who want every digit.
pub(crate) const SQUARED_TOLERANCE: f64 = 1e-12;
pub(crate) const SQUARED_STEP: f64 = 1e-11;

// ---------------------------------------------------------------------------------------------------- Several scans

/// Scales (radii of each scan) by which a scan that has just been placed, and the shape, come to rest with the others:
/// those of the last rungs of the registration. What only the new scan shows may be off by as much as its first scale.
pub(crate) const JOINT_SCALES: [f64; 4] = [0.2, 0.14, 0.1, FINE];
/// A place in which less of the model stands where the new scan shows empty space counts if the mean loss is no larger
/// by this factor: of a body of revolution with one handle, the back alone does not say where the handle is, but where
/// it is not.
pub(crate) const PLACED_AS_WELL: f64 = 1.05;
/// Scans from which the registration of all is begun in turn, while some scan is not explained.
pub(crate) const LEADERS: usize = 3;
/// Searches of each of these for its shape, which begin elsewhere: of a block with a post of which a scan shows seven
/// eighths, the first search finds another block as often as not.
pub(crate) const SEARCHES: u64 = 2;

// ----------------------------------------------------------------------------------------------------- Pose parameters

/// The motion is written into pose parameters in turns of so many radians, in so many steps at least, with so many
/// Gauss-Newton steps after each and after the last one.
pub(crate) const POSE_TURN: f64 = 0.1;
pub(crate) const POSE_STEPS: f64 = 4.0;
pub(crate) const POSE_ROUNDS: u32 = 3;
pub(crate) const POSE_LAST_ROUNDS: u32 = 30;
/// The distance (radii) up to which they reproduce it.
pub(crate) const WRITTEN_BACK: f64 = 1e-6;

// ------------------------------------------------------------------------------------------------------- Second search

/// Where the scan contradicts less of a second search's solution, its mean loss may even be this many times the first
/// one's.
pub(crate) const SECOND_AS_WELL: f64 = 1.02;
/// The ratio of the mean losses of another search's solution and of the present one below which the other one counts if
/// no more of it is contradicted: a hole in the wrong corner of a plate is 1 to 3 % of the loss, of 6000 points 1 % are
/// a likelihood ratio of exp(30).
pub(crate) const SECOND_BETTER: f64 = 0.99;
/// Coordinates at bounds from which on a second search is made. Half of a bracket with its legs exchanged had four of
/// six in its holes at bounds, and explained 98.9 % of the points.
pub(crate) const SQUEEZED: usize = 3;
/// Searches after the first one: of four amphoras whose foot it had put 60 mm too deep, one found three, and two all.
pub(crate) const SECOND_ROUNDS: usize = 2;
/// The most of the scan's area in pieces that are not explained at which a second search is made (the least is
/// `UNEXPLAINED`): beyond it the scan shows much else, of which a second search would find no more.
pub(crate) const MOST_LEFT_OVER: f64 = 0.25;
