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
      let ball = _touching_ball(wall, g, radius, side, range, u)
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
    |u: real| _touching_ball(shape, distance, radius, 1, if n == 1 { (0.0, 1.0) } else { range }, u)
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
/// distance from: where on the wall, its center, the directions to both places, whether v grows from the edge on,
/// and how far it is from touching both.
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
  let off = max(abs(left), abs(distance(c + toward * radius)))
  {v: v, center: c, to_wall: -normal(v), to_other: toward, rises: slope * side > 0mm, off: off}
}

/// The same, where there must be one.
fn _touching_ball(wall, distance, radius: length, side, between, u: real) {
  let ball = _ball(wall, distance, radius, side, between, u)
  require ball.off < _near,
    "no ball of this radius touches both here: make it smaller, say by 'between' where on the wall the edge is, or let the edge not leave the other surface"
  ball
}

/// The arc over which a ball is between the two places that it touches, with the normal towards its center; t is 0 at
/// one of them and 1 at the other.
fn _arc(ball, radius: length, t: real) {
  let (a, b) = (ball.to_wall, ball.to_other)
  let turn = atan2(norm(cross(a, b)), dot(a, b))
  let s = if ball.rises { 1 - t } else { t }
  ball.center + (a * sin(turn * (1 - s)) + b * sin(turn * s)) * (radius / sin(turn))
}

/// The center of the ball in whose plane across the edge p lies: Newton's steps towards the edge, and along it steps
/// that the ratio of the last two makes longer.
fn _center_beside(f, g, p, radius: length) {
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
  next(near, 0mm, longer)[0]
}

/// Negative between a ball that touches what two functions give the distance from, and where it touches them.
fn _beside_ball(f, g, p, radius: length) = max(
  -f(p),
  -g(p),
  f(p) - 2 * radius,
  g(p) - 2 * radius,
  _beside_center(f, g, p, _center_beside(f, g, p, radius), radius, false),
)

/// The same of a place on the ball's side of both, with its center; beyond the straight line between the places that
/// the ball touches, where that is asked.
fn _beside_center(f, g, p, c, radius: length, flat: bool) {
  let (a, b, from) = (_gradient(f, c), _gradient(g, c), c - p)
  let (x, y, k) = (dot(from, a), dot(from, b), dot(a, b))
  let edge = cross(a, b)
  let d = dot(edge, edge) + 1e-9
  // Where it does not touch them, as beyond the end of a wall, or where p is not beside it, there is no fillet.
  let off = abs(f(c) - radius) + abs(g(c) - radius) + abs(f(c - a * radius)) + abs(g(c - b * radius))
  let along = abs(dot(from, edge)) / sqrt(d)
  let away = max(
    if flat { radius * sqrt((1 + k) / 2) - (x + y) / sqrt(2 + 2 * k + 1e-9) } else { radius - norm(from) },
    (k * y - x) / d,
    (k * x - y) / d,
    off - radius / 20,
    along - radius / 2,
    // Nor is there where the ball is farther than from the edge of two planes, by half as much again.
    norm(from) - 1.5 * radius / sqrt((1 + k) / 2 + 1e-9),
  )
  // Far away the steps may end anywhere: what they say of the distance is not told there.
  min(away, _away * radius)
}

/// How far from a fillet, in its radii, its function tells how far: beyond that it is a bound. Where the function
/// jumped, triangles would be divided all along.
let _away = 0.25

// Fillets and chamfers of edges that are named: `body.fillet(top, hole.wall, 1mm)`, `body.chamfer(top, front, 1mm)`.
// The compiler finds the surfaces and their sides; where the edge runs, and whether it is an outer or an inner one, is
// found here from the body. A pair holds both sides, both walls without what trims them, the radius of the ball, and
// whether what it leaves is flat. What fills the body is handed on beside it, and stands in few places: each body has
// the one before it within.

/// The body with fillets on edges of its surfaces: `left` is what is left of those that it has, and `new` are the
/// others, for each edge: `round` and, where its surfaces meet twice, `again`; `start` and `end` close the fillet where
/// it ends with its walls, as at the ends of an angle, or at what crosses one of them. Of an outer edge it is as at an
/// inner edge of what is not the body: the distances are taken negative.
fn _rounded(body, edges, radius: length) {
  require radius > 0mm, "the radius of a fillet is positive"
  let filled = inside(body)
  let blends = for edge in edges {
    let pair = _pair(edge, radius, false, 0mm)
    _blend(pair, filled, _edge_of(pair, filled))
  }
  _blended(body, filled, blends, |across, ends| {
    round: across[0],
    again: across[1],
    start: ends[0],
    end: ends[1],
  })
}

