use std.curve (bezier)
use std.surface (tube, flip)
use std.frame (place, euler)

/// The 'real' cup: cup.gml's with an octagonal footprint, for the virtual scanner.
model octagonal_cup {
  /// How many sides the footprint has.
  input sides: int in 3..16 = 8
  /// Base point.
  param x: length = 0mm; param y: length = 0mm; param z: length = 0mm
  /// Orientation: rotation by alpha about x, then beta about y, then gamma about z.
  param alpha: angle = 0deg; param beta: angle = 0deg; param gamma: angle = 0deg
  /// Exponent offset of both profiles: 0 is a chalice, 4 and more a mug.
  param shape: real in -1..12 = 4
  /// Mean radius at the rim.
  param r: length in 15mm..80mm = 40mm
  /// Height.
  param h: length in 30mm..200mm = 90mm
  /// How far the footprint's corners stand out at the rim, and its sides back.
  param wave: length in 0mm..5mm = 0.75mm
  /// Handle: control points in the half plane (radius / r, height / h).
  param h1: real in 0.3..1 = 0.98
  param h2a: real in 1..3 = 1.9; param h2b: real in 0..1.5 = 0.95
  param h3a: real in 1..3 = 1.8; param h3b: real in -0.5..1 = 0.2
  param h4: real in 0.3..1 = 0.85

  fn outer(t: real) -> real = t ^ (3 + shape)
  fn inner(t: real) -> real = 1/25 + (t + 1/10) ^ (2 + shape)
  let rim = (24/25) ^ (1 / (2 + shape)) - 1/10

  /// A profile turned about z, with corners that stand out the more the wider it is.
  fn polygon(profile) = |u, v| {
    let p = profile(v)
    let a = u * 1turn
    let radius = p.x * (1 + wave / r * cos(sides * a))
    (radius * cos(a), radius * sin(a), p.y)
  }

  let pose = place((x, y, z), euler(alpha, beta, gamma))
  part outside = pose(polygon(|t| (r * t, h * outer(t))))
  part inside = pose(flip(polygon(|t| (r * rim * t, h * inner(rim * t)))))
  part lip = pose(polygon(|t| (r * mix(1, rim, t), h)))
  part handle = pose(tube(bezier([
    (r * h1, 0mm, h * outer(h1)),
    (r * h2a, 0mm, h * h2b),
    (r * h3a, 0mm, h * h3b),
    (r * h4, 0mm, h * outer(h4)),
  ]), radius: 5mm))
}
