// Solids: bodies of several named surfaces that close without gaps, all normals outwards, and what is inside of them.
// As any shape they can be moved, turned, mirrored and repeated; `a + b` is their union, `a - b` the first without the
// second, `a & b` what they have in common. `part tin = capped_cylinder(radius: 40mm)` has the parts `tin.wall`,
// `tin.top` and `tin.base`, and what is left of a surface after `+`, `-` and `&` keeps its name: `part plate =
// box(width: 60mm) - {hole: capped_cylinder(radius: 4mm)}` has `plate.top` and `plate.hole.wall`. Their lengths are at
// most 10 m.

/// A box that stands on the plane of x and y, about the z axis: six faces.
/// ```gml
/// let b = box(width: 40mm, depth: 20mm, height: 10mm)
/// b.top(1, 1)         // = (20, 10, 10) mm
/// b.right(0.5, 0.5)   // = (20, 0, 5) mm
/// ```
fn box(width: length = 20mm, depth: length = 20mm, height: length = 20mm) = solid(
  _box(width: width, depth: depth, height: height),
  |p| max(abs(p.x) - width / 2, abs(p.y) - depth / 2, -p.z, p.z - height),
  _box_sides(width, depth, height),
)

/// The sides of the faces of a box.
fn _box_sides(width, depth, height) = {
  top: |p| p.z - height,
  base: |p| -p.z,
  right: |p| p.x - width / 2,
  left: |p| -p.x - width / 2,
  back: |p| p.y - depth / 2,
  front: |p| -p.y - depth / 2,
}

/// The surfaces of box.
model _box {
  param width: length in 0mm..10m = 20mm
  param depth: length in 0mm..10m = 20mm
  param height: length in 0mm..10m = 20mm

  let lift = (0mm, 0mm, height / 2)
  part top = _above(width, depth, height / 2).translate(lift)
  part base = _above(width, depth, height / 2).rotate(180deg, (1, 0, 0)).translate(lift)
  part right = _turned_once(_above(depth, height, width / 2)).translate(lift)
  part left = _turned_once(_above(depth, height, width / 2)).rotate(180deg).translate(lift)
  part back = _turned_twice(_above(height, width, depth / 2)).translate(lift)
  part front = _turned_twice(_above(height, width, depth / 2)).rotate(180deg).translate(lift)
}

/// A box with rounded edges that stands on the plane of x and y, about the z axis: six faces, twelve quarters of
/// cylinders (edge[0] to edge[3] along x, then along y, then along z) and eight eighths of a sphere (corner[0] to
/// corner[3] below, then above).
/// ```gml
/// let b = rounded_box(width: 40mm, depth: 20mm, height: 10mm, radius: 2mm)
/// b.top(1, 1)           // = (18, 8, 10) mm
/// len(b.edge)           // = 12
/// norm(b.corner[4](0.3, 0.6) - (18mm, 8mm, 8mm))   // = 2 mm
/// ```
fn rounded_box(
  width: length = 20mm,
  depth: length = 20mm,
  height: length = 20mm,
  radius: length = 2mm,
) {
  require radius > 0mm, "the radius of a rounded box is above zero: without it is a 'box'"
  require 2 * radius < min(width, depth, height),
    "the radius of a rounded box is less than half of its shortest side: beyond that it is a 'capsule' or a 'ball'"
  solid(
    _rounded_box(width: width, depth: depth, height: height, radius: radius),
    |p|
      _inside_rounded_box(p, width / 2 - radius, depth / 2 - radius, height / 2 - radius, height / 2)
      - radius,
    _box_sides(width, depth, height),
  )
}

