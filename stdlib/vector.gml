/// The scalar product of two vectors of any length.
fn dot(a, b) = sum(for i in 0..len(a) { a[i] * b[i] })

/// The vector product: at right angles to both; its length is the area of the parallelogram.
fn cross(a, b) = (a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)

/// The Euclidean length of a vector.
fn norm(v) = sqrt(dot(v, v))

/// The vector of length 1 in the same direction.
fn normalize(v) = v / norm(v)

/// The distance of two points.
fn distance(a, b) = norm(b - a)

/// The point at a distance from the z axis and an angle about it, at height z.
fn polar(radius, angle: angle, z = 0 * radius) = (radius * cos(angle), radius * sin(angle), z)

/// Where p lies after turning it about the unit vector `axis` by `angle` (Rodrigues).
fn turned(p, axis, angle: angle) {
  let c = cos(angle)
  p * c + cross(axis, p) * sin(angle) + axis * (dot(axis, p) * (1 - c))
}
