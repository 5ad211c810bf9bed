//! Restarts of groups of parameters.

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
