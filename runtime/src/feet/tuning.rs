//! The constants of the search for foot points. docs/decisions/0029-tuning-constants.md says what became of fits with
//! half and with twice of each.

// -------------------------------------------------------------------------------------------------------------- Facets

/// Cells of facets that a model has at least along its size, so that boxes stay small.
pub(super) const CELLS_OF_SIZE: f64 = 10.0;
/// Cells each way of the grid on which a patch's curvature is measured, and the most that it is divided into.
pub(super) const CURVATURE_CELLS: usize = 12;
pub(super) const MOST_CELLS: f64 = 48.0;
/// The same along a patch that is trimmed, whose facets end at its edge where that is straight between them: times the
/// root of the size in chords. A circle with a tenth of the size as its radius has cells of a chord by 1.1.
pub(super) const TRIMMED_CELLS: f64 = 1.0;
/// Parts into which cells of a trimmed patch are divided to see whether something in them is there, or is not, that
/// their corners do not show, how often at most, and the most lines that a grid has each way where cells were divided
/// for that.
pub(super) const SLIVERS: usize = 6;
pub(super) const EDGE_ROUNDS: usize = 3;
pub(super) const MOST_LINES: usize = 400;
/// Between breaks: cells of the grid of curvature in a stretch at least, and the most stretches each way that have
/// cells of their own, even if only one each.
pub(super) const LEAST_CURVATURE_CELLS: usize = 3;
pub(super) const MOST_STRETCHES: usize = 400;

/// Millimetres: a million kilometres from the origin, where coordinates in double precision are 0.0001 mm apart.
/// Georeferenced coordinates are below 1e10 mm. Surface beyond is taken for absent: cells and squares of distances are
/// exact to nothing there.
pub(super) const FARTHEST: f64 = 1e12;

// ------------------------------------------------------------------------------------------------------ Nearest facets

/// Facets that a search lists for the slack. Where more are within reach, nothing is known of the slack.
pub(super) const LISTED: usize = 48;
/// The cosine between normals up to which a facet that faces away is grazing: it may turn over within the last steps of
/// a fit.
pub(super) const GRAZING: f64 = 0.1;

// --------------------------------------------------------------------------------------------------------- Foot points

/// The pull of one side of a corner on a foot that is rounding, as a part of the other's.
pub(super) const LEVEL_PULL: f64 = 1e-9;
/// Newton's method for a foot: evaluations at most (four suffice except across a sharp bend), the factor on a step that
/// led away, and the longest step along a closed patch, whose period is 1.
pub(super) const FOOT_EVALUATIONS: usize = 16;
pub(super) const BACKTRACK: f64 = 0.25;
pub(super) const SEAM_STEP: f64 = 0.25;
/// Steps are Newton's where the Hessian's diagonal is larger than this part of the metric's, and its determinant than
/// this part of the diagonal's product; else they are Gauss-Newton's.
pub(super) const CURVED_CLEARLY: f64 = 1e-3;
pub(super) const CURVED_SOUNDLY: f64 = 1e-6;
/// Walks along the edge of a trimmed patch: evaluations at most, how far beside the edge a place is still on it, in
/// tolerances of feet, and the factor on a step that led away.
pub(super) const EDGE_EVALUATIONS: usize = 48;
pub(super) const EDGE_ERRORS: f64 = 0.1;
pub(super) const EDGE_BACKTRACK: f64 = 0.25;
/// Bisections of the way from what is there to what is not: to a millionth of the patch, from where Newton's method
/// goes on.
pub(super) const EDGE_BISECTIONS: usize = 20;
/// Newton's method on a patch's Taylor polynomial: steps at most, the part of the tolerance that the polynomial may be
/// off by, and the assumed ratio of third to second derivatives (2 pi for a sine whose period is the patch).
pub(super) const TAYLOR_STEPS: usize = 4;
pub(super) const TAYLOR_SHARE: f64 = 0.1;
pub(super) const TAYLOR_GROWTH: f64 = 16.0;
