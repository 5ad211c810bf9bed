use std.curve (bezier)
use std.surface (disc, flip, revolve)
use std.frame (translate)

/// A bowl of sheet metal or clay: a flat foot, a wall that turns up from it in one sweep, and a rolled rim.
/// It stands on the plane of x and y.
model bowl {
  /// Radius of the flat on which it stands.
  param foot: length in 15mm..80mm = 35mm
  /// Outer radius of the wall below the rim.
  param rim: length in 40mm..160mm = 70mm
  /// Height over all.
  param height: length in 20mm..120mm = 60mm
  /// Thickness of wall and floor.
  param wall: length in 0.5mm..8mm = 3mm
  /// How far the wall goes on outwards from the foot before it turns up: a fraction of the way out to the rim.
  param spread: real in 0.1..0.9 = 0.5
  /// How far down from the rim the wall is steep: a fraction of the height.
  param steepness: real in 0.1..0.9 = 0.5
  /// How far the rolled rim stands out beyond the wall; inside it ends with the wall.
  param roll: length in 0.5mm..12mm = 4mm
  /// Half the height of the rolled rim.
  param roll_height: length in 0.5mm..8mm = 3mm

  require foot + 5mm < rim, "the foot is wider than the rim: a bowl opens upwards"
  require 2 * wall < roll_height + roll, "the rolled rim is thinner than the wall that it ends"

  // The wall ends in the middle of the rolled rim.
  let top = height - roll_height

  /// The outer side of the wall, from the foot upwards: (radius, height). It leaves the foot flat and arrives upright.
  let outer = bezier([
    (foot, 0mm),
    (mix(foot, rim, spread), 0mm),
    (rim, top * (1 - steepness)),
    (rim, top),
  ])

  /// The curve at a distance on its left side, which is the inside of an outer profile that runs upwards.
  fn beside(c: real -> point2, distance: length) = |t| {
    let along = normalize(c'(t))
    c(t) + (-along.y, along.x) * distance
  }

  part outside = revolve(outer)
  part inside  = flip(revolve(beside(outer, wall)))
  part floor   = disc(foot).translate((0mm, 0mm, wall))
  part base    = flip(disc(foot))

  // From under the rim, around its outer edge and over the top to the inside.
  let half = (roll + wall) / 2
  part bead = revolve(|t| {
    let a = mix(-150deg, 180deg, t)
    (rim - wall + half + half * cos(a), top + roll_height * sin(a))
  })
}
