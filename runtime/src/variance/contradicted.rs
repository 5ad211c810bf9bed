//! Surface of the model without a distance that stands where the scan shows empty space.

use super::Deviations;
use crate::bvh::Bvh;
use crate::scan::{EmptySpace, Scan};
use glam::DVec3;

/// Texels of every row and column that are looked at, in turn. The borders of empty space are ragged, where it hangs on
/// few directions: texel by texel a vessel's shelf took half of the time of all rays.
const STRIDES: [u32; 2] = [8, 4];

/// By texel, whether it has no distance although the scan shows the space there to be empty; nothing for a scan whose
/// sides are not known, since it does not say which one was seen. Texels that are buried, or look at a closed hole,
/// are none of them: nothing could be measured there.
pub(in crate::variance) fn contradicted(deviations: &Deviations, scan: &Scan, bvh: &Bvh) -> Vec<bool> {
    if !scan.oriented {
        return Vec::new();
    }
    let space = EmptySpace::of(scan, bvh);
    where_empty(deviations, |place, normal| space.contains(place, normal))
}

/// By texel, whether it has no distance and stands in empty space. `is_empty` says that of a place of the surface with
/// its outward normal.
pub(super) fn where_empty(deviations: &Deviations, is_empty: impl Fn(DVec3, DVec3) -> bool + Sync) -> Vec<bool> {
    let texels = &deviations.texels;
    let lacks_distance =
        |i: usize| deviations.along(i).is_nan() && !deviations.is_buried(i) && !deviations.is_filled(i);
    let look = |i: usize| {
        let normal = DVec3::from_array(texels.normal[i].map(f64::from));
        lacks_distance(i) && is_empty(DVec3::from_array(texels.position[i]), normal)
    };
    let mut found = texels.classify(&STRIDES, look);
    // Those between others that were looked at may have a distance.
    found.iter_mut().enumerate().for_each(|(i, found)| *found &= lacks_distance(i));
    found
}

#[cfg(test)]
mod tests {
    use crate::model::{Fineness, Model, Motion, Tessellation};
    use crate::progress::Silent;
    use crate::scan::{Scan, from_mesh};
    use crate::variance::{DistanceTexture, Matching, MeasureOptions, Measurement, Reference, Resolution, measure};
    use gml_compiler::program::{Options, Program, compile};
    use gml_compiler::source::{NoFiles, SourceFile};
    use std::f64::consts::PI;

    /// A vessel whose inner radius is 37 mm, with parts inside of it.
    fn vessel(inside: &str) -> Program {
        let text = format!(
            "use std.surface (revolve, disc, flip, cylinder)
            use std.frame (translate)
            model vessel {{
              part outside = cylinder(40mm, 80mm)
              part inside = flip(cylinder(37mm, 77mm)).translate((0mm, 0mm, 3mm))
              part lip = revolve(|t| (mix(40mm, 37mm, t), 80mm))
              part bottom = flip(disc(40mm))
              part floor = disc(37mm).translate((0mm, 0mm, 3mm))
              {inside}
            }}"
        );
        let script = SourceFile { name: "vessel.gml".to_owned(), text };
        compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program
    }

    fn scan() -> Scan {
        let empty = vessel("");
        let fineness = Fineness { edge: 2.0, ..Fineness::default() };
        let mesh = Tessellation::new(&empty, &*Model::instantiate(&empty, &[]).unwrap(), fineness).unwrap().mesh;
        from_mesh(mesh, "vessel").unwrap()
    }

    fn measured(inside: &str, scan: &Scan) -> Measurement {
        measured_by(Matching::Mutual, inside, scan)
    }

    fn measured_by(matching: Matching, inside: &str, scan: &Scan) -> Measurement {
        let model = vessel(inside);
        let reference = Reference::Model { model: &model, x: &[], motion: Motion::IDENTITY };
        let resolution = Resolution::Side(256);
        let max_distance = Some(8.0);
        let options = MeasureOptions { resolution, max_distance, matching, ..MeasureOptions::default() };
        measure(reference, scan, None, &options, &Silent).unwrap()
    }

    const SHELF: &str = "part shelf = disc(30mm).translate((0mm, 0mm, 45mm))";

    #[test]
    fn a_shelf_in_an_empty_vessel_stands_in_empty_space() {
        let found = measured(SHELF, &scan());
        for part in &found.report.parts {
            let expected = if part.name == "shelf" { PI * 30.0 * 30.0 } else { 0.0 };
            let area = part.statistics.contradicted_area;
            assert!((area - expected).abs() <= 0.01 * expected, "{}: {area}, not {expected}", part.name);
        }
        // It lacks data as before.
        let overall = &found.report.overall;
        assert!((overall.area - overall.measured_area - overall.contradicted_area).abs() < 0.01 * overall.area);
        let texture = DistanceTexture::new(&found.deviations);
        for i in (0..found.deviations.texels.len()).filter(|i| found.deviations.is_contradicted(*i)) {
            let at = 3 * found.deviations.texels.index[i] as usize;
            assert_eq!(texture.rgb[at..at + 3], [0, 0, 8]);
        }
    }

    #[test]
    fn what_has_a_distance_or_was_not_seen_does_not() {
        // The same shelf by 5 mm above the floor has the floor's distance only if that need not be its own.
        let low = "part shelf = disc(30mm).translate((0mm, 0mm, 8mm))";
        assert_eq!(measured_by(Matching::All, low, &scan()).report.overall.contradicted_texels, 0);
        let found = measured(low, &scan()).report.overall;
        assert!((found.contradicted_area / (PI * 30.0 * 30.0) - 1.0).abs() < 0.01, "{}", found.contradicted_area);
        assert!(found.ambiguous_area < 1.0, "{}", found.ambiguous_area);
        // The scan's sides are not known.
        let guessed = Scan { oriented: false, ..scan() };
        assert_eq!(measured(SHELF, &guessed).report.overall.contradicted_texels, 0);
        // The outside of the vessel alone says nothing of what is in it.
        let mut outside = scan();
        let inner = |t: &[u32; 3]| {
            t.iter().all(|c| outside.mesh.positions[*c as usize][..2].iter().map(|c| c * c).sum::<f64>() < 39.0 * 39.0)
        };
        outside.mesh.triangles = outside.mesh.triangles.iter().filter(|t| !inner(t)).copied().collect();
        assert_eq!(measured(SHELF, &outside).report.overall.contradicted_texels, 0);
    }
}
