use std.curve (arc, line)
use std.frame (translate)
use std.offset (offset)
use std.surface (disc, flip, revolve)

/// A frying pan of sheet steel: a flat bottom, a wall that leans outwards, and a strap for a handle, which ends in a
/// round eye with a hole to hang it by. It stands on the plane of x and y, the handle towards x.
model pan {
  /// Radius at which bottom and wall would meet without the rounding between them.
  param bottom: length in 60mm..150mm = 95mm
  /// Outer radius at the rim.
  param rim: length in 75mm..190mm = 125mm
  /// Height of the wall.
  param height: length in 25mm..100mm = 48mm
  /// Thickness of the sheet.
  param wall: length in 1mm..6mm = 3mm
  /// Radius of the rounding between bottom and wall, outside.
  param rounding: length in 8mm..30mm = 15mm

  /// Where the handle leaves the wall, as a fraction of the height.
  param mount: real in 0.55..0.85 = 0.7
  /// Length of the handle along its middle, from the wall to the middle of the eye.
  param handle: length in 90mm..260mm = 160mm
  /// How steeply the handle rises at the wall, and how far it bends down until the eye.
  param rise: angle in 5deg..45deg = 25deg
  param bend: angle in -10deg..50deg = 15deg
  /// Width of the strap, and its thickness.
  param width: length in 14mm..40mm = 24mm
  param thickness: length in 3mm..10mm = 6mm
  /// Radius of the eye, and of the hole in its middle.
  param eye: length in 12mm..32mm = 18mm
  param hole: length in 3mm..20mm = 8mm

  require bottom + 0.2 * height < rim, "the wall hardly leans outwards"
  require rim < bottom + 1.2 * height, "the wall leans outwards too far for a pan"
  require wall + 2mm < rounding, "the rounding is sharper than the sheet is thick"
  require 1.15 * width < 2 * eye, "the strap is wider than the eye at its end"
  require hole + 3mm < eye, "the hole breaks the eye"

  /// The angle at which the wall rises.
  let slope = atan2(height, rim - bottom)
  let setback = rounding * tan(slope / 2)
  require setback < 0.45 * height, "the rounding takes up the wall"
  require rise + 15deg < slope, "the handle rises as steeply as the wall"

  // Rounding and wall; the inner sides run beside them.
  let along = (cos(slope), sin(slope))
  let corner = arc((bottom - setback, rounding), rounding, -90deg, slope - 90deg)
  let side = line((bottom, 0mm) + setback * along, (rim, height))

  part outside = {corner: revolve(corner), wall: revolve(side)}
  part inside = flip({corner: revolve(offset(corner, -wall)), wall: revolve(offset(side, -wall))})
  part lip = revolve(|t| {
    let out = -perpendicular(along)
    (rim, height) - out * (wall / 2) + (out * cos(t * 180deg) + along * sin(t * 180deg)) * (wall / 2)
  })
  part floor = disc(bottom - setback).translate((0mm, 0mm, wall))
  part base = flip(disc(bottom - setback))

  // The handle is cut out of a flat strap and bent: (s, y) is a place on the strap, s from the wall towards the eye,
  // and n the distance from its middle plane. The strap turns down at a constant rate.
  let start = mix((bottom, 0mm), (rim, height), mount) + perpendicular(along) * (wall / 2)
  /// sin(x) / x, by its series: what is left out is below 3e-9 for the angles of a handle.
  fn sinc(x: real) = 1 - x ^ 2 / 6 + x ^ 4 / 120 - x ^ 6 / 5040
  fn bent(s: length, y: length, n: length) {
    let turn = bend * (s / handle)
    let chord = s * sinc(turn / 2)
    let (middle, direction) = (rise - turn / 2, rise - turn)
    (
      start.x + chord * cos(middle) - n * sin(direction),
      y,
      start.y + chord * sin(middle) + n * cos(direction),
    )
  }
  /// Where the strap begins: in the middle of the sheet.
  fn beginning(y: length, n: length) {
    let lean = cos(slope) / sin(slope)
    let sagitta = start.x - sqrt(start.x ^ 2 - y ^ 2)
    (n * (sin(rise) + lean * cos(rise)) - sagitta) / (cos(rise) - lean * sin(rise))
  }

  // Half the angle at which the strap enters the eye.
  let entry = asin(width / (2 * eye))
  let half = thickness / 2
  /// Between the strap's edges, from the wall to the eye's circle.
  fn strap(u: real, v: real, n: length) {
    let a = mix(-entry, entry, u)
    let y = eye * sin(a)
    bent(mix(beginning(y, n), handle - eye * cos(a), v), y, n)
  }
  /// A point of the eye: at an angle from the handle's direction, and at a distance from its middle.
  fn ring(a: angle, r: length, n: length) = bent(handle + r * cos(a), r * sin(a), n)

  part strap = {
    upper: |u, v| strap(1 - u, v, half),
    lower: |u, v| strap(u, v, -half),
    left: |u, v| strap(1, 1 - u, mix(-half, half, v)),
    right: |u, v| strap(0, u, mix(-half, half, v)),
  }
  part eye = {
    upper: |u, v| ring(u * 1turn, mix(eye, hole, v), half),
    lower: |u, v| ring(u * 1turn, mix(hole, eye, v), -half),
    edge: |u, v| ring(mix(entry - 180deg, 180deg - entry, u), eye, mix(-half, half, v)),
    hole: |u, v| ring(u * 1turn, hole, mix(half, -half, v)),
  }
}
