//! What is likely to be wrong where next to nothing of a surface was measured.

use super::{Deviations, Statistics};
use crate::mesh::Bounds;
use crate::scan::{Scan, Unit};
use glam::DVec3;

/// Less than this share of the surface's area is next to nothing.
const LITTLE: f64 = 0.01;

/// Sizes that are in the proportion of two units up to this factor suggest that unit; parts of an object are smaller
/// than it, and the scene around it is larger.
const ALIKE: f64 = 1.5;

/// From this proportion of sizes on it is not one object.
const UNLIKE: f64 = 8.0;

/// Distances of the middles below this share of the surface's size do not suggest another position.
const BESIDE: f64 = 0.1;

/// How little was measured, with a sentence on what is likely to be wrong.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Misfit {
    /// Nothing, or what things of such different sizes share by chance.
    Nothing(String),
    /// Little.
    Little(String),
}

/// None if enough was measured.
pub(super) fn likely(overall: &Statistics, deviations: &Deviations, scan: &Scan, is_mesh: bool) -> Option<Misfit> {
    if overall.coverage >= LITTLE {
        return None;
    }
    let model: Bounds = deviations.texels.position.iter().copied().map(DVec3::from_array).collect();
    let read_in = &scan.source.unit;
    let scan = scan.mesh.bounds();
    let ratio = scan.diagonal() / model.diagonal();
    let is_alien = !(1.0 / UNLIKE..UNLIKE).contains(&ratio);
    let why = if is_alien {
        let meant = other_unit(ratio, read_in, is_mesh);
        format!("the scan is {:.3} mm across, the model {:.3} mm{meant}", scan.diagonal(), model.diagonal())
    } else {
        let [x, y, z] = (scan.centre() - model.centre()).to_array();
        let beside = scan.centre().distance(model.centre());
        match beside > BESIDE * model.diagonal() || beside > deviations.max_distance {
            true => format!(
                "the middle of the scan is {beside:.3} mm from that of the model, at ({x:.3}, {y:.3}, {z:.3}) from it: \
                 it may not be in the model's position (`gmlc fit` finds it, `--params` takes it)"
            ),
            false => format!(
                "the scan lies around the model, but within {:.3} mm of it hardly anything faces as the model does: it \
                 may be turned, of another object, or too far away for `--max-distance`",
                deviations.max_distance
            ),
        }
    };
    let nothing = overall.measured_texels == 0 || is_alien;
    let share = 100.0 * overall.coverage;
    Some(match nothing {
        true => Misfit::Nothing(why),
        false => Misfit::Little(format!("only {share:.2} % of the model's surface was measured: {why}")),
    })
}

/// The unit that a proportion of the sizes of scan and model suggests, where the scan was read in `unit`.
fn other_unit(ratio: f64, unit: &str, is_mesh: bool) -> String {
    let alike = |factor: f64| (1.0 / ALIKE..ALIKE).contains(&(ratio * factor));
    let own = unit.parse().unwrap_or(Unit::default()).millimetres();
    let of_scan = Unit::ALL.into_iter().find(|unit| unit.millimetres() != own && alike(unit.millimetres() / own));
    // Models have units of their own, and reference meshes have an option.
    let of_mesh = Unit::ALL.into_iter().filter(|_| is_mesh);
    let of_mesh = of_mesh.into_iter().find(|unit| unit.millimetres() > 1.0 && alike(1.0 / unit.millimetres()));
    match (of_scan, of_mesh) {
        (Some(unit), _) => format!(": its file may be in {unit} (`--unit {unit}`)"),
        (None, Some(unit)) => format!(": the mesh's file may be in {unit} (`--reference-unit {unit}`)"),
        (None, None) => ": one of the units may be wrong (`--unit`), or it is another object".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn proportions_of_sizes_suggest_units() {
        for (ratio, expected) in [
            (0.001, "--unit m`"),
            (0.0012, "--unit m`"),
            (1.0 / 25.4, "--unit in`"),
            (0.1, "--unit cm`"),
            (1.0 / 304.8, "--unit ft`"),
            (1000.0, "--unit um`"),
            (25.4, "--reference-unit in`"),
            (70.0, "one of the units"),
        ] {
            let said = other_unit(ratio, "mm", true);
            assert!(said.contains(expected), "{ratio}: {said}");
        }
        // The unit of --unit was wrong; a script has no unit that could be.
        assert!(other_unit(25.4, "in", false).contains("--unit mm`"));
        assert!(other_unit(25.4, "mm", false).contains("one of the units"));
    }
}
