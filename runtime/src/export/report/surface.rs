//! The input of the interactive view and of the map: mesh, and deviations of the texels.

use super::Report;
use super::pack::Planes;
use crate::export::colormap::{AMBIGUOUS, BURIED, CONTRADICTED, FILLED, NO_DATA};
use crate::export::scale::Scale;
use crate::mesh::TriangleMesh;
use crate::variance::{Class, Deviations};

/// Steps of a deviation from zero to the end of the colour scale: with so many no channel of its colour is off by more
/// than one.
const STEPS: f64 = 256.0;

/// What a texel is if it has no distance; data.js and viewer.frag know the numbers.
pub(super) const CLASSES: [[u8; 3]; 5] = [NO_DATA, FILLED, BURIED, CONTRADICTED, AMBIGUOUS];

/// The mesh as data.js reads it: planes of the vertices' positions within the bounding box and texture coordinates, 16
/// bits each; of their normals, 8 bits each; and of the triangles' vertices, counted from those of the triangle before.
/// Triangles with vertices that do not exist are left out.
pub(super) fn mesh(mesh: &TriangleMesh) -> String {
    let (centre, half) = (mesh.bounds().centre(), mesh.bounds().size() / 2.0);
    let share = |x: f64| (x.clamp(0.0, 1.0) * 65535.0).round() as u16;
    let mut planes = Planes::default();
    for k in 0..3 {
        let place = |p: &[f64; 3]| if half[k] > 0.0 { 0.5 + 0.5 * (p[k] - centre[k]) / half[k] } else { 0.5 };
        planes.smooth(&mesh.positions.iter().map(|p| share(place(p))).collect::<Vec<_>>());
    }
    let vertices = 0..mesh.positions.len();
    for k in 0..2 {
        let coordinate = |i: usize| mesh.texcoords.get(i).map_or(0, |c| share(c[k]));
        planes.smooth(&vertices.clone().map(coordinate).collect::<Vec<_>>());
    }
    for k in 0..3 {
        let mut before = 0_u8;
        planes.bytes(vertices.clone().map(|i| {
            let normal = mesh.normals.get(i).copied().unwrap_or([0.0, 0.0, 1.0]);
            let byte = (normal[k] * 127.0).round() as i8 as u8;
            byte.wrapping_sub(std::mem::replace(&mut before, byte))
        }));
    }
    for corner in 0..3 {
        let mut before = 0;
        let step = |t: &[u32; 3]| t[corner] as i32 - std::mem::replace(&mut before, t[corner] as i32);
        planes.numbers(&drawn(mesh).map(step).collect::<Vec<_>>(), 4);
    }
    planes.text()
}

pub(super) fn drawn(mesh: &TriangleMesh) -> impl Iterator<Item = &[u32; 3]> {
    drawn_of(mesh, &mesh.triangles)
}

/// Those of some triangles of a mesh whose vertices exist.
pub(super) fn drawn_of<'m>(mesh: &TriangleMesh, triangles: &'m [[u32; 3]]) -> impl Iterator<Item = &'m [u32; 3]> {
    let vertices = mesh.positions.len();
    triangles.iter().filter(move |t| t.iter().all(|&v| (v as usize) < vertices))
}

/// The width of a step of the deviations in the page: not coarser than the robust range asks for, however wide the
/// scale of colours is. Millimetres.
pub(super) fn step(report: &Report<'_>) -> f64 {
    let range = report.scale.end.min(Scale::robust(report.variance).end);
    (range / STEPS).max(report.variance.max_distance / f64::from(i16::MAX))
}

/// The deviations as data.js reads them: for each texel of the texture, row by row from the top, whether it has one
/// (1), or what else it is (0 beside the charts, 2 and on: `CLASSES`); then those of the texels that have one, as whole
/// numbers of steps, 16 bits, less what the neighbours before let expect.
pub(super) fn texels(deviations: &Deviations, step: f64) -> String {
    let (width, height) = (deviations.texels.width as usize, deviations.texels.height as usize);
    let mut classes = vec![0_u8; width * height];
    let mut steps = vec![0_i32; width * height];
    for i in 0..deviations.texels.len() {
        let [x, y] = deviations.texels.place(i).map(|n| n as usize);
        let distance = f64::from(deviations.signed(i));
        let (class, value) = (number(deviations.class(i)), (distance / step).round());
        classes[y * width + x] = class;
        steps[y * width + x] = if class == 1 { value.clamp(-32767.0, 32767.0) as i32 } else { 0 };
    }
    let known = |x: usize, y: usize, dx: usize, dy: usize| {
        (x >= dx && y >= dy).then(|| (y - dy) * width + x - dx).filter(|i| classes[*i] == 1).map(|i| steps[i])
    };
    let mut differences = Vec::with_capacity(deviations.texels.len());
    for i in (0..width * height).filter(|i| classes[*i] == 1) {
        let (x, y) = (i % width, i / width);
        let expected = match (known(x, y, 1, 0), known(x, y, 0, 1), known(x, y, 1, 1)) {
            (Some(left), Some(above), Some(corner)) => left + above - corner,
            (Some(one), ..) | (None, Some(one), _) => one,
            _ => 0,
        };
        differences.push(i32::from((steps[i] - expected) as i16));
    }
    let mut planes = Planes::default();
    planes.bytes(classes);
    planes.numbers(&differences, 2);
    planes.text()
}

/// The number of a texel's class, in the order of `CLASSES`.
fn number(class: Class) -> u8 {
    match class {
        Class::Measured => 1,
        Class::NoData | Class::Beyond | Class::FacingAway => 2,
        Class::Filled => 3,
        Class::Buried => 4,
        Class::Contradicted => 5,
        Class::Ambiguous => 6,
    }
}
