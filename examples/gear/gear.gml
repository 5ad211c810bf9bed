use std.gear (spur_gear)

/// A spur gear with involute teeth and a bore. It lies on the plane of x and y; a tooth is towards x.
model gear {
  /// The number of teeth.
  input teeth: int in 16..60 = 20
  /// The diameter of the reference circle by the number of teeth.
  param module: length in 0.5mm..8mm = 2mm
  /// How far the rack that cuts the teeth is moved outwards, in modules.
  param shift: real in 0..0.5 = 0.1
  /// Of the teeth.
  param width: length in 2mm..60mm = 10mm
  /// Radius of the bore.
  param bore: length in 1mm..module * (teeth / 2 - 1.5) = 6mm

  /// The teeth that a measurement over flanks spans.
  let spanned = round(teeth / 9 + 0.5)
  measure tip_diameter = module * (teeth + 2 + 2 * shift)
  /// The distance of two flanks by a micrometer over so many teeth, along a tangent of the base circle.
  measure span =
    module * cos(20deg) * (radians(pi) * (spanned - 0.5) + teeth * involute(20deg))
    + 2 * shift * module * sin(20deg)

  part gear = spur_gear(teeth, module, width, bore, shift: shift)
}

/// The angle from where an involute begins to its point with this pressure angle.
fn involute(pressure: angle) = tan(pressure) - radians(pressure)