/// The surfaces of rounded_box.
model _rounded_box {
  param width: length in 0mm..10m = 20mm
  param depth: length in 0mm..10m = 20mm
  param height: length in 0mm..10m = 20mm
  param radius: length in 0mm..min(width, depth, height) / 2 = 2mm

  let lift = (0mm, 0mm, height / 2)
  // What is left of the sides between the roundings.
  let (w, d, h) = (width - 2 * radius, depth - 2 * radius, height - 2 * radius)
  part top = _above(w, d, height / 2).translate(lift)
  part base = _above(w, d, height / 2).rotate(180deg, (1, 0, 0)).translate(lift)
  part right = _turned_once(_above(d, h, width / 2)).translate(lift)
  part left = _turned_once(_above(d, h, width / 2)).rotate(180deg).translate(lift)
  part back = _turned_twice(_above(h, w, depth / 2)).translate(lift)
  part front = _turned_twice(_above(h, w, depth / 2)).rotate(180deg).translate(lift)
  for i in 0..12 {
    let upright =
      if i < 4 { _edge(i, d, h, w, radius) }
      else if i < 8 { _edge(i - 4, h, w, d, radius) }
      else { _edge(i - 8, w, d, h, radius) }
    let turned = if i < 4 { _turned_once(upright) } else if i < 8 { _turned_twice(upright) } else { upright }
    part edge = turned.translate(lift)
  }
  for i in 0..8 {
    let elevation = if i < 4 { -90deg } else { 0deg }
    let azimuth = (i % 4) * 90deg
    part corner = sphere_zone(radius, elevation, elevation + 90deg, (azimuth, azimuth + 90deg))
      .translate(_quadrant(i % 4, w, d, if i < 4 { -h / 2 } else { h / 2 }))
      .translate(lift)
  }
}

/// A rectangle about the z axis at a height, its normal upwards.
fn _above(width, depth, height) = plane(width, depth).translate((0mm, 0mm, height))

/// The shape with z carried to x, x to y and y to z.
fn _turned_once(shape) = transform(shape, |p| (p.z, p.x, p.y))

/// The shape with z carried to y, y to x and x to z.
fn _turned_twice(shape) = transform(shape, |p| (p.y, p.z, p.x))

/// The corner of a rectangle about the z axis that is in a quadrant (0 to 3, counterclockwise), at height z.
fn _quadrant(i: int, width, depth, z) = (
  if i == 0 or i == 3 { width / 2 } else { -width / 2 },
  if i < 2 { depth / 2 } else { -depth / 2 },
  z,
)

/// The rounded edge along z of a box with faces of a width and depth, about the origin.
fn _edge(i: int, width, depth, height, radius) = revolve(
  line((radius, -height / 2), (radius, height / 2)),
  i * 90deg,
  (i + 1) * 90deg,
).translate(_quadrant(i, width, depth, 0mm))

/// A cylinder that stands on the plane of x and y, about the z axis, with its two ends.
/// ```gml
/// let c = capped_cylinder(radius: 5mm, height: 8mm)
/// c.wall(0, 0.5)         // = (5, 0, 4) mm
/// normal(c.base, 0, 0.5) // = (0, 0, -1)
/// ```
fn capped_cylinder(radius: length = 10mm, height: length = 20mm) = solid(
  _capped_cylinder(radius: radius, height: height),
  |p| max(hypot(p.x, p.y) - radius, -p.z, p.z - height),
  {wall: |p| hypot(p.x, p.y) - radius, top: |p| p.z - height, base: |p| -p.z},
)

/// The surfaces of capped_cylinder.
model _capped_cylinder {
  param radius: length in 0mm..10m = 10mm
  param height: length in 0mm..10m = 20mm

  part wall = cylinder(radius, height)
  part top = disc(radius).translate((0mm, 0mm, height))
  part base = flip(disc(radius))
}

/// A cone without its point, with its two ends; it stands on the plane of x and y, about the z axis.
/// ```gml
/// frustum(bottom: 6mm, top: 2mm, height: 10mm).wall(0, 0.5)   // = (4, 0, 5) mm
/// ```
fn frustum(bottom: length = 10mm, top: length = 5mm, height: length = 20mm) = solid(
  _frustum(bottom: bottom, top: top, height: height),
  |p| {
    let beyond = hypot(p.x, p.y) - mix(bottom, top, p.z / height)
    max(beyond * height / hypot(height, bottom - top), -p.z, p.z - height)
  },
  {
    wall: |p| (hypot(p.x, p.y) - mix(bottom, top, p.z / height)) * (height / hypot(height, bottom - top)),
    lid: |p| p.z - height,
    base: |p| -p.z,
  },
)

