// Surfaces are functions of (u, v), both over 0..1, whose values are points in space. The outer side is the one to
// which the cross product of the derivatives by u and v points; `flip` turns it. Surfaces of revolution stand about the
// z axis: u runs around, from the x axis counterclockwise, and v along the profile.

/// A profile turned about the z axis: the whole way around, or from one angle to another. The profile gives (radius,
/// height); u runs around, v along the profile. A profile that runs upwards has its normal away from the axis, one that
/// runs inwards has it upwards.
/// ```gml
/// revolve(|t| (2mm + t * 3mm, t * 8mm))(0, 0.5)                       // = (3.5, 0, 4) mm
/// norm(revolve(line((2mm, 0mm), (2mm, 4mm)), to: 90deg)(1, 0) - (0mm, 2mm, 0mm)) < 1e-9mm   // = true
/// ```
fn revolve(profile: real -> point2, from: angle = 0deg, to: angle = 360deg) = |u: real, v: real| {
  let p = profile(v)
  let a = mix(from, to, u)
  (p.x * cos(a), p.x * sin(a), p.y)
}

/// A surface turned inside out: the same points, v backwards, the normal the other way. Also all surfaces of a solid:
/// what was full is hollow then.
/// ```gml
/// flip(cylinder(2mm, 5mm))(0, 0.2)              // = (2, 0, 4) mm
/// normal(flip(cylinder(2mm, 5mm)), 0, 0.5)      // = (-1, 0, 0)
/// ```
fn flip(surface) = each(surface, |s| |u: real, v: real| s(u, 1 - v))

/// The patch of a surface from one value of u to another, and of v.
/// ```gml
/// trim(cylinder(2mm, 10mm), v: (0.5, 1))(0, 0)   // = (2, 0, 5) mm
/// ```
fn trim(surface: surface, u: vec2 = (0, 1), v: vec2 = (0, 1)) = |s: real, t: real|
  surface(mix(u.x, u.y, s), mix(v.x, v.y, t))

