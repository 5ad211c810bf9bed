use std.curve (helix)
use std.frame (rotate, translate)
use std.solid (capped_cylinder, extruded, separate)
use std.surface (tube)

/// A spiral stair about the z axis with posts and a rail. The first step is towards x.
model stair {
  /// The number of steps.
  input steps: int in 4..40 = 12
  /// Height of a step, and the angle from one to the next.
  param rise: length in 120mm..260mm = 185mm
  param turn: angle in 12deg..40deg = 24deg
  /// Outer radius of the steps, and that of the column.
  param radius: length in 500mm..1600mm = 850mm
  param column: length in 40mm..250mm = 80mm
  /// Thickness of a step, and half of its width at the outer end.
  param thickness: length in 20mm..110mm = 45mm
  param half_width: length in 100mm..400mm = 210mm
  /// From a step up to the middle of the rail.
  param rail: length in 600mm..1200mm = 900mm

  require thickness < rise - 20mm, "each step lies on the one below"

  /// On the line of walking, at two thirds of the radius: two risers and a going should be some 630 mm.
  measure stride = 2 * rise + radians(turn) * (2/3 * radius)
  measure steel = volume(stair)

  /// Where the posts stand.
  let edge = radius - 40mm
  let step = extruded([
    (0mm, -0.5 * column),
    (radius, -half_width),
    (radius, half_width),
    (0mm, 0.5 * column),
  ], thickness)
  let post = capped_cylinder(radius: 12mm, height: rail)

  part stair =
    capped_cylinder(radius: column, height: steps * rise + rail)
    + {
      step: separate(for i in 0..steps {
        step.translate((0mm, 0mm, (i + 1) * rise - thickness)).rotate(i * turn)
      }),
    }
    + {post: separate(for i in 0..steps { post.translate((edge, 0mm, (i + 1) * rise)).rotate(i * turn) })}
  part rail = tube(helix(edge, rise * 1turn / turn, (steps - 1) * turn / 1turn), radius: 25mm).translate(
    (0mm, 0mm, rise + rail + 20mm),
  )
}
