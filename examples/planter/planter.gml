use std.surface (annulus, cylinder, flip)
use std.frame (translate)

/// A planter whose rim rises and falls as a cosine. Its footprint is a circle; the walls lean outwards.
/// It stands on the plane of x and y; a wave's crest lies towards x.
model planter {
  /// How many waves go around the rim.
  input waves: int in 2..12 = 5
  /// Outer radius at the foot.
  param foot: length in 30mm..150mm = 55mm
  /// Outer radius at the mean height of the rim.
  param rim: length in 40mm..200mm = 80mm
  /// Mean height of the rim.
  param height: length in 50mm..300mm = 110mm
  /// How far the rim rises above its mean height, and falls below it.
  param wave: length in 0mm..40mm = 12mm
  /// How far the wall's middle stands out beyond the straight line from foot to rim.
  param belly: length in -15mm..25mm = 6mm
  /// Thickness of wall and floor.
  param wall: length in 2mm..12mm = 5mm
  /// Radius of the hole in the floor.
  param drain: length in 3mm..20mm = 8mm

  require wave < 0.35 * height,
    "the waves of the rim reach down to the foot: make them lower, or the planter higher"
  require drain + 2 * wall < foot, "the hole in the floor reaches the wall"
  require foot - 20mm < rim, "a planter is not narrower at the rim than at its foot"

  /// Height of the rim at an angle.
  fn rim_height(a: angle) = height + wave * cos(waves * a)
  /// Radius of the outer side at a height.
  fn radius_at(z: length) {
    let t = z / height
    mix(foot, rim, t) + 4 * belly * t * (1 - t)
  }
  /// A point at an angle, a height and a distance inwards from the outer side.
  fn point(a: angle, z: length, inwards: length) = polar(radius_at(z) - inwards, a, z)

  part outside = |u, v| {
    let a = u * 1turn
    point(a, v * rim_height(a), 0mm)
  }
  part inside = flip(|u, v| {
    let a = u * 1turn
    point(a, mix(wall, rim_height(a), v), wall)
  })
  // The lip is a half round between the two, at right angles to the wall's course in plan.
  part lip = |u, v| {
    let a = u * 1turn
    let across = v * 180deg
    let middle = point(a, rim_height(a), wall / 2)
    let out = polar(wall / 2, a)
    middle + out * cos(across) + (0mm, 0mm, wall / 2 * sin(across))
  }
  part floor = annulus(drain, radius_at(wall) - wall).translate((0mm, 0mm, wall))
  part base = flip(annulus(drain, foot))
  part hole = flip(cylinder(drain, wall))
}