/// A tube about a curve, u around it and v along, with the normal away from the curve. A curve in the plane counts as
/// (radius, height) in the half plane of x and z. `radii` are the semi-axes of an elliptic section: the first in the
/// plane at right angles to `up`, the second towards `up`, which must nowhere be parallel to the curve (sweep has no
/// such direction). Both may be functions of v.
/// ```gml
/// let axis = line((0mm, 0mm, 0mm), (10mm, 0mm, 0mm))
/// norm(tube(axis, radius: 2mm)(0.3, 0))                     // = 2 mm
/// norm(tube(axis, radius: |v| 2mm + 4mm * v)(0.3, 0))       // = 2 mm
/// tube(axis, radii: (2mm, 3mm))(0.25, 0)                    // = (0, 3, 0) mm
/// ```
fn tube(curve: curve, radius = 1mm, radii = (radius, radius), up = (0, 1, 0)) {
  let path = spatial(curve)
  |u: real, v: real| {
    let along = normalize(path'(v))
    let b = normalize(up - along * dot(up, along))
    let n = cross(b, along)
    let r = _radii_at(radii, v)
    let a = u * 1turn
    path(v) + n * (r.x * cos(a)) + b * (r.y * sin(a))
  }
}

/// The semi-axes at v, which are given once for all, or as a function, or each as a function.
fn _radii_at(radii, v) =
  if arity(radii) == 1 { radii(v) }
  else { (_radius_at(radii.x, v), _radius_at(radii.y, v)) }

/// A radius at v, which is given once for all or as a function.
fn _radius_at(radius, v) = if arity(radius) == 1 { _radius(radius(v)) } else { _radius(radius) }

/// A radius, which is a length.
fn _radius(radius: length) = radius

/// A rectangle about the origin in the plane of x and y, its normal upwards.
/// ```gml
/// plane(8mm, 4mm)(1, 1)   // = (4, 2, 0) mm
/// ```
fn plane(width: length, depth: length) = |u: real, v: real| ((u - 0.5) * width, (v - 0.5) * depth, 0mm)

/// A disc about the origin in the plane of x and y, its normal upwards; v runs from the rim to the middle.
/// ```gml
/// disc(5mm)(0, 0)   // = (5, 0, 0) mm
/// ```
fn disc(radius: length) = revolve(|t: real| (radius * (1 - t), 0mm))

/// A ring about the origin in the plane of x and y, its normal upwards; v runs from the outer rim to the inner.
/// ```gml
/// annulus(3mm, 5mm)(0, 1)   // = (3, 0, 0) mm
/// ```
fn annulus(inner: length, outer: length) = revolve(|t: real| (mix(outer, inner, t), 0mm))

/// The wall of a cylinder that stands on the plane of x and y, its normal outwards.
/// ```gml
/// cylinder(2mm, 10mm)(0, 0.5)   // = (2, 0, 5) mm
/// ```
fn cylinder(radius: length, height: length) = revolve(|t: real| (radius, height * t))

/// The wall of a truncated cone that stands on the plane of x and y, its normal outwards; `top` may be 0mm.
/// ```gml
/// cone(6mm, 2mm, 10mm)(0, 0.5)   // = (4, 0, 5) mm
/// ```
fn cone(bottom: length, top: length, height: length) = revolve(|t: real| (mix(bottom, top, t), height * t))

/// A sphere about the origin, its normal outwards; v runs from the lowest to the highest point.
/// ```gml
/// norm(sphere(5mm)(0.2, 0.7))   // = 5 mm
/// sphere(5mm)(0, 0.5).x         // = 5 mm
/// ```
fn sphere(radius: length) = revolve(|t: real| (radius * sin(t * 180deg), -radius * cos(t * 180deg)))

/// The zone of a sphere about the origin between two elevations above the equator (-90deg to 90deg), its normal
/// outwards; with `around` also a part of it only: the azimuths from and to.
/// ```gml
/// sphere_zone(5mm, 0deg, 90deg)(0, 0)   // = (5, 0, 0) mm
/// norm(sphere_zone(5mm, 0deg, 90deg, around: (0deg, 90deg))(0.4, 0.3))   // = 5 mm
/// ```
fn sphere_zone(radius: length, from: angle, to: angle, around: (angle, angle) = (0deg, 360deg)) =
  revolve(arc((0mm, 0mm), radius, from, to), around.x, around.y)

/// An ellipsoid about the origin with semi-axes a, b and c along x, y and z, its normal outwards; v runs from the
/// lowest to the highest point.
/// ```gml
/// ellipsoid(3mm, 4mm, 5mm)(0.25, 0.5).y   // = 4 mm
/// ```
fn ellipsoid(a: length, b: length, c: length) = sphere(1mm).stretch((a / 1mm, b / 1mm, c / 1mm))

/// A torus about the z axis: a tube of radius `minor` about a circle of radius `major`. Normal outwards; v runs around
/// the tube from its outermost circle upwards.
/// ```gml
/// torus(10mm, 2mm)(0, 0)   // = (12, 0, 0) mm
/// ```
fn torus(major: length, minor: length) =
  revolve(|t: real| (major + minor * cos(t * 1turn), minor * sin(t * 1turn)))

/// A paraboloid that opens upwards from the origin to a rim of a radius at a height, its normal downwards and outwards;
/// flip it for the inside of a dish. Its focus is at the height radius^2 / (4 height).
/// ```gml
/// paraboloid(4mm, 8mm)(0, 0.5)   // = (2, 0, 2) mm
/// ```
fn paraboloid(radius: length, height: length) = revolve(|t: real| (radius * t, height * t * t))

/// A helicoid: a ramp about the z axis between two radii, which rises counterclockwise by `pitch` in a turn. Normal
/// upwards.
/// ```gml
/// helicoid(2mm, 6mm, 10mm, 0.5)(0.5, 0)   // = (4, 0, 0) mm
/// helicoid(2mm, 6mm, 10mm, 0.5)(0.5, 1).z   // = 5 mm
/// ```
fn helicoid(inner: length, outer: length, pitch: length, turns: real) = |u: real, v: real|
  polar(mix(inner, outer, u), turns * v * 1turn, pitch * turns * v)

/// The superellipsoid ((|x / a|^m + |y / b|^m)^(n / m) + |z / c|^n) = 1 about the origin (Barr 1981), its normal
/// outwards; v runs from the lowest to the highest point. m shapes it seen from above, n seen from the side: 2 is
/// round, 1 a rhombus, large exponents near a box. Both are 1 or more. The parameters go with the angles, not with
/// Barr's powers, so that there are no cusps.
/// ```gml
/// superellipsoid(3mm, 4mm, 5mm, 2.5, 4)(0, 0.5).x             // = 3 mm
/// norm(superellipsoid(5mm, 5mm, 5mm, 2, 2)(0.2, 0.7))         // = 5 mm
/// ```
fn superellipsoid(a: length, b: length, c: length, m: real, n: real) = |u: real, v: real| {
  let (around, up) = (u * 1turn, (v - 0.5) * 180deg)
  let ring = superradius(around, m)
  let r = superradius(up, n)
  (a * (ring * r * cos(up) * cos(around)), b * (ring * r * cos(up) * sin(around)), c * (r * sin(up)))
}

/// A supertoroid about the z axis (Barr 1981): a ring with the superellipse of exponent m and radius `major` seen from
/// above, and a section that is a superellipse of exponent n with semi-axes `width` (along the radius) and `height`.
/// Normal outwards.
/// ```gml
/// supertoroid(10mm, 2mm, 3mm, 4, 2.5)(0, 0)   // = (12, 0, 0) mm
/// ```
fn supertoroid(major: length, width: length, height: length, m: real, n: real) = |u: real, v: real| {
  let section = superellipse(width, height, n)(v)
  let a = u * 1turn
  let r = superradius(a, m) * (major + section.x)
  (r * cos(a), r * sin(a), section.y)
}
