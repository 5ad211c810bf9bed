//! The constants that decide how a fit goes about its work: how much is tried, when something is good enough, and what
//! is accepted. Lengths are in radii of gyration of the scan ("radii") or in sigma, the scale of the loss. Numbers of
//! points are those of samples, even in space where nothing else is said. docs/decisions/0029-tuning-constants.md says
//! what became of fits with half and with twice of each. Bounds on rounding errors stand beside the code that they
//! guard.

// -------------------------------------------------------------------------------------------------------------- Start

/// Common start values of equal parameters: how often all are moved into bounds that depend on each other, and from
/// how many other places.
pub(crate) const ROOM_SWEEPS: usize = 100;
pub(crate) const ROOM_SAMPLES: u32 = 400;

// ---------------------------------------------------------------------------------------------------------- Screening

/// A rung of the screening: every candidate is optimised over all coordinates, from a coarse scale of the loss to a
/// finer one (graduated non-convexity).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rung<'s> {
    /// Distinct candidates that are taken over from the rung before.
    pub(crate) candidates: usize,
    /// Points.
    pub(crate) points: usize,
    /// Scales of the loss in turn. Radii.
    pub(crate) scales: &'s [f64],
    /// Whether points belong to the side of a wall that their normals say. Above about 0.15 radii walls are thinner
    /// than the scale and the sides are still to be learnt.
    pub(crate) sided: bool,
}

/// The last scale of the screening: half of it finds one near start in forty more and takes half as long again (0017).
pub(crate) const FINE: f64 = 0.07;
/// From orientations to one candidate: few points for many candidates, many for few.
pub(crate) const GLOBAL_RUNGS: [Rung; 4] = [
    Rung { candidates: 20, points: 350, scales: &[0.3], sided: false },
    Rung { candidates: 12, points: 500, scales: &[0.2], sided: false },
    Rung { candidates: 5, points: 1000, scales: &[0.14, 0.1], sided: true },
    Rung { candidates: 3, points: 1500, scales: &[FINE], sided: true },
];
/// From a near start.
pub(crate) const NEAR_RUNGS: [Rung; 2] = [
    Rung { candidates: 1, points: 500, scales: &[0.3, 0.2], sided: false },
    Rung { candidates: 1, points: 1000, scales: &[0.14, 0.1, FINE], sided: true },
];
/// Gauss-Newton steps at a scale, and the step (sigma) that is the last one.
pub(crate) const RUNG_ITERATIONS: u32 = 8;
pub(crate) const RUNG_STEP: f64 = 0.03;
/// Points and scale (radii) by which the sides of patches are learnt: of small patches there are few points on a rung.
pub(crate) const SIDES_POINTS: usize = 2000;
pub(crate) const SIDES_SCALE: f64 = 0.2;
/// Candidates that are restarted at the end.
pub(crate) const RESTARTED: usize = 2;
/// Points by which candidates are compared at the end.
pub(crate) const COMPARED: usize = 1500;
/// Candidates are the same whose parameters move the surface apart by less, in radii, ...
pub(crate) const SAME_PARAMETERS: f64 = 0.05;
/// ... and whose parts have means that differ by less than this many radii, and covariances by less than this many
/// squared.
pub(crate) const SAME_MOMENTS: f64 = 0.1;
/// Samples each way of a patch for its moments. Around a circle they do not depend on where samples begin if there are
/// more than two.
pub(crate) const MOMENT_SAMPLES: usize = 6;

/// The share of points near a start, below which scales are doubled until they reach it, or the widest one (radii).
pub(crate) const CAPTURED: f64 = 0.5;
pub(crate) const WIDEST: f64 = 20.0;
/// Inlier ratio at the scale `FINE` below which a near start is given up for all orientations before its parts are
/// looked at (0024), ...
pub(crate) const HOPELESS: f64 = 0.5;
/// ... and above which no orientations are screened: a wrong pose does not have it (0017).
pub(crate) const CONVINCING: f64 = 0.9;
/// The objective of another pose must be this part of the near start's to be preferred, and that of a second search's
/// solution this part of the first one's.
pub(crate) const CLEARLY_BETTER: f64 = 0.9;
/// Where the scan contradicts less of the second one, its objective may even be this many times the first one's.
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
/// A scan that is larger or smaller than the model at its start by more was hardly read in its unit: 25.4 of inches is
/// the least.
pub(crate) const ANOTHER_UNIT: f64 = 15.0;