/// The surfaces of frustum.
model _frustum {
  param bottom: length in 0mm..10m = 10mm
  param top: length in 0mm..10m = 5mm
  param height: length in 0mm..10m = 20mm

  part wall = cone(bottom, top, height)
  part lid = disc(top).translate((0mm, 0mm, height))
  part base = flip(disc(bottom))
}

/// A straight pipe that stands on the plane of x and y, about the z axis: its outer and inner wall and two rims.
/// ```gml
/// let p = pipe(outer: 10mm, inner: 8mm, height: 50mm)
/// normal(p.inside, 0, 0.5)   // = (-1, 0, 0)
/// p.rim(0, 1)                // = (8, 0, 50) mm
/// ```
fn pipe(outer: length = 10mm, inner: length = 8mm, height: length = 50mm) {
  require inner < outer, "the inner radius of a pipe is less than its outer one"
  solid(
    _pipe(outer: outer, inner: inner, height: height),
    |p| max(hypot(p.x, p.y) - outer, inner - hypot(p.x, p.y), -p.z, p.z - height),
    {
      outside: |p| hypot(p.x, p.y) - outer,
      inside: |p| inner - hypot(p.x, p.y),
      rim: |p| p.z - height,
      foot: |p| -p.z,
    },
  )
}

/// The surfaces of pipe.
model _pipe {
  param outer: length in 0mm..10m = 10mm
  param inner: length in 0mm..outer = 8mm
  param height: length in 0mm..10m = 50mm

  part outside = cylinder(outer, height)
  part inside = flip(cylinder(inner, height))
  part rim = annulus(inner, outer).translate((0mm, 0mm, height))
  part foot = flip(annulus(inner, outer))
}

/// A pipe bent about the z axis, from the x axis on: its outer and inner wall and a ring at either end.
/// ```gml
/// let e = elbow(bend: 60mm, angle: 90deg, outer: 10mm, inner: 8mm)
/// e.outside(0, 0)           // = (70, 0, 0) mm
/// normal(e.start, 0, 0.5)   // = (0, -1, 0)
/// normal(e.end, 0, 0.5)     // = (-1, 0, 0)
/// normal(e.outside, 0, 0)   // = (1, 0, 0)
/// normal(e.inside, 0, 0)    // = (-1, 0, 0)
/// ```
fn elbow(bend: length = 50mm, angle: angle = 90deg, outer: length = 10mm, inner: length = 8mm) {
  require inner < outer, "the inner radius of an elbow is less than its outer one"
  solid(
    _elbow(bend: bend, angle: angle, outer: outer, inner: inner),
    |p| _inside_elbow(p, bend, angle, outer, inner),
    {
      outside: |p| hypot(hypot(p.x, p.y) - bend, p.z) - outer,
      inside: |p| inner - hypot(hypot(p.x, p.y) - bend, p.z),
      start: |p| -p.y,
      end: |p| p.y * cos(angle) - p.x * sin(angle),
    },
  )
}

/// The surfaces of elbow.
model _elbow {
  param bend: length in 0mm..100m = 50mm
  param angle: angle in 0deg..360deg = 90deg
  param outer: length in 0mm..bend = 10mm
  param inner: length in 0mm..outer = 8mm

  let middle = (bend, 0mm)
  let ring = annulus(inner, outer).rotate(90deg, (1, 0, 0)).translate((bend, 0mm, 0mm))
  part outside = revolve(circle(outer, middle), 0deg, angle)
  part inside = flip(revolve(circle(inner, middle), 0deg, angle))
  part start = ring
  part end = flip(ring).rotate(angle)
}

