use std.surface (revolve)

/// A sphere about the origin.
model sphere {
  /// About the size of the object, in millimetres.
  input reach: real = 10
  param r: length in 0mm..reach * 10mm = reach * 1mm
  part all = revolve(|t| (r * sin(t * 180deg), -r * cos(t * 180deg)))
}
