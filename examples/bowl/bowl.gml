use std.curve (arc, bezier)
use std.offset (offset)
use std.surface (disc, flip, revolve)
use std.frame (translate)

/// A bowl of sheet metal or clay: a flat foot, a wall that turns up in one sweep, and a rim that is turned outwards and
/// rolled. It stands on the plane of x and y.
model bowl {
  /// Radius of the flat on which it stands.
  param foot: length in 15mm..80mm = 35mm
  /// Outer radius of the wall below the rim.
  param rim: length in 40mm..160mm = 70mm
  /// Height over all.
  param height: length in 20mm..120mm = 60mm
  /// Thickness of the wall. The floor lies where the wall's inner side ends.
  param wall: length in 0.5mm..8mm = 3mm
  /// The angle at which the wall leaves the ground.
  param slope: angle in 5deg..65deg = 25deg
  /// How closely the wall follows its tangents at foot and rim to where they meet: little is a slack wall, much a sharp
  /// turn.
  param fullness: real in 0.3..0.95 = 0.65
  /// Radius at which the rim is turned outwards, on the outer side.
  param curl: length in 0.5mm..15mm = 4mm
  /// Radius of the bead in which the rim ends.
  param bead: length in 0.5mm..curl = 3mm

  require foot + 5mm < rim, "the foot is wider than the rim: a bowl opens upwards"
  require wall < 1.8 * bead, "the bead is thinner than the wall that ends in it"

  // Where the wall ends and the rim begins to turn outwards.
  let top = height - wall - curl
  // Where the wall's tangents at foot and rim meet.
  let corner = (rim, (rim - foot) * tan(slope))
  require corner.y < 0.9 * top, "so steep a wall rises above the rim: make its slope less, or the bowl higher"

  /// The outer side of the wall, from the foot upwards: (radius, height). It arrives upright at the rim.
  let (from, to) = ((foot, 0mm), (rim, top))
  let outer = bezier([from, mix(from, corner, fullness), mix(to, corner, fullness), to])

  part outside = revolve(outer)
  part inside = flip(revolve(offset(outer, -wall)))
  part floor = disc(foot - wall * sin(slope)).translate((0mm, 0mm, wall * cos(slope)))
  part base = flip(disc(foot))

  // The rim is turned outwards by a quarter of a turn and ends in a bead as high as the rim. Below, the two circles
  // meet at this height above the turn's centre.
  let middle = (rim + curl, top)
  let lift = wall + curl - bead
  let meet = (curl ^ 2 - bead ^ 2 + lift ^ 2) / (2 * lift)
  part turn_below = revolve(arc(middle, curl, 180deg, 180deg - asin(meet / curl)))
  part turn_above = flip(revolve(arc(middle, curl + wall, 180deg, 90deg)))
  part roll = revolve(arc(middle + (0mm, lift), bead, -180deg - asin((meet - lift) / bead), 90deg))
}
