//! Sites at which patches are evaluated, and orders of derivatives.

use super::Part;

/// The points (u, v) at which a patch is evaluated.
#[derive(Clone, Copy, Debug)]
pub enum Sites<'a> {
    /// Any points: both slices, of u and of v, have an entry for every point.
    Scattered(&'a [f64], &'a [f64]),
    /// Every u for every v, u running fastest: the same values, faster.
    Grid(&'a [f64], &'a [f64]),
}

impl Sites<'_> {
    /// Number of points.
    #[must_use]
    pub fn count(self) -> usize {
        match self {
            Sites::Scattered(u, _) => u.len(),
            Sites::Grid(u, v) => u.len() * v.len(),
        }
    }

    /// u and v of every point, in order.
    #[must_use]
    pub fn expanded(self) -> (Vec<f64>, Vec<f64>) {
        match self {
            Sites::Scattered(u, v) => (u.to_vec(), v.to_vec()),
            Sites::Grid(u, v) => v.iter().flat_map(|v| u.iter().map(move |u| (*u, *v))).unzip(),
        }
    }
}

/// The quantities that are evaluated at every site.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order<'w> {
    /// x, y, z.
    Points,
    /// Point, dS/du, dS/dv.
    Partials,
    /// Point, dS/du, dS/dv, d2S/du2, d2S/du dv, d2S/dv2.
    SecondPartials,
    /// dS/dx: for every active parameter of the part the derivatives of the three coordinates.
    Jacobian,
    /// Sum over the sites of (dS/dx)^T w: these are the w, one a site.
    Pullback(&'w [[f64; 3]]),
    /// Signatures of the decisions that the evaluation takes by u alone, by v alone, and by both: equal decisions have
    /// equal signatures, to the bit, and different ones almost certainly different signatures. A surface is smooth
    /// where none of them changes. A surface without decisions has zeros.
    Decisions,
}

impl Order<'static> {
    /// All of them, without weights.
    pub(super) const ALL: [Order<'static>; 6] = [
        Order::Points,
        Order::Partials,
        Order::SecondPartials,
        Order::Jacobian,
        Order::Pullback(&[]),
        Order::Decisions,
    ];
}

impl Order<'_> {
    /// Numbers a site of a part; none of a pullback, which is a sum.
    #[must_use]
    pub fn width(self, part: &Part) -> usize {
        match self {
            Order::Points | Order::Decisions => 3,
            Order::Partials => 9,
            Order::SecondPartials => 18,
            Order::Jacobian => 3 * part.active.len(),
            Order::Pullback(_) => 0,
        }
    }

    /// Its place in [`Order::ALL`].
    pub(super) fn index(self) -> usize {
        match self {
            Order::Points => 0,
            Order::Partials => 1,
            Order::SecondPartials => 2,
            Order::Jacobian => 3,
            Order::Pullback(_) => 4,
            Order::Decisions => 5,
        }
    }

    /// As people call it.
    pub(super) fn name(self) -> &'static str {
        ["points", "partials", "second partials", "jacobian", "pullback", "decisions"][self.index()]
    }
}
