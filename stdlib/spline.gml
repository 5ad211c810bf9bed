// Curves that follow or pass through points: B-splines, rational curves and interpolation. Points may be in the plane
// or in space, and depend on parameters; how many there are is known while compiling. Where t crosses from one piece to
// the next, nothing jumps.

/// The cubic curve from a to b that leaves a with the velocity da and comes to b with db (Hermite).
/// ```gml
/// hermite((0mm, 0mm), (3mm, 0mm), (3mm, 3mm), (0mm, 3mm))(0.5)   // = (1.875, 1.125) mm
/// ```
fn hermite(a, da, b, db) = |t: real| _cubic(a, da, b, db, t)

/// A point of the cubic with these ends and velocities.
fn _cubic(a, da, b, db, t) {
  let s = t * t * (3 - 2 * t)
  a + (b - a) * s + da * (t * (1 - t) ^ 2) - db * (t * t * (1 - t))
}

/// The B-spline curve of a degree with these control points, in the plane or in space. Its knots are uniform; it begins
/// at the first point and ends at the last, or, closed, runs around smoothly and touches none. There must be more
/// points than the degree. A point moves the curve only near it: the curve at t is a mean of degree + 1 points. (de
/// Boor's algorithm.)
/// ```gml
/// let p = [(0mm, 0mm), (0mm, 4mm), (4mm, 4mm), (4mm, 0mm)]
/// bspline(p)(0.5)                  // = (2, 3) mm
/// bspline(p, degree: 1)(1 / 6)     // = (0, 2) mm
/// bspline(p, degree: 2)(0.5)       // = (2, 4) mm
/// bspline(p, degree: 2, closed: true)(0)   // = (0, 2) mm
/// ```
fn bspline(points, degree: int = 3, closed: bool = false) {
  let n = len(points)
  let spans = if closed { n } else { n - degree }
  require degree < n, "a B-spline needs more points than its degree"
  |t: real| {
    let i = span_of(t, spans).x
    let near = for j in 0..degree + 1 { if closed { points[(i + j) % n] } else { points[i + j] } }
    let knot = |k| if closed { k - degree } else { clamp(k - degree, 0, spans) }
    _de_boor(near, knot, i + degree, t * spans, degree, 1)
  }
}

/// The B-spline curve with given control points and knots: numbers that do not fall, degree + 1 more than there are
/// points. t = 0 is the knot number `degree` (counted from 0), t = 1 the knot number len(points). A knot given k times
/// leaves the curve degree - k times differentiable there.
/// ```gml
/// let p = [(0mm, 0mm), (0mm, 4mm), (4mm, 4mm), (4mm, 0mm)]
/// bspline_knots(p, [0, 0, 0, 0.25, 1, 1, 1])(0)      // = (0, 0) mm
/// bspline_knots(p, [0, 0, 0, 0.25, 1, 1, 1])(0.25)   // = (1, 4) mm
/// ```
fn bspline_knots(points, knots) {
  let n = len(points)
  let degree = len(knots) - n - 1
  require degree > 0, "a B-spline has more knots than points: by its degree and one more"
  |t: real| {
    let x = mix(knots[degree], knots[n], t)
    let i = sum(for j in degree + 1..n { if x < knots[j] { 0 } else { 1 } })
    let near = for j in 0..degree + 1 { points[i + j] }
    _de_boor(near, |k| knots[k], i + degree, x, degree, 1)
  }
}

/// The B-spline curve with weights: the greater a point's weight (greater than 0), the more it draws the curve. Circles
/// are among them.
/// ```gml
/// let corner = [(1mm, 0mm), (1mm, 1mm), (0mm, 1mm)]
/// norm(nurbs(corner, [1, sqrt(0.5), 1], [0, 0, 0, 1, 1, 1])(0.3))   // = 1 mm
/// ```
fn nurbs(points, weights, knots) {
  let curve = bspline_knots(_weighted(points, weights), knots)
  |t: real| _projected(curve(t))
}

/// The Bezier curve with weights, which are greater than 0.
/// ```gml
/// norm(rational_bezier([(1mm, 0mm), (1mm, 1mm), (0mm, 1mm)], [1, sqrt(0.5), 1])(0.3))   // = 1 mm
/// ```
fn rational_bezier(points, weights) {
  let curve = bezier(_weighted(points, weights))
  |t: real| _projected(curve(t))
}