/// The body with chamfers on edges of its surfaces, with legs of one size: `flat` where a fillet is round, between the
/// places that a ball touches.
fn _chamfered(body, edges, size: length) {
  require size > 0mm, "the size of a chamfer is positive"
  let filled = inside(body)
  let blends = for edge in edges {
    let run = _edge_of(_pair(edge, size, true, 0mm), filled)
    let radius = size * sqrt((1 + run.cosine) / (1 - run.cosine))
    _blend(_pair(edge, radius, true, radius * (1 - run.cosine)), filled, run)
  }
  _blended(body, filled, blends, |across, ends| {
    flat: across[0],
    again: across[1],
    start: ends[0],
    end: ends[1],
  })
}

/// Two surfaces with a ball between them, and how far the places that it touches are from the other one where the walls
/// are straight.
fn _pair(edge, radius: length, flat: bool, apart: length) = {
  a: edge[0],
  b: edge[2],
  of_a: edge[1],
  of_b: edge[3],
  radius: radius,
  flat: flat,
  apart: apart,
}

/// How the edge of a pair runs: along which of the four parameters, at which stations, whether it is an outer (-1) or
/// an inner one (1), and the cosine of the angle between both normals, of the chamfer's edge.
fn _edge_of(pair, filled) {
  let (chosen, score) = stop(loop((0.0, 0.0), 4, |best, k| {
    let score = max(_survey(pair, filled, k, 0)[0], _survey(pair, filled, k, 1)[0])
    // The first of those that are as good but for rounding.
    if score > best[1] + 1e-6 { (real(k), score) } else { best }
  }))
  require score > 0,
    "these surfaces of the body do not meet in an edge that could be rounded, or not any more"
  let k = int(chosen)
  let (once, again) = (stop(_survey(pair, filled, k, 0)), stop(_survey(pair, filled, k, 1)))
  require stop(min(_to_other_wall(pair, k, once, 0), _to_other_wall(pair, k, again, 1))) < pair.radius / 10,
    "these surfaces of the body do not meet: one of them meets only what lies in the same plane, or the same cylinder, as the other one"
  // Two edges that end in each other are one, which turns back.
  let beyond = min(_meeting(pair, k, once[1] - 1/32, 0), _meeting(pair, k, once[2] + 1/32, 0))
  require again[6] == 0 or beyond > -0.5,
    "no parameter of either surface runs all along this edge, as where two balls meet: turn one of them so that its axis goes through the middle of the edge"
  let sum = once[5] + again[5]
  require abs(sum) == once[6] + again[6],
    "the edge of these surfaces is an outer one in some places and an inner one in others: a fillet has one kind"
  require not pair.flat or max(once[8], again[8]) - min(once[7], again[7]) < 1e-6,
    "the angle between these surfaces is not the same all along their edge, so that no chamfer has legs of one size: 'fillet' rounds it"
  {along: k, kind: if sum > 0 { 1.0 } else { -1.0 }, runs: [once, again], cosine: _cosine(pair, k, once)}
}

/// The least distance of nine places of an edge from the other wall, within its borders: where it goes on beyond them
/// another surface may be there.
fn _to_other_wall(pair, k: int, run, last: int) -> length = if run[6] > 0 {
  loop(_far, 9, |least, i| {
    let t = mix(run[1], run[2], i / 8)
    let e = _on_wall(pair, k, t, _meeting(pair, k, t, last))
    let other = if k < 2 { 2 } else { 0 }
    min(least, _to_surface(|u: real, v: real| _on_wall(pair, other, u, v), e))
  })
} else {
  _far
}

/// The distance of a point from a surface within its borders: steps of Gauss's and Newton's from the nearest of 64
/// places.
fn _to_surface(s, p) -> length {
  let (u, v, _) = loop((0.5, 0.5, _far), 64, |best, i| {
    let (u, v) = ((i % 8 + 0.5) / 8, (floor(i / 8) + 0.5) / 8)
    let d = norm(s(u, v) - p)
    if d < best[2] { (u, v, d) } else { best }
  })
  let (near_u, near_v) = loop((u, v), 8, |c, i| {
    let (a, b, off) = (s'u(c[0], c[1]), s'v(c[0], c[1]), p - s(c[0], c[1]))
    let (e, f, g, x, y) = (dot(a, a), dot(a, b), dot(b, b), dot(off, a), dot(off, b))
    let d = e * g - f * f + _near ^ 4
    (clamp(c[0] + (g * x - f * y) / d, 0, 1), clamp(c[1] + (e * y - f * x) / d, 0, 1))
  })
  norm(s(near_u, near_v) - p)
}

