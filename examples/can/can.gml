use std.curve (arc, bezier, line)
use std.surface (flip, revolve)

/// A drinks can: body, shoulder, neck, seam and lid above; a tapered foot and a dome pressed in below.
/// It stands on the plane of x and y.
model can {
  /// Radius of the body.
  param body_radius: length in 20mm..60mm = 33mm
  /// Height over all.
  param height: length in 60mm..250mm = 115mm
  /// Radius of the neck, under the seam.
  param neck_radius: length in 15mm..body_radius = 26mm
  /// How far below the top the body ends and the shoulder begins.
  param shoulder: length in 4mm..40mm = 16mm
  /// Radius of the circle on which it stands.
  param stand_radius: length in 12mm..body_radius = 24mm
  /// How high above the stand the body begins.
  param foot: length in 2mm..25mm = 9mm
  /// How deep the dome in the base is.
  param dome: length in 1mm..20mm = 10mm
  /// How far the seam stands out from the neck.
  param seam: length in 0.3mm..4mm = 1.5mm
  /// Height of the seam.
  param seam_height: length in 1.5mm..6mm = 3mm
  /// How deep the lid lies below the top of the seam.
  param lid_depth: length in 1mm..12mm = 5mm

  require seam_height + 1mm < shoulder,
    "the seam takes all of the shoulder's height: nothing is left for the neck"
  require foot + shoulder + 5mm < height, "foot and shoulder leave nothing of the body"
  require dome + lid_depth + 2mm < height, "the dome meets the lid"
  require dome < 0.9 * (stand_radius - 2mm), "the dome is more than half a sphere"

  /// Half the width of the ring on which it stands.
  let ring = 1.5mm

  // From the foot upwards, every curve begins where the one before ends.
  let body_end = height - shoulder
  let neck_end = height - seam_height
  part taper = revolve(bezier([
    (stand_radius + ring, ring),
    (mix(stand_radius + ring, body_radius, 0.6), ring + 0.25 * (foot - ring)),
    (body_radius, mix(ring, foot, 0.4)),
    (body_radius, foot),
  ]))
  part body = revolve(line((body_radius, foot), (body_radius, body_end)))
  part neck = revolve(bezier([
    (body_radius, body_end),
    (body_radius, mix(body_end, neck_end, 0.6)),
    (neck_radius, mix(body_end, neck_end, 0.4)),
    (neck_radius, neck_end),
  ]))

  // The seam: out, up, over and down to the lid.
  let top = height - seam
  part seam_under = flip(revolve(line((neck_radius + seam, neck_end), (neck_radius, neck_end))))
  part seam_side = revolve(line((neck_radius + seam, neck_end), (neck_radius + seam, top)))
  part seam_top = revolve(arc((neck_radius, top), seam, 0deg, 180deg))
  part lid_wall = revolve(line((neck_radius - seam, top), (neck_radius - seam, height - lid_depth)))
  part lid = revolve(line((neck_radius - seam, height - lid_depth), (0mm, height - lid_depth)))

  // The ring on which it stands, and the dome: a cap of a sphere.
  let cap = stand_radius - ring
  let sphere = (cap ^ 2 + dome ^ 2) / (2 * dome)
  let half = asin(cap / sphere)
  part stand = revolve(arc((stand_radius, ring), ring, -180deg, 0deg))
  part base = revolve(arc((0mm, ring + dome - sphere), sphere, 90deg, 90deg - half))
}
