// Curves of straight lines, with and without rounded corners.

/// Straight lines from point to point, in the plane or in space; each gets an equal share of t. A closed one returns to
/// the first point.
/// ```gml
/// polyline([(0mm, 0mm), (4mm, 0mm), (4mm, 2mm)])(0.75)                      // = (4, 1) mm
/// polyline([(0mm, 0mm), (4mm, 0mm), (4mm, 3mm)], closed: true)(5 / 6)       // = (2, 1.5) mm
/// ```
fn polyline(points, closed: bool = false) {
  require len(points) > 1, "a polyline needs two points at least"
  let corners = if closed { concat(points, [points[0]]) } else { points }
  |t: real| {
    let (i, s) = span_of(t, len(corners) - 1)
    mix(corners[i], corners[i + 1], s)
  }
}

/// Straight lines from point to point whose corners are rounded by arcs of a radius, in the plane or in space; by
/// `radii`, each point has a radius of its own, of which an open one does not use the first and the last. t goes in
/// proportion to the length. A closed one begins and ends in the middle of its first line. A radius may be 0mm; the
/// arcs must find room on the lines, and no corner may turn back by 180deg.
/// ```gml
/// let c = rounded_polyline([(0mm, 0mm), (10mm, 0mm), (10mm, 10mm)], radius: 2mm)
/// c(0)                                              // = (0, 0) mm
/// distance(c(0.5), (8mm, 2mm))                      // = 2 mm
/// distance(c(1), (10mm, 10mm)) < 1e-9mm             // = true
/// let d = rounded_polyline([(0mm, 0mm), (9mm, 0mm), (9mm, 9mm)], radii: [0mm, 3mm, 0mm])
/// distance(d(0.5), (6mm, 3mm))                      // = 3 mm
/// ```
fn rounded_polyline(points, radius: length = 0mm, closed: bool = false, radii = for p in points { radius }) {
  require len(radii) == len(points), "a rounded polyline needs a radius for each of its points"
  require len(points) > (if closed { 2 } else { 1 }),
    "a polyline needs two points at least, a closed one three"
  let p = if closed { _from_middle(points) } else { points }
  let n = len(p) - 1
  // Those of the corners from 1 on: a closed one begins before the second point, and its first comes last.
  let rounding = for i in 0..n + 1 { if closed { radii[i % len(points)] } else { radii[i] } }
  // Beyond the end it goes straight on, with a corner of no turn.
  let corners = concat(p, [p[n] * 2 - p[n - 1]])
  let turns = for i in 0..n + 1 { if i == 0 { 0deg } else { _turn(corners, i) } }
  let cuts = for (a, r) in zip(turns, rounding) { r * tan(a / 2) }
  let straights = for i in 0..n { distance(p[i], p[i + 1]) - cuts[i] - cuts[i + 1] }
  let arcs = for i in 0..n { rounding[i + 1] * turns[i + 1] }
  let ends = running_sums(for i in 0..n { straights[i] + arcs[i] })
  require min(straights) > -1e-9mm, "the rounded corners of the polyline do not fit on its lines"
  |t: real| {
    let x = t * last(ends)
    let i = sum(for k in 0..n - 1 { if x < ends[k] { 0 } else { 1 } })
    let beyond = x - ends[i] + arcs[i]
    let along = normalize(corners[i + 1] - corners[i])
    let start = corners[i + 1] - along * cuts[i + 1]
    if beyond <= 0mm {
      start + along * beyond
    } else {
      let next = normalize(corners[i + 2] - corners[i + 1])
      let (a, radius) = (turns[i + 1], rounding[i + 1])
      let b = a * (beyond / max(arcs[i], _tiny * 1mm))
      start
        + along * (radius * sin(b))
        + (next - along * cos(a)) * (radius * (1 - cos(b)) / max(sin(a), _tiny))
    }
  }
}

/// A rectangle about the origin of the plane, counterclockwise from the middle of its right side; its corners, by
/// default sharp, are rounded with `radius`. t goes in proportion to the length.
/// ```gml
/// rectangle(40mm, 20mm)(0)               // = (20, 0) mm
/// rectangle(40mm, 20mm, radius: 5mm)(0.5)   // = (-20, 0) mm
/// ```
fn rectangle(width: length, height: length, radius: length = 0mm) {
  let (x, y) = (width / 2, height / 2)
  rounded_polyline([(x, -y), (x, y), (-x, y), (-x, -y)], radius, closed: true)
}

/// A regular polygon about the origin of the plane with n corners at the distance `radius`, the first on the x axis,
/// counterclockwise.
/// ```gml
/// regular_polygon(6, 10mm)(0)         // = (10, 0) mm
/// distance(regular_polygon(6, 10mm)(0.5), (-10mm, 0mm)) < 1e-9mm      // = true
/// ```
fn regular_polygon(n: int, radius: length) =
  polyline(for i in 0..n { polar2(radius, i * 1turn / n) }, closed: true)

/// What keeps quotients finite where there is no corner.
let _tiny = 1e-12

/// A closed polyline's corners from the middle of its first line and back to it.
fn _from_middle(points) {
  let middle = (points[0] + points[1]) / 2
  let rest = slice(points, 1, len(points))
  concat([middle], rest).concat([points[0], middle])
}

/// By how much the polyline turns at its corner i.
fn _turn(p, i: int) = abs(angle_between(p[i] - p[i - 1], p[i + 1] - p[i]))