/// The cosine of the angle between both normals in the middle of an edge, with its derivative.
fn _cosine(pair, k: int, run) {
  let (t, x) = stop(((run[1] + run[2]) / 2, (run[3] + run[4]) / 2))
  let off = _from_other(pair, k, t, x)
  let p = _on_wall(pair, k, t, x - off / stop(_from_other'x(pair, k, t, x)))
  dot(_gradient(pair.a, p), _gradient(pair.b, p))
}

/// A pair with how its edge runs.
fn _blend(pair, filled, edge) {
  let (k, s) = (edge.along, edge.kind)
  let runs = for last in 0..2 { _edge_along(pair, filled, k, s, edge.runs[last], last) }
  {pair: pair, along: k, kind: s, runs: runs}
}

/// The body with its blends, whose new surfaces get names.
fn _blended(body, filled, blends, named) {
  let n = len(blends)
  let free = for i in 0..n { if n == 1 { 1.0 } else { stop(_free(blends, filled, i)) } }
  require min(free) > 0,
    "these edges are so near to each other that nothing of a surface is left between what is taken off or filled: make it smaller"
  // Surfaces hold on to no more than they ask of the others.
  let edges = for blend in blends { {pair: blend.pair, kind: blend.kind} }
  // Those of one call meet as they are: each new surface is where no other blend is.
  let new = for i in 0..n {
    let (pair, k, s, runs) = (blends[i].pair, blends[i].along, blends[i].kind, blends[i].runs)
    let alone = |w| |u: real, v: real| {
      let p = w(u, v)
      keep(p, min(for j in 0..n {
        if j == i { _far } else { _beside_edge(edges[j].pair, filled, edges[j].kind, p, p) }
      }))
    }
    let across = for run in runs { alone(_across(pair, filled, k, s, run)) }
    named(across, for end in runs[0].ends { alone(_end_of(pair, filled, k, s, runs[0], end)) })
  }
  solid(
    {
      left: each(body, |w| |u: real, v: real| keep(w(u, v), min(for edge in edges {
        _beside_edge(edge.pair, filled, edge.kind, _beside_wall(w, u, v, edge.kind), w(u, v))
      }))),
      new: new,
    },
    |p| {
      let beside = for edge in edges { _beside_edge(edge.pair, filled, edge.kind, p, p) }
      let off = for i in 0..n { if edges[i].kind < 0 { -beside[i] } else { -_far } }
      let on = for i in 0..n { if edges[i].kind < 0 { _far } else { beside[i] } }
      min(max(filled(p), max(off)), min(on))
    },
  )
}

/// At how many of 64 places along one of some edges the places that its ball touches are beside no other edge: the
/// lesser number of both surfaces.
fn _free(blends, filled, i: int) {
  let (pair, run) = (blends[i].pair, blends[i].runs[0])
  let (one, other) = loop((0.0, 0.0), 128, |free, j| {
    let first = j % 2 == 0
    let ball = _ball_along(pair, blends[i].along, blends[i].kind, run, mix(run.from, run.to, (j + 0.5) / 128))
    let p = ball.center + (if first { ball.to_wall } else { ball.to_other }) * (0.999 * pair.radius)
    let beside = min(for k in 0..len(blends) {
      if k == i { _far } else { _beside_edge(blends[k].pair, filled, blends[k].kind, p, p) }
    })
    let counts = if beside > -_near or run.there < 0 { 1.0 } else { 0.0 }
    if first { (free[0] + counts, free[1]) } else { (free[0], free[1] + counts) }
  })
  min(one, other)
}

/// Farther than anything.
let _far = 1000m

/// How far behind the places that the ball touches the body is asked for, as a part of the radius: at an end of the
/// edge there is nothing to be touched. Far more than rounding; thinner sheets have no fillets.
let _behind = 0.05

/// The point of a wall: k is 0 where t is the u of the first, 1 where it is its v, 2 and 3 for the second.
fn _on_wall(pair, k: int, t: real, x: real) =
  if k == 0 { pair.of_a(t, x) }
  else if k == 1 { pair.of_a(x, t) }
  else if k == 2 { pair.of_b(t, x) }
  else { pair.of_b(x, t) }

/// How far the point is from the other surface.
fn _from_other(pair, k: int, t: real, x: real) -> length {
  let p = _on_wall(pair, k, t, x)
  if k < 2 { pair.b(p) } else { pair.a(p) }
}

/// The first, or the last, x at which the wall meets the other surface, from a sixteenth before the wall to as much
/// behind it, as edges lie on its borders, or once about a wall that is closed; -1 for none.
fn _meeting(pair, k: int, t: real, last: int) {
  let closed = norm(_on_wall(pair, k, t, 0) - _on_wall(pair, k, t, 1)) < _near
  // Where a closed wall begins an edge may well be, which would be met twice.
  let (begin, end) = if closed { (0.0137, 1.0137) } else { (-1 / 16, 17/16) }
  let found = loop(-1.0, 16, |found, i| {
    let at = if last == 1 { 15 - i } else { i }
    let (low, high) = (mix(begin, end, at / 16), mix(begin, end, (at + 1) / 16))
    let crosses = _from_other(pair, k, t, low) * _from_other(pair, k, t, high) <= 0mm * 0mm
    if found < -0.5 and crosses { (low + high) / 2 } else { found }
  })
  loop(found, 8, |x, i| {
    let slope = _from_other'x(pair, k, t, x)
    // A wall that is level there does not meet it.
    if abs(slope) < 1e-9mm { x } else { x - clamp(_from_other(pair, k, t, x) / slope, -1 / 16, 1/16) }
  })
}

/// Whether at a place of both surfaces the body has an outer edge (-1), an inner one (1) or none (0): it is asked in
/// all four corners that the surfaces make, a fiftieth of the radius away.
fn _kind(pair, filled, e) {
  let (m, n) = (_gradient(pair.a, e), _gradient(pair.b, e))
  let c = dot(m, n)
  let h = pair.radius / 50
  let (up, out) = ((m + n) * (h / (1 + c + 1e-9)), (m - n) * (h / (1 - c + 1e-9)))
  // Surfaces at less than a degree touch rather than meet.
  if abs(pair.a(e)) + abs(pair.b(e)) > _near or abs(c) > 0.9998 {
    0.0
  } else {
    // How far below is not inside, or above is, and the least and the most beside.
    let (wrong, least, most) = loop((-1m, 1m, -1m), 4, |found, i| {
      let way = if i < 2 { up } else { out }
      let side = if i == 0 or i == 2 { 1 } else { -1 }
      let there = filled(e + way * side)
      if i < 2 {
        (max(found[0], -there * side), found[1], found[2])
      } else {
        (found[0], min(found[1], there), max(found[2], there))
      }
    })
    if wrong > 0mm { 0.0 }
    else if least > 0mm { -1.0 }
    else if most < 0mm { 1.0 }
    else { 0.0 }
  }
}

/// What 32 stations say of an edge along t: how well it runs that way, its first and last t, its least and greatest x,
/// the sum of its kinds, at how many stations it is, and the least and greatest cosine between both normals.
fn _survey(pair, filled, k: int, last: int) = loop(
  (0.0, 2.0, -1.0, 2.0, -2.0, 0.0, 0.0, 2.0, -2.0),
  32,
  |s, i| {
    let t = (i + 0.5) / 32
    let x = _meeting(pair, k, t, last)
    // The last one is another than the first.
    let none = x < -0.5 or last == 1 and abs(_meeting(pair, k, t, 0) - x) < 1e-6
    let e = _on_wall(pair, k, t, x)
    let kind = if none { 0.0 } else { _kind(pair, filled, e) }
    fn at(t: real, x: real) = _on_wall(pair, k, t, x)
    fn off(t: real, x: real) -> length = _from_other(pair, k, t, x)
    let along = off'x(t, x) * norm(at't(t, x)) / (1mm * 1mm)
    let across = off't(t, x) * norm(at'x(t, x)) / (1mm * 1mm)
    let share = along ^ 2 / (along ^ 2 + across ^ 2 + 1e-30)
    let cosine = dot(_gradient(pair.a, e), _gradient(pair.b, e))
    if kind == 0 {
      s
    } else {
      (
        s[0] + share,
        min(s[1], t),
        max(s[2], t),
        min(s[3], x),
        max(s[4], x),
        s[5] + kind,
        s[6] + 1,
        min(s[7], cosine),
        max(s[8], cosine),
      )
    }
  },
)

