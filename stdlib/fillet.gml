// Fillets by a rolling ball: the surface that a ball leaves which rolls along two others and touches both. It works for
// any two surfaces whose solids say what is inside by the distance from them, as those of std.solid do; for walls at
// right angles the forms of std.edge take less time.

/// What fills the inner edge between the wall of one solid and another one, to be added to both; its surface is
/// `round`. The wall is a surface of the first solid that runs along the edge with u and across it with v, as the walls
/// of cylinders do. The ball rolls outside of both solids. With `within_first` or `within_second` it rolls inside:
/// inside of both, what is taken off the edge of what they have in common rounds it; inside of the second alone, the
/// edge of a hole that the first cuts in it. Where the wall meets the other solid twice, as that of a drill which goes
/// through a block, `between` says from where to where on the wall (0 to 1) each of the edges is, and the surfaces are
/// `round[0]` and `round[1]`.
/// ```gml
/// let post = capped_cylinder(radius: 8mm, height: 20mm)
/// let floor = half_space(at: (0mm, 0mm, 5mm))
/// rolling_fillet(post.wall, post, floor, 3mm).round(0, 0.5)      // = (8.87868, 0, 5.87868) mm
/// let slope = half_space(at: (0mm, 0mm, 5mm), normal: (0, 0.6, 0.8))
/// let rounded = rolling_fillet(post.wall, post, slope, 3mm)
/// inside(slope)(rounded.round(0.25, 0.3))                        // = 0.100555 mm
/// let rim = rolling_fillet(post.wall, post, floor, 2mm, within_first: true, within_second: true)
/// rim.round(0, 0.5)                                              // = (7.41421, 0, 4.41421) mm
/// ```
fn rolling_fillet(
  wall,
  first,
  second,
  radius: length,
  within_first: bool = false,
  within_second: bool = false,
  between = [(0.0, 1.0)],
) {
  require radius > 0mm, "the radius of a fillet is positive"
  let f = _on_side(inside(first), within_first)
  let g = _on_side(inside(second), within_second)
  let side = if within_first { -1 } else { 1 }
  let round = for range in between {
    |u: real, v: real| {
      let ball = _ball(wall, g, radius, side, range, u)
      require abs(f(ball.center) - radius) < _near,
        "the wall is no surface of the first solid where the ball touches it"
      // Somewhat longer than it is, so that its edges are where it meets the walls.
      let t = mix(-0.05, 1.05, v)
      keep(_arc(ball, radius, t), radius * min(t, 1 - t))
    }
  }
  solid(
    {round: if len(round) == 1 { round[0] } else { round }},
    |p| _beside_ball(f, g, p, radius),
  )
}

