//! Correspondence of points and model: the fineness of facets, the reach of searches.

// -------------------------------------------------------------------------------------------------------------- Facets

/// Chord error (radii) of the facets on which the refinement and everything after it work, and of those of the
/// registration. Facets are for the search only; feet lie on the exact surface.
pub(crate) const CHORD: f64 = 0.002;
pub(crate) const START_CHORD: f64 = 0.01;
/// Size of a model (radii), of which a cell of facets is a tenth at most.
pub(crate) const MODEL_SIZE: f64 = 2.0;

// ------------------------------------------------------------------------------------------------------ Nearest facets

/// The reach of searches (see `Query::reach`) in sigma: enough for the last steps of a fit; where points are dense, in
/// distances between neighbours: enough for all steps that remain to all points after some of them were fitted (0024).
pub(crate) const REACH_SIGMAS: f64 = 0.15;
pub(crate) const REACH_SPACINGS: f64 = 2.0;
/// Points are dense where the latter is below this many radii. Beyond it, too many facets are within reach.
pub(crate) const REACH_LIMIT: f64 = 0.06;
