use std.curve (arc, bezier, line)
use std.frame (translate)
use std.repeat (polar_pattern)
use std.surface (flip, plane, revolve)
use std.sweep (ruled)
use std.vector (lift)

/// A fluted column: plinth and moulded base, a shaft with entasis, and a capital of echinus and abacus.
/// It stands on the plane of x and y; the sides of plinth and abacus look along x and y.
model column {
  /// How many flutes go around the shaft: 20 are Doric, 24 Ionic.
  input flutes: int in 8..32 = 20
  /// Radius of the shaft at its foot, to the ridges between the flutes.
  param lower_radius: length in 100mm..800mm = 300mm
  /// Radius of the shaft at its top.
  param upper_radius: length in 80mm..lower_radius = 250mm
  /// Length of the shaft.
  param shaft_height: length in 500mm..8m = 2400mm
  /// How far the shaft's middle swells beyond the straight line from foot to top.
  param entasis: length in 0mm..60mm = 12mm
  /// Depth of the flutes.
  param flute: length in 0mm..40mm = 18mm
  /// Height of base and plinth.
  param base_height: length in 100mm..800mm = 300mm
  /// How far the base stands out from the shaft.
  param base_spread: length in 60mm..400mm = 120mm
  /// Height of the capital.
  param capital_height: length in 100mm..800mm = 260mm
  /// How far the abacus stands out from the shaft, at the middle of its sides.
  param capital_spread: length in 40mm..400mm = 110mm

  require flute < 0.2 * upper_radius, "the flutes eat up the shaft"
  require 0.25 * base_height < base_spread,
    "the base is too slender for its mouldings: make it lower or wider"

  /// From 0 to 1 between two values, without a corner; then back to 0.
  fn window(t: real) = smoothstep(0, 0.05, t) * smoothstep(0, 0.05, 1 - t)
  /// How deep a flute is at an angle, as a fraction: 0 on the ridge, 1 in the middle. The ridge is rounded.
  fn hollow(a: angle) {
    let s = sin(flutes * a / 2)
    (sqrt(s ^ 2 + 0.02) - sqrt(0.02)) / (sqrt(1.02) - sqrt(0.02))
  }

  part shaft = |u, v| {
    let a = u * 1turn
    let smooth = mix(lower_radius, upper_radius, v) + entasis * 4 * v * (1 - v)
    polar(smooth - flute * hollow(a) * window(v), a, base_height + shaft_height * v)
  }

  // The base, from the plinth upwards: torus, scotia, torus, and a flare into the shaft. Its heights are fractions of
  // the whole base, as the canon has them.
  let b = base_height
  let (half_width, lower, upper) = (lower_radius + base_spread, 0.135 * b, 0.085 * b)
  let below = (half_width - lower, 0.3 * b + lower)
  let above = (lower_radius + base_spread / 2 - upper, 0.73 * b + upper)
  part base = {
    torus: revolve(arc(below, lower, -90deg, 90deg)),
    scotia: revolve(bezier([
      (below.x, below.y + lower),
      (lower_radius + 0.2 * base_spread, below.y + lower),
      (lower_radius + 0.2 * base_spread, above.y - upper),
      (above.x, above.y - upper),
    ])),
    bead: revolve(arc(above, upper, -90deg, 90deg)),
    flare: revolve(bezier([(above.x, 0.9 * b), (lower_radius, 0.9 * b), (lower_radius, b)])),
  }

  // The capital: a neck, the echinus that swells below the abacus.
  let c = capital_height
  let top = base_height + shaft_height
  let echinus = upper_radius + 0.9 * capital_spread
  part capital = {
    neck: revolve(bezier([
      (upper_radius, top),
      (upper_radius, top + 0.2 * c),
      (upper_radius + 0.25 * capital_spread, top + 0.2 * c),
    ])),
    echinus: revolve(bezier([
      (upper_radius + 0.25 * capital_spread, top + 0.2 * c),
      (mix(upper_radius, echinus, 0.7), top + 0.3 * c),
      (echinus, top + 0.4 * c),
      (echinus, top + 0.6 * c),
    ])),
  }

  /// Four upright walls around a square.
  fn walls(half: length, height: length) {
    let wall = |u: real, v: real| (half, mix(-half, half, u), height * v)
    wall.polar_pattern(4)
  }
  /// A square from which a disc is left out, in four pieces: what shows of a block under something round. It looks
  /// upwards.
  fn ledge(half: length, radius: length) {
    let edge = line((half, -half, 0mm), (half, half, 0mm))
    let quarter = arc((0mm, 0mm), radius, -45deg, 45deg)
    ruled(edge, |t| lift(quarter(t))).polar_pattern(4)
  }

  part plinth = {
    side: walls(half_width, 0.3 * b),
    top: ledge(half_width, below.x).translate((0mm, 0mm, 0.3 * b)),
    bottom: flip(plane(2 * half_width, 2 * half_width)),
  }
  let abacus_half = upper_radius + capital_spread
  part abacus = {
    side: walls(abacus_half, 0.4 * c).translate((0mm, 0mm, top + 0.6 * c)),
    top: plane(2 * abacus_half, 2 * abacus_half).translate((0mm, 0mm, top + c)),
    bottom: flip(ledge(abacus_half, echinus)).translate((0mm, 0mm, top + 0.6 * c)),
  }
}