// ------------------------------------------------------------------------------------------------------- Orientations

/// Rotations that are tried with every shape: 120 leave no rotation farther than 50 degrees from one of them.
pub(crate) const ORIENTATIONS: usize = 200;
/// Those of them that are aligned with more points, best first, and distinct candidates that a shape has in the end.
pub(crate) const ALIGNED_AGAIN: usize = 80;
pub(crate) const PER_SHAPE: usize = 12;
/// The distance of a part's middle from the object's, in the object's radii of gyration: half of a cylinder's wall has
/// it at 0.5 to 0.6.
pub(crate) const BESIDE: f64 = 0.5;
/// Points of the two alignments: few tell the hopeless orientations (0017).
pub(crate) const ALIGNMENT_FEW: usize = 90;
pub(crate) const ALIGNMENT_POINTS: usize = 350;
/// Scale of their loss (radii), Gauss-Newton steps, the relative gain of the last one, and the factor on the diagonal.
pub(crate) const ALIGNMENT_SCALE: f64 = 0.35;
pub(crate) const ALIGNMENT_STEPS: u32 = 8;
pub(crate) const FIELD_GAIN: f64 = 1e-4;
pub(crate) const FIELD_DAMPING: f64 = 1.01;
/// Voxels along the longest side of the distance field, and its margin about the model (radii).
pub(crate) const VOXELS: f64 = 22.0;
pub(crate) const FIELD_MARGIN: f64 = 0.5;

// --------------------------------------------------------------------------------------------------- Shape proposals

/// Shapes beside the start's and the default's that are tried in all orientations: of twelve cups far from the script's
/// defaults three were not found without them (0029).
pub(crate) const PROPOSALS: usize = 4;
/// Shapes that are drawn. Mutating the best of them in rounds found no more (0029).
pub(crate) const PROPOSAL_DRAWS: usize = 512;
/// Least difference of two proposals in some parameter, as a fraction of its range.
pub(crate) const PROPOSALS_APART: f64 = 0.12;
/// Points of a shape, of pairs of which distances are taken; bins of the distribution of distances, and what they span
/// (radii: no two points of a scan are likely to be farther apart).
pub(crate) const D2_POINTS: usize = 120;
pub(crate) const D2_BINS: usize = 24;
pub(crate) const D2_SPAN: f64 = 5.0;
/// Samples each way of a patch, between which those points are drawn.
pub(crate) const D2_GRID: usize = 11;

// ---------------------------------------------------------------------------------- Restarts of groups of parameters

/// An effort by the number of a group's parameters.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PerMember {
    /// For each of them.
    pub(crate) each: usize,
    /// In all, at most.
    pub(crate) most: usize,
}

