//! How the lines of texels are spread over u and v of a patch: so that every row and every column of a chart stands for
//! an equal area of the surface.

use super::breaks::{Break, Breaks, spans};
use super::{EvaluationError, Instance, Partials};
use glam::DVec3;

/// Steps of u in which the area along u is summed, and of v along v: within one the area of texels changes by 7 % where
/// it changes the most in the examples, in the wall of the cup.
const FINE: f64 = 256.0;
/// Steps of the other parameter.
const COARSE: f64 = 32.0;
/// The fewest steps between two breaks.
const LEAST: f64 = 4.0;
/// Evaluations of all patches together from which on the steps are longer, down to `COARSE`.
const MOST: usize = 1 << 21;

/// The longest side of a texel, in widths of a square one. At a pole rows of equal area would be the longer the nearer
/// they are to it: without a limit the first row of a disc of 300 rows had 17 times the length of a side at the mean.
/// With 2, texels are smaller than elsewhere by more than a tenth on 6 % of a disc only.
const LONGEST: f64 = 2.0;

/// Rounds in which extent and spacings are found from each other: after three they change by less than a thousandth.
const ROUNDS: usize = 3;

/// The slowest that texels advance on the texture, as a share of the mean: where the surface stands still.
const SLOWEST: f64 = 1e-3;

/// A parameter of a patch as a function of the place on its chart, both from 0 to 1: linear between knots, ascending.
#[derive(Clone, Debug, PartialEq)]
pub struct Spacing {
    places: Vec<f64>,
    values: Vec<f64>,
}

impl Default for Spacing {
    fn default() -> Self {
        Self { places: vec![0.0, 1.0], values: vec![0.0, 1.0] }
    }
}

impl Spacing {
    /// By the knots' values, which ascend from 0 to 1, and the lengths of the stretches between them on the chart, all
    /// of them positive.
    pub(super) fn new(values: Vec<f64>, lengths: &[f64]) -> Self {
        let whole: f64 = lengths.iter().sum();
        let mut reached = 0.0;
        let mut places = vec![0.0];
        places.extend(lengths.iter().map(|length| {
            reached += length;
            reached / whole
        }));
        if let Some(last) = places.last_mut() {
            *last = 1.0;
        }
        Self { places, values }
    }

    /// The parameter at a place of the chart.
    #[must_use]
    pub fn value(&self, place: f64) -> f64 {
        interpolated(&self.places, &self.values, place)
    }

    /// The place of a value of the parameter.
    #[must_use]
    pub fn place(&self, value: f64) -> f64 {
        interpolated(&self.values, &self.places, value)
    }
}

/// The value at x of a function that is linear between knots.
fn interpolated(x: &[f64], y: &[f64], at: f64) -> f64 {
    let k = x.partition_point(|knot| *knot <= at).clamp(1, x.len() - 1);
    let share = (at - x[k - 1]) / (x[k] - x[k - 1]);
    // The knots themselves are exact.
    if at == x[k] { y[k] } else { y[k - 1] + share * (y[k] - y[k - 1]) }
}

/// The shape of a patch on its chart.
pub(super) struct Layout {
    /// Area of the patch. Square millimetres.
    pub(super) area: f64,
    /// Width and height in millimetres. Their product is the area of as many texels of equal area as the chart has: the
    /// patch's, and more where texels are smaller, at poles. Their proportion makes texels square on the average (the
    /// mean of the logarithm of the sides' proportion, by area).
    pub(super) extent: [f64; 2],
    /// Those of u and of v.
    pub(super) spacings: [Spacing; 2],
}

