//! What else a scan shows than the object: the likely reason for which a fit does not explain all of it. Pieces of the
//! scan are fitted alone where the whole of it was not explained; then what remains is looked at.

mod pieces;
mod remainder;

use super::attempt::{Attempt, attempt_if_likely};
use super::options::{EarlierFit, FitOptions};
use super::problem::loss::LossKind;
use super::problem::rigid::pose_parameters;
use super::result::FitResult;
use super::tuning::{EXPLAINED, MIRRORED, PIECE_EXPLAINED, REMAINDER};
use crate::model::Model;
use crate::progress::{Piece, Progress};
use crate::scan::Scan;
use remainder::Remainder;

/// A model with the scan of a scene.
pub(crate) struct Scene<'a> {
    pub(crate) model: &'a dyn Model,
    pub(crate) scan: &'a Scan,
    pub(crate) options: &'a FitOptions,
    pub(crate) progress: &'a dyn Progress,
}

impl Scene<'_> {
    /// The better of a first fit and of those of pieces of the scan, with sentences on what else the scan shows.
    pub(crate) fn explain(&self, first: Attempt) -> FitResult {
        // With the other losses the user says that every point belongs to the object.
        let is_bounded = matches!(self.options.loss, LossKind::Welsch | LossKind::Tukey);
        if !is_bounded || first.result.degenerate || !first.in_proportion || self.ends(&first) {
            return first.result;
        }
        let of_piece = (first.result.inliers < EXPLAINED).then(|| self.in_pieces()).flatten();
        let whole = of_piece.is_none();
        let mut best = of_piece.unwrap_or(first);
        let mut said = None;
        if 1.0 - best.result.inliers > REMAINDER && !self.ends(&best) {
            match whole.then(|| self.mirrored(&best)).flatten() {
                Some(Mirrored::Alike(found)) => best = *found,
                Some(Mirrored::Other(text)) => said = Some(Remainder { text, explains_pieces: true }),
                None => {}
            }
        }
        if said.is_none() && 1.0 - best.result.inliers > REMAINDER && !self.ends(&best) {
            said = remainder::sentence(self, &best);
        }
        // A plane, a copy and a mirror image are what the pieces are.
        let pieces =
            if said.as_ref().is_some_and(|said| said.explains_pieces) { None } else { remainder::pieces(&best.result) };
        best.result.warnings.extend(said.map(|said| said.text).into_iter().chain(pieces));
        best.result
    }

    fn ends(&self, attempt: &Attempt) -> bool {
        attempt.result.interrupted || self.progress.cancelled()
    }

    /// The options without what only the result needs.
    fn plain(&self) -> FitOptions {
        FitOptions { bootstrap: 0, coverage: false, ..self.options.clone() }
    }

    /// The shape of a fit's result, in no place.
    fn shape_of(&self, result: &FitResult) -> EarlierFit {
        let of_pose = pose_parameters(self.model, self.scan);
        let of_shape = result.parameters.iter().filter(|p| !of_pose.contains(&p.name));
        EarlierFit {
            values: of_shape.map(|p| (p.name.clone(), p.value)).collect(),
            pose: None,
            scans: Vec::new(),
            converged: None,
        }
    }

    /// A fit of the model to a scan; none where there is none, or where it explains no more than some of it.
    fn fit(&self, scan: &Scan, options: FitOptions, name: &str) -> Option<Attempt> {
        let piece = Piece { whole: self.progress, name: name.to_owned(), range: (0.0, 1.0) };
        attempt_if_likely(self.model, scan, &options, &piece)
            .ok()
            .flatten()
            .filter(|attempt| !attempt.result.interrupted)
    }

    /// The fit to the piece of the scan that the model explains best; none where it explains none.
    fn in_pieces(&self) -> Option<Attempt> {
        let mut best: Option<(Attempt, Vec<bool>)> = None;
        for kept in pieces::of(self.scan) {
            let name = "fitting a piece of the scan";
            let Some(found) = self.fit(&self.scan.part(&kept), self.plain(), name) else { continue };
            if best.as_ref().is_none_or(|(best, _)| found.result.inliers > best.result.inliers) {
                best = Some((found, kept));
            }
        }
        let (Attempt { mut result, near, in_proportion }, kept) =
            best.filter(|(best, _)| best.result.converged && best.result.inliers > PIECE_EXPLAINED)?;
        let points = self.scan.mesh.positions.len();
        let share = near.len() as f64 / points.max(1) as f64;
        let mut of_piece = near.iter();
        let near: Vec<bool> = kept.iter().map(|kept| *kept && of_piece.next() == Some(&true)).collect();
        let [x, y, z] = remainder::middle(&self.scan.mesh.positions, &near).to_array();
        result.warnings.push(format!(
            "the model was fitted to a piece of the scan about ({x:.0}, {y:.0}, {z:.0}) mm, {:.0} % of its points, of which {:.0} % lie within {:.3} mm of it: the whole of the scan it does not explain",
            100.0 * share,
            100.0 * result.inliers,
            result.inlier_distance()
        ));
        // The loss of points that are far away is 1.
        result.objective = 1.0 - share * (1.0 - result.objective);
        result.inliers *= share;
        result.scan = self.scan.source.clone();
        Some(Attempt { result, near, in_proportion })
    }

    /// The meaning of a mirror image of the scan, if the model explains it, and not the scan.
    fn mirrored(&self, best: &Attempt) -> Option<Mirrored> {
        let mirrored = self.fit(&self.scan.mirrored(), self.plain(), "fitting a mirror image of the scan")?.result;
        if !(mirrored.inliers > MIRRORED && mirrored.inliers - best.result.inliers > REMAINDER) {
            return None;
        }
        // A shape that is its own mirror image explains both: the search had missed it.
        let options = FitOptions { earlier: Some(self.shape_of(&mirrored)), ..self.options.clone() };
        let again = self.fit(self.scan, options, "fitting the shape of the mirror image").filter(|again| {
            mirrored.inliers - again.result.inliers < REMAINDER && again.result.inliers > best.result.inliers
        });
        Some(match again {
            Some(found) => Mirrored::Alike(Box::new(found)),
            None => Mirrored::Other(format!(
                "the scan looks like a mirror image of the object: mirrored, {:.0} % of its points lie within {:.3} mm of the model, and as it is {:.0} % within {:.3} mm; look for an axis whose sign was changed on the way",
                100.0 * mirrored.inliers,
                mirrored.inlier_distance(),
                100.0 * best.result.inliers,
                best.result.inlier_distance()
            )),
        })
    }
}

/// The meaning of a mirror image of the scan that the model explains.
enum Mirrored {
    /// The object is its own mirror image, and this fit of the scan is better.
    Alike(Box<Attempt>),
    /// A sentence: the scan is a mirror image of the object.
    Other(String),
}
