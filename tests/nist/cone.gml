use std.surface (revolve)

/// A cone about the z axis that widens upwards: its radius at height z is r + z tan(half).
model cone {
  /// About the size of the object, in millimetres.
  input reach: real = 10
  param r: length in 0mm..reach * 10mm = reach * 1mm
  param half: angle in 0.1deg..80deg = 30deg
  fn radius(z: length) -> length = r + z * tan(half)
  fn height(t: real) -> length = (t - 1/2) * reach * 8mm
  part side = revolve(|t| (radius(height(t)), height(t)))
}
