use std.curve (arc, bezier, line)
use std.frame (translate)
use std.solid (frustum, outside_of)
use std.surface (flip, revolve, tube)

/// An enamelled mug: a slightly conical wall with a rolled rim, a rounded foot and a handle of elliptic section.
/// It stands on the plane of x and y, the handle towards x; where it stands in a scan, gmlc finds out.
model mug {
  /// Outer radius where the wall meets the rounding of the foot.
  param foot: length in 20mm..80mm = 40mm
  /// Outer radius of the wall below the rim.
  param rim: length in 20mm..80mm = 40mm
  /// Height over all.
  param height: length in 40mm..160mm = 80mm
  /// Thickness of wall and floor.
  param wall: length in 0.5mm..5mm = 1.5mm
  /// Radius of the rounding between wall and base.
  param rounding: length in 1mm..15mm = 5mm
  /// How far the base is pushed up in its middle.
  param dome: length in 0mm..10mm = 1.5mm
  /// How far the rolled rim stands out beyond the wall; inside it ends with the wall.
  param roll: length in 1mm..12mm = 5mm
  /// Half the height of the rolled rim.
  param roll_height: length in 0.5mm..8mm = 2mm

  /// The handle leaves the wall at this fraction of the height, and comes back at that one.
  param handle_top: real in 0.5..0.95 = 0.8
  param handle_bottom: real in 0.05..0.5 = 0.2
  /// The control points between: distance from the axis, and fraction of the height.
  param reach_top: length in 45mm..140mm = 70mm; param lift_top: real in 0.4..1.2 = 0.85
  param reach_bottom: length in 45mm..140mm = 70mm; param lift_bottom: real in -0.2..0.6 = 0.15
  /// Half the thickness and half the width of the handle.
  param handle_thickness: length in 1mm..10mm = 4mm
  param handle_width: length in 1mm..15mm = 6mm

  let shoulder = height - roll_height
  fn domed(t) = dome * (1 - t ^ 2)

  part outside = revolve(line((foot, rounding), (rim, shoulder)))
  part inside = revolve(line((rim - wall, shoulder), (foot - wall, wall)))
  part floor = flip(revolve(|t| ((foot - wall) * t, wall + domed(t))))
  part corner = revolve(arc((foot - rounding, rounding), rounding, -90deg, 0deg))
  part base = revolve(|t| ((foot - rounding) * t, domed(t)))

  // From under the bead, around its outer edge and over the top to the inside.
  let roll_width = (roll + wall) / 2
  part bead = revolve(|t| {
    let a = mix(-120deg, 180deg, t)
    (rim - wall + roll_width + roll_width * cos(a), shoulder + roll_height * sin(a))
  })

  /// The middle of the wall at a fraction of the height.
  fn wall_at(t) = (mix(foot, rim, t) - wall / 2, t * height)

  // The handle ends at the wall.
  let body = frustum(bottom: foot, top: rim, height: shoulder - rounding).translate((0mm, 0mm, rounding))

  part handle = tube(bezier([
    wall_at(handle_top),
    (reach_top, lift_top * height),
    (reach_bottom, lift_bottom * height),
    wall_at(handle_bottom),
  ]), radii: (handle_thickness, handle_width)).outside_of(body)
}
