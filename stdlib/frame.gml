// Moving, turning and scaling. The functions that take a shape take a point, a curve, a surface, the parts of a model,
// and arrays and records of such: `cylinder(2mm, 5mm).rotate(30deg).translate((0mm, 0mm, 1mm))`. Rotations (`euler`,
// `about_x`, ...) are functions of points and vectors, frames (`place`, `look_at`, ...) are functions of shapes. Angles
// count by the right-hand rule.

/// What f, a function of points, makes of a shape: of a point, of every point of a curve or surface, or of all that an
/// array, a record or a model's parts hold. Rotations such as euler(..) and frames such as place(..) are functions of
/// points, too.
/// ```gml
/// transform((1mm, 2mm, 3mm), |p| p * 2)                    // = (2, 4, 6) mm
/// norm(transform(sphere(5mm), |p| p * 2)(0.3, 0.6))        // = 10 mm
/// ```
fn transform(shape, f) = each(shape, |s| _mapped(s, f))

/// What f makes of a surface, a curve or a point.
fn _mapped(s, f) =
  if arity(s) == 2 { |u, v| f(s(u, v)) }
  else if arity(s) == 1 { |t| f(s(t)) }
  else { f(s) }

/// As transform, where `back` undoes f: a solid stays one.
fn _moved(shape, f, back) = each_solid(shape, |s| _mapped(s, f), |inside| |p| inside(back(p)))

/// The shape moved by a vector of lengths.
/// ```gml
/// (1mm, 2mm, 3mm).translate((10mm, 0mm, 0mm))                // = (11, 2, 3) mm
/// line((0mm, 0mm), (2mm, 0mm)).translate((0mm, 5mm))(0.5)    // = (1, 5) mm
/// ```
fn translate(shape, by) = _moved(shape, |p| p + by, |p| p - by)

/// The shape turned about an axis through the origin, by the right-hand rule; in the plane counterclockwise.
/// ```gml
/// distance((2mm, 0mm, 1mm).rotate(90deg), (0mm, 2mm, 1mm)) < 1e-9mm              // = true
/// distance((2mm, 0mm, 1mm).rotate(90deg, (0, 1, 0)), (1mm, 0mm, -2mm)) < 1e-9mm  // = true
/// distance((2mm, 0mm).rotate(90deg), (0mm, 2mm)) < 1e-9mm                        // = true
/// ```
fn rotate(shape, angle: angle, axis = (0, 0, 1)) {
  let rotation = axis_angle(axis, angle)
  let (c, s) = (cos(angle), sin(angle))
  _moved(
    shape,
    |p| if len(p) == 2 { (p.x * c - p.y * s, p.x * s + p.y * c) } else { rotation(p) },
    axis_angle(axis, -angle),
  )
}

/// The shape turned about an axis through the point `center`; in the plane about the point.
/// ```gml
/// distance((2mm, 0mm).rotate_about((1mm, 0mm), 90deg), (1mm, 1mm)) < 1e-9mm   // = true
/// ```
fn rotate_about(shape, center, angle: angle, axis = (0, 0, 1)) =
  shape.translate(-center).rotate(angle, axis).translate(center)

/// The shape scaled about the origin: by one number, or along x, y and z by a number each. An odd count of negative
/// numbers turns surfaces inside out: use mirror instead.
/// ```gml
/// (1mm, 2mm, 3mm).scale(2)        // = (2, 4, 6) mm
/// (1mm, 2mm, 3mm).scale(z: 0.5)   // = (1, 2, 1.5) mm
/// ```
fn scale(shape, by: real = 1, x: real = by, y: real = by, z: real = by) = each_solid(
  shape,
  |s| _mapped(s, |p| if len(p) == 2 { (p.x * x, p.y * y) } else { (p.x * x, p.y * y, p.z * z) }),
  |inside| _stretched(inside, (x, y, z)),
)

/// The shape stretched along x, y and z by the components of a vector.
/// ```gml
/// (1mm, 2mm, 3mm).stretch((1, 2, 3))   // = (1, 4, 9) mm
/// ```
fn stretch(shape, by: vec3) = each_solid(
  shape,
  |s| _mapped(s, |p| (p.x * by.x, p.y * by.y, p.z * by.z)),
  |inside| _stretched(inside, by),
)

