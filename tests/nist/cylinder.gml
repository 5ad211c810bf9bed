use std.surface (revolve)

/// A cylinder about the z axis, longer than the measured one.
model cylinder {
  /// About the size of the object, in millimetres.
  input reach: real = 10
  param r: length in 0mm..reach * 10mm = reach * 1mm
  part side = revolve(|t| (r, (t - 1/2) * reach * 8mm))
}
