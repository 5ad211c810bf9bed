//! Choice of a model, and search over discrete inputs.

// ----------------------------------------------------------------------------------------------------- Model selection

/// The best of several models, this number of them, are fitted again, each from the shape of the best other one, so
/// that a fit that went astray does not decide; unless the winner has strong evidence and at least this ratio of
/// inliers.
pub(crate) const FINALISTS: usize = 3;
pub(crate) const CONVINCING_INLIERS: f64 = 0.95;
/// Differences of BIC (Kass and Raftery 1995): below the first hardly worth a mention, above the second strong
/// evidence.
pub(crate) const SOME_EVIDENCE: f64 = 2.0;
pub(crate) const STRONG_EVIDENCE: f64 = 10.0;

// -------------------------------------------------------------------------------------------------- Search over inputs

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
