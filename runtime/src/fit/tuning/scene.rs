//! The scene: what else a scan shows.

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