/// The mean loss of a group's own points over that of the others, below which the group needs no restart at the final
/// scale ...
pub(crate) const ACCEPTED: f64 = 1.1;
/// ... and at a coarser one, where half of the near starts took the next local minimum for the right one with the
/// former (0024).
pub(crate) const CLEAR: f64 = 0.5;
/// Rounds over all groups.
pub(crate) const RESTART_ROUNDS: usize = 3;
/// Another round follows where the objective has become smaller by this part.
pub(crate) const WORTH_ANOTHER_ROUND: f64 = 0.01;
/// Objectives that differ by less, relatively, are equal: samples of the same surface are not the same.
pub(crate) const EQUAL_VALUES: f64 = 0.002;
/// Values that are drawn over the bounds; half as many again are drawn about the start's, over this part of the bounds.
pub(crate) const VARIANTS: PerMember = PerMember { each: 12, most: 48 };
pub(crate) const AROUND_START: f64 = 0.4;
/// Angles about the axis of symmetry of the other parts.
pub(crate) const ANGLES: u32 = 16;
/// A group without so many points that no other part explains is left alone; those on which it is optimised alone, and
/// those by which starts are ranked.
pub(crate) const LEAST_UNEXPLAINED: usize = 8;
pub(crate) const UNEXPLAINED_POINTS: usize = 200;
pub(crate) const RANKED_POINTS: usize = 80;
/// Starts from which the group is optimised alone, and how many at a time: after each batch the best is judged (0024).
pub(crate) const ALONE: PerMember = PerMember { each: 4, most: 20 };
pub(crate) const BATCH: usize = 8;
/// The best of a batch that are optimised with everything else.
pub(crate) const JOINT: usize = 2;
/// Points of that, and for groups with so few parameters: their parts may have hardly any points (0017).
pub(crate) const JOINT_POINTS: usize = 800;
pub(crate) const SMALL_GROUP: usize = 2;
pub(crate) const SMALL_GROUP_POINTS: usize = 3000;
/// Starts are the same whose values move the surface by less (radii), whose motions do, or whose angles (radians)
/// differ by less.
pub(crate) const SAME_START: f64 = 0.1;
/// Those of small groups are whose values move it by less than this many scales of the loss (0024).
pub(crate) const SMALL_GROUP_STARTS: f64 = 3.0;
/// The scales at which a group is optimised alone: a coarse one (radii), then this part of the final one.
pub(crate) const ALONE_COARSE: f64 = 0.1;
pub(crate) const ALONE_FINE: f64 = 0.8;
/// Gauss-Newton steps of a group alone and with everything else, and the steps (radii) that are the last ones.
pub(crate) const ALONE_ITERATIONS: u32 = 10;
pub(crate) const ALONE_STEP: f64 = 1e-3;
pub(crate) const JOINT_ITERATIONS: u32 = 12;
pub(crate) const JOINT_STEP: f64 = 5e-4;
/// Chord error (radii) of a group's facets, while it is alone.
pub(crate) const PART_CHORD: f64 = 0.005;
/// Points of the other parts that decide whether they have an axis of symmetry, the eigenvalue of a motion that leaves
/// their surface where it is, and the part of it that is a rotation.
pub(crate) const AXIS_POINTS: u32 = 20;
pub(crate) const AXIS_EIGENVALUE: f64 = 1e-3;
pub(crate) const AXIS_TURN: f64 = 0.3;
/// What the area of a group's parts counts against the mean loss, as a part of the whole model's: less than a tenth
/// of the loss of so many points that nothing explains, so that no scanned surface is given up, and ten times what
/// a handle of a cup gained by its other intersection with the wall's surface (0.0002 for a thirtieth of the
/// model's area).
pub(crate) const AREA_WEIGHT: f64 = 0.1;
/// Exchanges of parameters that are tried, and the factor on the objective within which a surface is the same but for
/// where it is sampled.
pub(crate) const EXCHANGES: usize = 128;
pub(crate) const SAME_SURFACE: f64 = 1.01;

// --------------------------------------------------------------------------------------------------------------- Loss

/// Distances beyond so many sigma are not computed where the loss is bounded, and their loss is 1 (\[VA\] eq. 4):
/// Welsch's there is 1 - 4.8e-6.
pub(crate) const CUTOFF_SIGMAS: f64 = 3.5;
/// The distance up to which points are inliers (d + eps in \[VA\] sect. 3), in robust standard deviations of the
/// residuals. At 3 the estimator is 97 % as efficient as least squares on Gaussian residuals.
pub(crate) const INLIER_DEVIATIONS: f64 = 3.0;

// ------------------------------------------------------------------------------------------------- Points and facets

