//! What looks wrong with a scan, in sentences that say what to do.

use super::Survey;
use crate::scan::Unit;
use gml_compiler::number::plain;

/// Objects that are scanned are mostly larger than this and smaller than that. Millimetres.
const USUAL: [f64; 2] = [5.0, 50_000.0];
/// A flat scan is thinner than this share of its size.
const FLAT: f64 = 1e-6;
/// Shares of points or of the surface that are worth a sentence.
const MANY: f64 = 0.01;
/// Equal points of a cloud that are worth one.
const REPEATED: f64 = 0.05;

/// All that looks wrong.
pub(super) fn of(survey: &Survey) -> Vec<String> {
    let rules = [size, flatness, repeated, left_out, orientation, clutter, fragments, topology, layers];
    rules.iter().filter_map(|rule| rule(survey)).collect()
}

fn extents(survey: &Survey) -> [f64; 3] {
    std::array::from_fn(|k| survey.high[k] - survey.low[k])
}

/// Three significant digits.
fn length(x: f64) -> String {
    format!("{x:.2e}").parse().map_or_else(|_| plain(x), plain)
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

/// Of a file that states no unit, a size that another one makes usual.
fn size(survey: &Survey) -> Option<String> {
    let size = extents(survey).into_iter().fold(0.0, f64::max);
    if !matches!(survey.unit_from, "default" | "format") || size == 0.0 || (USUAL[0]..USUAL[1]).contains(&size) {
        return None;
    }
    let usual = |unit: &Unit| (USUAL[0]..USUAL[1]).contains(&(size * unit.millimetres()));
    let likely: Vec<String> =
        [Unit::M, Unit::Um, Unit::In].iter().filter(|u| usual(u)).map(|u| format!("--unit {u}")).collect();
    let advice = if likely.is_empty() {
        "check its unit (--unit)".into()
    } else {
        format!("is it in another unit ({})?", likely.join(", "))
    };
    Some(format!("the scan is {} mm large, and the file states no unit: {advice}", length(size)))
}

fn flatness(survey: &Survey) -> Option<String> {
    let extents = extents(survey);
    let size = extents.into_iter().fold(0.0, f64::max);
    let axis = (0..3).find(|k| extents[*k] <= FLAT * size)?;
    Some(format!("all points have the same {}: a projection, or a drawing, is no scan", ["x", "y", "z"][axis]))
}

fn repeated(survey: &Survey) -> Option<String> {
    let (equal, points) = (survey.cleaning.equal_points as f64, survey.cleaning.points as f64);
    let share = equal / points.max(1.0);
    (survey.triangles == 0 && share > REPEATED).then(|| {
        format!("{} of its points are at the place of another one: was it merged with itself?", percent(share))
    })
}

fn left_out(survey: &Survey) -> Option<String> {
    let cleaning = &survey.cleaning;
    let share = cleaning.marked as f64 / (cleaning.marked + cleaning.points).max(1) as f64;
    (share > 0.5).then(|| format!("the file marks {} of its points as invalid", percent(share)))
}

fn orientation(survey: &Survey) -> Option<String> {
    (!survey.oriented).then(|| {
        "nothing tells the outer side of its surface: the sides of thin walls cannot be told apart; export normals, or the scanner's places, with it"
            .to_owned()
    })
}

fn clutter(survey: &Survey) -> Option<String> {
    let share = survey.outliers.filter(|share| *share > MANY)?;
    Some(format!(
        "about {} of its points lie on no surface (dust, spray, mixed pixels): --drop-outliers leaves them out",
        percent(share)
    ))
}

fn fragments(survey: &Survey) -> Option<String> {
    let share = 1.0 - survey.largest_piece;
    (survey.pieces > 1 && share > MANY).then(|| {
        let of = if survey.triangles > 0 { "its surface" } else { "its points" };
        format!(
            "it has {} pieces, and {} of {of} is not in the largest: --keep-largest leaves that out, --crop cuts out a box",
            survey.pieces,
            percent(share)
        )
    })
}

fn topology(survey: &Survey) -> Option<String> {
    let surface = survey.surface?;
    let odd = [
        (surface.edges_of_many, "belong to more than two triangles"),
        (surface.torn_edges, "lie between triangles that face to different sides"),
    ];
    let odd: Vec<String> = odd.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} edges {what}")).collect();
    (!odd.is_empty()).then(|| format!("{}: the mesh was put together badly there", odd.join(", ")))
}

/// Points below this number may be as far apart as the shape of a thing is large, and then tell no noise from that.
const FEW_POINTS: usize = 500;

/// A scan that is thicker than its points are apart.
fn layers(survey: &Survey) -> Option<String> {
    let spacing = survey.spacing[1];
    let why = if survey.points < FEW_POINTS {
        "so few points hardly tell noise from shape"
    } else {
        "were scans merged that do not fit together?"
    };
    (spacing > 0.0 && survey.noise > spacing).then(|| {
        format!(
            "its noise, {} mm, is larger than the distance of its points, {} mm: {why}",
            length(survey.noise),
            length(spacing)
        )
    })
}
