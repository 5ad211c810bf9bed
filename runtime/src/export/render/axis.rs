//! The view that shows a model cut open: along its axis.

use super::view::{Cut, View};
use crate::eigen;
use crate::mesh::{Bounds, TriangleMesh};
use glam::{DMat3, DVec3};
use nalgebra::Matrix3;

/// How far the normal of surface about an axis may miss it: the sine of the angle between the normal and the plane
/// through the place and the axis. Flutes and chords are rougher than an exact surface of revolution.
const ABOUT: f64 = 0.1;

/// The axis of a part takes the place of the model's own upright one if so many times the area lies about it.
const BETTER: f64 = 1.02;

/// What stands out of a body of revolution to one side, such as a handle, decides how the plane turns about the axis if
/// the centre of gravity is by so much of the model's size beside the axis.
const ASIDE: f64 = 0.01;

/// The share of the surface that must lie about the axis of a part: a bent pipe is no body of revolution, though its
/// bend is a part of a torus, along whose axis a cut would show a ring.
const MOSTLY: f64 = 0.75;

/// The number of parts whose axes are tried, the largest ones: each is held against all of the surface.
const TRIED: usize = 16;

/// The height of the eye above the plane's normal.
const ELEVATION: f64 = 0.35;

/// Triangles with their areas, in the model's frame.
struct Face {
    place: DVec3,
    normal: DVec3,
    area: f64,
}

/// A line: a point, and a unit direction.
type Axis = (DVec3, DVec3);

/// The view of a mesh that is cut open along the axis about which nearly all of its surface lies, or else along its own
/// upright one, so that the profile is seen. Where something stands out to one side, as a handle does, the plane
/// contains that; otherwise it faces the front. `turned` is the rotation from the model's own frame, row by row.
#[must_use]
pub fn cut_open(mesh: &TriangleMesh, turned: &[[f64; 3]; 3]) -> View {
    let own = DMat3::from_cols_array_2d(turned).transpose();
    let size = mesh.bounds().diagonal().max(f64::MIN_POSITIVE);
    let mut groups: Vec<Vec<Face>> = match mesh.groups.as_slice() {
        [] => vec![faces(mesh, &mesh.triangles)],
        groups => groups.iter().map(|g| faces(mesh, mesh.triangles.get(g.start..g.end).unwrap_or_default())).collect(),
    };
    groups.sort_by(|a, b| area_of(b).total_cmp(&area_of(a)));
    let all = || groups.iter().flatten();
    let area: f64 = groups.iter().map(|group| area_of(group)).sum();
    let bounds: Bounds = mesh.positions.iter().map(|p| own.transpose() * DVec3::from_array(*p)).collect();
    let middle = own * bounds.centre();
    let mut axis: Axis = (middle, own * DVec3::Z);
    let about = |axis: &Axis| all().filter(|face| is_about(face, axis)).map(|face| face.area).sum::<f64>();
    let mut most = about(&axis);
    for candidate in groups.iter().take(TRIED).filter_map(|group| axis_of(group)) {
        let share = about(&candidate);
        if share > BETTER * most && share > MOSTLY * area {
            (axis, most) = (candidate, share);
        }
    }
    let (through, along) = axis;
    let aside = all().fold(DVec3::ZERO, |sum, f| sum + f.area * (f.place - through).reject_from_normalized(along));
    let aside = (aside.length() > ASIDE * size * area).then_some(aside);
    let (front, up) = (own * DVec3::NEG_Y, own * DVec3::Z);
    let beside = aside.and_then(|aside| along.cross(aside).try_normalize());
    let faced = [front, own * DVec3::X].map(|d| d.reject_from_normalized(along)).into_iter();
    let normal = beside.or_else(|| faced.filter(|d| d.length() > 0.5).find_map(DVec3::try_normalize)).unwrap_or(front);
    // The half that is cut away is the front one, or else the right or the upper one.
    let towards = [front, own * DVec3::X, up].into_iter().map(|d| normal.dot(d)).find(|dot| dot.abs() > 1e-6);
    let normal = if towards.is_some_and(|dot| dot < 0.0) { -normal } else { normal };
    let (high, raised) = match up.reject_from_normalized(normal).try_normalize() {
        Some(high) if normal.dot(up).abs() < 0.9 => (high, high),
        _ => (-front, front),
    };
    View { toward: normal + ELEVATION * raised, up: high, cut: Some(Cut { normal, through: Some(through) }) }
}

fn faces(mesh: &TriangleMesh, triangles: &[[u32; 3]]) -> Vec<Face> {
    let is_finite = |v: &u32| mesh.positions.get(*v as usize).is_some_and(|p| p.iter().all(|c| c.is_finite()));
    let face = |t: &[u32; 3]| {
        let [a, b, c] = mesh.corners(*t);
        Some(Face { place: (a + b + c) / 3.0, normal: mesh.triangle_normal(*t)?, area: mesh.triangle_area(*t) })
    };
    triangles.iter().filter(|t| t.iter().all(is_finite)).filter_map(face).collect()
}

fn area_of(faces: &[Face]) -> f64 {
    faces.iter().map(|face| face.area).sum()
}

/// Whether a face may belong to a surface of revolution about an axis: its normal meets the axis.
fn is_about(face: &Face, (through, along): &Axis) -> bool {
    let round = along.cross(face.place - *through);
    face.normal.dot(round).abs() <= ABOUT * round.length()
}

/// The axis about which a turn moves a surface within itself the most: the velocities c x p + d of its places have the
/// least components along the normals (Pottmann and Wallner, 'Computational Line Geometry', 2001). None without
/// surface. It is any line of a sphere through its centre, and that through the middle of a disc.
fn axis_of(faces: &[Face]) -> Option<Axis> {
    let area = area_of(faces);
    if area <= 0.0 {
        return None;
    }
    let centre = faces.iter().fold(DVec3::ZERO, |sum, face| sum + face.area * face.place) / area;
    let reach = faces.iter().map(|face| (face.place - centre).length()).fold(f64::MIN_POSITIVE, f64::max);
    let [mut shifts, mut mixed, mut turns] = [Matrix3::<f64>::zeros(); 3];
    for face in faces {
        let n = nalgebra::Vector3::from(face.normal.to_array());
        let moment = nalgebra::Vector3::from(((face.place - centre) / reach).cross(face.normal).to_array());
        let weight = face.area / area;
        shifts += weight * n * n.transpose();
        mixed += weight * n * moment.transpose();
        turns += weight * moment * moment.transpose();
    }
    // The best shift follows from the turn; directions in which any shift is as good have none.
    let found = eigen::symmetric(shifts);
    let inverse = (0..3).filter(|k| found.eigenvalues[*k] > 1e-6).fold(Matrix3::zeros(), |sum: Matrix3<f64>, k| {
        let v = found.eigenvectors.column(k);
        sum + v * v.transpose() / found.eigenvalues[k]
    });
    let rest = turns - mixed.transpose() * inverse * mixed;
    let found = eigen::symmetric(rest);
    let least = (0..3).min_by(|a, b| found.eigenvalues[*a].total_cmp(&found.eigenvalues[*b]))?;
    let turn = found.eigenvectors.column(least).into_owned();
    let shift = -(inverse * mixed * turn);
    let (along, shift) = (DVec3::new(turn.x, turn.y, turn.z).try_normalize()?, DVec3::new(shift.x, shift.y, shift.z));
    Some((centre + reach * along.cross(shift), along))
}
