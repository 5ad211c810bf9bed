//! Directions of view.

use super::Layer;
use crate::mesh::Bounds;
use glam::{DMat3, DVec3};

/// The share of the picture's sides that stays free around the surfaces.
const MARGIN: f64 = 0.06;

/// A direction of view. The projection is orthographic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The direction from the surfaces towards the eye.
    pub toward: DVec3,
    /// The direction that is roughly up in the picture.
    pub up: DVec3,
    /// The plane in front of which everything is cut away.
    pub cut: Option<Cut>,
}

/// A plane that cuts surfaces open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    /// The direction towards what is cut away; it points to the eye's side.
    pub normal: DVec3,
    /// A point of the plane, in millimetres; the middle of the surfaces where there is none.
    pub through: Option<DVec3>,
}

impl View {
    /// From the front (from -y), a little to the right and above.
    pub const FRONT: Self = Self { toward: DVec3::new(0.35, -1.0, 0.4), up: DVec3::Z, cut: None };
    /// From the back, a little to the left of it and above.
    pub const BACK: Self = Self { toward: DVec3::new(-0.35, 1.0, 0.4), up: DVec3::Z, cut: None };
    /// From above, the front at the bottom.
    pub const TOP: Self = Self { toward: DVec3::Z, up: DVec3::Y, cut: None };
    /// From the right.
    pub const RIGHT: Self = Self { toward: DVec3::new(1.0, 0.35, 0.4), up: DVec3::Z, cut: None };
    /// From the left.
    pub const LEFT: Self = Self { toward: DVec3::new(-1.0, -0.35, 0.4), up: DVec3::Z, cut: None };
    /// From below, the front at the top.
    pub const BELOW: Self = Self { toward: DVec3::NEG_Z, up: DVec3::NEG_Y, cut: None };
    /// From the front and above, without the front half: the cut is upright.
    pub const INSIDE: Self = Self {
        toward: DVec3::new(0.0, -1.0, 0.35),
        up: DVec3::Z,
        cut: Some(Cut { normal: DVec3::NEG_Y, through: None }),
    };

    /// From a direction in degrees: an azimuth, counted from the front (-y) over the right (+x), and an elevation above
    /// the plane of x and y. Up is up also from straight above and below.
    #[must_use]
    pub fn from_angles(azimuth: f64, elevation: f64) -> Self {
        let ((sa, ca), (se, ce)) = (azimuth.to_radians().sin_cos(), elevation.to_radians().sin_cos());
        Self { toward: DVec3::new(sa * ce, -ca * ce, se), up: DVec3::new(-sa * se, ca * se, ce), cut: None }
    }

    /// The same view of something that was turned by a rotation matrix (row by row): a fitted model lies as the scan
    /// does, while front and top are the model's own.
    #[must_use]
    pub fn of_turned(self, rotation: &[[f64; 3]; 3]) -> Self {
        let turn = DMat3::from_cols_array_2d(rotation).transpose();
        let turned = |cut: Cut| Cut { normal: turn * cut.normal, through: cut.through.map(|p| turn * p) };
        Self { toward: turn * self.toward, up: turn * self.up, cut: self.cut.map(turned) }
    }
}

/// A view fitted to surfaces and to a picture.
pub(super) struct Camera {
    /// The picture's axes as rows: right, up, and towards the eye, of unit length.
    axes: DMat3,
    centre: DVec3,
    /// Samples a millimetre.
    pub(super) scale: f64,
    middle: [f64; 2],
    /// The plane of the cut: its normal, and a point of it.
    cut: Option<(DVec3, DVec3)>,
}

/// The depth of the plane of a cut: nothing nearer is drawn. It is `at[0] + at[1] * column + at[2] * row`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limit {
    at: [f32; 3],
}

impl Limit {
    /// The greatest depth that is drawn at a sample's middle.
    pub(super) fn depth(&self, column: f32, row: f32) -> f32 {
        self.at[0] + self.at[1] * column + self.at[2] * row
    }
}

impl Camera {
    /// The camera from which the layers fill a picture of so many samples.
    pub(super) fn fit<'a>(
        layers: impl IntoIterator<Item = &'a Layer<'a>>,
        view: &View,
        width: usize,
        height: usize,
    ) -> Self {
        let axes = axes(view);
        let used = layers
            .into_iter()
            .flat_map(|l| l.mesh.triangles.iter().flatten().filter_map(|&v| l.mesh.positions.get(v as usize)))
            .map(|p| DVec3::from_array(*p))
            .filter(|p| p.is_finite());
        let mut bounds: Bounds = used.map(|p| axes * p).collect();
        if bounds.is_empty() {
            bounds = Bounds { low: DVec3::NEG_ONE, high: DVec3::ONE };
        }
        let centre = axes.transpose() * bounds.centre();
        let (size, extent) = ([width as f64, height as f64], bounds.size());
        let room = |k: usize| size[k] * (1.0 - 2.0 * MARGIN) / extent[k].max(1e-9);
        let cut = view.cut.map(|cut| (cut.normal, cut.through.unwrap_or(centre)));
        Self { axes, centre, scale: room(0).min(room(1)), middle: size.map(|s| 0.5 * s), cut }
    }

    /// Column, row (downwards) and depth (growing towards the eye, 0 at the centre) of a point, in samples.
    pub(super) fn project(&self, p: DVec3) -> [f32; 3] {
        let d = self.scale * (self.axes * (p - self.centre));
        [(self.middle[0] + d.x) as f32, (self.middle[1] - d.y) as f32, d.z as f32]
    }

    /// The plane of the cut: a point of it, and its normal.
    pub(super) fn cut(&self) -> Option<(DVec3, DVec3)> {
        self.cut.map(|(normal, through)| (through, normal))
    }

    /// The depths of the plane of the cut; none where nothing is cut, or where the plane is seen edge-on.
    pub(super) fn limit(&self) -> Option<Limit> {
        let (normal, through) = self.cut?;
        let (n, p) = ((self.axes * normal).try_normalize()?, self.scale * (self.axes * (through - self.centre)));
        if n.z < 1e-3 {
            return None;
        }
        let (across, down) = (-n.x / n.z, n.y / n.z);
        let origin = p.z - across * (p.x + self.middle[0]) - down * (self.middle[1] - p.y);
        Some(Limit { at: [origin, across, down].map(|c| c as f32) })
    }

    /// Components of a direction along right, up and towards the eye.
    pub(super) fn turn(&self, n: DVec3) -> [f32; 3] {
        (self.axes * n).as_vec3().to_array()
    }
}

/// Right, up and towards the eye as unit vectors, the rows of a matrix; any that fit where the view's own are parallel.
fn axes(view: &View) -> DMat3 {
    let unit = |v: DVec3| v.try_normalize().filter(|_| v.length() > 1e-9);
    let toward = unit(view.toward).unwrap_or(DVec3::NEG_Y);
    let right = [view.up, DVec3::Z, DVec3::Y, DVec3::X].into_iter().find_map(|up| unit(up.cross(toward)));
    let right = right.unwrap_or(DVec3::X);
    DMat3::from_cols(right, toward.cross(right), toward).transpose()
}