/// Points are flat in a direction in which their standard deviation is below so many of the noise: that of points in a
/// plane is the noise itself, which is estimated to some 20 % from few points.
pub(crate) const FLAT_NOISE: f64 = 1.5;
/// The fewest points that are fitted: three do not determine a surface.
pub(crate) const FEWEST_POINTS: usize = 4;
/// Points are sorted by cells of a grid with so many along its longest edge, so that neighbours are near in memory.
pub(crate) const WALK_CELLS: f64 = 64.0;
/// A sample even in space has one point a cell: the most cells along an edge, rounds in which their number is sought,
/// the factor by which a sample may be too small, and the factor on the number of points that a round aims at.
pub(crate) const MOST_SAMPLE_CELLS: f64 = 4096.0;
pub(crate) const SAMPLE_ROUNDS: usize = 14;
pub(crate) const SAMPLE_ENOUGH: f64 = 1.05;
pub(crate) const SAMPLE_AIM: f64 = 0.975;
/// Cells of which most hold one point only: that share of all points, and the ratio that is taken for theirs.
pub(crate) const SAMPLE_SPARSE: f64 = 0.9;
pub(crate) const SAMPLE_COARSER: f64 = 0.5;
/// Points of a chunk, the unit of parallel work and of the order of sums. Few points make the second number of chunks
/// all the same, as long as a chunk has the third number of points.
pub(crate) const CHUNK_POINTS: usize = 512;
pub(crate) const FEW_CHUNKS: usize = 16;
pub(crate) const LEAST_CHUNK: usize = 96;
/// Chunks whose rows of the Jacobian are computed at a time: memory does not grow with the scan.
pub(crate) const CHUNKS_AT_ONCE: usize = 64;
/// Rows of more points are computed anew in each pass: those of so many take 160 MB of a model with a hundred
/// parameters.
pub(crate) const KEPT_ROWS: usize = 200_000;
/// Points of a scan of which the registration takes its samples; the refinement has as many, as dense as the scan,
/// before it has all (0017).
pub(crate) const THIN_POINTS: usize = 6000;
/// Cells of a sample with less than this share of the median number of points count as empty (0023).
pub(crate) const EMPTY_CELL: f64 = 0.05;
/// Passes of the statistical removal of outliers, the points of a cloud that it looks at, and the share that a cloud
/// without clutter keeps; a cluttered one is sampled by density (0023).
pub(crate) const OUTLIER_PASSES: usize = 2;
pub(crate) const OUTLIER_POINTS: usize = 30_000;
pub(crate) const CLEAN_CLOUD: f64 = 0.95;
/// Points whose distance to the next one is looked at for the spacing of all.
pub(crate) const SPACING_POINTS: usize = 2000;
/// Chord error (radii) of the facets on which the refinement and everything after it work, and of those of the
/// registration. Facets are for the search only; feet lie on the exact surface.
pub(crate) const CHORD: f64 = 0.002;
pub(crate) const START_CHORD: f64 = 0.01;
/// Size of a model (radii), and how many cells of facets it has at least, so that boxes stay small.
pub(crate) const MODEL_SIZE: f64 = 2.0;
pub(crate) const CELLS_OF_SIZE: f64 = 10.0;
/// Cells each way of the grid on which a patch's curvature is measured, and the most that it is divided into.
pub(crate) const CURVATURE_CELLS: usize = 12;
pub(crate) const MOST_CELLS: f64 = 48.0;
/// Between breaks: cells of the grid of curvature in a stretch at least, and the most stretches each way that have
/// cells of their own, even if only one each.
pub(crate) const LEAST_CURVATURE_CELLS: usize = 3;
pub(crate) const MOST_STRETCHES: usize = 400;
/// Samples each way of a patch for the velocities by which rigid parameters are recognised and coordinates scaled.
pub(crate) const VELOCITY_SAMPLES: usize = 5;
/// A field of velocities is rigid up to this part of its size: far above rounding, far below any true deformation.
pub(crate) const RIGID: f64 = 1e-8;
/// Places beside the start at which it must be: steps of all parameters in this part of their bounds, or about the size
/// of the scan.
pub(crate) const OTHER_PLACES: [f64; 2] = [0.23, -0.31];
pub(crate) const OTHER_PLACE_REACH: f64 = 0.3;
/// The motion is written into pose parameters in turns of so many radians, in so many steps at least, with so many
/// Gauss-Newton steps after each and after the last one.
pub(crate) const POSE_TURN: f64 = 0.1;
pub(crate) const POSE_STEPS: f64 = 4.0;
pub(crate) const POSE_ROUNDS: u32 = 3;
pub(crate) const POSE_LAST_ROUNDS: u32 = 30;
/// The distance (radii) up to which they reproduce it.
pub(crate) const WRITTEN_BACK: f64 = 1e-6;
/// Sum of weights from which the normals of the scan decide which way a patch faces, and the share of it that must say
/// inwards.
pub(crate) const FACING_POINTS: f64 = 10.0;
pub(crate) const FACING_CLEAR: f64 = 0.85;
/// Which side is out is the script's in the end (`Sides`). The mean cosine beyond which the scan's normals contradict a
/// patch, and the share of all weights from which on it is the scan that is reversed.
pub(crate) const FACING_AGAINST: f64 = 0.5;
pub(crate) const REVERSED_SHARE: f64 = 0.9;
/// A patch faces another side of the scan where its points lose more than this share of their weight once they have to
/// belong to what faces their way, or are more times as far off as the second number (root mean square).
pub(crate) const SIDED_SHARE: f64 = 0.5;
pub(crate) const OTHER_SIDE: f64 = 3.0;
/// A patch is a sheet without thickness where each of its faces has this share of the weight, and where they are less
/// than so much of the noise and of the points' spacing apart. Walls are thicker than half of the noise, or no fit tells
/// their faces apart; the spacing is for scans without noise, whose points on curved surfaces lie on chords.
pub(crate) const SHEET_SHARE: f64 = 0.2;
pub(crate) const SHEET_NOISE: f64 = 0.5;
pub(crate) const SHEET_SPACINGS: f64 = 0.02;
/// Two faces of a scan without sides are mixed up to so many standard deviations of the noise: of points one in fifteen is
/// then nearer to the other face. Faces that are opposite each other are no more than 45 degrees
/// from it (a cosine), and mixed where that holds for most of a patch's points (a share).
pub(crate) const MIXED_REACH: f64 = 3.0;
pub(crate) const MIXED_OPPOSITE: f64 = 0.7;
pub(crate) const MIXED_SHARE: f64 = 0.5;
/// The reach of searches (see `Query::reach`) in sigma: enough for the last steps of a fit; where points are dense, in
/// distances between neighbours: enough for all steps that remain to all points after some of them were fitted (0024).
pub(crate) const REACH_SIGMAS: f64 = 0.15;
pub(crate) const REACH_SPACINGS: f64 = 2.0;
/// Points are dense where the latter is below this many radii. Beyond it, too many facets are within reach.
pub(crate) const REACH_LIMIT: f64 = 0.06;
/// Facets that a search lists for the slack. Where more are within reach, nothing is known of the slack.
pub(crate) const LISTED: usize = 48;
/// The cosine between normals up to which a facet that faces away is grazing: it may turn over within the last steps of
/// a fit.
pub(crate) const GRAZING: f64 = 0.1;
/// Newton's method for a foot: evaluations at most (four suffice except across a sharp bend), the factor on a step that
/// led away, and the longest step along a closed patch, whose period is 1.
pub(crate) const FOOT_EVALUATIONS: usize = 16;
pub(crate) const BACKTRACK: f64 = 0.25;
pub(crate) const SEAM_STEP: f64 = 0.25;
/// Steps are Newton's where the Hessian's diagonal is larger than this part of the metric's, and its determinant than
/// this part of the diagonal's product; else they are Gauss-Newton's.
pub(crate) const CURVED_CLEARLY: f64 = 1e-3;
pub(crate) const CURVED_SOUNDLY: f64 = 1e-6;
/// Newton's method on a patch's Taylor polynomial: steps at most, the part of the tolerance that the polynomial may be
/// off by, and the assumed ratio of third to second derivatives (2 pi for a sine whose period is the patch).
pub(crate) const TAYLOR_STEPS: usize = 4;
pub(crate) const TAYLOR_SHARE: f64 = 0.1;
pub(crate) const TAYLOR_GROWTH: f64 = 16.0;