/// The curve through all points in turn, which at every point runs in parallel to the line between its neighbours
/// (Catmull and Rom 1974). Each piece has an equal share of t. Where distances between points differ much,
/// `centripetal` has no loops.
/// ```gml
/// let p = [(0mm, 0mm), (1mm, 2mm), (4mm, 2mm), (5mm, 0mm)]
/// catmull_rom(p)(1 / 3)                // = (1, 2) mm
/// catmull_rom(p)(0.5)                  // = (2.5, 2.25) mm
/// catmull_rom(p, closed: true)(0.25)   // = (1, 2) mm
/// ```
fn catmull_rom(points, closed: bool = false) {
  let p = _with_neighbours(points, closed)
  |t: real| {
    let (i, s) = span_of(t, len(p) - 3)
    _cubic(p[i + 1], (p[i + 2] - p[i]) / 2, p[i + 2], (p[i + 3] - p[i + 1]) / 2, s)
  }
}

/// The curve through all points in turn in which the share of t of each piece is in proportion to the square root of
/// the distance of its ends: it has no loops or cusps between points (Yuksel, Schaefer and Keyser 2011). No two
/// neighbours may be the same.
/// ```gml
/// let p = [(0mm, 0mm), (1mm, 0mm), (5mm, 0mm)]
/// distance(centripetal(p)(1 / 3), (1mm, 0mm)) < 1e-9mm   // = true
/// ```
fn centripetal(points, closed: bool = false) {
  let p = _with_neighbours(points, closed)
  let spans = len(p) - 3
  let gaps = for (a, b) in pairs(p) { sqrt(distance(a, b)) }
  let ends = running_sums(slice(gaps, 1, spans + 1))
  |t: real| {
    let x = t * last(ends)
    let i = sum(for k in 0..spans - 1 { if x < ends[k] { 0 } else { 1 } })
    let (a, b, c, d) = (p[i], p[i + 1], p[i + 2], p[i + 3])
    let (g, h, k) = (gaps[i], gaps[i + 1], gaps[i + 2])
    let v = (b - a) * (h / g) - (c - a) * (h / (g + h)) + (c - b)
    let w = (c - b) - (d - b) * (h / (h + k)) + (d - c) * (h / k)
    _cubic(b, v, c, w, 1 - (ends[i] - x) / h)
  }
}

/// The smoothest curve through all points in turn: a cubic spline whose curvature does not jump and ends at 0 (the
/// natural spline). Each piece has an equal share of t, and every point moves all of the curve, by ever less away from
/// it. There must be three points or more.
/// ```gml
/// let p = [(0mm, 0mm), (1mm, 2mm), (2mm, 0mm), (3mm, 2mm)]
/// distance(natural_spline(p)(1 / 3), (1mm, 2mm)) < 1e-9mm   // = true
/// natural_spline([(0mm, 0mm), (1mm, 2mm), (2mm, 0mm)])(0.25)   // = (0.5, 1.375) mm
/// ```
fn natural_spline(points) {
  let n = len(points)
  // As a B-spline: its control points c are such that (c[i - 1] + 4 c[i] + c[i + 1]) / 6 is points[i].
  let inner = _control_points(points, 1, 0, points[0])
  let through = concat([points[0]], inner)
  let control = _with_neighbours(through, false)
  |t: real| {
    let i = span_of(t, n - 1).x
    _de_boor(for j in 0..4 { control[i + j] }, |k| k - 3, i + 3, t * (n - 1), 3, 1)
  }
}

/// The control points from i on, by elimination: c[i - 1] is d - g c[i].
fn _control_points(points, i: int, g, d) = if i == len(points) - 1 {
  [points[i]]
} else {
  let h = 1 / (4 - g)
  let e = (points[i] * 6 - d) * h
  let rest = _control_points(points, i + 1, h, e)
  concat([e - rest[0] * h], rest)
}

/// de Boor's recursion: `near` are the points that matter in the span from knot k, level by level mixed to one.
fn _de_boor(near, knot, k, x, degree: int, level: int) = if level > degree {
  near[0]
} else {
  let next = for q in 0..len(near) - 1 {
    let low = knot(k + level + q - degree)
    mix(near[q], near[q + 1], (x - low) / (knot(k + q + 1) - low))
  }
  _de_boor(next, knot, k, x, degree, level + 1)
}

/// The points with one more at either end: those around the corner, or what continues the first and last line.
fn _with_neighbours(points, closed: bool) {
  let n = len(points)
  require n > 1, "a curve through points needs two points at least"
  let (before, after) =
    if closed { ([points[n - 1]], [points[0], points[1]]) }
    else { ([points[0] * 2 - points[1]], [points[n - 1] * 2 - points[n - 2]]) }
  concat(before, points).concat(after)
}

/// Homogeneous coordinates.
fn _weighted(points, weights) = for (p, w) in zip(points, weights) {
  if len(p) == 2 { (p.x * w, p.y * w, real(w)) } else { (p.x * w, p.y * w, p.z * w, real(w)) }
}

/// The point with these homogeneous coordinates.
fn _projected(p) = if len(p) == 3 { (p.x / p.z, p.y / p.z) } else { (p.x / p.w, p.y / p.w, p.z / p.w) }
