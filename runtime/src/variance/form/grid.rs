//! Places on a surface about an axis, in sections at right angles to it and along generators.

use super::filter::{Cells, Filter, Place};
use super::linear::{self, Row};
use super::noise::Simulation;
use crate::spread::mean_and_sd;
use glam::DVec3;
use std::f64::consts::TAU;

/// Sections along the axis.
pub(super) const SECTIONS: usize = 24;
/// Places around a section: one for an eighth of the cut-off, but between these.
const FEWEST_ANGLES: f64 = 72.0;
const MOST_ANGLES: f64 = 720.0;
/// The least component of a unit normal away from the axis: a disc has no sections.
const STEEP: f64 = 0.3;
/// A section whose radii differ by more than this share of the cut-off (root mean square about a line along the axis)
/// meets several sheets of the surface.
const SHEETS: f64 = 0.05;
/// Cells within this share of the cut-off of a section's plane say what its radius is.
const BESIDE: f64 = 0.25;

/// A step runs around beside a section if the filter clearly does not follow the surface at so many of its places, by
/// the same side ...
const STEPPED: f64 = 0.25;
/// ... and at less than this part of these by the other one: lobes are on both.
const ONE_SIDED: f64 = 0.25;

/// A difference is clearly more than noise from so many standard deviations on.
const CLEAR: f64 = 3.0;

/// A section.
pub(super) struct Section {
    /// Its point on the axis.
    pub(super) middle: DVec3,
    /// Its coordinate along the axis. Millimetres.
    pub(super) height: f64,
    /// The component of the surface's normal away from the axis.
    pub(super) outward: f64,
    /// Its number; that of its first place is this times the grid's angles.
    number: usize,
    /// Whether it lies beside a step of the surface that runs around, as that of a collar: how much of the step is in
    /// its values changes from place to place with the scan's points, and is no form of the section.
    is_stepped: bool,
}

/// The sections of a part, and the filter of its cells at their places.
pub(super) struct Grid {
    pub(super) sections: Vec<Section>,
    pub(super) angles: usize,
    filter: Filter,
}

/// Cells in coordinates of an axis.
struct Polar {
    height: f64,
    radius: f64,
    outward: f64,
    along: f64,
}

impl Grid {
    /// The sections of cells about an axis (a point and a unit direction). None where there are none.
    pub(super) fn new(
        cells: &Cells,
        (origin, axis): (DVec3, DVec3),
        simulation: &Simulation,
        (cutoff, precision): (f64, f64),
    ) -> Option<Self> {
        let polar: Vec<Polar> = cells.places.iter().map(|place| polar(place, origin, axis)).collect();
        let (low, high) =
            polar.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p.height), h.max(p.height)));
        if !(high > low) {
            return None;
        }
        let largest = polar.iter().map(|p| p.radius).fold(0.0, f64::max);
        let angles = (TAU * largest / (0.125 * cutoff)).clamp(FEWEST_ANGLES, MOST_ANGLES) as usize;
        let (x, y) = axis.any_orthonormal_pair();
        let (mut sections, mut places) = (Vec::new(), Vec::new());
        for k in 0..SECTIONS {
            let height = low + (k as f64 + 0.5) / SECTIONS as f64 * (high - low);
            let Some((radius, outward, along)) = profile(&polar, height, cutoff) else { continue };
            let middle = origin + height * axis;
            let number = sections.len();
            sections.push(Section { middle, height, outward, number, is_stepped: false });
            places.extend((0..angles).map(|j| {
                let (sin, cos) = (TAU * j as f64 / angles as f64).sin_cos();
                let away = cos * x + sin * y;
                Place { position: middle + radius * away, normal: (outward * away + along * axis).normalize_or_zero() }
            }));
        }
        let filter = Filter::new(cells, &places, cutoff);
        let unfollowed = simulation.unfollowed(cells, &places, &filter);
        let beside: Vec<BesideStep> =
            unfollowed.chunks(angles).map(|section| BesideStep::new(section, precision)).collect();
        for (k, section) in sections.iter_mut().enumerate() {
            let is_by = [k.wrapping_sub(1), k + 1].iter().filter_map(|k| beside.get(*k)).any(|by| by.is_clear);
            section.is_stepped = beside[k].is_clear || is_by && beside[k].is_uneven;
        }
        (!sections.is_empty()).then_some(Self { sections, angles, filter })
    }

    /// The filtered values of the cells' `values` at all places, section by section.
    pub(super) fn apply(&self, values: &[f64]) -> Vec<Option<f64>> {
        self.filter.apply(values)
    }

    /// The sections that have a form of their own.
    pub(super) fn even(&self) -> impl Iterator<Item = &Section> {
        self.sections.iter().filter(|section| !section.is_stepped)
    }

    /// A section's values.
    pub(super) fn of_section<'v>(&self, values: &'v [Option<f64>], section: &Section) -> &'v [Option<f64>] {
        &values[section.number * self.angles..][..self.angles]
    }

    /// The values along a generator with the heights of their sections.
    pub(super) fn of_generator<'v>(
        &'v self,
        values: &'v [Option<f64>],
        angle: usize,
    ) -> impl Iterator<Item = (f64, f64)> + 'v {
        let at = move |section: &Section| Some((section.height, values[section.number * self.angles + angle]?));
        self.sections.iter().filter_map(at)
    }
}