// --------------------------------------------------------------------------------------------------------- Refinement

/// Limit of a Gauss-Newton step (sigma): the linear model holds for about as long.
pub(crate) const STEP_LIMIT: f64 = 2.0;
/// A step shorter than this (sigma) gains less than the objective is rounded by: the gradient judges it (0017).
pub(crate) const ROUNDED_STEP: f64 = 2e-3;
/// Levenberg and Marquardt's damping, relative to the diagonal: the first, and factors on it after a step with a good
/// and with a poor ratio of the gain to the predicted one, after a rejected step, and where the matrix is singular.
pub(crate) const DAMPING_START: f64 = 1e-4;
pub(crate) const GOOD_RATIO: f64 = 0.75;
pub(crate) const POOR_RATIO: f64 = 0.25;
pub(crate) const DAMPING_GOOD: f64 = 0.2;
pub(crate) const DAMPING_POOR: f64 = 3.0;
pub(crate) const DAMPING_REJECTED: f64 = 8.0;
pub(crate) const DAMPING_SINGULAR: f64 = 100.0;
/// The damping is at least the first, at least the second once it has been raised, and beyond the third no step is
/// possible.
pub(crate) const DAMPING_LEAST: f64 = 1e-9;
pub(crate) const DAMPING_RAISED: f64 = 1e-6;
pub(crate) const DAMPING_MOST: f64 = 1e8;
/// The part of the damping that is relative to the largest diagonal element: it holds coordinates without influence.
pub(crate) const DAMPING_FLOOR: f64 = 1e-4;
/// The loss's second derivative counts for at least this part of its weight, so that no step runs away.
pub(crate) const LEAST_CURVATURE: f64 = 0.3;
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
/// L-BFGS, where Gauss-Newton does not converge: iterations; the gradient, the relative gain of a step and that of a
/// round at which it ends; corrections that are kept; rounds in which the set of coordinates at bounds settles; sigma
/// over the distance by which the first step moves the surface.
pub(crate) const LBFGS_ITERATIONS: u32 = 40;
pub(crate) const LBFGS_GRADIENT: f64 = 1e-7;
pub(crate) const LBFGS_COST: f64 = 1e-10;
pub(crate) const LBFGS_GAIN: f64 = 1e-9;
pub(crate) const LBFGS_MEMORY: usize = 8;
pub(crate) const LBFGS_ROUNDS: u32 = 6;
pub(crate) const LBFGS_FIRST_STEP: f64 = 3.0;

