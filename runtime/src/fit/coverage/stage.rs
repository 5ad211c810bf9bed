//! The stage of a fit in which the term takes part: after everything else has been found.

use super::super::descent::Last;
use super::super::loss::Loss;
use super::super::result::Covered;
use super::super::setting::{MIDDLE, Setting};
use super::{Coverage, Scanned, places};
use crate::scan::Scan;
use std::sync::Arc;

/// Scales of the term's psi, as fractions of the scan's radius: from ends that are far beyond the scan to those that are hardly so.
const SCALES: [f64; 2] = [0.1, 0.03];
/// The last one is the points' own, but not below this fraction.
const LAST: f64 = 0.01;

impl<'a> Setting<'a> {
    /// Goes on from an optimum with the term; the same with a warning where that cannot be.
    pub(crate) fn cover(
        &mut self,
        last: Last,
        scan: &'a Scan,
        iterations: &mut u32,
        warnings: &mut Vec<String>,
    ) -> Last {
        if let Err(why) = self.look_back(&last, scan) {
            warnings.push(format!("ends are not held to the scan: {why}"));
            return last;
        }
        self.progress.report("coverage", f64::NAN, "");
        let some = self.points.every(MIDDLE);
        let mut at = last;
        for scale in SCALES {
            self.look_at_scale(scale * self.radius);
            at = self.polish(&some, at.estimate, at.loss, at.signs, iterations);
        }
        self.look_at_scale((LAST * self.radius).max(at.loss.sigma));
        self.polish(self.points, at.estimate, at.loss, at.signs, iterations)
    }

    /// Sets the term up for the model as it is.
    fn look_back(&mut self, last: &Last, scan: &'a Scan) -> Result<(), String> {
        let x = self.space.x(&last.estimate.z).ok_or("the bounds of the parameters leave no room")?;
        let instance = self.model.instantiate(&x).map_err(|e| e.to_string())?;
        let places = places(self.model, &*instance, self.radius).map_err(|e| e.to_string())?;
        let scanned = Scanned::new(scan, self.oriented, self.radius).map_err(|e| e.to_string())?;
        self.coverage = Some(Arc::new(Coverage::new(scanned, places, Loss::welsch(SCALES[0] * self.radius))));
        Ok(())
    }

    fn look_at_scale(&mut self, sigma: f64) {
        self.coverage = self.coverage.take().map(|c| Arc::new(c.at_scale(sigma)));
    }

    /// What the result says of the term.
    pub(crate) fn covered(&self, last: &Last) -> Option<Covered> {
        let coverage = self.coverage.as_ref()?;
        let x = self.space.x(&last.estimate.z)?;
        let instance = self.model.instantiate(&x).ok()?;
        let share = coverage.share(&*instance, &last.estimate.motion)?;
        Some(Covered { share, sigma: coverage.loss.sigma })
    }
}
