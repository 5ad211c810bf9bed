use std.curve (bezier)
use std.frame (translate)
use std.offset (offset)
use std.repeat (polar_pattern)
use std.solid (outside_of, revolved_curve)
use std.spline (bspline_knots)
use std.surface (disc, flip, revolve, tube)

/// An amphora: a body whose profile is a cubic B-spline through five stations, and handles from neck to shoulder.
/// It stands on the plane of x and y; the first handle is towards x.
model amphora {
  /// How many handles there are.
  input handles: int in 0..4 = 2

  /// Radius at the foot.
  param foot: length in 15mm..150mm = 32mm
  /// Radius of the belly, and its height.
  param belly: length in 40mm..250mm = 88mm
  param belly_height: length in 40mm..250mm = 120mm
  /// Radius of the shoulder, which lies halfway between belly and neck.
  param shoulder: length in 25mm..220mm = 68mm
  /// Radius of the neck, and its height.
  param neck: length in 12mm..100mm = 30mm
  param neck_height: length in 120mm..450mm = 250mm
  /// Radius of the lip, and its height, which is the height over all.
  param lip: length in 15mm..200mm = 40mm
  param height: length in 150mm..600mm = 300mm
  /// Thickness of the wall.
  param wall: length in 2mm..25mm = 5mm

  /// Where the handles leave the neck and come down on the shoulder: positions on the profile, on which foot, belly,
  /// shoulder, neck and lip are 0, 1, 2, 3 and 4.
  param handle_top: real in 2.7..3.8 = 3.3
  param handle_bottom: real in 1.5..2.4 = 1.9
  /// How far the handles' control points are from the axis.
  param reach: length in 50mm..300mm = 110mm
  /// How high the upper control point lies above the handle's upper end, and the lower one above its lower end.
  param rise: length in -20mm..80mm = 25mm
  param fall: length in -60mm..120mm = 40mm
  /// Half the thickness and half the width of a handle's section.
  param handle_thickness: length in 3mm..30mm = 6mm
  param handle_width: length in 4mm..40mm = 10mm

  require belly_height + 40mm < neck_height, "the neck must lie well above the belly"
  require neck_height + 15mm < height, "the lip must lie above the neck"
  require neck < lip and neck < shoulder, "the neck is the narrowest place above the belly"
  require shoulder < belly, "the belly is the widest place"
  require foot < belly, "the foot is narrower than the belly"
  require 2 * wall < neck, "the wall closes the neck"
  require shoulder + 15mm < reach, "the handles do not come out of the body"

  let stations = [
    (foot, 0mm),
    (belly, belly_height),
    (shoulder, (belly_height + neck_height) / 2),
    (neck, neck_height),
    (lip, height),
  ]
  let profile = through(stations)
  let hollow = offset(profile, -wall)
  // The foot is solid up to here.
  let solid = 0.06

  part outside = revolve(profile)
  part inside = flip(revolve(|t| hollow(mix(solid, 1, t))))
  part floor = disc(hollow(solid).x).translate((0mm, 0mm, hollow(solid).y))
  part base = flip(disc(foot))
  // The lip is a half round from the outside over the top to the inside.
  part rim = revolve(|t| {
    let (p, q) = (profile(1), hollow(1))
    let across = (p - q) / 2
    let over = (-across.y, across.x)
    (p + q) / 2 + across * cos(t * 180deg) + over * sin(t * 180deg)
  })

  let (top, bottom) = (profile(handle_top / 4), profile(handle_bottom / 4))
  let handle_curve = bezier([
    top - (wall / 2, 0mm),
    (reach, top.y + rise),
    (reach, bottom.y + fall),
    bottom - (wall / 2, 0mm),
  ])
  part handle = tube(handle_curve, radii: (handle_thickness, handle_width))
    .outside_of(revolved_curve(profile))
    .polar_pattern(handles)
}

/// Chebyshev's polynomials of the second kind at 2: 1, 4, 15, 56, ...
fn chebyshev(k: int) -> int = if k <= 0 { k + 1 } else { 4 * chebyshev(k - 1) - chebyshev(k - 2) }

/// Control points of the uniform cubic B-spline that runs through points and ends without curvature. Within, every
/// point p wants p[i] = (c[i - 1] + 4 c[i] + c[i + 1]) / 6, and at the ends c = p. The inverse of the matrix (1 4 1) is
/// known in closed form: its entry (i, j) is (-1)^(i + j) U(min(i, j)) U(n - 1 - max(i, j)) / U(n), with Chebyshev's U
/// at 2.
fn control_points(p) {
  let n = len(p) - 2
  fn side(j) =
    6 * p[j + 1] - (if j == 0 { p[0] } else { 0 * p[0] }) - (if j == n - 1 { p[n + 1] } else { 0 * p[0] })
  fn entry(i, j) {
    let sign = if (i + j) % 2 == 0 { 1 } else { -1 }
    sign * chebyshev(min(i, j)) * chebyshev(n - 1 - max(i, j)) / chebyshev(n)
  }
  for k in 0..n + 2 {
    if k == 0 or k == n + 1 { p[k] } else { sum(for j in 0..n { side(j) * entry(k - 1, j) }) }
  }
}

/// The natural cubic spline through points, in B-spline form: it arrives at them at equal steps of its parameter.
fn through(p) {
  let c = control_points(p)
  let (n, m) = (len(c), len(c) - 1)
  // Beyond the ends the control points go on straight, which is to be without curvature there.
  let points = for i in 0..n + 2 {
    if i == 0 { 2 * c[0] - c[1] } else if i > n { 2 * c[m] - c[m - 1] } else { c[i - 1] }
  }
  bspline_knots(points, for k in 0..n + 6 { k })
}
