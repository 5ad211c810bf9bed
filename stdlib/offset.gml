// Curves and surfaces at a distance from others, sheets of a thickness, and hollow solids.

/// A curve in the plane (of x and y) moved sideways by a distance, to the right of its sense: outwards for a closed one
/// that runs counterclockwise. Of a surface: moved along its normal, outwards. A negative distance goes to the other
/// side. Beyond the radius of curvature it folds over. At a pole it follows the limit of the normal. A corner is torn
/// apart: both of its sides are moved along their own normals.
/// ```gml
/// norm(offset(circle(5mm), 2mm)(0.3))          // = 7 mm
/// norm(offset(sphere(5mm), -1mm)(0.3, 0.6))    // = 4 mm
/// norm(offset(sphere(5mm), -1mm)(0.3, 1))      // = 4 mm
/// ```
fn offset(shape, distance) = each(shape, |s|
  if arity(s) == 2 { |u: real, v: real| s(u, v) + normal(s, u, v) * distance }
  else { |t: real| s(t) - perpendicular(normalize(s'(t))) * distance })

/// A sheet of a thickness on the outer side of a surface: {outer, inner, rims}, all normals outwards. The rims are
/// those at v = 0, v = 1, u = 0 and u = 1; `around: true` leaves out the last two, where the surface closes on itself
/// in u. The rim of a pole has no surface. At a corner of the surface the sheet gapes, as `offset` does.
/// ```gml
/// norm(thicken(cylinder(5mm, 9mm), 2mm, around: true).outer(0.2, 0)) // = 7 mm
/// len(thicken(plane(4mm, 4mm), 1mm).rims)                            // = 4
/// ```
fn thicken(surface: surface, thickness: length, around: bool = false) {
  let outer = offset(surface, thickness)
  let low = ruled(|t| surface(t, 0), |t| outer(t, 0))
  let high = flip(ruled(|t| surface(t, 1), |t| outer(t, 1)))
  let left = flip(ruled(|t| surface(0, t), |t| outer(0, t)))
  let right = ruled(|t| surface(1, t), |t| outer(1, t))
  {outer: outer, inner: flip(surface), rims: if around { [low, high] } else { [low, high, left, right] }}
}

/// A solid as a hollow one with walls of a thickness: its surfaces are those of the solid, as `outside`, and those of
/// the hollow, as `inside`. It is opened by what cuts it: `shell(tin, 1mm) & {rim: half_space(...)}`. What is inside of
/// the solid must be told by the distance, as the functions of std.solid do, and the solid must have no inner edges:
/// there the hollow has a rounding, which is not made, so that it stays open.
/// ```gml
/// let tin = shell(capped_cylinder(radius: 20mm, height: 30mm), 1mm)
/// tin.inside.wall(0, 0.5)              // = (19, 0, 15) mm
/// inside(tin)((0mm, 0mm, 0.5mm))       // = -0.5 mm
/// inside(tin)((0mm, 0mm, 9mm))         // = 8 mm
/// ```
fn shell(body, thickness: length) {
  require thickness > 0mm, "the thickness of a shell is positive"
  let distance = inside(body)
  solid(
    {
      outside: each(body, |s| s),
      inside: flip(each(body, |s| |u: real, v: real| {
        let n = normal(s, u, v)
        let p = s(u, v) - n * thickness
        // A little deeper than it is another surface of the hollow may be nearer.
        keep(p, -thickness - distance(p - n * 1e-6mm))
      })),
    },
    |p| max(distance(p), -thickness - distance(p)),
  )
}