/// A cylinder with half spheres for ends, which stands on the plane of x and y, about the z axis.
/// ```gml
/// let c = capsule(radius: 4mm, height: 20mm)
/// norm(c.top(0.2, 0.3) - (0mm, 0mm, 16mm))    // = 4 mm
/// norm(c.base(0.2, 0.3) - (0mm, 0mm, 4mm))    // = 4 mm
/// ```
fn capsule(radius: length = 5mm, height: length = 20mm) = solid(
  _capsule(radius: radius, height: height),
  |p| norm((p.x, p.y, p.z - clamp(p.z, radius, height - radius))) - radius,
  {
    wall: |p| hypot(p.x, p.y) - radius,
    top: |p| norm((p.x, p.y, p.z - (height - radius))) - radius,
    base: |p| norm((p.x, p.y, p.z - radius)) - radius,
  },
)

/// The surfaces of capsule.
model _capsule {
  param radius: length in 0mm..10m = 5mm
  param height: length in 2 * radius..20m = 20mm

  part wall = revolve(line((radius, radius), (radius, height - radius)))
  part top = sphere_zone(radius, 0deg, 90deg).translate((0mm, 0mm, height - radius))
  part base = sphere_zone(radius, -90deg, 0deg).translate((0mm, 0mm, radius))
}

/// A hollow sphere about the origin: outer and inner wall.
/// ```gml
/// norm(hollow_sphere(outer: 10mm, inner: 9mm).inside(0.2, 0.3))   // = 9 mm
/// ```
fn hollow_sphere(outer: length = 10mm, inner: length = 8mm) {
  require inner < outer, "the inner radius of a hollow sphere is less than its outer one"
  solid(
    _hollow_sphere(outer: outer, inner: inner),
    |p| max(norm(p) - outer, inner - norm(p)),
    {outside: |p| norm(p) - outer, inside: |p| inner - norm(p)},
  )
}

/// The surfaces of hollow_sphere.
model _hollow_sphere {
  param outer: length in 0mm..10m = 10mm
  param inner: length in 0mm..outer = 8mm

  part outside = sphere(outer)
  part inside = flip(sphere(inner))
}

/// A ball about the origin: one surface, `wall`.
/// ```gml
/// inside(ball(radius: 5mm))((0mm, 3mm, 0mm))   // = -2 mm
/// ```
fn ball(radius: length = 10mm) {
  require radius > 0mm, "the radius of a ball is above zero"
  let distance = |p| norm(p) - radius
  solid({wall: sphere(radius)}, distance, {wall: distance})
}

/// A ring about the z axis with a round section: one surface, `wall`. `bend` is the radius to the middle of the
/// section.
/// ```gml
/// inside(solid_torus(bend: 20mm, radius: 5mm))((22mm, 0mm, 0mm))   // = -3 mm
/// ```
fn solid_torus(bend: length = 20mm, radius: length = 5mm) {
  require radius > 0mm and radius <= bend,
    "the radius of a ring is above zero and no more than its bend, or its surface crosses itself"
  let distance = |p| hypot(hypot(p.x, p.y) - bend, p.z) - radius
  solid({wall: torus(bend, radius)}, distance, {wall: distance})
}

/// A prism that stands on the plane of x and y: an outline of straight lines between points of the plane, which run
/// counterclockwise and do not cross. Its surfaces are `side[0]` from the first point to the second, and so on, `top`
/// and `base`.
/// ```gml
/// let wedge = extruded([(0mm, 0mm), (8mm, 0mm), (0mm, 6mm)], 5mm)
/// wedge.side[1](0.5, 1)               // = (4, 3, 5) mm
/// inside(wedge)((3mm, 1mm, 2mm))      // = -1 mm
/// ```
fn extruded(points, height: length) {
  let n = len(points)
  require n > 2, "an outline needs three points at least"
  let outline = for p in points { (p.x, p.y) }
  require _doubled_area(outline) > 0mm * 0mm, "the points of an outline run counterclockwise"
  let face = outlined_face(outline_lines([outline]))
  solid(
    {
      side: for i in 0..n {
        let (a, b) = (outline[i], outline[(i + 1) % n])
        |u: real, v: real| lift(mix(a, b, u), height * v)
      },
      top: face.translate((0mm, 0mm, height)),
      base: flip(face),
    },
    |p| max(distance_from_lines((p.x, p.y), outline_lines([outline])), -p.z, p.z - height),
    {
      side: for i in 0..n {
        let (a, b) = (outline[i], outline[(i + 1) % n])
        |p| cross2((p.x, p.y) - a, b - a) / norm(b - a)
      },
      // The faces are trimmed; these planes are not.
      top: half_space(at: lift(outline[0], height), size: _size_of(outline)),
      base: half_space(at: lift(outline[0]), normal: (0, 0, -1), size: _size_of(outline)),
    },
  )
}

