use std.fillet (rolling_fillet)
use std.frame (rotate, translate)
use std.solid (capped_cylinder)

/// A cast pipe tee: a branch that leaves the run at a slant, with a fillet all around.
model tee {
  /// Outer radius of the run.
  param run: length in 10mm..60mm = 25mm
  /// Outer radius of the branch.
  param branch: length in 5mm..0.9 * run = 15mm
  /// Thickness of the walls.
  param wall: length in 1mm..8mm = 4mm
  /// Half the length of the run.
  param half: length in 30mm..150mm = 70mm
  /// Length of the branch, from the run's axis.
  param reach: length in 30mm..150mm = 70mm
  /// How far the branch leans towards the run's end. A tee can be turned around: that it leans to one side makes it
  /// unique.
  param lean: angle in 0deg..45deg = 25deg
  /// Radius of the fillet between them.
  param fillet: length in 1mm..12mm = 5mm

  require wall < 0.6 * branch, "the wall leaves no bore"
  require run + 3 * fillet + branch * sin(lean) < reach * cos(lean), "the branch is too short for its fillet"
  require run * tan(lean) + (branch + 3 * fillet) / cos(lean) < half,
    "the run ends within the fillet of the branch"

  /// The run of some radius, and the branch.
  fn along_run(r) =
    capped_cylinder(radius: r, height: 2 * half).translate((0mm, 0mm, -half)).rotate(90deg, (0, 1, 0))
  fn along_branch(r) = capped_cylinder(radius: r, height: reach).rotate(lean, (0, 1, 0))

  let (outer, stub) = (along_run(run), along_branch(branch))
  part body =
    outer
    + {branch: stub}
    + {root: rolling_fillet(stub.wall, stub, outer, fillet)}
    - {bore: along_run(run - wall) + {branch: along_branch(branch - wall)}}
}
