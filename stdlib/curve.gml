// Curves are functions of t over 0..1 whose values are points in the plane or in space. A profile, for `revolve`, is a
// curve in the plane whose first coordinate is the radius and whose second is the height.

/// The straight line from a to b, in the plane or in space.
/// ```gml
/// line((0mm, 0mm, 0mm), (4mm, 0mm, 2mm))(0.5)   // = (2, 0, 1) mm
/// ```
fn line(a, b) = |t: real| mix(a, b, t)

/// The part of a circle in the plane from one angle to another, counterclockwise where `to` is the greater. Angles
/// count from the x axis and may be any.
/// ```gml
/// distance(arc((1mm, 0mm), 2mm, 0deg, 180deg)(0.5), (1mm, 2mm)) < 1e-9mm   // = true
/// ```
fn arc(center: point2, radius: length, from: angle, to: angle) = |t: real| {
  let a = mix(from, to, t)
  (center.x + radius * cos(a), center.y + radius * sin(a))
}

/// The circular arc from a to b by way of a point between them, in the plane or in space. The three must not lie on one
/// line.
/// ```gml
/// let c = arc_through((2mm, 0mm), (0mm, 2mm), (-2mm, 0mm))
/// c(0)                 // = (2, 0) mm
/// norm(c(0.3))         // = 2 mm
/// ```
fn arc_through(a, between, b) {
  let (p, q) = (between - a, b - a)
  let (pp, qq, pq) = (dot(p, p), dot(q, q), dot(p, q))
  // The centre is where the perpendicular bisectors of both chords meet, in the plane of the three points.
  let half = 0.5 / (pp * qq - pq * pq)
  let out = -(p * (half * qq * (pp - pq)) + q * (half * pp * (qq - pq)))
  // At right angles to the first radius, in the same plane.
  let side = normalize(p * (dot(q, out) / 1mm ^ 2) - q * (dot(p, out) / 1mm ^ 2)) * norm(out)
  let angle_of = |d| atan2(dot(d, side), dot(d, out)) % 1turn
  let (middle, end) = (angle_of(out + p), angle_of(out + q))
  let total = if end < middle { end - 1turn } else { end }
  |t: real| a - out + out * cos(total * t) + side * sin(total * t)
}

/// A circle in the plane, counterclockwise from the x axis.
/// ```gml
/// norm(circle(5mm)(0.3))                        // = 5 mm
/// circle(5mm, center: (1mm, 1mm))(0)            // = (6, 1) mm
/// ```
fn circle(radius: length, center: point2 = (0mm, 0mm)) = arc(center, radius, 0deg, 360deg)

/// An ellipse in the plane with semi-axes a (along x) and b, counterclockwise from the x axis.
/// ```gml
/// ellipse(4mm, 2mm)(0)     // = (4, 0) mm
/// ```
fn ellipse(a: length, b: length, center: point2 = (0mm, 0mm)) = |t: real| (
  center.x + a * cos(t * 1turn),
  center.y + b * sin(t * 1turn),
)

/// The superellipse |x / a|^n + |y / b|^n = 1 in the plane, counterclockwise from the x axis (Lamé). n = 2 is an
/// ellipse, 1 a rhombus, 2.5 Piet Hein's, and the greater n the closer to a rectangle; n is 1 or more. t is not the
/// usual parameter, in which the curve would have cusps at the axes, but in proportion to the angle of the ellipse's
/// point in that direction.
/// ```gml
/// superellipse(4mm, 2mm, 2.5)(0)     // = (4, 0) mm
/// norm(superellipse(4mm, 4mm, 2)(0.1))     // = 4 mm
/// ```
fn superellipse(a: length, b: length, n: real, center: point2 = (0mm, 0mm)) = |t: real| {
  let r = superradius(t * 1turn, n)
  (center.x + a * (r * cos(t * 1turn)), center.y + b * (r * sin(t * 1turn)))
}