/// Distances from a solid that is stretched: no longer than they are, and exact where it is stretched as much along all
/// axes.
fn _stretched(inside, by: vec3) = |p|
  inside((p.x / by.x, p.y / by.y, p.z / by.z)) * min(abs(by.x), abs(by.y), abs(by.z))

/// The shape mirrored in the plane through the point `through` at right angles to `normal` (in the plane: in that
/// line). A surface's u runs backwards then, so that its outer side stays outside.
/// ```gml
/// (1mm, 2mm, 3mm).mirror()                                   // = (-1, 2, 3) mm
/// (1mm, 2mm, 3mm).mirror((0, 0, 1), (0mm, 0mm, 10mm))        // = (1, 2, 17) mm
/// (1mm, 2mm).mirror((0, 1))                                  // = (1, -2) mm
/// dot(cylinder(2mm, 5mm).mirror().normal(0, 0.5), (-1, 0, 0))   // = 1
/// ```
fn mirror(shape, normal = (1, 0, 0), through = normal * 0mm) = each_solid(
  shape,
  |s|
    if arity(s) == 2 { |u, v| _mirrored(s(1 - u, v), normal, through) }
    else if arity(s) == 1 { |t| _mirrored(s(t), normal, through) }
    else { _mirrored(s, normal, through) },
  |inside| |p| inside(_mirrored(p, normal, through)),
)

/// A point, mirrored.
fn _mirrored(p, normal, through) = through + reflect(p - through, normal)

/// The rotation that leaves everything as it is, as a function of points and vectors.
/// ```gml
/// unturned((1, 2, 3))   // = (1, 2, 3)
/// ```
fn unturned(p) = p

/// The rotation by an angle about the x axis, by the right-hand rule, as a function of points and vectors.
/// ```gml
/// norm(about_x(90deg)((0, 1, 0)) - (0, 0, 1)) < 1e-12   // = true
/// ```
fn about_x(angle: angle) {
  let (c, s) = (cos(angle), sin(angle))
  |p| (p.x, c * p.y - s * p.z, s * p.y + c * p.z)
}

/// The rotation by an angle about the y axis, as a function of points and vectors.
/// ```gml
/// norm(about_y(90deg)((0, 0, 1)) - (1, 0, 0)) < 1e-12   // = true
/// ```
fn about_y(angle: angle) {
  let (c, s) = (cos(angle), sin(angle))
  |p| (c * p.x + s * p.z, p.y, c * p.z - s * p.x)
}

/// The rotation by an angle about the z axis, as a function of points and vectors.
/// ```gml
/// norm(about_z(90deg)((1, 0, 0)) - (0, 1, 0)) < 1e-12   // = true
/// ```
fn about_z(angle: angle) {
  let (c, s) = (cos(angle), sin(angle))
  |p| (c * p.x - s * p.y, s * p.x + c * p.y, p.z)
}

/// The rotation by alpha about x, then beta about y, then gamma about z, as a function of points and vectors:
/// Rz(gamma) Ry(beta) Rx(alpha).
/// ```gml
/// norm(euler(90deg, 0deg, 90deg)((0, 1, 0)) - (0, 0, 1)) < 1e-12   // = true
/// ```
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

/// The rotation about an axis through the origin by the right-hand rule, as a function of points and vectors. The axis
/// may have any length but 0.
/// ```gml
/// norm(axis_angle((0, 0, 2), 90deg)((1, 0, 0)) - (0, 1, 0)) < 1e-12   // = true
/// ```
fn axis_angle(axis, angle: angle) {
  let n = normalize(axis)
  |p| turned(p, n, angle)
}

/// The rotation that carries the x, y and z axes to three vectors, which should be of length 1 and at right angles.
/// ```gml
/// basis((0, 1, 0), (0, 0, 1), (1, 0, 0))((1mm, 2mm, 3mm))   // = (3, 1, 2) mm
/// ```
fn basis(x, y, z) = |p| x * p.x + y * p.y + z * p.z