// ------------------------------------------------------------------------------------------------------ Coverage term

/// Scales of the term (radii): from ends that are far beyond the scan to those that are hardly so; the last one is the
/// points' own, but not below the second.
pub(crate) const COVERAGE_SCALES: [f64; 2] = [0.1, 0.03];
pub(crate) const COVERAGE_FINEST: f64 = 0.01;
/// Places on the model in all, about (0023), and at most each way on a patch; samples each way from which a patch's
/// size follows.
pub(crate) const COVERAGE_PLACES: f64 = 8000.0;
pub(crate) const PLACES_EACH_WAY: usize = 400;
pub(crate) const PLACE_SAMPLES: usize = 8;
/// Facets each way at most, of the surface against which views of places are tested.
pub(crate) const PLACE_SEGMENTS: u32 = 128;
/// Directions from which a place may be seen, the cosine of those that are too grazing, and how far above the surface
/// (radii) rays begin.
pub(crate) const VIEW_DIRECTIONS: usize = 48;
pub(crate) const GRAZING_VIEW: f64 = 0.15;
pub(crate) const VIEW_OFFSET: f64 = 1e-3;
/// Neighbours in a cloud that say on which sides of a place there are points (0023), and nearest points among which
/// those are sought that face the same way.
pub(crate) const SUPPORT_NEIGHBOURS: usize = 12;
pub(crate) const SUPPORT_NEAREST: usize = 24;

// ---------------------------------------------------------------------------------------------------------- Inference

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

// ---------------------------------------------------------------------------------------- Warnings and model selection

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
/// Correlations beyond this are worth a warning.
pub(crate) const INSEPARABLE: f64 = 0.999;
/// Coordinates of an undetermined direction are named that have this part of its largest one.
pub(crate) const NAMED: f64 = 0.05;
/// A length is hardly determined whose standard deviation is above this part of the radius or of its value, and a part
/// with fewer points hardly shown.
pub(crate) const HARDLY_DETERMINED: f64 = 0.1;
pub(crate) const HARDLY_ANY_POINTS: f64 = 10.0;
/// The best of several models, this number of them, are fitted again, each from the shape of the best other one, so
/// that a fit that went astray does not decide; unless the winner has strong evidence and at least this ratio of
/// inliers.
pub(crate) const FINALISTS: usize = 3;
pub(crate) const CONVINCING_INLIERS: f64 = 0.95;
/// Differences of BIC (Kass and Raftery 1995): below the first hardly worth a mention, above the second strong
/// evidence.
pub(crate) const SOME_EVIDENCE: f64 = 2.0;
pub(crate) const STRONG_EVIDENCE: f64 = 10.0;

// ------------------------------------------------------------------------------------------------- Search over inputs

