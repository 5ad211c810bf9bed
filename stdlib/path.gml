// Profiles in named pieces: curves in the plane that go on where another one ends, in its direction, and the pieces of
// corners. Each piece is a curve of its own and can be a part of its own, as by `revolve`; `join` makes one of several.

/// The straight line that goes on from the end of a curve, in its direction.
/// ```gml
/// line_on(line((0mm, 0mm), (3mm, 0mm)), 2mm)(1)   // = (5, 0) mm
/// ```
fn line_on(curve: curve, by: length) {
  let (p, d) = _end(curve)
  line(p, p + d * by)
}

/// The arc that goes on from the end of a curve, in its direction, with a radius and through an angle: to the left
/// where that is positive.
/// ```gml
/// distance(arc_on(line((0mm, 0mm), (3mm, 0mm)), 2mm, 90deg)(1), (5mm, 2mm)) < 1e-9mm    // = true
/// distance(arc_on(line((0mm, 0mm), (3mm, 0mm)), 2mm, -90deg)(1), (5mm, -2mm)) < 1e-9mm  // = true
/// curvature(arc_on(line((0mm, 0mm), (3mm, 0mm)), 2mm, -90deg), 0) * 1mm                 // = -0.5
/// ```
fn arc_on(curve: curve, radius: length, turn: angle) {
  let (p, d) = _end(curve)
  let side = if turn < 0deg { -1 } else { 1 }
  |t: real| {
    // The chord to a point of an arc turns by half of what the arc does.
    let half = turn * (t / 2)
    p + d.rotate(half) * (2 * side * radius * sin(half))
  }
}

/// The arc that goes on from the end of a curve, in its direction, and ends at a point; a straight line where that lies
/// ahead. It must not lie straight behind.
/// ```gml
/// let c = arc_to(line((0mm, 0mm), (3mm, 0mm)), (5mm, 2mm))
/// distance(c(1), (5mm, 2mm)) < 1e-9mm                   // = true
/// distance(c(0.5), (3mm, 2mm))                          // = 2 mm
/// arc_to(line((0mm, 0mm), (3mm, 0mm)), (5mm, 0mm))(0.5)   // = (4, 0) mm
/// ```
fn arc_to(curve: curve, to: point2) {
  let (p, d) = _end(curve)
  let half = angle_between(d, to - p)
  require abs(half) < 179.999deg, "the arc cannot end straight behind the curve that it goes on from"
  |t: real| p + (to - p).rotate(half * (t - 1)) * _sine_ratio(half, t)
}

/// The cubic curve that goes on from the end of a curve, in its direction, and ends at a point in the direction
/// `toward`, of any length. `ease` says how far it keeps to both directions, in distances of its ends.
/// ```gml
/// let c = spline_to(line((0mm, 0mm), (3mm, 0mm)), (6mm, 4mm), (0, 1))
/// tangent(c, 0)   // = (1, 0)
/// tangent(c, 1)   // = (0, 1)
/// ```
fn spline_to(curve: curve, to: point2, toward: vec2, ease: real = 1) {
  let (p, d) = _end(curve)
  let reach = distance(p, to) * ease
  hermite(p, d * reach, to, normalize(toward) * reach)
}

/// The three pieces of a way from a to b by a corner that is rounded: the straight `before` and `after`, and `round`
/// between them, which touches both.
/// ```gml
/// let c = rounded_corner((0mm, 0mm), (10mm, 0mm), (10mm, 10mm), 2mm)
/// c.before(1)                              // = (8, 0) mm
/// distance(c.round(0.5), (8mm, 2mm))       // = 2 mm
/// c.after(0)                               // = (10, 2) mm
/// ```
fn rounded_corner(a: point2, corner: point2, b: point2, radius: length) {
  let cut = radius * tan(abs(angle_between(corner - a, b - corner)) / 2)
  let (before, after) = _cut_corner(a, corner, b, cut, cut)
  {before: before, round: arc_to(before, after(0)), after: after}
}

/// The same with a bevel: it begins `cut` before the corner, and ends `beyond` behind it.
/// ```gml
/// let c = bevelled_corner((0mm, 0mm), (10mm, 0mm), (10mm, 10mm), 2mm)
/// c.bevel(0.5)   // = (9, 1) mm
/// ```
fn bevelled_corner(a: point2, corner: point2, b: point2, cut: length, beyond: length = cut) {
  let (before, after) = _cut_corner(a, corner, b, cut, beyond)
  {before: before, bevel: line(before(1), after(0)), after: after}
}

/// The lines from a to a corner and from there to b, with so much cut off at the corner.
fn _cut_corner(a: point2, corner: point2, b: point2, cut: length, beyond: length) {
  let (to, from) = (corner - a, b - corner)
  require cut <= norm(to) and beyond <= norm(from), "the corner does not fit between the points beside it"
  (line(a, corner - normalize(to) * cut), line(corner + normalize(from) * beyond, b))
}

/// Where a curve ends, and its direction there.
fn _end(curve) = (curve(1), tangent(curve, 1))

/// sin(a t) / sin(a), also at a = 0.
fn _sine_ratio(a: angle, t: real) = if abs(a) < 0.01rad {
  // The series: what it leaves out is below 1e-14.
  let x = radians(a) ^ 2
  t * (1 + x * (1 - t ^ 2) / 6 + x ^ 2 * (7 - 10 * t ^ 2 + 3 * t ^ 4) / 360)
} else {
  sin(a * t) / sin(a)
}
