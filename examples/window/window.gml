use std.frame (rotate, translate)
use std.solid (box, capped_cylinder)

/// A Gothic window: two lancets and a quatrefoil under a pointed arch, cut into a wall along x whose front is at y = 0.
/// The sill is at z = 0.
model window {
  /// Width of the arch, and the height at which its curves begin.
  param width: length in 600mm..3000mm = 1600mm
  param springing: length in 600mm..4000mm = 1900mm
  /// Width of a lancet, and where its curves begin.
  param light: length in 200mm..0.48 * width = 640mm
  param impost: length in 400mm..springing = 1500mm
  /// Radius of the four circles of the quatrefoil, and how far they are from its middle.
  param foil: length in 60mm..400mm = 190mm
  param spread: length in 40mm..300mm = 170mm
  /// Thickness of the wall, and the depth of the arch in it in front of the tracery.
  param wall: length in 200mm..1200mm = 500mm
  param recess: length in 50mm..wall - 100mm = 320mm

  /// The middle of the quatrefoil.
  let eye = springing + 0.33 * width

  /// Of all three openings.
  measure mullion = width / 2 - light
  measure material = volume(stone)
  measure tracery = area(stone.recess.back) + area(stone.recess.arch.top) + area(stone.recess.arch.other.top)

  part stone =
    box(width: 1.7 * width, depth: wall, height: springing + 1.5 * width).translate(
      (0mm, wall / 2, -0.3 * width),
    )
    - {recess: pointed(width, springing, recess)}
    - {
      light: for side in 0..2 {
        pointed(light, impost, wall).translate(((side - 0.5) * width / 2, 0mm, 0mm))
      },
      foil: for i in 0..4 {
        across(foil, wall).translate((spread * cos(i * 90deg), 0mm, eye + spread * sin(i * 90deg)))
      },
    }
}

/// A cylinder through the wall from its front.
fn across(radius: length, depth: length) =
  capped_cylinder(radius: radius, height: depth).rotate(-90deg, (1, 0, 0))

/// What is below an equilateral pointed arch, from the front of the wall up to a depth.
fn pointed(width: length, springing: length, depth: length) {
  let round = across(width, depth)
  let lens =
    round.translate((-width / 2, 0mm, springing)) & {other: round.translate((width / 2, 0mm, springing))}
  box(width: width, depth: depth, height: springing).translate((0mm, depth / 2, 0mm)) + {arch: lens}
}