/// A length that is no shorter than twice the distance of an outline's first point from any other.
fn _size_of(outline) = fold(0mm, outline, |size, p| max(size, 2 * norm(p - outline[0])))

/// A body between two outlines of as many points, from the first on the plane of x and y to the second at a height:
/// straight lines run from each point to its partner, and every section between is an outline. Both run
/// counterclockwise. The surfaces are `side[0]` from the first points to the second ones, and so on, `top` and `base`.
/// ```gml
/// let square = [(9mm, -9mm), (9mm, 9mm), (-9mm, 9mm), (-9mm, -9mm)]
/// let small = [(3mm, -5mm), (3mm, 5mm), (-3mm, 5mm), (-3mm, -5mm)]
/// let spout = lofted(square, small, 8mm)
/// spout.side[0](0.5, 0.5)             // = (6, 0, 4) mm
/// inside(spout)((5mm, 0mm, 4mm))      // = -1 mm
/// ```
fn lofted(bottom, top, height: length) {
  let n = len(bottom)
  require n > 2, "an outline needs three points at least"
  require len(top) == n, "both outlines of a loft have as many points"
  let (below, above) = (for p in bottom { (p.x, p.y) }, for p in top { (p.x, p.y) })
  require _doubled_area(below) > 0mm * 0mm, "the points of an outline run counterclockwise"
  require _doubled_area(above) > 0mm * 0mm, "the points of an outline run counterclockwise"
  solid(
    {
      side: for i in 0..n {
        let next = (i + 1) % n
        |u: real, v: real|
          lift(mix(mix(below[i], below[next], u), mix(above[i], above[next], u), v), height * v)
      },
      top: outlined_face(outline_lines([above])).translate((0mm, 0mm, height)),
      base: flip(outlined_face(outline_lines([below]))),
    },
    |p| {
      let t = clamp(p.z / height, 0, 1)
      let section = for i in 0..n { mix(below[i], above[i], t) }
      max(distance_from_lines((p.x, p.y), outline_lines([section])), -p.z, p.z - height)
    },
  )
}

/// A body of revolution about the z axis: its profile are straight lines between points (distance from the axis,
/// height), from one on the axis to another above it. Its surfaces are `wall[0]` from the first point to the second,
/// and so on.
/// ```gml
/// let top = revolved([(0mm, 0mm), (6mm, 4mm), (6mm, 9mm), (0mm, 9mm)])
/// top.wall[1](0, 0.5)                 // = (6, 0, 6.5) mm
/// inside(top)((0mm, 4mm, 7mm))        // = -2 mm
/// ```
fn revolved(profile) {
  let n = len(profile) - 1
  require n > 1, "a profile needs three points at least"
  require abs(profile[0].x) + abs(profile[n].x) < 1e-9mm,
    "the first and the last point of a profile are on the axis"
  require _doubled_area(profile) > 0mm * 0mm,
    "a profile runs from its lowest point on the axis outwards and up"
  solid(
    {wall: for i in 0..n { revolve(line(profile[i], profile[i + 1])) }},
    |p| distance_from_lines((hypot(p.x, p.y), p.z), outline_lines([profile]), n),
    {
      wall: for i in 0..n {
        let (a, b) = (profile[i], profile[i + 1])
        |p| cross2((hypot(p.x, p.y), p.z) - a, b - a) / norm(b - a)
      },
    },
  )
}

