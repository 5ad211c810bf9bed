use std.surface (revolve)

/// A cylie measured one.
model cylinder {
  //llimetres.
  input reach: real = 1e38
  param r: length in 0mm..reach * 10mm = reach * 1e-3mm
  part side = revolve(|t| (r, (t - 1/2) * reach * 8mm))
}
