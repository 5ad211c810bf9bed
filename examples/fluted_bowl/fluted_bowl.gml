use std.surface (flip)

/// A bowl or a ramekin whose wall is fluted: concave flutes that meet in sharp ridges, from the foot to the rim. It
/// stands on the plane of x and y; a ridge lies towards x.
model fluted_bowl {
  /// How many flutes go around.
  input flutes: int in 6..48 = 16
  /// Radius of the ridges at the foot.
  param foot: length in 15mm..100mm = 45mm
  /// Radius of the ridges at the rim.
  param rim: length in 30mm..200mm = 75mm
  /// Height over all.
  param height: length in 25mm..350mm = 80mm
  /// How far the wall's middle stands out beyond the straight line from foot to rim.
  param belly: length in -20mm..40mm = 8mm
  /// Thickness of the wall at the ridges, and of the floor.
  param wall: length in 2mm..24mm = 6mm
  /// Depth of the flutes outside, at the foot and at the rim.
  param groove_foot: length in 0mm..12mm = 3mm
  param groove_rim: length in 0mm..12mm = 3mm
  /// Depth of the flutes inside, where they stand out into the bowl; 0 is a smooth inside.
  param groove_inside: length in 0mm..12mm = 2mm

  require foot < rim + 10mm, "the bowl is narrower at the rim than at its foot"
  require groove_foot < wall + groove_inside and groove_rim < wall + groove_inside,
    "the flutes cut through the wall"
  require wall + groove_inside < 0.5 * foot, "the wall leaves no floor"
  require 3 * wall < height, "a plate has no flutes"

  // The rim is half an ellipse over the wall, half as high as the wall is thick.
  let top = height - wall / 2

  /// How far a flute is hollowed at an angle: 0 on a ridge, 1 in the middle between two.
  fn hollow(a: angle) = abs(sin(flutes * a / 2))
  /// Radius of the ridges at a height.
  fn ridge(z: length) {
    let t = z / top
    mix(foot, rim, t) + 4 * belly * t * (1 - t)
  }
  fn outer(a: angle, z: length) = polar(ridge(z) - mix(groove_foot, groove_rim, z / top) * hollow(a), a, z)
  fn inner(a: angle, z: length) = polar(ridge(z) - wall - groove_inside * hollow(a), a, z)

  part outside = |u, v| outer(u * 1turn, v * top)
  part inside = flip(|u, v| inner(u * 1turn, mix(wall, top, v)))
  part lip = |u, v| {
    let (p, q, across) = (outer(u * 1turn, top), inner(u * 1turn, top), v * 180deg)
    (p + q) / 2 + (p - q) / 2 * cos(across) + (0mm, 0mm, wall / 2 * sin(across))
  }
  part floor = |u, v| mix(inner(u * 1turn, wall), (0mm, 0mm, wall), v)
  part base = flip(|u, v| mix(outer(u * 1turn, 0mm), (0mm, 0mm, 0mm), v))
}
