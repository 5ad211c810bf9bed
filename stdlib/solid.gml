// Solids of several named surfaces that close without gaps, all normals outwards. They are models: their arguments are
// labelled, what is left out has its default, and `part tin = capped_cylinder(radius: 40mm)` has the parts `tin.wall`,
// `tin.top` and `tin.base`. As any shape they can be moved, turned, mirrored and repeated.

/// A box that stands on the plane of x and y, about the z axis: six faces.
/// ```gml
/// let b = box(width: 40mm, depth: 20mm, height: 10mm)
/// b.top(1, 1)         // = (20, 10, 10) mm
/// b.right(0.5, 0.5)   // = (20, 0, 5) mm
/// ```
model box {
  /// Along x.
  param width: length in 0mm..10m = 20mm
  /// Along y.
  param depth: length in 0mm..10m = 20mm
  /// Along z.
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
model rounded_box {
  /// Along x.
  param width: length in 0mm..10m = 20mm
  /// Along y.
  param depth: length in 0mm..10m = 20mm
  /// Along z.
  param height: length in 0mm..10m = 20mm
  /// Of edges and corners; at most half of the least side.
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
model capped_cylinder {
  /// Radius.
  param radius: length in 0mm..10m = 10mm
  /// Along z.
  param height: length in 0mm..10m = 20mm

  part wall = cylinder(radius, height)
  part top = disc(radius).translate((0mm, 0mm, height))
  part base = flip(disc(radius))
}

/// A cone without its point, with its two ends; it stands on the plane of x and y, about the z axis.
/// ```gml
/// frustum(bottom: 6mm, top: 2mm, height: 10mm).wall(0, 0.5)   // = (4, 0, 5) mm
/// ```
model frustum {
  /// Radius at the base.
  param bottom: length in 0mm..10m = 10mm
  /// Radius at the top.
  param top: length in 0mm..10m = 5mm
  /// Along z.
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
model pipe {
  /// Outer radius.
  param outer: length in 0mm..10m = 10mm
  /// Inner radius.
  param inner: length in 0mm..outer = 8mm
  /// Along z.
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
model elbow {
  /// Radius of the bend, to the middle of the pipe.
  param bend: length in 0mm..100m = 50mm
  /// How far it is bent.
  param angle: angle in 0deg..360deg = 90deg
  /// Outer radius of the pipe.
  param outer: length in 0mm..bend = 10mm
  /// Inner radius of the pipe.
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
model capsule {
  /// Of wall and ends.
  param radius: length in 0mm..10m = 5mm
  /// From end to end.
  param height: length in 2 * radius..20m = 20mm

  part wall = revolve(line((radius, radius), (radius, height - radius)))
  part top = sphere_zone(radius, 0deg, 90deg).translate((0mm, 0mm, height - radius))
  part base = sphere_zone(radius, -90deg, 0deg).translate((0mm, 0mm, radius))
}

/// A hollow sphere about the origin: outer and inner wall.
/// ```gml
/// norm(hollow_sphere(outer: 10mm, inner: 9mm).inside(0.2, 0.3))   // = 9 mm
/// ```
model hollow_sphere {
  /// Outer radius.
  param outer: length in 0mm..10m = 10mm
  /// Inner radius.
  param inner: length in 0mm..outer = 8mm

  part outside = sphere(outer)
  part inside = flip(sphere(inner))
}