impl Layout {
    /// The chart of a patch whose rows and columns stand for equal areas, but where their texels would be longer than
    /// `LONGEST` allows. `patches` are those of the model.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub(super) fn equal(instance: &dyn Instance, patch: usize, patches: usize) -> Result<Self, EvaluationError> {
        // Where breaks cannot be looked for, partial derivatives may still exist.
        let breaks = Breaks::of_patch(instance, patch).unwrap_or_default();
        let fine = (MOST as f64 / patches.max(1) as f64 / (2.0 * COARSE)).clamp(COARSE, FINE);
        let along_u = Samples::new(instance, patch, [Steps::of(&breaks.u, fine), Steps::of(&breaks.v, COARSE)])?;
        let along_v = Samples::new(instance, patch, [Steps::of(&breaks.u, COARSE), Steps::of(&breaks.v, fine)])?;
        let mut layout = along_v.layout([(Spacing::default(), 1.0), (Spacing::default(), 1.0)]);
        let mut square = layout.extent;
        // The limit of the sides depends on the extent, and this on the spacings.
        for _ in 0..ROUNDS {
            if layout.area <= 0.0 {
                break;
            }
            let spread = [along_u.spacing(0, square[0]), along_v.spacing(1, square[1])];
            let stretches = spread.each_ref().map(|(_, stretch)| *stretch);
            layout = along_v.layout(spread);
            square = [0, 1].map(|axis| layout.extent[axis] / stretches[axis]);
        }
        Ok(layout)
    }

    /// The chart of a patch over which u and v run linearly.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub(super) fn linear(instance: &dyn Instance, patch: usize) -> Result<Self, EvaluationError> {
        let breaks = Breaks::of_patch(instance, patch).unwrap_or_default();
        let samples = Samples::new(instance, patch, [&breaks.u, &breaks.v].map(|b| Steps::of(b, COARSE)))?;
        Ok(samples.layout([(Spacing::default(), 1.0), (Spacing::default(), 1.0)]))
    }
}

/// Steps of a parameter between breaks: none crosses one.
struct Steps {
    /// Where they begin.
    starts: Vec<f64>,
    middles: Vec<f64>,
    lengths: Vec<f64>,
}

impl Steps {
    /// So many to a unit of the parameter.
    fn of(breaks: &[Break], to_unit: f64) -> Self {
        let mut steps = Self { starts: Vec::new(), middles: Vec::new(), lengths: Vec::new() };
        for (start, end) in spans(breaks.iter().map(|b| (b.before, b.after))) {
            let length = end - start;
            let count = (to_unit * length).ceil().max(LEAST);
            for k in 0..count as u32 {
                let at = |k: f64| start + length * (k / count);
                steps.starts.push(at(f64::from(k)));
                steps.middles.push(at(f64::from(k) + 0.5));
                steps.lengths.push(length / count);
            }
        }
        steps
    }
}

/// The partial derivatives of a patch in the middle of steps of u and of v: the midpoint rule.
struct Samples {
    steps: [Steps; 2],
    /// By v, then u.
    partials: Vec<Partials>,
}

impl Samples {
    fn new(instance: &dyn Instance, patch: usize, steps: [Steps; 2]) -> Result<Self, EvaluationError> {
        let [u, v] = steps.each_ref().map(|steps| steps.middles.as_slice());
        let mut partials = vec![Partials::default(); u.len() * v.len()];
        instance.partials_grid(patch, u, v, &mut partials)?;
        Ok(Self { steps, partials })
    }

    /// For every sample the numbers of its steps of u and of v, the lengths of both sides of the surface there, and its
    /// area. Those whose area is zero or not finite are left out.
    fn pieces(&self) -> impl Iterator<Item = ([usize; 2], [f64; 2], f64)> {
        let count = self.steps[0].middles.len();
        self.partials.iter().enumerate().filter_map(move |(k, p)| {
            let at = [k % count, k / count];
            let (du, dv) = (DVec3::from_array(p.du), DVec3::from_array(p.dv));
            let [of_u, of_v] = [0, 1].map(|axis| self.steps[axis].lengths[at[axis]]);
            let area = du.cross(dv).length() * of_u * of_v;
            (area > 0.0 && area.is_finite()).then(|| (at, [du.length() * of_u, dv.length() * of_v], area))
        })
    }