/// A body of revolution about the z axis whose profile is a smooth curve (distance from the axis, height), which runs
/// from its lowest point up to its highest one; its surfaces are `wall`, `top` and `base`. The profile must be smooth
/// and must not cross itself; of its waves ten at the most are told apart.
/// ```gml
/// let vase = revolved_curve(bezier([(20mm, 0mm), (35mm, 20mm), (10mm, 60mm), (20mm, 80mm)]))
/// vase.wall(0, 1)                       // = (20, 0, 80) mm
/// inside(vase)((0mm, 0mm, 78mm))        // = -2 mm
/// ```
fn revolved_curve(profile: curve) {
  let (foot, rim) = (profile(0), profile(1))
  require foot.y < rim.y,
    "a profile runs from its lowest point up to its highest one: turn it around by 'reversed'"
  let stations = _stations(profile)
  solid(
    {
      wall: revolve(profile),
      top: disc(rim.x).translate((0mm, 0mm, rim.y)),
      base: flip(disc(foot.x)).translate((0mm, 0mm, foot.y)),
    },
    |p| max(_from_curve((hypot(p.x, p.y), p.z), profile, stations, false), foot.y - p.z, p.z - rim.y),
  )
}

/// A prism that stands on the plane of x and y, on a smooth closed outline that runs counterclockwise; its surfaces are
/// `wall`, `top` and `base`. The outline may have arcs that run on in the direction of lines, but no corners; of its
/// waves ten at the most are told apart.
/// ```gml
/// let cam = extruded_curve(|t| (9mm * cos(t * 1turn), 5mm * sin(t * 1turn)), 4mm)
/// cam.wall(0.25, 0.5)                   // = (0, 5, 2) mm
/// inside(cam)((8mm, 0mm, 2mm))          // = -1 mm
/// ```
fn extruded_curve(outline: curve, height: length) {
  let stations = _stations(outline)
  require _doubled_area(stations) > 0mm * 0mm, "an outline runs counterclockwise"
  let face = plane_within(stations, |p| _from_curve(p, outline, stations, true), larger: 1.1)
  solid(
    {
      wall: |u: real, v: real| lift(outline(u), height * v),
      top: face.translate((0mm, 0mm, height)),
      base: flip(face),
    },
    |p| max(_from_curve((p.x, p.y), outline, stations, true), -p.z, p.z - height),
  )
}

/// The half space below the plane through `at` with a normal: no surface of its own, to cut others with `-` and `&`.
/// The plane is a square about `at` of the size that is said. It closes the cut where the body is no larger there; and
/// should not be much larger, as textures and samples are spread over all of it.
/// ```gml
/// inside(half_space(at: (0mm, 0mm, 4mm)))((1mm, 2mm, 0mm))   // = -4 mm
/// ```
fn half_space(at = (0mm, 0mm, 0mm), normal = (0, 0, 1), size: length = 200mm) {
  let n = normalize(normal)
  let x = normalize(cross(if abs(n.z) > 0.9 { (1, 0, 0) } else { (0, 0, 1) }, n))
  let y = cross(n, x)
  let distance = |p| dot(p - at, n)
  solid(
    {cut: |u: real, v: real| at + x * ((u - 0.5) * size) + y * ((v - 0.5) * size)},
    distance,
    {cut: distance},
  )
}

/// The part of an open surface that is outside of a solid, or inside of it: a handle ends at a wall.
/// ```gml
/// // part handle = tube(bow, radius: 6mm).outside_of(body)
/// inside(ball(radius: 5mm))((9mm, 0mm, 0mm))   // = 4 mm
/// ```
fn outside_of(shape, body) = each(shape, |s| |u: real, v: real| {
  let p = s(u, v)
  keep(p, inside(body)(p))
})

/// The part of an open surface that is inside of a solid.
/// ```gml
/// inside(ball(radius: 5mm))((1mm, 0mm, 0mm))   // = -4 mm
/// ```
fn inside_of(shape, body) = each(shape, |s| |u: real, v: real| {
  let p = s(u, v)
  keep(p, -inside(body)(p))
})

