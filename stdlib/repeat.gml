// Copies of a shape in rows, rings, grids and mirrors. A shape is a point, a curve, a surface or the parts of a model;
// a pattern is an array, and patterns of patterns are arrays of arrays:
// `part hole = cylinder(2mm, 5mm).translate((30mm, 0mm, 0mm)).polar_pattern(6)` has the parts hole[0] to hole[5]. How
// many copies there are may be an `input`, and not a `param`.

/// Copies of a shape in a row: `count` of them, each moved by `step` from the one before, the first where it is. A
/// shape is a point, a curve, a surface, or what a model gives; as a part the copies are named [0], [1], ...
/// ```gml
/// linear_pattern((1mm, 0mm, 0mm), 3, (10mm, 0mm, 0mm))[2]     // = (21, 0, 0) mm
/// len(cylinder(2mm, 5mm).linear_pattern(4, (8mm, 0mm, 0mm)))  // = 4
/// ```
fn linear_pattern(shape, count: int, step) = for i in 0..count { shape.translate(step * i) }

/// Copies of a shape around the z axis: `count` of them over `angle`, the first where it is. Over a full turn, either
/// way, they are evenly spaced; over any other angle, the last one is at its end.
/// ```gml
/// let holes = (30mm, 0mm, 0mm).polar_pattern(6)
/// distance(holes[3], (-30mm, 0mm, 0mm)) < 1e-9mm                // = true
/// distance((30mm, 0mm, 0mm).polar_pattern(3, 90deg)[2], (0mm, 30mm, 0mm)) < 1e-9mm   // = true
/// distance((30mm, 0mm, 0mm).polar_pattern(4, -360deg)[1], (0mm, -30mm, 0mm)) < 1e-9mm   // = true
/// ```
fn polar_pattern(shape, count: int, angle: angle = 360deg) {
  let gaps = if abs(abs(degrees(angle)) - 360) < 1e-9 or count == 1 { real(count) } else { count - 1.0 }
  for i in 0..count { shape.rotate(angle * i / gaps) }
}

/// Copies of a shape in a grid: `columns` along x and `rows` along y, dx and dy apart, the first where it is. An array
/// of rows.
/// ```gml
/// (0mm, 0mm, 5mm).grid_pattern(3, 2, 10mm, 20mm)[1][2]   // = (20, 20, 5) mm
/// ```
fn grid_pattern(shape, columns: int, rows: int, dx: length, dy: length) = for j in 0..rows {
  for i in 0..columns { shape.translate((i * dx, j * dy, 0mm)) }
}

/// A shape and its mirror image in the plane through the point `through` at right angles to `normal`.
/// ```gml
/// mirror_pattern((3mm, 1mm, 0mm))[1]   // = (-3, 1, 0) mm
/// ```
fn mirror_pattern(shape, normal = (1, 0, 0), through = normal * 0mm) = [shape, shape.mirror(normal, through)]

/// Copies of a shape along a curve: `count` of them at equal steps of its parameter, both ends among them, moved there
/// but not turned.
/// ```gml
/// (0mm, 0mm, 1mm).along_pattern(line((0mm, 0mm, 0mm), (9mm, 0mm, 0mm)), 4)[2]   // = (6, 0, 1) mm
/// ```
fn along_pattern(shape, curve, count: int) = for t in steps(0, 1, count) { shape.translate(lift(curve(t))) }

/// A copy of a shape in every one of an array of frames (place, look_at, frame_at, ...).
/// ```gml
/// let feet = for x in [10mm, 50mm] { place((x, 0mm, 0mm), about_z(90deg)) }
/// norm((1mm, 0mm, 0mm).placed(feet)[1] - (50mm, 1mm, 0mm)) < 1e-9mm   // = true
/// ```
fn placed(shape, frames) = for frame in frames { frame(shape) }