/// Searches over at least so many values are races (0040): of fewer, the pilot and the finalists are nearly all.
pub(crate) const RACED: usize = 5;
/// Points of a quick fit from each of its starts: those of a sample, and those of 2,000 whose losses, at so many angles
/// about the axis, differ most. Three holes of a flange have 60 of 3,648 points, too few of any sample.
pub(crate) const QUICK_POINTS: usize = 600;
pub(crate) const QUICK_TELLING: usize = 200;
pub(crate) const QUICK_PROBES: u32 = 7;
/// Angles that are tried with these, at a scale of the loss (radii), and how many of the best minima between them are
/// starts: 120 are three for each of forty flutes.
pub(crate) const QUICK_ANGLES: u32 = 120;
pub(crate) const QUICK_SCALE: f64 = 0.05;
pub(crate) const QUICK_TURNS: usize = 2;
/// A quick fit whose mean loss is so many times the winner's is hopeless: whole fits of wrong numbers of flutes, holes
/// and waves had 0.95 to 1.01 times the loss of the quick ones.
pub(crate) const QUICK_HOPELESS: f64 = 1.5;
/// Time of a quick fit, where a whole one takes 1.
pub(crate) const QUICK_SHARE: f64 = 0.05;

// ---------------------------------------------------------------------------------------------------- Separate walls

/// The share of the model's area that has passed through a wall from which on it is no accident of a few places.
pub(crate) const PASSED_THROUGH: f64 = 1e-3;
/// The term that holds walls apart counts a place at a depth of sigma as so many points at that distance count: what
/// is left of the depth then vanishes beside what is worth a sentence (0039).
pub(crate) const SEPARATION_WEIGHT: f64 = 100.0;
/// The scale of the loss with which walls begin to be held apart, in units of the depth by which they pass.
pub(crate) const APART_START: f64 = 2.0;
/// Places on the facets, about, of the look that says whether walls may have passed through each other: four of them
/// are the share above. It takes 0.1 to 1.5 % of a fit.
pub(crate) const WALL_PLACES: f64 = 4000.0;

// -------------------------------------------------------------------------------------------------------------- Scene

/// The share of the points that nothing explains from which on a fit asks what they are: inliers of right fits are 94 %
/// at least where the noise is ten times larger than the spacing.
pub(crate) const REMAINDER: f64 = 0.1;
/// The share of them that one reason must account for.
pub(crate) const MOSTLY: f64 = 0.7;
/// A piece of the scan, and a mirror image, is explained by a fit that has this share of its points.
pub(crate) const PIECE_EXPLAINED: f64 = 0.8;
pub(crate) const MIRRORED: f64 = 0.9;
/// Another copy shows this part of the points of the first at least.
pub(crate) const COPY_POINTS: f64 = 0.4;
/// The most pieces that are fitted, the least points and the least share of the scan that one has; a plane with a
/// larger share than the last may be what the object stands on.
pub(crate) const PIECES: usize = 3;
pub(crate) const PIECE_POINTS: usize = 100;
pub(crate) const PIECE_SHARE: f64 = 0.03;
pub(crate) const SUPPORT_SHARE: f64 = 0.3;
/// Points of a scene that are clustered; neighbours of a point by which its density is judged; the share of the points
/// that are as dense as the object; the factor on their reach.
pub(crate) const SCENE_POINTS: usize = 30_000;
pub(crate) const CLUSTER_NEIGHBOURS: usize = 8;
pub(crate) const CLUSTER_DENSEST: f64 = 0.05;
pub(crate) const CLUSTER_REACH: f64 = 1.6;
/// The least share of the scan's area that is a piece of its own, and what pieces that are not explained must be
/// together for a warning and for a second search. Of 108 right fits of whole and cut scans of six models the most left
/// over were 0.15 % (0.3 % in a cloud); a box whose floor is 3 mm off leaves over 0.7 to 2.2 %, a hole in the wrong
/// place 1 to 3 %.
pub(crate) const LEAST_PIECE: f64 = 0.001;
pub(crate) const UNEXPLAINED: f64 = 0.005;
/// A point of a cloud belongs to such a piece if so many of its nine nearest points, itself among them, are not
/// explained: of points that noise throws beyond the inliers, which may be 6 %, one in a hundred.
pub(crate) const UNEXPLAINED_NEIGHBOURS: usize = 4;
/// Points of a piece for which the nearest patches are looked up, and the share of them to which a patch must be the
/// nearest to be next to the piece.
pub(crate) const BESIDE_SAMPLES: usize = 300;
pub(crate) const BESIDE_SHARE: f64 = 0.05;
/// Planes that are drawn, of which one in 37 lies on a plane with 30 % of the points; the points by which they are
/// judged; half their thickness in standard deviations of the noise.
pub(crate) const PLANE_DRAWS: usize = 400;
pub(crate) const PLANE_SAMPLES: usize = 3000;
pub(crate) const PLANE_NOISE: f64 = 3.0;

