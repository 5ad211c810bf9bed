/// A profile turned about the z axis. The profile gives (radius, height); u runs once around, v along the profile.
/// A profile that runs upwards has its normal away from the axis, one that runs inwards has it upwards.
fn revolve(profile: real -> point2) = |u: real, v: real| {
  let p = profile(v)
  let a = u * 1turn
  (p.x * cos(a), p.x * sin(a), p.y)
}

/// A surface turned inside out: the same points, the normal the other way.
fn flip(surface: surface) = |u: real, v: real| surface(u, 1 - v)

/// A tube about a curve, u around it and v along, with the normal away from the curve. A curve in the plane counts as (radius,
/// height) in the half plane of x and z. `radii` are the semi-axes of an elliptic section: the first in the plane at right angles
/// to `up`, the second towards `up`, which must nowhere be parallel to the curve. Both may be functions of v.
fn tube(curve: curve, radius = 1mm, radii = (radius, radius), up = (0, 1, 0)) {
  let path = spatial(curve)
  |u: real, v: real| {
    let along = normalize(path'(v))
    let b = normalize(up - along * dot(up, along))
    let n = cross(b, along)
    let r = radii_at(radii, v)
    let a = u * 1turn
    path(v) + n * (r.x * cos(a)) + b * (r.y * sin(a))
  }
}

/// The semi-axes at v, which are given once for all, or as a function, or each as a function.
fn radii_at(radii, v) =
  if arity(radii) == 1 { radii(v) }
  else { (radius_at(radii.x, v), radius_at(radii.y, v)) }

/// A radius at v, which is given once for all or as a function.
fn radius_at(radius, v) = if arity(radius) == 1 { radius(v) } else { radius }

/// A rectangle about the origin in the plane of x and y, its normal upwards.
fn plane(width: length, depth: length) = |u: real, v: real| ((u - 0.5) * width, (v - 0.5) * depth, 0mm)

/// A disc about the origin, its normal upwards.
fn disc(radius: length) = revolve(|t: real| (radius * (1 - t), 0mm))

/// A ring about the origin, its normal upwards.
fn annulus(inner: length, outer: length) = revolve(|t: real| (mix(outer, inner, t), 0mm))

/// The wall of a cylinder that stands on the plane of x and y, its normal outwards.
fn cylinder(radius: length, height: length) = revolve(|t: real| (radius, height * t))

/// The wall of a truncated cone that stands on the plane of x and y; `top` may be 0mm.
fn cone(bottom: length, top: length, height: length) = revolve(|t: real| (mix(bottom, top, t), height * t))

/// A sphere about the origin; v runs from the lowest to the highest point.
fn sphere(radius: length) = revolve(|t: real| (radius * sin(t * 180deg), -radius * cos(t * 180deg)))

/// A torus about the z axis: a tube of radius `minor` about a circle of radius `major`.
fn torus(major: length, minor: length) =
  revolve(|t: real| (major + minor * cos(t * 1turn), minor * sin(t * 1turn)))
