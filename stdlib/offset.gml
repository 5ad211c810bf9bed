// Curves and surfaces at a distance from others, and sheets of a thickness.

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
