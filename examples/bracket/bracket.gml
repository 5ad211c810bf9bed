use std.edge (cove)
use std.frame (rotate, translate)
use std.solid (box, capped_cylinder, half_space)

/// An angle bracket: a leg with two holes lies on the plane of x and y, one with a single hole stands at its edge, and
/// a web is between the two. The corner outside lies along the x axis.
model bracket {
  /// Length of the corner.
  param width: length in 40mm..120mm = 64mm
  /// Depth of the leg that lies, and height of the leg that stands, both from the outer corner.
  param depth: length in 30mm..120mm = 50mm
  param height: length in 30mm..120mm = 56mm
  /// Thickness of both legs, and of the web.
  param thickness: length in 3mm..12mm = 6mm
  param web: length in 3mm..12mm = 5mm
  /// Radius of the fillet between the legs.
  param fillet: length in 1mm..12mm = 4mm
  /// How far the web reaches along the legs.
  param reach: length in 10mm..80mm = 22mm
  /// Diameter of the holes.
  param bolt: length in 4mm..14mm = 9mm
  /// From the middle of one hole to that of the other.
  param spacing: length in 20mm..80mm = 40mm

  require web + bolt + 2mm < spacing, "the holes run into the web"
  require spacing + bolt + 4mm < width, "the holes break the ends of the leg"
  require fillet < reach - 2mm, "the fillet reaches beyond the web"
  require thickness + fillet + bolt / 2 + 1mm < 0.7 * depth, "the lower holes run into the fillet"
  require thickness + reach + bolt / 2 < 0.75 * height, "the upper hole runs into the web"

  measure hole_spacing of body.hole[0].wall, body.hole[1].wall = spacing

  let lying = box(width: width, depth: depth, height: thickness).translate((0mm, depth / 2, 0mm))
  let standing = box(width: width, depth: thickness, height: height).translate((0mm, thickness / 2, 0mm))
  // What is between the two legs, cut at a slant.
  let gusset =
    box(width: web, depth: reach, height: reach).translate((0mm, thickness + reach / 2, thickness))
    & {slant: half_space(at: (0mm, thickness + reach, thickness), normal: (0, 1, 1), size: 100mm)}
  let corner = cove(fillet, width).rotate(-90deg, (0, 1, 0)).translate((width / 2, thickness, thickness))
  let drill = capped_cylinder(radius: bolt / 2, height: thickness)

  part body =
    lying
    + {leg: standing}
    + {fillet: corner}
    + {web: gusset}
    - {
      hole: for i in 0..2 { drill.translate(((i - 0.5) * spacing, 0.7 * depth, 0mm)) },
      upper: drill.rotate(-90deg, (1, 0, 0)).translate((0mm, 0mm, 0.75 * height)),
    }
}