/// The least rotation that carries the direction `from` to the direction `to`. They must not be opposite. (Moeller and
/// Hughes 1999: Rodrigues' formula with the sine and cosine given by the vectors.)
/// ```gml
/// align((0, 0, 1), (1, 0, 0))((0mm, 0mm, 5mm))   // = (5, 0, 0) mm
/// ```
fn align(from, to) {
  let (a, b) = (normalize(from), normalize(to))
  let axis = cross(a, b)
  let c = dot(a, b)
  |p| p * c + cross(axis, p) + axis * (dot(axis, p) / (1 + c))
}

/// The rotation undone: the inverse of a rotation, as a function of points and vectors.
/// ```gml
/// let r = euler(10deg, 20deg, 30deg)
/// norm(inverse_rotation(r)(r((1, 2, 3))) - (1, 2, 3)) < 1e-12   // = true
/// ```
fn inverse_rotation(rotation) {
  let (x, y, z) = (rotation((1.0, 0.0, 0.0)), rotation((0.0, 1.0, 0.0)), rotation((0.0, 0.0, 1.0)))
  |p| (dot(x, p), dot(y, p), dot(z, p))
}

/// A frame: puts shapes that are made about the origin at `origin`, turned by `rotation` (such as euler(..),
/// about_z(..), or any function of points that is one). It is applied to points, curves, surfaces, and all that hold
/// such.
/// ```gml
/// let pose = place((10mm, 0mm, 0mm), about_z(180deg))
/// norm(pose((2mm, 0mm, 1mm)) - (8mm, 0mm, 1mm)) < 1e-9mm   // = true
/// norm(pose(sphere(2mm))(0.2, 0) - (10mm, 0mm, -2mm)) < 1e-9mm   // = true
/// ```
fn place(origin, rotation = unturned) {
  let back = inverse_rotation(rotation)
  |shape| _moved(shape, |p| origin + rotation(p), |p| back(p - origin))
}

/// The frame at `origin` whose z axis points to `target` and whose y axis lies on the side of `up`, which must not be
/// parallel to the z axis.
/// ```gml
/// look_at((0mm, 0mm, 9mm), (5mm, 0mm, 9mm))((1mm, 2mm, 3mm))   // = (3, 1, 11) mm
/// ```
fn look_at(origin, target, up = (0, 0, 1)) {
  let z = normalize(target - origin)
  let x = normalize(cross(up, z))
  place(origin, basis(x, cross(z, x), z))
}

/// The frame at a curve's point for t: z along the curve, y on the side of `up`, which must not be parallel to the
/// curve there.
/// ```gml
/// let ramp = line((0mm, 0mm, 0mm), (10mm, 0mm, 0mm))
/// frame_at(ramp, 0.5)((0mm, 1mm, 0mm))   // = (5, 0, 1) mm
/// ```
fn frame_at(curve, t, up = (0, 0, 1)) {
  let path = spatial(curve)
  look_at(path(t), path(t) + path'(t), up)
}

/// One frame (or rotation) after another: compose(a, b)(shape) is a(b(shape)).
/// ```gml
/// let f = compose(place((1mm, 0mm, 0mm)), place((0mm, 5mm, 0mm)))
/// f((0mm, 0mm, 2mm))   // = (1, 5, 2) mm
/// ```
fn compose(outer, inner) = |shape| outer(inner(shape))

/// The inverse of a frame that keeps lengths and angles, such as place, look_at and what compose makes of them: it
/// takes shapes back to the origin.
/// ```gml
/// let pose = place((1mm, 2mm, 3mm), euler(10deg, 20deg, 30deg))
/// norm(inverse(pose)(pose((4mm, 5mm, 6mm))) - (4mm, 5mm, 6mm)) < 1e-9mm   // = true
/// ```
fn inverse(frame) {
  let origin = frame((0mm, 0mm, 0mm))
  let x = (frame((1mm, 0mm, 0mm)) - origin) / 1mm
  let y = (frame((0mm, 1mm, 0mm)) - origin) / 1mm
  let z = (frame((0mm, 0mm, 1mm)) - origin) / 1mm
  |shape| _moved(
    shape,
    |p| {
      let q = p - origin
      (dot(x, q), dot(y, q), dot(z, q))
    },
    frame,
  )
}
