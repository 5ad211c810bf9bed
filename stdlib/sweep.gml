// Surfaces that a curve makes when it moves: prisms, ruled and lofted surfaces, sections carried along a path.

/// A curve in the plane of x and y raised along z: the wall of a prism. Where the curve runs counterclockwise the
/// normal is outwards. On the way it can be turned by `twist` in all and scaled to `taper` times its size, both about
/// the z axis. Of a curve in space every point is raised.
/// ```gml
/// extrude(circle(5mm), 8mm)(0, 0.5)              // = (5, 0, 4) mm
/// extrude(circle(5mm), 8mm, taper: 0.2)(0, 1)    // = (1, 0, 8) mm
/// ```
fn extrude(curve: curve, height: length, twist: angle = 0deg, taper: real = 1) = |u: real, v: real| {
  let p = lift(curve(u))
  let k = mix(1, taper, v)
  let (c, s) = (k * cos(twist * v), k * sin(twist * v))
  (p.x * c - p.y * s, p.x * s + p.y * c, p.z + height * v)
}

/// What a closed curve encloses: lines from the curve to a point inside, from which all of the curve must be seen. Of a
/// curve in the plane (of x and y) that runs counterclockwise the normal is upwards. v runs inwards.
/// ```gml
/// fill(circle(5mm))(0, 0.5)   // = (2.5, 0, 0) mm
/// normal(fill(rectangle(4mm, 2mm)), 0.1, 0.5)   // = (0, 0, 1)
/// ```
fn fill(curve: curve, center = (0mm, 0mm, 0mm)) = |u: real, v: real| mix(lift(curve(u)), lift(center), v)

/// A solid on a closed curve in the plane that runs counterclockwise about the z axis: {wall, top, base}, as extrude
/// and fill make them.
/// ```gml
/// prism(rectangle(40mm, 20mm), 5mm).top(0, 0)      // = (20, 0, 5) mm
/// prism(regular_polygon(6, 10mm), 5mm).base(0, 1)  // = (10, 0, 0) mm
/// ```
fn prism(curve: curve, height: length, twist: angle = 0deg, taper: real = 1) {
  let wall = extrude(curve, height, twist, taper)
  {
    wall: wall,
    top: fill(|t: real| wall(t, 1), (0mm, 0mm, height)),
    base: flip(fill(|t: real| wall(t, 0))),
  }
}

/// The surface of the straight lines between points of two curves in space with the same t: u along the curves, v from
/// the first to the second.
/// ```gml
/// let (a, b) = (line((0mm, 0mm, 0mm), (4mm, 0mm, 0mm)), line((0mm, 2mm, 0mm), (4mm, 2mm, 6mm)))
/// ruled(a, b)(0.5, 0.5)   // = (2, 1, 1.5) mm
/// ```
fn ruled(a, b) = |u: real, v: real| mix(a(u), b(u), v)

/// A smooth surface through curves in space (Catmull-Rom in v): u along the curves, v from the first to the last, or,
/// `closed`, back to it. Where counterclockwise curves are stacked upwards the normal is outwards. Two curves give a
/// ruled surface.
/// ```gml
/// let ring = |r, z| |t| polar(r, t * 1turn, z)
/// let vase = loft([ring(20mm, 0mm), ring(35mm, 30mm), ring(15mm, 60mm), ring(20mm, 80mm)])
/// vase(0, 0)         // = (20, 0, 0) mm
/// vase(0, 1 / 3)     // = (35, 0, 30) mm
/// ```
fn loft(curves, closed: bool = false) = |u: real, v: real| catmull_rom(for c in curves { c(u) }, closed)(v)

/// A section carried along a curve without twisting about it: u along the section, v along the curve. A curve in the
/// plane counts as (radius, height) in the half plane of x and z. The section is a curve in the plane of the normal and
/// the binormal, or a function of (u, v), for one that changes. One that runs counterclockwise has its normal outwards.
///
/// The normal starts towards `up`, as far as that is at right angles to the curve, and is carried along by double
/// reflection (Wang, Jüttler, Zheng and Liu, Computation of Rotation Minimizing Frames, 2008) from one to the next of
/// `stations` equal steps of v; within a step from its beginning. Its error falls with the fourth power of their
/// number: 32 steps leave about 1e-8 where the curve turns by 90deg, and 1e-6 where it turns twice around. `twist` is
/// added evenly along v; with `closed`, for a curve that returns with the direction it started with, also what brings
/// the section back to where it was.
/// ```gml
/// let arch = |t| (10mm * cos(t * 180deg), 0mm, 10mm * sin(t * 180deg))
/// norm(sweep(arch, circle(2mm), up: (0, 1, 0))(0, 0.7))    // = 10.198039 mm
/// let knot = |t| polar(20mm + 5mm * cos(3turn * t), 2turn * t, 8mm * sin(3turn * t))
/// let s = sweep(knot, rectangle(4mm, 2mm), closed: true)
/// distance(s(0.1, 0), s(0.1, 1)) < 1e-9mm    // = true
/// norm(sweep(arch, |u, v| circle(1mm + 1mm * v)(u))(0.3, 1) - (-10mm, 0mm, 0mm))    // = 2 mm
/// ```
fn sweep(
  curve,
  section,
  up = perpendicular3(tangent(spatial(curve), 0)),
  twist: angle = 0deg,
  closed: bool = false,
  stations: int = 32,
) {
  let path = spatial(curve)
  let along = tangent(path, 0)
  let first = normalize(reject(up, along))
  let carried = loop(
    {normal: first, all: for j in 0..stations + 1 { first }},
    stations,
    |acc, i| {
      let next = _carried(path, acc.normal, i / stations, (i + 1) / stations)
      {normal: next, all: for j in 0..stations + 1 { if j == i + 1 { next } else { acc.all[j] } }}
    },
  )
  let last = carried.normal
  let turn = if closed { twist + atan2(dot(cross(last, first), along), dot(last, first)) } else { twist }
  |u: real, v: real| {
    let k = span_of(v, stations).x
    let normal = _carried(path, carried.all[k], k / stations, v)
    let binormal = cross(tangent(path, v), normal)
    let (c, s) = (cos(turn * v), sin(turn * v))
    let q = if arity(section) == 2 { section(u, v) } else { section(u) }
    path(v) + normal * (q.x * c - q.y * s) + binormal * (q.x * s + q.y * c)
  }
}