// --------------------------------------------------------------------------------------------------------- Free space

/// A place is away from the scan beyond so many scales of the loss: what the model's family cannot follow is no empty
/// space.
pub(crate) const EMPTY_AWAY_SIGMAS: f64 = 2.0;
/// Contradicted area as a part of the model's, from which on it is no accident: some ten of the
/// places.
pub(crate) const CONTRADICTED: f64 = 1.5e-3;

// ------------------------------------------------------------------------------------------------------------- Rivals

/// Points of a group by which its rivals are looked for, and the least number.
pub(crate) const RIVAL_POINTS: usize = 150;
pub(crate) const RIVAL_LEAST_POINTS: usize = 20;
/// Values of each parameter of a group, all over its bounds, and the coarse scale (radii) at which the others follow.
pub(crate) const RIVAL_VALUES: u32 = 6;
pub(crate) const RIVAL_COARSE: f64 = 0.03;
/// Gauss-Newton steps, and the step (scales of the loss) that is the last one.
pub(crate) const RIVAL_ITERATIONS: u32 = 10;
pub(crate) const RIVAL_STEP: f64 = 1e-3;
/// Twice the logarithm of a likelihood ratio beyond which another shape explains the scan worse: Schwarz's "very
/// strong" (Kass and Raftery 1995). By the group's own points, with the rest held, it may be more.
pub(crate) const RIVAL_EVIDENCE: f64 = 10.0;
pub(crate) const RIVALS_JOINTLY: f64 = 300.0;
/// Points of the group, and others, by which a shape is judged before all points of the sample are: an eighth of them.
/// Beyond the first number of standard deviations (see `RIVAL_WORSE`) it is worse whatever all of them would say, and
/// below the second one (see `RIVAL_DEVIATIONS`) it has come back to the solution. Of 27 shapes of the test data's cup
/// none remains; with half as many others a sixth do, at certainties just below 4 (0043).
pub(crate) const RIVAL_FEW_OWN: usize = 300;
pub(crate) const RIVAL_FEW_OTHERS: usize = 600;
pub(crate) const RIVAL_CLEARLY_WORSE: f64 = 4.0;
pub(crate) const RIVAL_SAME: f64 = 2.0;
/// Standard deviations of the mean difference in loss beyond which another shape is worse, or better by more than a
/// few outliers that are near it by chance.
pub(crate) const RIVAL_WORSE: f64 = 2.0;
pub(crate) const RIVAL_BETTER: f64 = 3.0;
/// Of two shapes that explain the scan alike the scan prefers the one with less contradicted area, if they differ by
/// this share of what a warning needs: five places.
pub(crate) const RIVAL_CONTRADICTED: f64 = 0.4;
/// A rival is another shape than the solution beyond so many standard deviations in some parameter. Along a valley the
/// first step is half as long again, and so often it may double.
pub(crate) const RIVAL_DEVIATIONS: f64 = 4.0;
pub(crate) const RIVAL_DOUBLINGS: u32 = 8;
/// A rival that the scan prefers takes the solution's place, and its rivals are looked for in turn, so often.
pub(crate) const RIVALS_ADOPTED: u32 = 3;

// ------------------------------------------------------------------------------------------------------ Least surface

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
/// The model is turned by so many steps of a full turn about each of up to four axes (15 degrees: multiples of 30, 45
/// and 60 are met, and from 7.5 beside a fifth or a seventh the coarse scale leads there), and looked at over so many
/// points.
pub(crate) const TURN_STEPS: u32 = 24;
pub(crate) const TURN_POINTS: usize = 250;
/// So many of the best turns are refined, over so many points.
pub(crate) const TURNS_REFINED: usize = 6;
pub(crate) const TURN_REFINED_POINTS: usize = 900;
/// Cosine of the angle between two axes that are one: 8 degrees.
pub(crate) const TURN_SAME_AXIS: f64 = 0.99;
