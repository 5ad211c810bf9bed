//! Rivals: other shapes and poses that explain the scan as well.

/// Points of a group by which its rivals are looked for, and the least number.
pub(crate) const RIVAL_POINTS: usize = 150;
pub(crate) const RIVAL_LEAST_POINTS: usize = 20;
/// Points of a group with a patch that the scan does not show: of 150 points on an angle bracket's leg none or one is
/// where its hole is.
pub(crate) const RIVAL_POINTS_OF_UNSEEN: usize = 600;
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
/// The model is turned by so many steps of a full turn about each of up to four axes (15 degrees: multiples of 30, 45
/// and 60 are met, and from 7.5 beside a fifth or a seventh the coarse scale leads there), and looked at over so many
/// points.
pub(crate) const TURN_STEPS: u32 = 24;
pub(crate) const TURN_POINTS: usize = 250;
/// The number of the best turns that are refined, and the number of points over which they are.
pub(crate) const TURNS_REFINED: usize = 8;
pub(crate) const TURN_REFINED_POINTS: usize = 900;
/// A turned model is the solution if it explains the scan better by these (see `RIVAL_EVIDENCE`, `RIVAL_BETTER`): no
/// more than chance. Of three nuts that a coarse scan had upside down the right way was better by 7.3, 4.4 and 1.7, and
/// 3.8, 3.2 and 1.3 standard deviations.
pub(crate) const TURN_EVIDENCE: f64 = 1.0;
pub(crate) const TURN_BETTER: f64 = 1.0;
/// Cosine of the angle between two axes that are one: 8 degrees.
pub(crate) const TURN_SAME_AXIS: f64 = 0.99;
/// Two shapes are one surface where none of so many squared places inside of each patch of the one is farther from the
/// other than this many scales of the loss, which is some four times the noise.
pub(crate) const SAME_SURFACE_PLACES: u32 = 8;
pub(crate) const SAME_SURFACE_APART: f64 = 0.02;
/// A shape has planes in a direction if this share of its normals lies along it, within 8 degrees (a cosine). Of a
/// pipe 9 % do, along any direction across it, and a pipe's axis is a turn's. No more than so many directions are
/// looked at: they have up to 72 rotations.
pub(crate) const FRAME_SHARE: f64 = 0.1;
pub(crate) const FRAME_PARALLEL: f64 = 0.99;
pub(crate) const FRAME_DIRECTIONS: usize = 5;
/// Where the scan leaves values open, parameters that have changed places are other names of what it shows. Of so many
/// of the best, other two change places too; so many of the best are given this many combinations of open values; and
/// so many are refined.
pub(crate) const NAMES_AGAIN: usize = 6;
pub(crate) const NAMES_PLACED: usize = 24;
pub(crate) const OPEN_VALUES: usize = 64;
pub(crate) const NAMES_REFINED: usize = 8;
/// The greatest difference in the cosine of two angles that are one: 3 degrees of a right angle. Two rotations are one
/// if half of the angle between them has a greater cosine than the second number: 11 degrees.
pub(crate) const FRAME_ANGLE: f64 = 0.05;
pub(crate) const FRAME_SAME: f64 = 0.995;