/// From where to where along t an edge is followed, where across balls are sought, on which side of the wall, and
/// whether it is there at all. The ends are those of the stations, and beyond them as far as the fillet runs over other
/// surfaces that cut the edge.
fn _edge_along(pair, filled, k: int, s, run, last: int) {
  fn at(t: real, x: real) = _on_wall(pair, k, t, x)
  let there = run[6] > 0
  let (t, x) = if there { ((run[1] + run[2]) / 2, (run[3] + run[4]) / 2) } else { (0.5, 0.5) }
  let (by_t, by_x) = (at't(t, x), at'x(t, x))
  let closed = norm(at(0, x) - at(1, x)) < _near
  let wide = 1/16 + 2 * pair.radius / (norm(by_x) + _near)
  let e = at(t, x)
  let (of_a, of_b) = (_gradient(pair.a, e), _gradient(pair.b, e))
  require not there or max(abs(norm(of_a) - 1), abs(norm(of_b) - 1)) < 0.001,
    "the side of one of these surfaces tells no distances there, as of a body that is scaled unlike along its axes"
  let out = if k < 2 { of_a } else { of_b }
  let between = stop(if there { (run[3] - wide, run[4] + wide) } else { (0.0, 1.0) })
  let side = stop(s * sign(dot(cross(by_t, by_x), out)))
  let whole = closed or not there
  let by_radius = pair.radius / (norm(by_t) + _near)
  fn end(station: real, way: real) =
    station + way * (1/32 + by_radius * _beyond(pair, filled, k, s, between, side, station, way * by_radius))
  let edge = {
    there: if there { 1.0 } else { -1.0 },
    from: stop(if whole { 0.0 } else { end(run[1], -1) }),
    to: stop(if whole { 1.0 } else { end(run[2], 1) }),
    between: between,
    side: side,
  }
  require not pair.flat or not there or stop(_bends(pair, k, s, edge, t)) < 0.01,
    "the surfaces are bent across this edge, so that the legs of its chamfer would not have its size: 'fillet' rounds it"
  let found = stop(_fits(pair, filled, k, s, edge, run))
  require found[0] >= 0.125 or not there,
    "a ball of this radius does not touch both surfaces within their borders: make it smaller"
  require found[1] < (if last == 1 { 0.5 } else { 2.5 }) or not there,
    "this edge is in several pieces, between which the fillet would end: name the surfaces of each piece apart"
  {
    there: edge.there,
    from: edge.from,
    to: edge.to,
    between: edge.between,
    side: edge.side,
    ends: [(found[2], found[3]), (found[4], found[5])],
  }
}

