use std.curve (bezier)
use std.frame (transform, translate)
use std.surface (disc, ellipsoid, flip, tube)
use std.vector (turned)

/// A tree that is grown by recursion: every branch bends away from the one that bears it and forks into two, until the
/// last ones end in leaves. It stands on the plane of x and y.
model tree {
  /// How often the trunk forks.
  input forks: int in 0..6 = 4
  /// Length of the trunk.
  param trunk: length in 20mm..200mm = 70mm
  /// Radius of the trunk at its foot.
  param radius: length in 3mm..20mm = 9mm
  /// A branch's radius at its end, as a fraction of that at its beginning.
  param taper: real in 0.5..0.95 = 0.7
  /// How far the trunk leans.
  param lean: angle in 0deg..30deg = 6deg
  /// Length of the left branch of a fork and of the right one, as fractions of the branch below.
  param left: real in 0.5..0.95 = 0.85
  param right: real in 0.5..0.95 = 0.75
  /// How far the left branch bends away, and the right one.
  param left_bend: angle in 5deg..70deg = 30deg
  param right_bend: angle in 5deg..70deg = 42deg
  /// How far a fork is turned about the branch below.
  param twist: angle in 20deg..160deg = 80deg
  /// Length of a leaf.
  param leaf: length in 4mm..60mm = 24mm

  /// A branch in a frame in whose origin it begins and along whose z axis it leaves, with all that grows on it: it
  /// bends towards x.
  fn grow(frame, length: length, thickness: length, bend: angle, level: int) {
    let knee = (0mm, 0mm, length / 2)
    let tip = knee + (sin(bend), 0, cos(bend)) * (length / 2)
    // The last branches end in a point, within their leaves.
    let slim = if level == 0 { 0mm } else { thickness * taper }
    let wood =
      tube(bezier([(0mm, 0mm, 0mm), knee, tip]), radius: |v| mix(thickness, slim, v)).transform(frame)
    let end = |p| frame(tip + turned(p, (0, 1, 0), bend))
    if level == 0 {
      {
        wood: wood,
        leaf: ellipsoid(leaf / 4, leaf / 12, leaf / 2).translate((0mm, 0mm, 0.4 * leaf)).transform(end),
      }
    } else {
      let fork = |p| end(turned(p, (0, 0, 1), twist))
      let back = |p| fork((-p.x, -p.y, p.z))
      {
        wood: wood,
        left: grow(fork, length * left, slim, left_bend, level - 1),
        right: grow(back, length * right, slim, right_bend, level - 1),
      }
    }
  }

  part foot = flip(disc(radius))
  part tree = grow(|p| p, trunk, radius, lean, forks)
}
