//! The problem: points, loss, pose, sides, coverage, walls and empty space.

// --------------------------------------------------------------------------------------------------------------- Start

/// Common start values of equal parameters: how often all are moved into bounds that depend on each other, and from
/// how many other places.
pub(crate) const ROOM_SWEEPS: usize = 100;
pub(crate) const ROOM_SAMPLES: u32 = 400;

// ---------------------------------------------------------------------------------------------------------------- Loss

/// Distances beyond so many sigma are not computed where the loss is bounded, and their loss is 1 (\[VA\] eq. 4):
/// Welsch's there is 1 - 4.8e-6.
pub(crate) const CUTOFF_SIGMAS: f64 = 3.5;
/// The distance up to which points are inliers (d + eps in \[VA\] sect. 3), in robust standard deviations of the
/// residuals. At 3 the estimator is 97 % as efficient as least squares on Gaussian residuals.
pub(crate) const INLIER_DEVIATIONS: f64 = 3.0;

// -------------------------------------------------------------------------------------------------------------- Points

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
/// The share of the points that is on surfaces at least. Of ten million triangles, of whose vertices a thousandth was
/// off, 68 % of a sample of 2,000 points were these, and the handle of a cup was not found.
pub(crate) const SURFACE_SHARE: f64 = 0.98;
/// Passes of the statistical removal of outliers, the points of a cloud that it looks at, and the share that a cloud
/// without clutter keeps; a cluttered one is sampled by density (0023).
pub(crate) const OUTLIER_PASSES: usize = 2;
pub(crate) const OUTLIER_POINTS: usize = 30_000;
pub(crate) const CLEAN_CLOUD: f64 = 0.95;
/// Points whose distance to the next one is looked at for the spacing of all.
pub(crate) const SPACING_POINTS: usize = 2000;

// ----------------------------------------------------------------------------------------------------- Pose parameters

/// Samples each way of a patch for the velocities by which rigid parameters are recognised and coordinates scaled.
pub(crate) const VELOCITY_SAMPLES: usize = 5;
/// A field of velocities is rigid up to this part of its size: far above rounding, far below any true deformation.
pub(crate) const RIGID: f64 = 1e-8;
/// Places beside the start at which it must be: steps of all parameters in this part of their bounds, or about the size
/// of the scan.
pub(crate) const OTHER_PLACES: [f64; 2] = [0.23, -0.31];
pub(crate) const OTHER_PLACE_REACH: f64 = 0.3;

// --------------------------------------------------------------------------------------------------------------- Sides

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
/// than so much of the noise and of the points' spacing apart. No fit tells the faces of a wall apart that is thinner
/// than half of the noise; the spacing is for scans without noise, whose points on curved surfaces lie on chords. Of a
/// wall of 1.7 times the noise a fifth of the points are nearest to the wrong face, and close to it. Of the weight of
/// the face that is shown less, so much is lost where they must face the patch's way: nearly all, or they belong
/// elsewhere.
pub(crate) const SHEET_SHARE: f64 = 0.35;
pub(crate) const SHEET_LOST: f64 = 0.7;
pub(crate) const SHEET_NOISE: f64 = 0.5;
pub(crate) const SHEET_SPACINGS: f64 = 0.02;
/// Two faces of a scan without sides are mixed up to so many standard deviations of the noise: of the points one in
/// fifteen is then nearer to the other face. Faces are opposite each other up to 45 degrees from it (a cosine), and
/// mixed where that holds for most of a patch's points (a share).
pub(crate) const MIXED_REACH: f64 = 3.0;
pub(crate) const MIXED_OPPOSITE: f64 = 0.7;
pub(crate) const MIXED_SHARE: f64 = 0.5;

// ------------------------------------------------------------------------------------------------------- Coverage term

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

// ------------------------------------------------------------------------------------------------------ Separate walls

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

// ---------------------------------------------------------------------------------------------------------- Free space

/// A place is away from the scan beyond so many scales of the loss: what the model's family cannot follow is no empty
/// space.
pub(crate) const EMPTY_AWAY_SIGMAS: f64 = 2.0;
/// Contradicted area as a part of the model's, from which on it is no accident: some ten of the places.
pub(crate) const CONTRADICTED: f64 = 1.5e-3;