/// By how much of it the legs of a chamfer are off its size at t: on straight walls the places that the ball touches
/// are `pair.apart` from the other one.
fn _bends(pair, k: int, s, edge, t: real) {
  let ball = _ball_along(pair, k, s, edge, t)
  let (one, other) = (ball.center + ball.to_wall * pair.radius, ball.center + ball.to_other * pair.radius)
  let (on_a, on_b) = if k < 2 { (one, other) } else { (other, one) }
  max(abs(abs(pair.b(on_a)) - pair.apart), abs(abs(pair.a(on_b)) - pair.apart)) / (pair.apart + _near)
}

/// How many radii beyond its last station an edge is followed: 3, or 6, 12 or 24 where there is still something to take
/// off or to fill at the end of fewer, as where a surface cuts the edge at a slant.
fn _beyond(pair, filled, k: int, s, between, side, station: real, by_radius: real) = loop(
  3.0,
  3,
  |radii, i| {
    let ball = _ball_along(pair, k, s, {side: side, between: between}, station + radii * by_radius)
    // Just beyond both places that the ball touches, and between them.
    let most = loop(-1m, 3, |most, i| {
      let w = 0.15 + 0.35 * i
      let toward = normalize(ball.to_wall * (1 - w) + ball.to_other * w)
      let outer = _to_blend(pair, ball, toward) + 0.08 * w * (1 - w) * pair.radius
      max(most, s * filled(ball.center + toward * outer))
    })
    let goes_on = ball.off < _near and most > _near and _behind_ball(pair, filled, s, ball) < 0mm
    if goes_on { 2 * radii } else { radii }
  },
)

