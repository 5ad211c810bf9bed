/// What f, a function of points, makes of a point, a curve or a surface, or of all in an array or record.
fn transform(shape, f) = each(shape, |s|
  if arity(s) == 2 { |u, v| f(s(u, v)) }
  else if arity(s) == 1 { |t| f(s(t)) }
  else { f(s) })

/// The rotation by alpha about x, then beta about y, then gamma about z, as a function of points and vectors:
/// Rz(gamma) Ry(beta) Rx(alpha).
fn euler(alpha: angle, beta: angle, gamma: angle) {
  let (ca, sa) = (cos(alpha), sin(alpha))
  let (cb, sb) = (cos(beta), sin(beta))
  let (cc, sc) = (cos(gamma), sin(gamma))
  let (xx, xy, xz) = (cb * cc, sa * sb * cc - ca * sc, ca * sb * cc + sa * sc)
  let (yx, yy, yz) = (cb * sc, sa * sb * sc + ca * cc, ca * sb * sc - sa * cc)
  let (zx, zy, zz) = (-sb, sa * cb, ca * cb)
  |p| (
    xx * p.x + xy * p.y + xz * p.z,
    yx * p.x + yy * p.y + yz * p.z,
    zx * p.x + zy * p.y + zz * p.z,
  )
}

/// The rotation about an axis through the origin, as a function of points and vectors.
fn axis_angle(axis, angle: angle) {
  let n = normalize(axis)
  |p| turned(p, n, angle)
}

/// A frame: puts shapes that are made about the origin at `origin`, turned by `rotation` (such as euler(..)).
fn place(origin, rotation) = |shape| transform(shape, |p| origin + rotation(p))

/// The shape moved by a vector of lengths.
fn translate(shape, by) = transform(shape, |p| p + by)

/// The shape turned about an axis through the origin.
fn rotate(shape, angle: angle, axis = (0, 0, 1)) = transform(shape, axis_angle(axis, angle))

/// The shape scaled about the origin by a number. A negative number turns it inside out.
fn scale(shape, by: real) = transform(shape, |p| p * by)

/// The shape stretched along x, y and z by three numbers.
fn stretch(shape, by: vec3) = transform(shape, |p| (p.x * by.x, p.y * by.y, p.z * by.z))
