//! Correspondence of points and model: facets, nearest facets, foot points.

// -------------------------------------------------------------------------------------------------------------- Facets

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

// ------------------------------------------------------------------------------------------------------ Nearest facets

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

// --------------------------------------------------------------------------------------------------------- Foot points

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
