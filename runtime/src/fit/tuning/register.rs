//! Registration: screening of candidates, orientations, proposals of shapes.

// ----------------------------------------------------------------------------------------------------------- Screening

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
/// The rungs that candidates for a pose alone climb, with the shape known from other scans. The last one learns the
/// sides; all scans together decide between what it leaves. A flange with six bolts has six poses that are alike, on
/// either side of it.
pub(crate) const POSE_RUNGS: [Rung; 3] = [
    Rung { candidates: 24, points: 350, scales: &[0.3], sided: false },
    Rung { candidates: 16, points: 500, scales: &[0.2], sided: false },
    Rung { candidates: 12, points: 1000, scales: &[0.14, 0.1], sided: true },
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
/// The objective of another pose must be this part of the near start's to be preferred.
pub(crate) const CLEARLY_BETTER: f64 = 0.9;
/// A scan that is larger or smaller than the model at its start by more was hardly read in its unit: 25.4 of inches is
/// the least.
pub(crate) const ANOTHER_UNIT: f64 = 15.0;

// -------------------------------------------------------------------------------------------------------- Orientations

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

// ----------------------------------------------------------------------------------------------------- Shape proposals

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
