//! The quadric that fits the cells about a place best, as what it multiplies their weights by.

use glam::DVec2;

/// Slope and bend along a direction count if the cells reach farther along it than this share of the cut-off.
const SLOPED: f64 = 0.05;
/// A bend counts if this share of its mean square is not that of slopes and of the other bends: cells on few lines show
/// no bend between these.
const BENT: f64 = 1e-3;

/// A cell about a place.
pub(super) struct Near {
    pub(super) cell: u32,
    /// Its weight; those of all cells add up to 1.
    pub(super) weight: f64,
    /// Where it is in the tangent plane, as far away as it is along the surface. Cut-offs.
    pub(super) at: DVec2,
}

/// Coefficients of 1, p, q, p^2, pq and q^2, where p and q are along the cells' principal directions about their
/// centre.
type Coefficients = [f64; 6];

/// The exponents of p and q.
const EXPONENTS: [[usize; 2]; 6] = [[0, 0], [1, 0], [0, 1], [2, 0], [1, 1], [0, 2]];

/// A quadric that is orthogonal to others over the cells with their weights.
struct Function {
    coefficients: Coefficients,
    /// At the place that is filtered.
    here: f64,
    /// Its mean square over the cells.
    square: f64,
}

/// What a cell's weight is multiplied by so that the filtered value is that of the best quadric.
pub(super) struct Quadric {
    centre: DVec2,
    axes: [DVec2; 2],
    coefficients: Coefficients,
}

impl Quadric {
    pub(super) fn of(near: &[Near]) -> Self {
        let centre = near.iter().map(|n| n.weight * n.at).sum::<DVec2>();
        let (axes, variances) = principal(near, centre);
        let mut quadric = Self { centre, axes, coefficients: [0.0; 6] };
        let place = quadric.local(DVec2::ZERO);
        let moments = quadric.moments(near);
        let product = |a: &Coefficients, b: &Coefficients| -> f64 {
            let of_term = |i: usize| {
                let with = |k: usize| {
                    let [p, q] = [0, 1].map(|axis| EXPONENTS[i][axis] + EXPONENTS[k][axis]);
                    b[k] * moments[p][q]
                };
                a[i] * (0..6).map(with).sum::<f64>()
            };
            (0..6).map(of_term).sum()
        };
        // An even one, slopes along directions in which the cells reach far enough, and these slopes' bends.
        let is_sloped = variances.map(|variance| variance > SLOPED * SLOPED);
        let has = |[p, q]: [usize; 2]| (p == 0 || is_sloped[0]) && (q == 0 || is_sloped[1]);
        let mut functions: Vec<Function> = Vec::with_capacity(6);
        for term in (0..6).filter(|term| has(EXPONENTS[*term])) {
            let mut coefficients = [0.0; 6];
            coefficients[term] = 1.0;
            let whole = product(&coefficients, &coefficients);
            // Gram-Schmidt, twice over for its rounding.
            for f in functions.iter().chain(&functions) {
                let share = product(&coefficients, &f.coefficients) / f.square;
                coefficients.iter_mut().zip(f.coefficients).for_each(|(c, f)| *c -= share * f);
            }
            let square = product(&coefficients, &coefficients);
            if square > BENT * whole {
                let here = value(&coefficients, place);
                functions.push(Function { coefficients, here, square });
            }
        }
        for f in &functions {
            quadric.coefficients.iter_mut().zip(f.coefficients).for_each(|(sum, c)| *sum += c * f.here / f.square);
        }
        quadric
    }

    /// Along the principal directions.
    fn local(&self, at: DVec2) -> DVec2 {
        DVec2::from_array(self.axes.map(|axis| axis.dot(at - self.centre)))
    }

    pub(super) fn at(&self, at: DVec2) -> f64 {
        value(&self.coefficients, self.local(at))
    }

    /// Means of p^a q^b, by a and b.
    fn moments(&self, near: &[Near]) -> [[f64; 5]; 5] {
        let mut moments = [[0.0; 5]; 5];
        for n in near {
            let local = self.local(n.at);
            let mut of_p = n.weight;
            for (a, row) in moments.iter_mut().enumerate() {
                let mut power = of_p;
                for moment in &mut row[..5 - a] {
                    *moment += power;
                    power *= local.y;
                }
                of_p *= local.x;
            }
        }
        moments
    }
}

fn value(c: &Coefficients, DVec2 { x: p, y: q }: DVec2) -> f64 {
    c[0] + p * (c[1] + p * c[3] + q * c[4]) + q * (c[2] + q * c[5])
}

/// The cells' principal directions about their centre, and their variances along these, the larger first.
fn principal(near: &[Near], centre: DVec2) -> ([DVec2; 2], [f64; 2]) {
    let [mut xx, mut xy, mut yy] = [0.0; 3];
    for n in near {
        let t = n.at - centre;
        xx += n.weight * t.x * t.x;
        xy += n.weight * t.x * t.y;
        yy += n.weight * t.y * t.y;
    }
    let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
    let root = half.hypot(xy);
    let first = DVec2::from_angle(0.5 * xy.atan2(half));
    ([first, first.perp()], [mean + root, mean - root])
}
