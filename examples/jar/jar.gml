use std.curve (arc, bezier, line)
use std.offset (offset)
use std.surface (disc, flip, revolve)
use std.frame (translate)

/// A wide jar with a coarse, round screw thread around its neck. It stands on the plane of x and y.
model jar {
  /// Outer radius of the body.
  param body: length in 25mm..80mm = 42mm
  /// Height over all.
  param height: length in 70mm..220mm = 120mm
  /// Radius of the neck between the turns of its thread.
  param neck: length in 18mm..70mm = 34mm
  /// Height of the neck, from the shoulder to the top.
  param neck_height: length in 15mm..50mm = 30mm
  /// Height of the shoulder between body and neck.
  param shoulder: length in 5mm..40mm = 16mm
  /// Radius of the rounding between body and base.
  param rounding: length in 4mm..16mm = 8mm
  /// Thickness of the glass.
  param wall: length in 1.5mm..8mm = 3mm
  /// How far the thread stands out from the neck.
  param thread: length in 0.5mm..5mm = 2mm
  /// How far the thread rises in a turn; it is right-handed.
  param pitch: length in 6mm..20mm = 12mm

  require neck + 2mm < body, "the neck is as wide as the body"
  require rounding + shoulder + neck_height + 10mm < height,
    "rounding, shoulder and neck leave nothing of the body"
  require wall + 1mm < rounding, "the rounding is sharper than the glass is thick"
  require pitch < 0.7 * neck_height, "the neck is too low for a turn and a half of the thread"

  let body_end = height - neck_height - shoulder
  let neck_start = height - neck_height
  // The mouth is a half round.
  let mouth = height - wall / 2

  // The outer side in three pieces, from the base upwards, each of which runs on smoothly from the one before.
  let corner = arc((body - rounding, rounding), rounding, -90deg, 0deg)
  let side = line((body, rounding), (body, body_end))
  let bend = bezier([
    (body, body_end),
    (body, mix(body_end, neck_start, 0.6)),
    (neck, mix(body_end, neck_start, 0.4)),
    (neck, neck_start),
  ])

  /// How far the thread stands out at an angle and a height above the shoulder. It is as round on its crest as between
  /// its turns, and fades in and out at the ends of the neck.
  fn ridge(a: angle, z: length) {
    let end = pitch / 3
    let fade = smoothstep(0mm, end, z) * smoothstep(0mm, end, mouth - neck_start - z)
    thread * fade * (1 + cos(z / pitch * 1turn - a)) / 2
  }

  part outside = {
    corner: revolve(corner),
    side: revolve(side),
    shoulder: revolve(bend),
    neck: |u, v| {
      let (a, z) = (u * 1turn, v * (mouth - neck_start))
      polar(neck + ridge(a, z), a, neck_start + z)
    },
  }
  part inside = flip({
    corner: revolve(offset(corner, -wall)),
    side: revolve(offset(side, -wall)),
    shoulder: revolve(offset(bend, -wall)),
    neck: revolve(line((neck - wall, neck_start), (neck - wall, mouth))),
  })
  part lip = revolve(arc((neck - wall / 2, mouth), wall / 2, 0deg, 180deg))
  part floor = disc(body - rounding).translate((0mm, 0mm, wall))
  part base = flip(disc(body - rounding))
}