/// Whether a step runs around beside a section.
struct BesideStep {
    /// The difference between the filter and a short one varies around the section by more than noise. One that is the
    /// same all around is that of a bent profile, and no step.
    is_uneven: bool,
    /// It varies, and is clearly to one side on much of the section.
    is_clear: bool,
}

impl BesideStep {
    /// By what the filter does not follow at the section's places, with the standard deviation of that by noise.
    fn new(unfollowed: &[Option<[f64; 2]>], precision: f64) -> Self {
        let all: Vec<[f64; 2]> = unfollowed.iter().flatten().copied().collect();
        let (_, scatter) = mean_and_sd(&all.iter().map(|[off, _]| *off).collect::<Vec<f64>>());
        let noise = (all.iter().map(|[_, sd]| sd * sd).sum::<f64>() / all.len().max(1) as f64).sqrt();
        let share = |sign: f64| {
            let clear = all.iter().filter(|[off, sd]| sign * off > precision.max(CLEAR * sd));
            clear.count() as f64 / unfollowed.len() as f64
        };
        let [out, inward] = [share(1.0), share(-1.0)];
        let is_uneven = scatter > precision.max(noise);
        let is_one_sided = out.max(inward) > STEPPED && out.min(inward) < ONE_SIDED * out.max(inward);
        Self { is_uneven, is_clear: is_uneven && is_one_sided }
    }
}

fn polar(place: &Place, origin: DVec3, axis: DVec3) -> Polar {
    let to = place.position - origin;
    let across = to.reject_from_normalized(axis);
    Polar {
        height: to.dot(axis),
        radius: across.length(),
        outward: place.normal.dot(across.normalize_or_zero()),
        along: place.normal.dot(axis),
    }
}

/// Radius and normal (away from the axis, and along it) of the surface at a height. None on discs, and where several
/// sheets of the surface are at that height.
fn profile(cells: &[Polar], height: f64, cutoff: f64) -> Option<(f64, f64, f64)> {
    let near = || cells.iter().filter(|p| (p.height - height).abs() < BESIDE * cutoff);
    let count = near().count() as f64;
    let rows = || near().map(|p| Row { factors: [1.0, p.height - height, 0.0, 0.0, 0.0, 0.0], value: p.radius });
    let (line, _) = linear::least_squares(rows(), 2)?;
    let spread = (rows().map(|row| row.error(&line).powi(2)).sum::<f64>() / count).sqrt();
    let mean = |of: fn(&Polar) -> f64| near().map(of).sum::<f64>() / count;
    let (outward, along) = (mean(|p| p.outward), mean(|p| p.along));
    (outward.abs() >= STEEP && spread <= SHEETS * cutoff).then_some((line[0], outward, along))
}