/// How far from the origin the superellipse with semi-axes of 1 is at an angle: (|cos|^n + |sin|^n)^(-1 / n).
/// ```gml
/// superradius(30deg, 2)   // = 1
/// ```
fn superradius(angle: angle, n: real) = (abs(cos(angle)) ^ n + abs(sin(angle)) ^ n) ^ (-1 / n)

/// The Bezier curve with these control points, as many as you like, in the plane or in space (de Casteljau). It starts
/// at the first and ends at the last.
/// ```gml
/// bezier([(0mm, 0mm), (0mm, 2mm), (2mm, 2mm)])(0.5)   // = (0.5, 1.5) mm
/// ```
fn bezier(points) = |t: real| _casteljau(points, t)

/// One point of a Bezier curve: neighbours are mixed until one is left.
fn _casteljau(points, t) =
  if len(points) == 1 { points[0] }
  else { _casteljau(for i in 0..len(points) - 1 { mix(points[i], points[i + 1], t) }, t) }

/// A helix about the z axis that rises from the plane of x and y, counterclockwise from the x axis. `turns` need not be
/// whole; a negative `pitch` (rise in a turn) makes it fall. `top` is the radius at its end, where that differs.
/// ```gml
/// helix(5mm, 2mm, 3)(0)     // = (5, 0, 0) mm
/// distance(helix(5mm, 2mm, 3)(1), (5mm, 0mm, 6mm)) < 1e-9mm     // = true
/// ```
fn helix(radius: length, pitch: length, turns: real, top: length = radius) = |t: real|
  polar(mix(radius, top, t), turns * t * 1turn, pitch * turns * t)

/// A spiral of Archimedes in the plane: the radius grows in proportion to the angle, from `inner` to `outer` in `turns`
/// turns counterclockwise.
/// ```gml
/// spiral(1mm, 5mm, 2)(0)     // = (1, 0) mm
/// norm(spiral(1mm, 5mm, 2)(0.5))     // = 3 mm
/// ```
fn spiral(inner: length, outer: length, turns: real) = |t: real|
  polar2(mix(inner, outer, t), turns * t * 1turn)

/// A curve with its sense reversed.
/// ```gml
/// reversed(line((0mm, 0mm), (4mm, 0mm)))(0.25)   // = (3, 0) mm
/// ```
fn reversed(curve) = |t: real| curve(1 - t)

/// The part of a curve from one value of its parameter to another; backwards where `from` is the greater.
/// ```gml
/// segment(line((0mm, 0mm), (8mm, 0mm)), 0.25, 0.75)(0.5)   // = (4, 0) mm
/// ```
fn segment(curve, from: real, to: real) = |t: real| curve(mix(from, to, t))

/// Curves, one after the other. Each gets an equal share of t, or one in proportion to its entry in `shares` (such as
/// the lengths). Where one does not begin at the end of the one before there is a jump.
/// ```gml
/// let c = join([line((0mm, 0mm), (4mm, 0mm)), line((4mm, 0mm), (4mm, 2mm))])
/// c(0.5)    // = (4, 0) mm
/// c(0.75)   // = (4, 1) mm
/// ```
fn join(curves, shares = for c in curves { 1 }) {
  let whole = sum(shares)
  |t: real| _joined(curves, shares, 0, t * whole)
}

/// A point of the curves from i on, x beyond their start.
fn _joined(curves, shares, i: int, x) =
  if i == len(curves) - 1 { curves[i](keep_within(x / shares[i], 0, 1)) }
  else if x < shares[i] { curves[i](keep_within(x / shares[i], 0, 1)) }
  else { _joined(curves, shares, i + 1, x - shares[i]) }

/// A curve in the plane as one in space, in the half plane of x (its first coordinate) and z (its second), as profiles
/// are. A curve in space stays as it is. For the plane of x and y there is lift.
/// ```gml
/// spatial(line((1mm, 0mm), (3mm, 4mm)))(0.5)   // = (2, 0, 2) mm
/// ```
fn spatial(curve) = if len(curve(0.5)) == 2 {
  |t: real| {
    let p = curve(t)
    (p.x, 0mm, p.y)
  }
} else {
  curve
}
