// Involute gears as a rack cuts them (ISO 53): flanks, and the trochoids of the rack's rounded corners at their roots.

/// The pieces of one tooth of a spur gear and of the gap behind it, as curves in the plane, counterclockwise: the tooth
/// stands on the x axis. `right_root`, `right`, `tip`, `left`, `left_root` and `gap` each begin where the one before
/// ends, the roots tangentially.
///
/// The reference circle has the radius teeth / 2 times `module`. `shift` is the profile shift in modules; `addendum`,
/// `dedendum` and `rounding` are those of the rack, in modules too (ISO 53, profile A). A gear whose roots would be
/// undercut is refused: it needs more teeth or a greater shift.
/// ```gml
/// let t = gear_tooth(20, 2mm)
/// norm(t.tip(0.5))                     // = 22 mm
/// norm(t.gap(0.5))                     // = 17.5 mm
/// distance(t.right(1), t.tip(0)) < 1e-9mm and distance(t.left(1), t.left_root(0)) < 1e-9mm   // = true
/// ```
fn gear_tooth(
  teeth: int,
  module: length,
  pressure: angle = 20deg,
  shift: real = 0,
  addendum: real = 1,
  dedendum: real = 1.25,
  rounding: real = 0.38,
) {
  let r = module * (teeth / 2)
  let base = r * cos(pressure)
  let outside = r + module * (addendum + shift)
  // The middle of the rack's rounded corner, from the middle of its tooth and from the reference circle.
  let side = module * (radians(pi) / 4 - dedendum * tan(pressure) - rounding * tan(45deg - pressure / 2))
  let depth = module * (dedendum - rounding - shift)
  let round = module * rounding
  // Rolling angles at the flank's ends: how far its points are from the base circle, along the normal.
  let low = tan(pressure) - (depth / sin(pressure) + round) / base
  let high = sqrt((outside / base) ^ 2 - 1)
  require depth > 0mm,
    "the rack's corners do not reach below the reference circle: the shift or their rounding is too large"
  require low >= 0, "the gear's roots are undercut: it needs more teeth or a greater shift"
  require side >= 0mm, "the rounding of the rack's corners is too large for its teeth"
  // Half the tooth as an angle, at the reference circle and where its flank meets the base circle.
  let half = (radians(pi) / 2 + 2 * shift * tan(pressure)) / teeth
  let from_base = (half + tan(pressure)) * 1rad - pressure
  let involute = |roll: real| roll * 1rad - atan(roll)
  let flank = |t: real| {
    let roll = mix(high, low, t)
    polar2(base * sqrt(1 + roll ^ 2), from_base - involute(roll))
  }
  require from_base > involute(high), "the gear's teeth end in a point below their tips"
  let middle = 180deg / teeth
  let root = |t: real| {
    // The angle of the normal at a point of the rounded corner, which goes through the pitch point.
    let lean = (1 - t) * (90deg - pressure)
    let way = depth / cos(lean) + round
    let rolled = (depth * tan(lean) - side) / r * 1rad
    let p = (r - way * cos(lean), -way * sin(lean))
    p.rotate(rolled + middle)
  }
  let mirrored = |c| |t: real| (c(1 - t).x, -c(1 - t).y)
  let tip = atan2(flank(0).y, flank(0).x)
  let gap = side / r * 1rad
  {
    right_root: mirrored(root),
    right: mirrored(flank),
    tip: arc((0mm, 0mm), outside, -tip, tip),
    left: flank,
    left_root: root,
    gap: arc((0mm, 0mm), r - module * (dedendum - shift), middle - gap, middle + gap),
  }
}

/// A spur gear that stands on the plane of x and y, about the z axis, with a bore: {tooth, top, base, bore}. `tooth`
/// has for each tooth the walls over the pieces of gear_tooth, the first of which stands on the x axis, and its faces
/// `top` and `base`, in pieces between the flanks and between the roots. The gear's `top` and `base` are rings, from
/// the roots to the bore.
/// ```gml
/// let g = spur_gear(20, 2mm, width: 8mm, bore: 6mm)
/// norm(g.tooth[5].tip(0.5, 0) - (0mm, 22mm, 0mm)) < 1e-9mm     // = true
/// normal(g.top, 0.3, 0.5)                                      // = (0, 0, 1)
/// ```
fn spur_gear(
  teeth: int,
  module: length,
  width: length,
  bore: length,
  pressure: angle = 20deg,
  shift: real = 0,
  addendum: real = 1,
  dedendum: real = 1.25,
  rounding: real = 0.38,
) {
  let tooth = gear_tooth(teeth, module, pressure, shift, addendum, dedendum, rounding)
  require bore < norm(tooth.gap(0.5)), "the bore reaches the gear's teeth"
  let walls = each(tooth, |c| extrude(c, width))
  // From one side of the tooth to the other at the same radius.
  let across = |side| |u: real, v: real| {
    let p = side(v)
    lift(polar2(norm(p), mix(-1, 1, u) * atan2(p.y, p.x)))
  }
  let faces = {flank: across(tooth.left), root: across(tooth.left_root)}
  let one = {
    right_root: walls.right_root,
    right: walls.right,
    tip: walls.tip,
    left: walls.left,
    left_root: walls.left_root,
    gap: walls.gap,
    top: faces.translate((0mm, 0mm, width)),
    base: flip(faces),
  }
  let ring = annulus(bore, norm(tooth.gap(0.5)))
  {
    tooth: for k in 0..teeth { one.rotate(k * 1turn / teeth) },
    top: ring.translate((0mm, 0mm, width)),
    base: flip(ring),
    bore: flip(cylinder(bore, width)),
  }
}
