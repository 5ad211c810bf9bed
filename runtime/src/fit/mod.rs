//! Parameters and pose from a scan.

mod result;

pub use result::{FitResult, FittedParameter, FittedPose};
