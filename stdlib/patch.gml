// Surfaces between four curves and over grids of points.

/// The surface between four points: the lines from a to b and from c to d are its edges at v = 0 and v = 1. Not flat,
/// in general.
/// ```gml
/// bilinear((0mm, 0mm, 0mm), (4mm, 0mm, 0mm), (0mm, 4mm, 0mm), (4mm, 4mm, 4mm))(0.5, 0.5)   // = (2, 2, 1) mm
/// ```
fn bilinear(a, b, c, d) = |u: real, v: real| mix(mix(a, b, u), mix(c, d, u), v)

/// The surface between four curves in space (Coons 1967): `bottom` and `top` run along u at v = 0 and v = 1, `left` and
/// `right` along v at u = 0 and u = 1. They must meet at the four corners.
/// ```gml
/// let arch = |z| |t| (10mm * t, 0mm, z * t * (1 - t))
/// let side = |x| line((x, 0mm, 0mm), (x, 10mm, 0mm))
/// let s = coons(arch(8mm), arch(4mm).translate((0mm, 10mm, 0mm)), side(0mm), side(10mm))
/// s(0.5, 0)       // = (5, 0, 2) mm
/// s(0.5, 0.5)     // = (5, 5, 1.5) mm
/// ```
fn coons(bottom, top, left, right) = |u: real, v: real| {
  let corners = mix(mix(bottom(0), bottom(1), u), mix(top(0), top(1), u), v)
  mix(bottom(u), top(u), v) + mix(left(v), right(v), u) - corners
}

/// The Bezier patch with these control points, an array of rows: u runs along the rows, v from row to row. It goes
/// through the four corners.
/// ```gml
/// let rows = for j in 0..3 { for i in 0..3 { (i * 2mm, j * 2mm, if i == 1 and j == 1 { 8mm } else { 0mm }) } }
/// bezier_patch(rows)(0.5, 0.5)   // = (2, 2, 2) mm
/// ```
fn bezier_patch(rows) = |u: real, v: real| bezier(for row in rows { bezier(row)(u) })(v)

/// The B-spline patch with these control points, an array of rows: u runs along the rows, v from row to row. As for
/// bspline the knots are uniform; `closed_u` makes it run around along the rows, `closed_v` across.
/// ```gml
/// let rows = for j in 0..4 { for i in 0..5 { (i * 1mm, j * 1mm, 2mm) } }
/// bspline_patch(rows, degree: 2)(0.5, 0.5)    // = (2, 1.5, 2) mm
/// ```
fn bspline_patch(rows, degree: int = 3, closed_u: bool = false, closed_v: bool = false) = |u: real, v: real|
  bspline(for row in rows { bspline(row, degree, closed_u)(u) }, degree, closed_v)(v)

/// The smooth surface through a grid of points, an array of rows (Catmull-Rom both ways): u runs along the rows, v from
/// row to row.
/// ```gml
/// let rows = for j in 0..3 { for i in 0..4 { (i * 3mm, j * 2mm, i * j * 1mm) } }
/// through_grid(rows)(1 / 3, 0.5)   // = (3, 2, 1) mm
/// ```
fn through_grid(rows, closed_u: bool = false, closed_v: bool = false) = |u: real, v: real|
  catmull_rom(for row in rows { catmull_rom(row, closed_u)(u) }, closed_v)(v)
