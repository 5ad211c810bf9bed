use std.surface (annulus, cylinder, flip)
use std.frame (translate, rotate)

/// A flat flange with a raised sealing face and a circle of bolt holes. It lies on the plane of x and y; the first bolt
/// hole is towards x.
model flange {
  /// How many bolt holes there are.
  input bolts: int in 3..24 = 6
  /// Outer radius.
  param rim: length in 40mm..150mm = 80mm
  /// Radius of the bore.
  param bore: length in 10mm..rim = 28mm
  /// Radius of the circle on which the bolts are.
  param bolt_circle: length in bore..rim = 62mm
  /// Diameter of a bolt hole.
  param bolt: length in 4mm..30mm = 14mm
  /// Thickness at the bolts.
  param thickness: length in 4mm..40mm = 16mm
  /// Outer radius of the sealing face.
  param face: length in bore..bolt_circle = 44mm
  /// How far the sealing face is raised.
  param raised: length in 0.5mm..8mm = 3mm

  require bolt_circle + bolt / 2 + 2mm < rim, "the bolt holes break the rim"
  require bore + 4mm < face, "the bore leaves nothing of the sealing face"
  require face + bolt / 2 + 1mm < bolt_circle, "the bolt holes reach into the sealing face"
  require 1.2 * bolt < 2 * bolt_circle * sin(180deg / bolts), "the bolt holes run into each other"

  let (within, beyond) = (bolt_circle - bolt / 2, bolt_circle + bolt / 2)
  /// The angle from one bolt hole to the next.
  let pitch = 1turn / bolts

  measure bore_diameter of bore_wall = 2 * bore
  /// From the axis of one bolt hole to the next.
  measure spacing of hole[0], hole[1] = 2 * bolt_circle * sin(pitch / 2)
  /// Least material between two bolt holes.
  measure web = spacing - bolt

  /// The plane between two bolt holes: u runs from the edge of the one to that of the next at the same distance from
  /// the axis, v outwards.
  fn land(u: real, v: real) {
    let a = mix(-90deg, 90deg, v)
    let (along, out) = (bolt / 2 * cos(a), bolt_circle + bolt / 2 * sin(a))
    let radius = hypot(along, out)
    let edge = atan2(along, out)
    polar(radius, mix(edge, pitch - edge, u))
  }

  part side = cylinder(rim, thickness)
  part bore_wall = flip(cylinder(bore, thickness + raised))
  part seal = annulus(bore, face).translate((0mm, 0mm, thickness + raised))
  part step = cylinder(face, raised).translate((0mm, 0mm, thickness))
  part top = {
    inner: annulus(face, within).translate((0mm, 0mm, thickness)),
    outer: annulus(beyond, rim).translate((0mm, 0mm, thickness)),
  }
  part bottom = {inner: flip(annulus(bore, within)), outer: flip(annulus(beyond, rim))}
  for i in 0..bolts {
    // Beside the hole, the upper and the lower side up to the next one.
    part upper = flip(land).translate((0mm, 0mm, thickness)).rotate(i * pitch)
    part lower = rotate(land, i * pitch)
    part hole = flip(cylinder(bolt / 2, thickness)).translate(polar(bolt_circle, i * pitch))
  }
}