/// The union of an array of solids, whose surfaces are `at[0]`, `at[1]` and so on. Under a name, as in `a - {hole:
/// solids}`, an array needs no `union`.
/// ```gml
/// let row = union(for i in 0..3 { ball(radius: 3mm).translate((i * 4mm, 0mm, 0mm)) })
/// inside(row)((4mm, 0mm, 0mm))   // = -3 mm
/// ```
fn union(solids) = _combined(solids, 1)

/// What all solids of an array have in common; their surfaces are `at[0]`, `at[1]` and so on.
/// ```gml
/// let lens = intersection([ball(radius: 5mm), ball(radius: 5mm).translate((6mm, 0mm, 0mm))])
/// inside(lens)((3mm, 0mm, 0mm))   // = -2 mm
/// ```
fn intersection(solids) = _combined(solids, -1)

/// The union of an array of solids that do not touch each other: none asks where the others are, so that there may be a
/// hundred of them. Their surfaces are `at[0]`, `at[1]` and so on. `gmlc check` says that the model is not closed
/// where they overlap by more than some ten-thousandths of its size.
/// ```gml
/// // part plate = box() - {hole: separate(for i in 0..100 { bolt.translate(place(i)) })}   // plate.hole[3].wall
/// let two = separate(for i in 0..2 { ball(radius: 2mm).translate((i * 9mm, 0mm, 0mm)) })
/// inside(two)((9mm, 0mm, 0mm))   // = -2 mm
/// ```
fn separate(solids) = solid(
  {at: for i in 0..len(solids) { each(solids[i], |s| s) }},
  |p| _least(for i in 0..len(solids) { inside(solids[i])(p) }),
  {at: for i in 0..len(solids) { sides(solids[i]) }},
)

// What is left of the surfaces of two solids. On a surface of one solid the other is asked a little below or above it,
// so that surfaces of both that coincide are kept once or not at all, as Requicha and Voelcker have it (1985): where
// both face the same way, `+` and `&` keep that of the first and `-` none; where they face each other, `-` keeps that
// of the first and the others none. The second solid's never stays: it is kept where it is clearly outside, or inside.
// Inside is what is so on both sides of the surface: of solids that were joined at a common face, what is inside of
// either is zero on that face, too.

/// How far beside a surface the other solid is asked: far above the rounding of coordinates (1e-11 mm in a model of
/// 10 m), far below what is made or measured.
let _beside = 1e-6mm

/// The way from a surface to the point beside it, above.
fn _aside(s, u, v) {
  let n = stop(cross(s'u(u, v), s'v(u, v)))
  n * (_beside / (norm(n) + 1e-12mm * 1mm))
}

/// The point beside a surface: `side` is 1 above it and -1 below.
fn _beside_surface(s, u, v, side) = s(u, v) + _aside(s, u, v) * side

/// Positive where both sides of a surface are inside of a solid. Far from its surface one side tells of both.
fn _within(s, u, v, other) {
  let (p, aside) = (s(u, v), _aside(s, u, v))
  let above = -other(p + aside)
  if abs(above) > 1000 * _beside { above } else { min(above, -other(p - aside)) }
}

/// The first of two solids in their union.
fn _union_first(surfaces, other) =
  each(surfaces, |s| |u: real, v: real| keep(s(u, v), other(_beside_surface(s, u, v, 1))))

/// The second of two solids in their union.
fn _union_second(surfaces, other) = each(surfaces, |s| |u: real, v: real| {
  let p = s(u, v)
  keep(p, other(p) - _beside)
})

/// The first of two solids without the second.
fn _difference_first(surfaces, other) =
  each(surfaces, |s| |u: real, v: real| keep(s(u, v), other(_beside_surface(s, u, v, -1))))

/// The second of two solids where it bounds what is left of the first: turned inside out.
fn _difference_second(surfaces, other) = flip(_intersection_second(surfaces, other))

/// The first of two solids where they have it in common.
fn _intersection_first(surfaces, other) =
  each(surfaces, |s| |u: real, v: real| keep(s(u, v), -other(_beside_surface(s, u, v, -1))))

/// The second of two solids where they have it in common.
fn _intersection_second(surfaces, other) =
  each(surfaces, |s| |u: real, v: real| keep(s(u, v), _within(s, u, v, other)))