/// A vector at right angles to the path at `from`, carried to `to` by double reflection. The first mirror is at right
/// angles to the chord, whose direction is had from the velocity at two Gauss nodes, so that it does not vanish with
/// the step; the second brings the reflected tangent to the tangent at the end.
fn _carried(path, normal, from, to) {
  let chord = path'(mix(from, to, 0.21132486540518713)) + path'(mix(from, to, 0.7886751345948129))
  let mirrored = reflect(tangent(path, from), chord)
  reflect(reflect(normal, chord), tangent(path, to) - mirrored)
}

/// A section carried along straight lines from point to point in space, cut and joined in mitres at the corners: a
/// surface for each line, u along the section, v along the line. The section is a curve in the plane of the normal
/// and the binormal, as that of a sweep: the normal starts towards `up`, as far as that is at right angles to the
/// first line, and is mirrored in each mitre. With `closed` there is a line back to the first point, and the lines
/// lie in a plane or return with the normal that they started with. Lines must be longer than what the mitres take
/// off the section.
/// ```gml
/// let ring = [(0mm, 0mm, 0mm), (9mm, 0mm, 0mm), (9mm, 9mm, 0mm), (0mm, 9mm, 0mm)]
/// let frame = mitred_sweep(ring, rectangle(2mm, 2mm), up: (0, 0, 1), closed: true)
/// len(frame)              // = 4
/// frame[0](0.25, 0)       // = (-1, -1, 0) mm
/// frame[3](0.75, 1)       // = (1, 1, 0) mm
/// ```
fn mitred_sweep(points, section: curve, up = perpendicular3(points[1] - points[0]), closed: bool = false) {
  require len(points) > (if closed { 2 } else { 1 }), "a sweep needs two points at least, a closed one three"
  let count = if closed { len(points) } else { len(points) - 1 }
  let at = for i in 0..count + 1 { points[i % len(points)] }
  let along = for (a, b) in pairs(at) { normalize(b - a) }
  // The planes of the cuts, by their normals.
  let cuts = for i in 0..count + 1 {
    if i == 0 and not closed { along[0] }
    else if i == count and not closed { along[count - 1] }
    else { normalize(along[(i + count - 1) % count] + along[i % count]) }
  }
  let first = normalize(reject(up, along[0]))
  require not closed or distance(_mirrored(first, cuts, count), first) < 1e-6,
    "the lines of a closed mitred sweep must return with the normal that they started with, as those in a plane do"
  for i in 0..count {
    let normal = _mirrored(first, cuts, i)
    let binormal = cross(along[i], normal)
    |u: real, v: real| {
      let q = section(u)
      let beside = normal * q.x + binormal * q.y
      let cut = |k: int| at[k] + beside - along[i] * (dot(beside, cuts[k]) / dot(along[i], cuts[k]))
      mix(cut(i), cut(i + 1), v)
    }
  }
}

/// A normal of the first line, mirrored in the cuts up to the line i.
fn _mirrored(normal, cuts, i: int) =
  if i == 0 { normal }
  else { reflect(_mirrored(normal, cuts, i - 1), cuts[i]) }

/// A solid bar: a sweep with its ends filled, {wall, start, end}. The section is closed, runs counterclockwise, and can
/// all be seen from its origin.
/// ```gml
/// let b = bar(line((0mm, 0mm, 0mm), (0mm, 0mm, 9mm)), rectangle(4mm, 2mm))
/// b.end(0, 1)                      // = (0, 0, 9) mm
/// normal(b.start, 0.1, 0.5)        // = (0, 0, -1)
/// ```
fn bar(
  curve,
  section,
  up = perpendicular3(tangent(spatial(curve), 0)),
  twist: angle = 0deg,
  stations: int = 32,
) {
  let path = spatial(curve)
  let wall = sweep(path, section, up, twist, false, stations)
  {
    wall: wall,
    start: flip(fill(|t: real| wall(t, 0), path(0))),
    end: fill(|t: real| wall(t, 1), path(1)),
  }
}

/// A coil spring about the z axis: round wire of a radius along a helix from the plane of x and y upwards. `radius` is
/// that of the wire's axis, `pitch` the rise in a turn, which must not be vertical.
/// ```gml
/// coil(10mm, 5mm, 4, 1mm)(0, 0)   // = (9, 0, 0) mm
/// ```
fn coil(radius: length, pitch: length, turns: real, wire: length) =
  tube(helix(radius, pitch, turns), radius: wire, up: (0, 0, 1))
