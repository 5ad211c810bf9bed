use std.frame (translate)
use std.outline (embossed)
use std.solid (box)

/// Digits that are 12 high, on the line y = 0: in a path y points down. The bar of the 7 overlaps it.
let digits = svg_path(
  "M 6 0 V -2.4 H 0 V -4.4 L 5.4 -12 H 8.2 V -4.4 H 10 V -2.4 H 8.2 V 0 Z M 6 -4.4 V -8.9 L 2.8 -4.4 Z"
    + "M 12 -12 H 20 V -9.8 L 15.6 0 H 13 L 17.4 -9.8 H 12 Z M 13.4 -6.4 H 19.2 V -4.6 H 13.4 Z",
)

/// A heart, 20 wide.
let heart =
  svg_path("M 0 8 C -14 -1 -10 -9 -5 -9 A 5 5 0 0 1 0 -5 A 5 5 0 0 1 5 -9 C 10 -9 14 -1 0 8 Z", 0.1mm)

/// The sign of a house: its number embossed, and a heart engraved.
model sign {
  param width: length in 100mm..300mm = 160mm
  param height: length in 60mm..200mm = 90mm
  param thickness: length in 3mm..15mm = 6mm
  /// Height of the digits, by how much they stand out, and where they begin.
  param size: length in 20mm..60mm = 45mm
  param relief: length in 1mm..10mm = 4mm
  param left: length in -90mm..-20mm = -66mm
  /// Width of the heart, its depth, and its place beside the middle.
  param heart_width: length in 15mm..60mm = 40mm
  param engraved: length in 0.5mm..thickness - 1mm = 2.5mm
  param right: length in 20mm..90mm = 48mm

  measure material = volume(sign)

  let number = embossed(digits, height: relief, scale: size / 12mm)
  let cut = embossed(heart, height: engraved, scale: heart_width / 20mm)
  part sign =
    box(width: width, depth: height, height: thickness)
    + {number: number.translate((left, -size / 2, thickness))}
    - {heart: cut.translate((right, 0mm, thickness - engraved))}
}