/// The sides of surfaces that are turned inside out.
fn _turned_sides(of) = each_solid(of, |s| s, |side| |p| -side(p))

/// What is inside of either solid.
fn _inside_union(a, b) = |p| min(a(p), b(p))

/// What is inside of the first solid and not of the second.
fn _inside_difference(a, b) = |p| max(a(p), -b(p))

/// What is inside of both solids.
fn _inside_intersection(a, b) = |p| max(a(p), b(p))

/// The union of an array of solids (1), or what they have in common (-1): each surface where it is on that side of all
/// others.
fn _combined(solids, side) {
  // Surfaces hold on to what is inside of all others, and not to their surfaces: there may be many.
  let insides = for i in 0..len(solids) { inside(solids[i]) }
  solid(
    {
      at: for i in 0..len(solids) {
        let others = for k in 0..len(insides) - 1 { insides[if k < i { k } else { k + 1 }] }
        each(solids[i], |s| |u: real, v: real| {
          let (p, beside) = (s(u, v), _beside_surface(s, u, v, side))
          keep(p, _least(for k in 0..len(others) {
            if k >= i { side * others[k](beside) }
            else if side > 0 { others[k](p) - _beside }
            else { _within(s, u, v, others[k]) }
          }))
        })
      },
    },
    |p| side * _least(for j in 0..len(insides) { side * insides[j](p) }),
    {at: for i in 0..len(solids) { sides(solids[i]) }},
  )
}

/// The least of some lengths, and of a kilometre.
fn _least(lengths) = fold(1000m, lengths, |least, x| min(least, x))

/// Distance to a box of half sides about the point (0, 0, middle), negative inside.
fn _inside_rounded_box(p, x, y, z, middle) {
  let q = (abs(p.x) - x, abs(p.y) - y, abs(p.z - middle) - z)
  let beyond = (max(q.x, 0mm), max(q.y, 0mm), max(q.z, 0mm))
  norm(beyond) + min(max(q.x, q.y, q.z), 0mm)
}

/// Twice the area within an outline, negative where it runs clockwise.
fn _doubled_area(outline) =
  sum(for i in 0..len(outline) { cross2(outline[i], outline[(i + 1) % len(outline)]) })

/// Where the nearest point of a curve is sought at first; computed once, and not for every point.
fn _stations(curve) = for i in 0..33 { curve(i / 32) }

/// Distance of a point of the plane from a smooth curve with its stations: to the right of its sense, negative to the
/// left.
fn _from_curve(p, curve, stations, closed: bool) {
  fn within(t: real) -> real = if closed { t - floor(stop(t)) } else { clamp(t, 0, 1) }
  // Newton's step towards the nearest point; where the curve turns away, a step of steepest descent.
  fn step(t: real) -> real {
    let (d, v) = (curve(t) - p, curve'(t))
    let square = dot(v, v)
    dot(d, v) / max(square + dot(d, curve''(t)), square / 4)
  }
  let first = fold((0.0, 1000m * 1000m), 0..33, |best, i| {
    let d = stations[i] - p
    let square = dot(d, d)
    if square < best[1] { (i / 32, square) } else { best }
  })
  let found = stop(loop(first[0], 3, |t, i| within(t - clamp(step(t), -1 / 32, 1/32))))
  // One more step is differentiated, so that derivatives are exact.
  let t = if closed or found > 0 and found < 1 { found - step(found) } else { found }
  let (from, v) = (p - curve(t), curve'(t))
  require norm(v) > 1e-9mm,
    "the curve stands still, as at a corner: a solid with corners is made by 'extruded' or 'revolved'"
  cross2(from, v) / norm(v)
}

/// Negative between the walls and the ends of a bent pipe.
fn _inside_elbow(p, bend, angle, outer, inner) {
  let middle = hypot(hypot(p.x, p.y) - bend, p.z)
  let (start, end) = (-p.y, p.y * cos(angle) - p.x * sin(angle))
  let ends = if angle <= 180deg { max(start, end) } else { min(start, end) }
  max(middle - outer, inner - middle, ends)
}