    /// The chart with spacings of u and of v, each with the factor by which its texels are more than if all had an
    /// equal area. Without an extent where the patch has no area.
    fn layout(&self, spread: [(Spacing, f64); 2]) -> Layout {
        let on_chart = [0, 1].map(|axis| {
            let (steps, (spacing, stretch)) = (&self.steps[axis], &spread[axis]);
            let of_step =
                |(start, length): (&f64, &f64)| stretch * (spacing.place(start + length) - spacing.place(*start));
            steps.starts.iter().zip(&steps.lengths).map(of_step).collect::<Vec<f64>>()
        });
        let (mut sum, mut logarithms) = (0.0, 0.0);
        for (at, sides, area) in self.pieces() {
            let [right, up] = [0, 1].map(|axis| sides[axis] / on_chart[axis][at[axis]]);
            sum += area;
            logarithms += area * (right / up).ln();
        }
        let (area, proportion) = (sum, (logarithms / sum).exp());
        let square = [(area * proportion).sqrt(), (area / proportion).sqrt()];
        let exists = square.iter().all(|e| *e > 0.0 && e.is_finite());
        let extent = [0, 1].map(|axis| if exists { square[axis] * spread[axis].1 } else { 0.0 });
        Layout { area: if exists { area } else { 0.0 }, extent, spacings: spread.map(|(spacing, _)| spacing) }
    }

