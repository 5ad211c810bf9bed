use std.surface (annulus, cylinder, flip)
use std.frame (transform, translate)

/// A ring of rectangular section that stands on the plane of x and y, without the wall of its bore: its face is below.
model collar {
  param bore: length = 20mm
  param neck: length = 25mm
  param radius: length = 40mm
  param thickness: length = 10mm
  part face = flip(annulus(bore, radius))
  part side = cylinder(radius, thickness)
  part back = annulus(neck, radius).translate((0mm, 0mm, thickness))
}

/// A pipe elbow: a bend between two straight legs, each with a welded collar at its end. The longer leg rises from the
/// plane of x and y along the z axis; the bend goes towards x.
model elbow {
  /// Outer radius of the pipe.
  param radius: length in 10mm..60mm = 25mm
  /// Thickness of the pipe's wall.
  param wall: length in 1mm..10mm = 4mm
  /// Radius of the bend, to the middle of the pipe.
  param bend_radius: length in 30mm..200mm = 70mm
  /// Angle of the bend.
  param bend: angle in 20deg..120deg = 90deg
  /// Length of the longer leg, from the collar's face to the bend.
  param long_leg: length in 15mm..150mm = 50mm
  /// Length of the shorter leg. An elbow can be turned around: that the legs are told apart by their length makes them
  /// unique.
  param short_leg: length in 10mm..long_leg = 30mm
  /// How far the collars stand out from the pipe.
  param rim: length in 3mm..40mm = 14mm
  /// Thickness of the collars.
  param thickness: length in 3mm..20mm = 9mm

  require wall < 0.6 * radius, "the wall leaves no bore"
  require 1.1 * radius < bend_radius, "the bend is tighter than the pipe is thick"
  require thickness + 1mm < short_leg, "the collars are thicker than the shorter leg is long"

  /// A frame on the pipe's middle line at an angle of the bend: x away from the bend's centre, z along the pipe.
  fn frame(a: angle) = |p| {
    let out = bend_radius + p.x
    (bend_radius - out * cos(a) + p.z * sin(a), -p.y, long_leg + out * sin(a) + p.z * cos(a))
  }
  /// The frames at the two ends, z from the collar's face into the pipe.
  fn inlet(p) = frame(0deg)((p.x, p.y, p.z - long_leg))
  fn outlet(p) = frame(bend)((p.x, -p.y, short_leg - p.z))

  /// Legs and bend of some radius, from one distance from the collars' faces on.
  fn pipe(r: length, from: length) = {
    inlet: cylinder(r, long_leg - from).translate((0mm, 0mm, from)).transform(inlet),
    bend: |u, v| frame(v * bend)((r * cos(u * 1turn), r * sin(u * 1turn), 0mm)),
    outlet: cylinder(r, short_leg - from).translate((0mm, 0mm, from)).transform(outlet),
  }

  part outside = pipe(radius, thickness)
  part inside = flip(pipe(radius - wall, 0mm))
  let ring = collar(bore: radius - wall, neck: radius, radius: radius + rim, thickness: thickness)
  part inlet_collar = ring.transform(inlet)
  part outlet_collar = ring.transform(outlet)
}