/// The ball beside an edge at t. Without branches, which would cost more than all four walls.
fn _ball_along(pair, k: int, s, edge, t: real) = if k == 0 {
  _ball(|u: real, v: real| pair.of_a(u, v), |p| s * pair.b(p), pair.radius, edge.side, edge.between, t)
} else if k == 1 {
  _ball(|u: real, v: real| pair.of_a(v, u), |p| s * pair.b(p), pair.radius, edge.side, edge.between, t)
} else if k == 2 {
  _ball(|u: real, v: real| pair.of_b(u, v), |p| s * pair.a(p), pair.radius, edge.side, edge.between, t)
} else {
  _ball(|u: real, v: real| pair.of_b(v, u), |p| s * pair.a(p), pair.radius, edge.side, edge.between, t)
}

/// The share of the places along an edge, between its first and last station, at which the ball touches what bounds the
/// body; how often the edge ends between two of 64 places where the fillet would gape; and for the first and the second
/// of such ends the place after it, and whether the fillet is before it (1), behind it (-1) or there is no such end
/// (0).
fn _fits(pair, filled, k: int, s, edge, run) {
  let step = (edge.to - edge.from) / 64
  // Two counts, the number of ends, what was at the last place, and the ends.
  let found = loop((0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0), 64, |so_far, i| {
    let t = edge.from + step * (i + 0.5)
    let ball = _ball_along(pair, k, s, edge, t)
    let is_ball = ball.off < _near
    // Whether the body ends where the ball touches it, and where it is between ball and edge. On a surface that another
    // fillet took off its function may be zero: it is asked a little before it and behind it.
    let between = normalize(ball.to_wall + ball.to_other)
    let (apart, middle) = loop((-1m, 0mm), 5, |found, i| {
      let toward = if i < 2 { ball.to_wall } else if i < 4 { ball.to_other } else { between }
      let side = if i == 0 or i == 2 { -1 } else { 1 }
      let outer =
        if i == 4 { _to_blend(pair, ball, between) + 0.02 * pair.radius }
        else { (1 + 0.001 * side) * pair.radius }
      let there = s * filled(ball.center + toward * outer)
      if i == 4 { (found[0], there) } else { (max(found[0], side * there), found[1]) }
    })
    let touches = is_ball and apart < _near
    let within = t > run[1] - 1e-9 and t < run[2] + 1e-9
    let gapes = is_ball and middle > _near
    let now = if _behind_ball(pair, filled, s, ball) < 0mm { 1.0 } else { -1.0 }
    let ends = gapes and so_far[4] > 0 and so_far[3] * now < 0
    let (first, second) = (ends and so_far[2] < 0.5, ends and so_far[2] > 0.5)
    (
      so_far[0] + (if within and touches { 1.0 } else { 0.0 }),
      so_far[1] + (if within { 1.0 } else { 0.0 }),
      so_far[2] + (if ends { 1.0 } else { 0.0 }),
      now,
      if gapes { 1.0 } else { -1.0 },
      if first { t } else { so_far[5] },
      if first { -now } else { so_far[6] },
      if second { t } else { so_far[7] },
      if second { -now } else { so_far[8] },
    )
  })
  // At one station alone there may be no place between.
  let share = if found[1] > 0 { found[0] / found[1] } else { 1.0 }
  (share, found[2], found[5], found[6], found[7], found[8])
}

/// How far the new surface is from the center of a ball, in a direction between the places that the ball touches.
fn _to_blend(pair, ball, toward) = if pair.flat {
  let both = ball.to_wall + ball.to_other
  // The straight line between both places.
  pair.radius * (1 + dot(ball.to_wall, ball.to_other)) / (dot(both, toward) + 1e-9)
} else {
  pair.radius
}

/// Negative where the body, or what is not the body, is behind both places that a ball touches.
fn _behind_ball(pair, filled, s, ball) {
  let depth = (1 + _behind) * pair.radius
  loop(-1m, 2, |most, i| {
    let toward = if i == 0 { ball.to_wall } else { ball.to_other }
    max(most, s * filled(ball.center + toward * depth))
  })
}