/// An open surface that ends on a solid, as a handle on a wall, with fillets there: `free` is what is left of it, and
/// `root` the fillets at v = 0 and v = 1, or at one of them. Both ends must run into the solid.
/// ```gml
/// let arch = tube(arc((0mm, 0mm), 20mm, -20deg, 200deg), radius: 3mm)
/// let handle = rooted(arch, half_space(), 2mm)
/// handle.root[0](0, 0.5)     // = (23.5634, 0, 0.530306) mm
/// ```
fn rooted(shape: surface, body, radius: length, ends = [0, 1]) {
  let n = len(ends)
  let distance = inside(body)
  let balls = for end in ends {
    let range = if end == 0 { (0.0, 0.5) } else { (0.5, 1.0) }
    |u: real| _ball(shape, distance, radius, 1, if n == 1 { (0.0, 1.0) } else { range }, u)
  }
  {
    free: |u: real, v: real| {
      let along = stop(norm(shape'v(u, v)))
      keep(shape(u, v), min(for k in 0..n {
        let from = v - balls[k](u).v
        along * (if ends[k] == 0 { from } else { -from })
      }))
    },
    root: for ball in balls { |u: real, v: real| _arc(ball(u), radius, v) },
  }
}

/// How near the ball must come to what it touches: far above the rounding of Newton's steps, far below what is made.
let _near = 1e-6mm

/// Distance from a solid on the side on which the ball rolls.
fn _on_side(distance, within: bool) = if within { |p| -distance(p) } else { distance }

/// The direction in which a length that depends on a point grows.
fn _gradient(f, p) {
  fn at(x: length, y: length, z: length) -> length = f((x, y, z))
  (at'x(p.x, p.y, p.z), at'y(p.x, p.y, p.z), at'z(p.x, p.y, p.z))
}

/// The ball that touches a wall at u (on the side of its normal, or on the other one) and what a function gives the
/// distance from: where on the wall, its center, the directions to both places, and whether v grows from the edge on.
fn _ball(wall, distance, radius: length, side, between, u: real) {
  fn normal(v: real) = normalize(cross(wall'u(u, v), wall'v(u, v))) * side
  fn center(v: real) = wall(u, v) + normal(v) * radius
  fn gap(v: real) -> length = distance(center(v)) - radius
  // The place among some that is nearest to touching, and Newton's steps from there.
  let first = loop((between[0], 1000m), 9, |best, i| {
    let v = mix(between[0], between[1], i / 8)
    let off = abs(gap(v))
    if off < best[1] { (v, off) } else { best }
  })
  let at = stop(loop(first[0], 6, |v, i| v - clamp(gap(v) / gap'(v), -0.1, 0.1)))
  // One more is differentiated: with the term of second order its first and second derivatives are exact.
  let (left, slope) = (gap(at), gap'(at))
  let step = left / slope
  let v = at - step - step ^ 2 * stop(gap''(at) / (2 * slope))
  let c = center(v)
  let toward = _gradient(distance, c) * (-1)
  let touch = c + toward * radius
  require abs(left) < _near and abs(distance(touch)) < _near,
    "no ball of this radius touches both here: make it smaller, say by 'between' where on the wall the edge is, or let the edge not leave the other surface"
  {v: v, center: c, to_wall: -normal(v), to_other: toward, rises: slope * side > 0mm}
}

/// The arc over which a ball is between the two places that it touches, with the normal towards its center; t is 0 at
/// one of them and 1 at the other.
fn _arc(ball, radius: length, t: real) {
  let (a, b) = (ball.to_wall, ball.to_other)
  let turn = atan2(norm(cross(a, b)), dot(a, b))
  let s = if ball.rises { 1 - t } else { t }
  ball.center + (a * sin(turn * (1 - s)) + b * sin(turn * s)) * (radius / sin(turn))
}

/// Negative between a ball that touches what two functions give the distance from, and where it touches them.
fn _beside_ball(f, g, p, radius: length) {
  // The center of the ball in whose plane across the edge p lies: Newton's steps towards the edge, and along it steps
  // that the ratio of the last two makes longer.
  fn next(c, before: length, longer: real) {
    let (a, b) = (_gradient(f, c), _gradient(g, c))
    let (x, y, k) = (radius - f(c), radius - g(c), dot(a, b))
    let edge = cross(a, b)
    let d = dot(edge, edge) + 1e-9
    let along = dot(p - c, edge) / sqrt(d)
    let grows = along * before > 0mm * 0mm and abs(along) > 1e-3 * radius
    let ratio =
      if abs(along) < 0.9 * abs(before) { longer / (1 - along / before) }
      else if grows { 3 }
      else { 1 }
    let m = clamp(ratio, 0.5, 8)
    (c + a * ((x - k * y) / d) + b * ((y - k * x) / d) + edge * (along * m / sqrt(d)), along, m)
  }
  let (near, before, longer) = stop(loop((p, 0mm, 1.0), 12, |s, i| next(s[0], s[1], s[2])))
  let c = next(near, 0mm, longer)[0]
  let (a, b, from) = (_gradient(f, c), _gradient(g, c), c - p)
  let (x, y, k) = (dot(from, a), dot(from, b), dot(a, b))
  let edge = cross(a, b)
  let d = dot(edge, edge) + 1e-9
  // Where it does not touch them, as beyond the end of a wall, or where p is not beside it, there is no fillet.
  let off = abs(f(c) - radius) + abs(g(c) - radius) + abs(f(c - a * radius)) + abs(g(c - b * radius))
  let along = abs(dot(from, edge)) / sqrt(d)
  let away = max(
    radius - norm(from),
    (k * y - x) / d,
    (k * x - y) / d,
    off - radius / 20,
    along - radius / 2,
    // Nor is there where the ball is farther than from the edge of two planes, by half as much again.
    norm(from) - 1.5 * radius / sqrt((1 + k) / 2 + 1e-9),
  )
  // Far away the steps may end anywhere: what they say of the distance is not told there.
  max(-f(p), -g(p), f(p) - 2 * radius, g(p) - 2 * radius, min(away, radius / 2))
}