    /// The spacing of u (0) or of v (1) in whose steps equal areas lie, but where that would make texels too long, on a
    /// chart that is `extent` millimetres long that way; with the factor by which texels are more for it.
    fn spacing(&self, axis: usize, extent: f64) -> (Spacing, f64) {
        let steps = &self.steps[axis];
        let mut areas = vec![0.0; steps.middles.len()];
        let mut sides = vec![0.0f64; steps.middles.len()];
        for (at, lengths, area) in self.pieces() {
            areas[at[axis]] += area;
            sides[at[axis]] = lengths[axis].max(sides[at[axis]]);
        }
        let whole: f64 = areas.iter().sum();
        let of_step = |k: usize| (areas[k] / whole).max(sides[k] / (LONGEST * extent)).max(SLOWEST * steps.lengths[k]);
        let lengths: Vec<f64> = (0..steps.middles.len()).map(of_step).collect();
        let stretch = lengths.iter().sum();
        (Spacing::new(steps.starts.iter().copied().chain([1.0]).collect(), &lengths), stretch)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Model;
    use gml_compiler::program::{Options, Program, compile};
    use gml_compiler::source::{NoFiles, SourceFile};

    fn compiled(text: &str) -> Program {
        let script = SourceFile { name: "a.gml".to_owned(), text: text.to_owned() };
        compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program
    }

    fn layouts(text: &str) -> Vec<Layout> {
        let program = compiled(text);
        let instance = Model::instantiate(&program, &[]).expect("it exists");
        let count = program.parts().len();
        (0..count).map(|patch| Layout::equal(&*instance, patch, count).expect("it is finite")).collect()
    }

    #[test]
    fn values_and_places_are_inverse_and_exact_at_knots() {
        let spacing = Spacing::new(vec![0.0, 0.25, 0.5, 1.0], &[3.0, 1.0, 4.0]);
        for (value, place) in [(0.0, 0.0), (0.25, 0.375), (0.5, 0.5), (1.0, 1.0), (0.125, 0.1875), (0.75, 0.75)] {
            assert!((spacing.place(value) - place).abs() < 1e-15, "{value}");
            assert!((spacing.value(place) - value).abs() < 1e-15, "{place}");
        }
        assert_eq!((spacing.value(1.0), spacing.place(1.0)), (1.0, 1.0));
    }

    #[test]
    fn areas_are_right_between_breaks() {
        // Seven pieces of an equal share of u, 63 mm long together, and five steps of 8 mm by 10 mm.
        let corners =
            "(0mm, 0mm), (1mm, 0mm), (1mm, 30mm), (2mm, 30mm), (2mm, 1mm), (3mm, 1mm), (3mm, 1.5mm), (3.5mm, 1.5mm)";
        let text = format!(
            "use std.polyline (polyline)\nuse std.sweep (extrude)\nmodel areas {{\n\
             part a = extrude(polyline([{corners}]), 10mm)\n\
             part b = |u: real, v: real| (u * 40mm, v * 10mm, floor(5 * u) * 7mm)\n}}"
        );
        let program = compiled(&text);
        let instance = Model::instantiate(&program, &[]).expect("it exists");
        for (patch, area) in [630.0, 400.0].into_iter().enumerate() {
            for layout in [Layout::equal(&*instance, patch, 2), Layout::linear(&*instance, patch)] {
                let layout = layout.expect("it is finite");
                let [width, height] = layout.extent;
                assert!((layout.area - area).abs() < 1e-9 * area, "{} for {area}", layout.area);
                // Both are linear between their breaks, so that the rule is exact but for rounding.
                assert!((width * height - area).abs() < 1e-9 * area, "{} for {area}", width * height);
            }
        }
        // The second corner is at 31 mm of 63.
        let equal = Layout::equal(&*instance, 0, 2).expect("it is finite");
        assert!((equal.spacings[0].place(2.0 / 7.0) - 31.0 / 63.0).abs() < 1e-9);
        assert_eq!(equal.spacings[1].place(0.3), 0.3);
    }

    /// The area of a cone between the apex and the radius r goes with r^2, that of a torus by its formula. Neither has
    /// rows that are too long.
    #[test]
    fn rows_stand_for_equal_areas_by_the_formulas() {
        let layouts = layouts(
            "model a {\n\
             part cone = |u: real, v: real| { let r = 15mm + 15mm * v\n let a = 1turn * u\n (r * cos(a), r * sin(a), 30mm * v) }\n\
             part torus = |u: real, v: real| { let b = 1turn * v\n let r = 30mm + 10mm * cos(b)\n let a = 1turn * u\n\
             (r * cos(a), r * sin(a), 10mm * sin(b)) }\n}",
        );
        let [cone, torus] = [0, 1].map(|k| &layouts[k].spacings);
        for k in 0..=20 {
            let v = f64::from(k) / 20.0;
            let r = 15.0 + 15.0 * v;
            let of_cone = (r * r - 225.0) / 675.0;
            let of_torus = v + 10.0 * (std::f64::consts::TAU * v).sin() / (30.0 * std::f64::consts::TAU);
            // Between knots the table is linear: (1/256)^2 of its bend.
            assert!((cone[1].place(v) - of_cone).abs() < 1e-4, "{v}: {}", cone[1].place(v));
            assert!((torus[1].place(v) - of_torus).abs() < 1e-4, "{v}: {}", torus[1].place(v));
            assert!((cone[0].place(v) - v).abs() < 1e-9 && (torus[0].place(v) - v).abs() < 1e-9);
        }
    }

    #[test]
    fn texels_at_a_pole_are_no_longer_than_the_limit() {
        let layout = &layouts("use std.surface (disc)\nmodel a { part a = disc(30mm) }")[0];
        // v runs from the rim to the middle.
        let (radius, extent) = (&layout.spacings[1], layout.extent[1]);
        assert!((layout.spacings[0].place(0.3) - 0.3).abs() < 1e-9);
        let mut longest: f64 = 0.0;
        for k in 0..1000 {
            let [from, to] = [k, k + 1].map(|k| radius.value(f64::from(k) / 1000.0));
            longest = longest.max(30.0 * (to - from) / (extent / 1000.0));
        }
        // The last round has changed the extent by a thousandth.
        assert!((longest / LONGEST - 1.0).abs() < 2e-3, "{longest}");
        let [width, height] = layout.extent;
        // Equal areas but within r, where 2 r of the radius is the limit: there twice as many.
        let more = width * height / layout.area - 1.0;
        assert!((0.03..0.1).contains(&more), "{more}");
        // Equal areas beyond: the place goes with the square of the radius.
        let slope = |r: f64| (radius.place(1.0 - r + 0.01) - radius.place(1.0 - r - 0.01)) / r;
        assert!((slope(0.9) / slope(0.4) - 1.0).abs() < 1e-2, "{} {}", slope(0.9), slope(0.4));
    }
}
