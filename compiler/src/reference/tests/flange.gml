// A flange, and what else
// a page can have.

/// A flange with a circle of bolt holes.
model flange {
  /// Number of holes.
  input bolts: int in 3..16 = 6
  input drilled: bool = true

  /// Outer radius,
  /// or |r|.
  param r_out: length in 40mm..150mm = 80mm
  param r_circle: length in 10mm..r_out = 60mm; param d_bolt: length in 4mm..20mm = 9mm
  param turned: angle = 0deg

  require r_circle + d_bolt / 2 < r_out, "the bolt holes break the rim"
  require r_circle > d_bolt

  /// The outside.
  part rim tolerance 0.1mm = cylinder(r_out, 12mm)
  if drilled {
    for i in 0..bolts {
      require i < 20, "too many"
      part hole = bolt_hole(i)
    }
  } else {
    part plug = disc(r_circle)
  }

  /// Across the outside.
  measure d_out of rim tolerance +0.2/-0.1mm = 2 * r_out
  measure pitch = 2 * r_circle * sin(180deg / bolts)

  let step = 1turn / bolts
  /// The distance of the circle from the rim.
  let margin = r_out - r_circle

  /// The wall of the hole of a number.
  fn bolt_hole(i: int) -> surface =
    cylinder(d_bolt / 2, 12mm).translate(polar(r_circle, i * step + turned))
}

/// Twice as much.
/// ```gml
/// for i in 0..2 {
///   twice(i)
/// }
/// ```
fn twice(
  x,
) {
  2 * x
}
