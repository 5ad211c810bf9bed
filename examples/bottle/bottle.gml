use std.frame (translate)
use std.solid (revolved)
use std.thread (threaded_rod)

/// A jar-like bottle with a screw thread on its neck. It stands on the plane of x and y, about the z axis.
model bottle {
  /// Outer radius of the body.
  param radius: length in 20mm..80mm = 36mm
  /// Height at which the shoulder begins, and how much higher the neck does.
  param height: length in 30mm..200mm = 84mm
  param shoulder: length in 5mm..60mm = 18mm
  /// Over the crests of the thread.
  param thread: length in 20mm..70mm = 40mm
  param pitch: length in 2mm..6mm = 4mm
  /// Length of the neck.
  param neck: length in 12mm..40mm = 20mm
  /// Thickness of walls and bottom.
  param wall: length in 1mm..6mm = 2.5mm

  /// Radius of the neck between the ridges of the thread.
  let root = thread / 2 - pitch * (5/16 * sqrt(3))
  require root < radius, "the neck is wider than the body"
  require wall < root - 5mm, "the wall leaves no mouth"

  let (foot, rim) = (height + shoulder, height + shoulder + neck)
  // The outside up to the neck, and the hollow up to the rim: points (distance from the axis, height).
  let outside = [(0mm, 0mm), (radius, 0mm), (radius, height), (root, foot), (0mm, foot)]
  let hollow = [
    (0mm, wall),
    (radius - wall, wall),
    (radius - wall, height),
    (root - wall, foot),
    (root - wall, rim),
    (0mm, rim),
  ]

  /// What it is made of.
  measure material = volume(bottle)
  /// The height of the centre of gravity of the empty bottle.
  measure balance = centroid(bottle).z

  part bottle =
    revolved(outside)
    + {neck: threaded_rod(thread, pitch, neck).translate((0mm, 0mm, foot))}
    - {hollow: revolved(hollow)}
}
