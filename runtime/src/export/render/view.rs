//! From where a picture is taken.

use super::Layer;
use crate::model::vector::{cross, dot, length, scale, sub};

/// The frame of a model that stands as its author drew it.
pub const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Part of the picture that stays free around the surfaces.
const MARGIN: f64 = 0.06;

/// A direction of view. The projection is orthographic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// From the surfaces towards the eye.
    pub toward: [f64; 3],
    /// What is up in the picture, roughly.
    pub up: [f64; 3],
    /// Whether everything in front of the centre is cut away.
    pub cut: bool,
}

impl View {
    /// From the front (from -y), a little to the right and above.
    pub const FRONT: View = View { toward: [0.35, -1.0, 0.4], up: [0.0, 0.0, 1.0], cut: false };
    /// From the back, a little to the left of it and above.
    pub const BACK: View = View { toward: [-0.35, 1.0, 0.4], up: [0.0, 0.0, 1.0], cut: false };
    /// From above, the front at the bottom.
    pub const TOP: View = View { toward: [0.0, 0.0, 1.0], up: [0.0, 1.0, 0.0], cut: false };
    /// From the front and above, without the front half.
    pub const INSIDE: View = View { toward: [0.0, -1.0, 0.35], up: [0.0, 0.0, 1.0], cut: true };

    /// From a direction in degrees: an azimuth, counted from the front (-y) over the right (+x), and an elevation above the
    /// plane of x and y. Up is up also from straight above and below.
    #[must_use]
    pub fn from_angles(azimuth: f64, elevation: f64) -> View {
        let ((sa, ca), (se, ce)) = (azimuth.to_radians().sin_cos(), elevation.to_radians().sin_cos());
        View { toward: [sa * ce, -ca * ce, se], up: [-sa * se, ca * se, ce], cut: false }
    }

    /// The same view of something that was turned by a rotation matrix (row by row): a fitted model lies as the scan
    /// does, while front and top are the model's own.
    #[must_use]
    pub fn of_turned(self, rotation: &[[f64; 3]; 3]) -> View {
        let turn = |v: [f64; 3]| [0, 1, 2].map(|k| dot(rotation[k], v));
        View { toward: turn(self.toward), up: turn(self.up), cut: self.cut }
    }
}

/// A view fitted to surfaces and to a picture.
pub(super) struct Camera {
    right: [f64; 3],
    up: [f64; 3],
    /// Unit vector towards the eye.
    pub(super) toward: [f64; 3],
    centre: [f64; 3],
    scale: f64,
    middle: [f64; 2],
    /// Nothing nearer than this is drawn.
    pub(super) nearest: f32,
}

impl Camera {
    /// So that the layers fill the picture.
    pub(super) fn fit<'a>(
        layers: impl IntoIterator<Item = &'a Layer<'a>>,
        view: &View,
        width: usize,
        height: usize,
    ) -> Camera {
        let (right, up, toward) = axes(view);
        let mut low = [f64::INFINITY; 3];
        let mut high = [f64::NEG_INFINITY; 3];
        let used = layers
            .into_iter()
            .flat_map(|l| l.mesh.triangles.iter().flatten().map(|&v| l.mesh.positions.get(v as usize)));
        for p in used.flatten().filter(|p| p.iter().all(|c| c.is_finite())) {
            for (k, axis) in [right, up, toward].into_iter().enumerate() {
                let c = dot(axis, *p);
                low[k] = low[k].min(c);
                high[k] = high[k].max(c);
            }
        }
        if low[0] > high[0] {
            (low, high) = ([-1.0; 3], [1.0; 3]);
        }
        let middle = [0, 1, 2].map(|k| 0.5 * low[k] + 0.5 * high[k]);
        let centre = [0, 1, 2].map(|k| right[k] * middle[0] + up[k] * middle[1] + toward[k] * middle[2]);
        let size = [width as f64, height as f64];
        let room = |k: usize| size[k] * (1.0 - 2.0 * MARGIN) / (high[k] - low[k]).max(1e-9);
        let nearest = if view.cut { 0.0 } else { f32::INFINITY };
        Camera { right, up, toward, centre, scale: room(0).min(room(1)), middle: size.map(|s| 0.5 * s), nearest }
    }

    /// Samples a millimetre.
    pub(super) fn scale(&self) -> f64 {
        self.scale
    }

    /// The same view at another scale.
    pub(super) fn at_scale(self, scale: f64) -> Camera {
        Camera { scale, ..self }
    }

    /// Column, row (downwards) and depth (growing towards the eye, 0 at the centre) of a point, in samples.
    pub(super) fn project(&self, p: [f64; 3]) -> [f32; 3] {
        let d = sub(p, self.centre);
        [
            (self.middle[0] + self.scale * dot(self.right, d)) as f32,
            (self.middle[1] - self.scale * dot(self.up, d)) as f32,
            (self.scale * dot(self.toward, d)) as f32,
        ]
    }

    /// Components of a direction along right, up and towards the eye.
    pub(super) fn turn(&self, n: [f64; 3]) -> [f32; 3] {
        [dot(self.right, n) as f32, dot(self.up, n) as f32, dot(self.toward, n) as f32]
    }
}

/// Right, up and towards the eye as unit vectors; any that fit where the view's own are parallel.
fn axes(view: &View) -> ([f64; 3], [f64; 3], [f64; 3]) {
    let unit = |v: [f64; 3]| {
        let l = length(v);
        (l > 1e-9 && l.is_finite()).then(|| scale(v, 1.0 / l))
    };
    let toward = unit(view.toward).unwrap_or([0.0, -1.0, 0.0]);
    let right = [view.up, [0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]
        .into_iter()
        .find_map(|up| unit(cross(up, toward)))
        .unwrap_or([1.0, 0.0, 0.0]);
    (right, cross(toward, right), toward)
}
