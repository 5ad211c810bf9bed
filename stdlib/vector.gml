// Vectors and points: `vec2` and `vec3` without dimension, `point2` and `point3` of lengths. Sums, differences and
// multiples are written with operators; what is here takes both kinds, in the plane and in space where it makes sense.

/// The scalar product of two vectors of any length.
/// ```gml
/// dot((1, 2, 3), (4, -5, 6))   // = 12
/// ```
fn dot(a, b) = sum(for i in 0..len(a) { a[i] * b[i] })

/// The vector product of two vectors in space: at right angles to both; its length is the area of the parallelogram.
/// ```gml
/// cross((1, 0, 0), (0, 1, 0))   // = (0, 0, 1)
/// ```
fn cross(a, b) = (a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)

/// The vector product of two vectors in the plane: the area of the parallelogram, positive where b lies
/// counterclockwise of a.
/// ```gml
/// cross2((2mm, 0mm), (1mm, 3mm)) / 1mm^2   // = 6
/// ```
fn cross2(a, b) = a.x * b.y - a.y * b.x

/// The Euclidean length of a vector.
/// ```gml
/// norm((2mm, 3mm, 6mm))   // = 7 mm
/// ```
fn norm(v) = sqrt(dot(v, v))

/// The vector of length 1 in the same direction. v must not be zero.
/// ```gml
/// normalize((3mm, 4mm))   // = (0.6, 0.8)
/// ```
fn normalize(v) = v / norm(v)

/// The distance of two points.
/// ```gml
/// distance((1mm, 1mm), (4mm, 5mm))   // = 5 mm
/// ```
fn distance(a, b) = norm(b - a)

/// The angle between two vectors, from 0deg to 180deg: atan2 of the lengths of their products, which is exact for small
/// angles too. In the plane it has a sign: positive where b lies counterclockwise of a.
/// ```gml
/// angle_between((1, 0, 0), (0, 0, 5))      // = 90 deg
/// angle_between((1mm, 1mm), (1mm, 0mm))    // = -45 deg
/// ```
fn angle_between(a, b) =
  if len(a) == 2 { atan2(cross2(a, b), dot(a, b)) }
  else { atan2(norm(cross(a, b)), dot(a, b)) }

/// The part of v along another vector.
/// ```gml
/// project((3mm, 4mm), (2, 0))   // = (3, 0) mm
/// ```
fn project(v, onto) = onto * (dot(v, onto) / dot(onto, onto))

/// The part of v at right angles to another vector.
/// ```gml
/// reject((3mm, 4mm), (2, 0))   // = (0, 4) mm
/// ```
fn reject(v, from) = v - project(v, from)

/// v mirrored in the plane (or line) through the origin at right angles to `normal`.
/// ```gml
/// reflect((3mm, 4mm), (1, 0))   // = (-3, 4) mm
/// ```
fn reflect(v, normal) = v - project(v, normal) * 2

/// A vector in the plane turned counterclockwise by a right angle.
/// ```gml
/// perpendicular((3mm, 1mm))   // = (-1, 3) mm
/// ```
fn perpendicular(v) = (-v.y, v.x)

/// A vector of length 1 at right angles to a vector in space: of what is left of the z axis, or of the x axis where v
/// is within 26 degrees of the z axis.
/// ```gml
/// perpendicular3((5, 0, 0))      // = (0, 0, 1)
/// perpendicular3((0mm, 0mm, 2mm))   // = (1, 0, 0)
/// ```
fn perpendicular3(v) {
  let n = normalize(v)
  let up = if abs(n.z) < 0.9 { (0.0, 0.0, 1.0) } else { (1.0, 0.0, 0.0) }
  normalize(up - n * dot(n, up))
}

/// The point at a distance from the z axis and an angle about it, at height z: cylindrical coordinates.
/// ```gml
/// polar(2mm, 0deg)                  // = (2, 0, 0) mm
/// distance(polar(2mm, 90deg, 3mm), (0mm, 2mm, 3mm)) < 1e-9mm   // = true
/// ```
fn polar(radius, angle: angle, z = 0 * radius) = (radius * cos(angle), radius * sin(angle), z)

/// The point in the plane at a distance from the origin and an angle from the x axis.
/// ```gml
/// polar2(2mm, 0deg)   // = (2, 0) mm
/// ```
fn polar2(radius, angle: angle) = (radius * cos(angle), radius * sin(angle))

/// The point at a distance from the origin, an angle (azimuth) about the z axis, and an angle (elevation) above the
/// plane of x and y.
/// ```gml
/// spherical(2mm, 0deg, 0deg)   // = (2, 0, 0) mm
/// norm(spherical(2mm, 30deg, 45deg))   // = 2 mm
/// ```
fn spherical(radius, azimuth: angle, elevation: angle) = (
  radius * cos(elevation) * cos(azimuth),
  radius * cos(elevation) * sin(azimuth),
  radius * sin(elevation),
)

/// A point's distance from the z axis and its angle about it, from -180deg to 180deg: the inverse of polar (and of
/// polar2). Of a point in space there is z, too.
/// ```gml
/// to_polar((3mm, 4mm)).radius        // = 5 mm
/// to_polar((0mm, 2mm, 7mm)).angle    // = 90 deg
/// to_polar((0mm, 2mm, 7mm)).z        // = 7 mm
/// ```
fn to_polar(p) {
  let (radius, angle) = (hypot(p.x, p.y), atan2(p.y, p.x))
  if len(p) == 2 { {radius: radius, angle: angle} } else { {radius: radius, angle: angle, z: p.z} }
}

/// A point in the plane as one in space: at height z above the plane of x and y. One in space stays where it is.
/// ```gml
/// lift((1mm, 2mm))        // = (1, 2, 0) mm
/// lift((1mm, 2mm), 5mm)   // = (1, 2, 5) mm
/// ```
fn lift(p, z = 0 * p.x) = if len(p) == 2 { (p.x, p.y, z) } else { p }

/// Where p lies after turning it about the unit vector `axis` through the origin by `angle` (Rodrigues' formula).
/// ```gml
/// norm(turned((1, 2, 3), (0, 0, 1), 90deg) - (-2, 1, 3)) < 1e-12   // = true
/// ```
fn turned(p, axis, angle: angle) {
  let c = cos(angle)
  p * c + cross(axis, p) * sin(angle) + axis * (dot(axis, p) * (1 - c))
}
