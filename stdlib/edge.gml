// Fillets and chamfers: solids that are added at inner edges and taken off outer ones. The piece that a rounding takes
// off an edge is the one that fills a corner: `body + {fillet: cove(2mm, 30mm)...}` rounds an inner edge of 90deg, and
// `body - {round: cove(2mm, 30mm)...}` an outer one. Their surfaces are tangent to, or meet, the walls where they end.

/// What is between the planes x = 0 and y = 0 and a cylinder that touches both, along z from 0 up to `length`. What is
/// left of it in a body is the cylinder, `round.wall`.
/// ```gml
/// let c = cove(2mm, 30mm)
/// inside(c)((0.5mm, 0.5mm, 9mm)) < 0mm    // = true
/// inside(c)((1mm, 1mm, 9mm)) > 0mm        // = true
/// ```
fn cove(radius: length, length: length) =
  box(width: radius, depth: radius, height: length).translate((radius / 2, radius / 2, 0mm))
  - {round: capped_cylinder(radius: radius, height: length).translate((radius, radius, 0mm))}

/// What is between the plane of x and y, a cylinder of a radius about z and a torus that touches both: the fillet about
/// a boss that stands on the plane. With `inward` it is on the inner side of the cylinder: at the bottom of a bore; or,
/// turned over and taken off, the rounding of a boss's rim. What is left of it in a body is the torus, `round.wall`.
/// ```gml
/// let c = cove_ring(10mm, 2mm)
/// inside(c)((0mm, 10.5mm, 0.5mm)) < 0mm   // = true
/// inside(c)((0mm, 11mm, 1mm)) > 0mm       // = true
/// inside(cove_ring(10mm, 2mm, inward: true))((0mm, 9.5mm, 0.5mm)) < 0mm   // = true
/// ```
fn cove_ring(radius: length, fillet: length, inward: bool = false) {
  require not inward or fillet <= radius,
    "the fillet on the inner side of a cylinder is no more than its radius"
  let far = if inward { radius - fillet } else { radius + fillet }
  pipe(outer: max(radius, far), inner: max(min(radius, far), 0mm), height: fillet)
    - {round: _ring(far, fillet).translate((0mm, 0mm, fillet))}
}

/// What is between the planes x = 0 and y = 0 and one at a slant, which cuts both at the distance `cut` from the edge;
/// along z from 0 up to `length`. What is left of it in a body is the slant, `side[1]`.
/// ```gml
/// bevel(2mm, 30mm).side[1](0.5, 0.5)      // = (1, 1, 15) mm
/// ```
fn bevel(cut: length, length: length) = extruded([(0mm, 0mm), (cut, 0mm), (0mm, cut)], length)

/// A torus as a solid, of which only the outer side of what crosses itself is used.
fn _ring(bend, radius) = solid({wall: torus(bend, radius)}, |p| hypot(hypot(p.x, p.y) - bend, p.z) - radius)

/// What is between the plane of x and y, a cylinder of a radius about z and a cone, which cuts both at the distance
/// `cut` from the edge. With `inward` it is on the inner side of the cylinder. What is left of it in a body is the
/// cone, `slant`.
/// ```gml
/// bevel_ring(10mm, 2mm).slant(0, 0.5)                 // = (11, 0, 1) mm
/// bevel_ring(10mm, 2mm, inward: true).slant(0, 0.5)   // = (9, 0, 1) mm
/// ```
fn bevel_ring(radius: length, cut: length, inward: bool = false) {
  require not inward or cut <= radius, "the cut of an inward bevel is no more than the cylinder's radius"
  let side = if inward { -1 } else { 1 }
  let slant = revolve(line((radius + side * cut, 0mm), (radius, cut)))
  let wall = cylinder(radius, cut)
  solid(
    {
      slant: if inward { flip(slant) } else { slant },
      wall: if inward { wall } else { flip(wall) },
      foot: flip(if inward { annulus(radius - cut, radius) } else { annulus(radius, radius + cut) }),
    },
    |p| {
      let beyond = side * (hypot(p.x, p.y) - radius)
      max(-beyond, -p.z, (beyond + p.z - cut) / sqrt(2))
    },
  )
}
