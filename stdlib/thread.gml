// Screw threads as surfaces about the z axis, from one flat end to the other: where a thread runs out it becomes the
// cylinder of its root, so that its neck can go on from there.

/// A surface about the z axis, from the plane of x and y up to `length`, whose radius follows a profile along a screw:
/// `radius` and what `profile` adds to it, a function of the way along the axis within a pitch, from 0 to 1, whose ends
/// are alike. The thread rises to its height over `run_out` at both ends, and is right-handed unless `left`.
/// ```gml
/// let s = helical(5mm, 20mm, 2mm, |t| 1mm * (1 - abs(2 * t - 1)), run_out: 0mm)
/// norm(s(0, 0.55))          // = 12.083 mm
/// ```
fn helical(
  radius: length,
  length: length,
  pitch: length,
  profile: real -> length,
  run_out: length = pitch,
  starts: int = 1,
  left: bool = false,
) = |u: real, v: real| {
  let z = length * v
  let turn = if left { -u } else { u }
  let height = profile((starts * (z / pitch - turn) + 0.5) % 1)
  let share = if run_out > 0mm { clamp(min(z, length - z) / run_out, 0, 1) } else { 1 }
  polar(radius + height * share, u * 1turn, z)
}

/// An ISO metric screw thread (ISO 68-1): flanks of 60deg, crests of an eighth of the pitch and roots of a quarter, at
/// the basic diameters. An internal one is the wall of a hole, and faces the axis.
/// ```gml
/// let m10 = metric_thread(10mm, 1.5mm, 21mm)
/// m10(0, 0.5).x            // = 5 mm
/// m10(0.5, 0.5).x          // = -4.18810 mm
/// ```
fn metric_thread(
  diameter: length,
  pitch: length,
  length: length,
  run_out: length = pitch,
  internal: bool = false,
  left: bool = false,
) {
  // 5/8 of the height of the sharp triangle.
  let depth = pitch * (5/16 * sqrt(3))
  _thread(diameter, pitch, length, depth, 1/8, 5/16, run_out, internal, left)
}

/// A trapezoidal thread (ISO 2904): flanks of 30deg, half a pitch deep, crests and roots of 0.366 of the pitch, at the
/// basic diameters.
/// ```gml
/// let tr = trapezoidal_thread(20mm, 4mm, 40mm)
/// tr(0, 0.5).x             // = 10 mm
/// tr(0.5, 0.5).x           // = -8 mm
/// ```
fn trapezoidal_thread(
  diameter: length,
  pitch: length,
  length: length,
  run_out: length = pitch,
  internal: bool = false,
  left: bool = false,
) {
  let flank = tan(15deg) / 2
  _thread(diameter, pitch, length, pitch / 2, 0.5 - flank, flank, run_out, internal, left)
}

/// A rod with an ISO metric thread that stands on the plane of x and y: a solid with the surfaces `wall`, `top` and
/// `base`. Taken off a body it cuts the thread of a nut; it should then reach beyond the body by `run_out`.
/// ```gml
/// let bolt = threaded_rod(10mm, 1.5mm, 21mm)
/// inside(bolt)((4.9mm, 0mm, 10.5mm)) < 0mm    // = true
/// inside(bolt)((-4.9mm, 0mm, 10.5mm)) > 0mm   // = true
/// // part nut = extruded(hexagon, 8mm) - {thread: threaded_rod(10mm, 1.5mm, 11mm).translate((0mm, 0mm, -1.5mm))}
/// ```
fn threaded_rod(
  diameter: length,
  pitch: length,
  length: length,
  run_out: length = pitch,
  left: bool = false,
) {
  require run_out > 0mm, "the thread of a rod runs out over a length above zero, so that its ends are round"
  let wall = metric_thread(diameter, pitch, length, run_out, left: left)
  let end = disc(norm((wall(0, 0).x, wall(0, 0).y)))
  solid(
    {wall: wall, top: end.translate((0mm, 0mm, length)), base: flip(end)},
    |p| {
      let q = wall(atan2(p.y, p.x) / 1turn, clamp(p.z, 0mm, length) / length)
      max(hypot(p.x, p.y) - hypot(q.x, q.y), -p.z, p.z - length)
    },
  )
}

/// A thread with straight flanks; widths of a crest and of a flank along the axis in pitches.
fn _thread(
  diameter: length,
  pitch: length,
  length: length,
  depth: length,
  crest: real,
  flank: real,
  run_out: length,
  internal: bool,
  left: bool,
) {
  require 2 * depth < diameter, "the thread is deeper than the rod's radius: make the pitch smaller"
  let profile = |t: real| depth * clamp((crest / 2 + flank - abs(t - 0.5)) / flank, 0, 1)
  let outer = helical(diameter / 2 - depth, length, pitch, profile, run_out, left: left)
  if internal { flip(outer) } else { outer }
}