/// Negative between a ball and the edge of two walls, as `_beside_ball` has it, where there is something behind both:
/// at p, which may be a little beside a place `on` a surface. Where walls meet at a sharp angle what is just beside one
/// of them is behind the other.
fn _beside_edge(pair, filled, s, p, on) {
  let radius = pair.radius
  let (f, g) = (|p| s * pair.a(p), |p| s * pair.b(p))
  let (depth, other) = (max(f(p), f(on)), max(g(p), g(on)))
  // At an inner edge what is on a wall of the body may be its border.
  let just = if s < 0 { _just } else { 0mm }
  let outer = max(-depth - just, -other - just, f(p) - 2 * radius, g(p) - 2 * radius)
  // Far away no ball need be found.
  if outer > _away * radius {
    outer
  } else {
    let c = _center_beside(f, g, p, radius)
    let beside = max(outer, _beside_center(f, g, p, c, radius, pair.flat))
    if beside > 0mm {
      beside
    } else {
      // On the border of the body it is negative, and beside the surface that ends the body positive.
      max(
        beside,
        _behind_ball(pair, filled, s, {
          center: c,
          to_wall: -_gradient(f, c),
          to_other: -_gradient(g, c),
        })
          - _near / 2,
      )
    }
  }
}

/// What is so near to a wall is on it: far above rounding, and below what may be on an edge (1e-7 mm).
let _just = 5e-8mm

/// The point a little beside a wall, on the side on which the ball rolls: far above rounding, far below what is made.
fn _beside_wall(w, u, v, s) {
  let n = stop(cross(w'u(u, v), w'v(u, v)))
  w(u, v) + n * (s * _near / (norm(n) + 1e-12mm * 1mm))
}

/// The new surface along an edge, round or flat; nothing of it is there where there is no edge.
fn _across(pair, filled, k: int, s, edge) = |u: real, v: real| {
  let ball = _ball_along(pair, k, s, edge, mix(edge.from, edge.to, u))
  // Somewhat longer than it is, so that its edges are where it meets the walls; turned over at an outer edge.
  let t = mix(-0.05, 1.05, if s > 0 { v } else { 1 - v })
  let p = if pair.flat {
    ball.center + mix(ball.to_wall, ball.to_other, if ball.rises { 1 - t } else { t }) * pair.radius
  } else {
    _arc(ball, pair.radius, t)
  }
  let is_there = edge.there > 0 and ball.off < _near
  let within = min(s * filled(p) - _near, pair.radius * min(t, 1 - t), -_behind_ball(pair, filled, s, ball))
  keep(p, if is_there { within } else { -pair.radius })
}

/// The plane surface across an edge that closes its fillet at an end, from the ball to the walls.
fn _end_of(pair, filled, k: int, s, edge, end) {
  let (after, kind) = (end[0], end[1])
  let step = (edge.to - edge.from) / 64
  fn behind(t: real) -> length = _behind_ball(pair, filled, s, _ball_along(pair, k, s, edge, t))
  // Where it ends: by halving, and a step of Newton's that is differentiated.
  let (low, high) = stop(loop((after - step, after), 30, |range, i| {
    let middle = (range[0] + range[1]) / 2
    if behind(middle) * kind < 0mm { (middle, range[1]) } else { (range[0], middle) }
  }))
  let (at, slope) = ((low + high) / 2, behind'((low + high) / 2))
  let is_there = edge.there > 0 and abs(kind) > 0.5 and abs(slope) > _near
  let t = if is_there { at - behind(at) / slope } else { at }
  let ball = _ball_along(pair, k, s, edge, t)
  let (a, b) = (ball.to_wall, ball.to_other)
  let turn = atan2(norm(cross(a, b)), dot(a, b))
  fn along(t: real, x: real) = _on_wall(pair, k, t, x)
  // Away from what is filled.
  let outwards = stop(s * kind * dot(cross(b, a), along't(at, ball.v))) > 0mm
  // What coincides with the end is asked a little before it.
  let before = normalize(along't(at, ball.v)) * (-kind * 100 * _near)
  // A little beyond the edge.
  let far = 1.5 * pair.radius / sqrt((1 + dot(a, b)) / 2 + 1e-9)
  |u: real, v: real| {
    let w = if outwards { u } else { 1 - u }
    let toward = (a * sin(turn * (1 - w)) + b * sin(turn * w)) / sin(turn)
    let p = ball.center + toward * mix(_to_blend(pair, ball, toward), far, v)
    let within = min(s * filled(p + before) - _near, s * pair.a(p), s * pair.b(p))
    keep(p, if is_there { within } else { -pair.radius })
  }
}
