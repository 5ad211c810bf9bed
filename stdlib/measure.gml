// What curves and surfaces measure: directions, lengths, curvature, area; and curves at constant speed.

/// The vector of length 1 along a curve.
/// ```gml
/// tangent(line((0mm, 0mm), (3mm, 4mm)), 0.2)   // = (0.6, 0.8)
/// ```
fn tangent(curve, t) = normalize(curve'(t))

/// A curve's curvature: one by the radius of the circle that touches it best. In the plane it has a sign: positive
/// where the curve turns left, as a counterclockwise circle does.
/// ```gml
/// 1 / curvature(circle(5mm), 0.3)          // = 5 mm
/// 1 / curvature(reversed(circle(5mm)), 0.3)   // = -5 mm
/// ```
fn curvature(curve, t) {
  let (v, a) = (curve'(t), curve''(t))
  let speed = norm(v)
  if len(v) == 2 { cross2(v, a) / speed ^ 3 } else { norm(cross(v, a)) / speed ^ 3 }
}

/// A surface's outward normal of length 1 at (u, v): along the cross product of its partial derivatives by u and v.
/// At a pole, a border that is one point, it is the limit from within.
/// ```gml
/// normal(cylinder(2mm, 5mm), 0, 0.5)                          // = (1, 0, 0)
/// norm(normal(sphere(2mm), 0.3, 0) - (0, 0, -1)) < 1e-12      // = true
/// normal(|u, v| (v * 2mm, u * v * 3mm, 0mm), 0.3, 0)          // = (0, 0, -1)
/// normal(|u, v| (u * 2mm, (1 - u) * v * 3mm, 0mm), 1, 0.3)    // = (0, 0, 1)
/// ```
fn normal(surface, u, v) {
  // At a pole one derivative vanishes. Its direction a little inside is the limit, but for some 1e-7; the derivative of
  // the normal is that of the limit, too, as the distance is constant.
  let (su, sv) = (surface'u(_pole_probe, v), surface'v(_pole_probe, v))
  let (tu, tv) = (surface'u(u, _pole_probe), surface'v(u, _pole_probe))
  let pole_v = dot(su, su) <= _pole * dot(sv, sv)
  let pole_u = dot(tv, tv) <= _pole * dot(tu, tu)
  let (inside_u, inside_v) = (u + stop(1 - 2 * u) * 1e-7, v + stop(1 - 2 * v) * 1e-7)
  let du = surface'u(u, if pole_v { inside_v } else { v })
  let dv = surface'v(if pole_u { inside_u } else { u }, v)
  normalize(cross(du, dv))
}

/// Where on a border it is tried whether that is a pole: no round number, where surfaces have seams and corners.
let _pole_probe = 0.382
/// The square of the ratio of the derivatives along a border and across it that makes it a pole.
let _pole = 1e-24

/// The length of a curve between two values of its parameter, by Gauss and Legendre's rule of three nodes in pieces:
/// each of 48 equal parts is cut into four where it bends. Exact, but for rounding, for polylines with at most two
/// corners in a part; for smooth curves to some 12 digits (10 for an ellipse of 10 to 1); and to some 9 where lines and
/// arcs meet at other speeds, as in `join`.
/// ```gml
/// arc_length(line((0mm, 0mm), (3mm, 4mm)))             // = 5 mm
/// arc_length(circle(10mm), 0, 0.25) / 1mm              // = 15.7079633
/// abs(arc_length(polyline([(0mm, 0mm), (4mm, 0mm), (4mm, 3mm)])) / 7mm - 1) < 1e-12   // = true
/// ```
fn arc_length(curve, from: real = 0, to: real = 1) {
  let whole = segment(curve, from, to)
  loop(0mm, _parts, |length, i| {
    let ends = _pieces(whole, i / _parts, (i + 1) / _parts)
    loop(length, 12, |length, j| {
      let (t, weight) = _node(ends, j)
      length + norm(curve'(mix(from, to, t))) * (weight * (to - from))
    })
  })
}

/// How many parts a curve is cut into to measure it.
let _parts = 48

/// Nodes of Gauss and Legendre's rule of three nodes over 0..1.
let _places = [0.1127016653792583, 0.5, 0.8872983346207417]
/// Their weights.
let _shares = [5/18, 8/18, 5/18]

/// Node j of the rule in four pieces of a curve, three in each, and its weight.
fn _node(ends, j: int) {
  let node = j % 3
  let piece = int((j - node) / 3)
  let (from, to) = (ends[piece], ends[piece + 1])
  (mix(from, to, _places[node]), _shares[node] * (to - from))
}

/// The ends of four pieces of a part of a curve: it is cut where it bends, and so is what is before and after that.
fn _pieces(curve, from, to) {
  let whole = _cut(curve, from, to)
  let (left, right) = (_cut(curve, from, whole.before), _cut(curve, whole.after, to))
  [from, left.at, whole.at, right.at, to]
}

/// Where a part of a curve is cut in two, and values on both sides of that which are or may be the same. Where the
/// velocity jumps or bends, as at a corner or between a line and an arc, that is where it does.
fn _cut(curve, from, to) {
  let start = {from: from, to: to, first: curve'(from), middle: curve'((from + to) / 2), last: curve'(to)}
  let uneven = |of| of.first - 2 * of.middle + of.last
  // The half of which the velocity is farther from changing evenly; of two that are alike the one beside the middle, so
  // that of several corners some are left on either side.
  let near = loop(start, _halvings, |near, _| {
    let at = (near.from + near.to) / 2
    let aside = at - (from + to) / 2
    let share = if aside < 0 { 4 } else if aside > 0 { 1/4 } else { 1 }
    let left = {
      from: near.from,
      to: at,
      first: near.first,
      middle: curve'((near.from + at) / 2),
      last: near.middle,
    }
    let right = {
      from: at,
      to: near.to,
      first: near.middle,
      middle: curve'((at + near.to) / 2),
      last: near.last,
    }
    let (before, after) = (uneven(left), uneven(right))
    if dot(before, before) > share * dot(after, after) { left } else { right }
  })
  let (all, rest) = (uneven(start), uneven(near))
  let is_sharp = dot(rest, rest) > _sharp * dot(all, all)
  let about = if is_sharp { near } else { start }
  let at = _bend(about.from, about.to, curve(about.from), curve(about.to), about.first, about.last)
  if is_sharp { {at: at, before: near.from, after: near.to} } else { {at: at, before: at, after: at} }
}

/// How often a part is halved to find a jump or a bend: to 1/1024 of it, where both sides are straight to 1e-9 of the
/// curve's length.
let _halvings = 10
/// How uneven the velocity of 1/1024 of a part is, compared with the whole part: 1 at a jump, 2^-10 at a bend, and
/// 2^-20 where it changes smoothly. The square of what is between the last two.
let _sharp = 1 / 2 ^ 30

/// Where the tangents at both ends p and q of a part of a curve come closest, as a value of its parameter: the corner
/// if there is one between straight lines, and the middle of what is straight or bends evenly. Its derivatives are
/// wanted: with a corner that moves along the parameter, the measure of both sides changes.
fn _bend(from, to, p, q, dp, dq) {
  let turn = dp - dq
  let little = 1e-12 * (dot(dp, dp) + dot(dq, dq)) + 1e-60 * (1mm) ^ 2
  let ahead = dot(q - p - dq * (to - from), turn) + little * (to - from) / 2
  from + keep_within(ahead / (dot(turn, turn) + little), 0, to - from)
}

/// The same curve at constant speed: its parameter goes in proportion to the length. The curve must nowhere stand
/// still.
///
/// The length up to the ends of 16 equal parts is had by Gauss and Legendre's rule of five nodes, which corners cost
/// digits: the speed of a polyline whose lines differ in length is not constant about them. In between, the old
/// parameter starts as the polynomial of degree 5 in the length that has the right value, first and second derivative
/// at both ends (Hermite), and is then improved by one step of Newton's method. The new curve lies exactly on the old
/// one, is differentiated as any other, and its speed is constant to 1e-8 of it for an ellipse of 2 to 1, to more for
/// what is less bent.
/// ```gml
/// let c = by_length(bezier([(0mm, 0mm), (0mm, 10mm), (30mm, 10mm)]))
/// abs(arc_length(c, 0, 0.5) / arc_length(c) - 0.5) < 1e-9   // = true
/// ```
fn by_length(curve) {
  let speed = |t: real| norm(curve'(t))
  let zeros = for j in 0.._spans + 1 { 0mm }
  let start = {lengths: zeros, speeds: zeros, bends: zeros}
  // Node 0 of every part is its beginning, where the derivatives are taken; the last one is the curve's end.
  let table = loop(start, 6 * _spans + 1, |acc, i| {
    let node = i % 6
    let t = ((i - node) / 6 + _nodes[node]) / _spans
    let (v, a) = (speed(t), speed'(t))
    let share = v * (_weights[node] / _spans)
    let ahead = for j in 0.._spans + 1 { 6 * j - i }
    {
      lengths: for j in 0.._spans + 1 { if ahead[j] > 0 { acc.lengths[j] + share } else { acc.lengths[j] } },
      speeds: for j in 0.._spans + 1 { if ahead[j] == 0 { v } else { acc.speeds[j] } },
      bends: for j in 0.._spans + 1 { if ahead[j] == 0 { a } else { acc.bends[j] } },
    }
  })
  |s: real| {
    let x = s * table.lengths[_spans]
    let k = sum(for j in 1.._spans { if x < table.lengths[j] { 0 } else { 1 } })
    let (begin, end) = (table.lengths[k], table.lengths[k + 1])
    let h = end - begin
    let f = (x - begin) / h
    // First and second derivatives of the old parameter by the length, for the part's length.
    let (d, e) = (h / table.speeds[k], h / table.speeds[k + 1])
    let (b, c) = (
      -d * d * table.bends[k] / table.speeds[k],
      -e * e * table.bends[k + 1] / table.speeds[k + 1],
    )
    let g = 1 - f
    let shape =
      f ^ 3 * (10 - 15 * f + 6 * f * f) / _spans
      + d * (f * g ^ 3 * (1 + 3 * f))
      - e * (g * f ^ 3 * (1 + 3 * g))
      + b * (f * f * g ^ 3 / 2)
      + c * (g * g * f ^ 3 / 2)
    // One step of Newton's method towards the length wanted.
    let from = k / _spans
    let near = from + shape
    let reached = begin + sum(for i in 1..6 { speed(mix(from, near, _nodes[i])) * _weights[i] }) * shape
    curve(keep_within(near - (reached - x) / speed(near), 0, 1))
  }
}

/// How many parts `by_length` cuts a curve into.
let _spans = 16
/// Nodes of Gauss and Legendre's rule of five nodes over 0..1, after a first one without weight.
let _nodes = [0, 0.046910077030668004, 0.23076534494715845, 0.5, 0.7692346550528415, 0.953089922969332]
/// Their weights.
let _weights = [
  0,
  0.11846344252809454,
  0.23931433524968324,
  0.28444444444444444,
  0.23931433524968324,
  0.11846344252809454,
]

/// The area that a closed curve in the plane encloses: positive where it runs counterclockwise. By Green's formula, in
/// the pieces of arc_length: exact for polylines, rectangles and polygons as that is, to some 12 digits for smooth
/// curves, and to some 9 where arcs meet lines, as in rounded corners (derivatives to some 5).
/// ```gml
/// sqrt(enclosed_area(ellipse(4mm, 1mm)) / radians(pi))   // = 2 mm
/// abs(enclosed_area(rectangle(40mm, 20mm)) / (40mm * 20mm) - 1) < 1e-12   // = true
/// ```
fn enclosed_area(curve) = loop(0mm * 0mm, _parts, |area, i| {
  let ends = _pieces(curve, i / _parts, (i + 1) / _parts)
  // The part's area beyond its chord is small: what the rule does not see of it, too.
  let start = curve(ends[0])
  loop(area + cross2(start, curve(ends[4])) / 2, 12, |area, j| {
    let (t, weight) = _node(ends, j)
    area + cross2(curve(t) - start, curve'(t)) * (weight / 2)
  })
})
