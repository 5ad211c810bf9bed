// Every curve and every surface of the library as functions of parameters, to test their derivatives
// (compiler/tests/suite/taylor.rs).

model library {
  param a: length in 4mm..9mm = 6mm
  param b: length in 2mm..5mm = 3mm
  param k: real in 0.2..0.8 = 0.45
  param n: real in 1.5..4 = 2.5
  param turn: angle in 10deg..80deg = 35deg
  param bend: length in -1mm..1mm = 0.3mm

  // Curves in the plane, closed ones first.
  let corners = [(a, 0mm), (1mm + bend, b), (-a, 1mm), (-b, -a)]
  let rounds = [circle(a), ellipse(a, b, (bend, 1mm)), superellipse(a, b, n), bspline(corners, closed: true),
    catmull_rom(corners, closed: true), centripetal(corners, closed: true), polyline(corners, closed: true),
    rounded_polyline(corners, b / 4, closed: true),
    rounded_polyline(corners, radii: [b / 4, 0mm, b / 6, b * k / 4], closed: true), rectangle(a, b, 0.5mm * k), regular_polygon(5, a),
    rational_bezier(corners, [1, n, k, 1]), offset(circle(a), b * k)]
  let first = line((a, 0mm), (b, b))
  let bent = rounded_corner((a, 0mm), (a, a), (0mm, b + a), b / 8)
  let cut = bevelled_corner((a, 0mm), (a, a), (0mm, b + a), b / 8, b / 9)
  let onward = [line_on(first, b), arc_on(first, b, turn + 60deg), arc_to(first, (a, b * 2)), spline_to(first, (a, b * 2),
    (k, 1), 0.9), bent.before, bent.round, bent.after, cut.before, cut.bevel, cut.after]
  let lines = [line((a, 0mm), (0mm, b)), arc((0mm, bend), a, turn, turn + 90deg), arc_through((a, 0mm), (a, b), (0mm, a)),
    bezier(corners), spiral(b, a, 1.5), reversed(bezier(corners)), segment(circle(a), 0.1, k),
    join([line((a, 0mm), (b, b)), line((b, b), (0mm, a))]), hermite((a, 0mm), (0mm, a), (0mm, b), (bend, b)),
    bspline(corners), bspline_knots(corners, [0, 0, 0, k, 1, 1, 1]), nurbs(corners, [1, n, k, 1], [0, 0, 0, k, 1, 1, 1]),
    natural_spline(corners), centripetal(corners), polyline(corners), rounded_polyline(corners, b / 4),
    |t| superradius((0.1 + t) * 1rad, n) * (a, b * t)]
  part walls = for c in rounds { extrude(c, b, twist: turn, taper: k) }
  part strips = for c in lines { extrude(c, a) }
  part pieces = for c in onward { extrude(c, a) }
  part frame = mitred_sweep([(a, 0mm, 0mm), (0mm, b, bend), (a * 2, b, a), (b, 3 * a, 0mm)], circle(b * k / 9))
  part top = fill(circle(a), (bend, bend, b))
  part block = prism(ellipse(a, b), b, twist: turn)

  // Curves in space.
  let wave = |t| (a * t, b * sin(t * turn), bend * t * t)
  part pipe = tube(wave, radius: 1mm * k)
  part horn = tube(spatial(bezier(corners)), radii: (0.2mm, 0.1mm * n))
  part spring = coil(a, b, 1.5, 0.5mm * k)
  part cable = tube(helix(a, b, 1.5, top: 2 * a), radius: 0.4mm)
  part rail = sweep(wave, rectangle(1mm, 0.5mm * k), twist: turn, stations: 3)
  part rod = bar(wave, circle(0.5mm * k), stations: 2)

  // Surfaces.
  part turned = revolve(|t| (a + b * t ^ n, b * t), 0deg, turn)
  part cut = trim(torus(a, b * k), (0.1, k), (0.2, 0.7))
  part back = flip(cone(a, b, a))
  part simple = [plane(a, b), disc(a), annulus(b * k, b), cylinder(a, b), sphere(a), sphere_zone(a, -turn, turn),
    ellipsoid(a, b, a * k), torus(a, b * k), paraboloid(a, b), helicoid(b * k, b, a, 1.5), superellipsoid(a, b, a, n, 2.2),
    supertoroid(a, b * k, b, n, 2)]
  let rows = for i in 0..4 { for j in 0..4 { (i * a, j * b, bend * i * j + 1mm * sin(i * turn)) } }
  part patches = [bilinear(rows[0][0], rows[0][3], rows[3][0], rows[3][3] + (a, b, b)), bezier_patch(rows),
    bspline_patch(rows), bspline_patch(rows, 2, closed_u: true), through_grid(rows),
    coons(wave, |t| wave(t) + (0mm, a, b * t), |t| (0mm, a * t, 0mm), |t| wave(1) + (0mm, a * t, b * t))]
  part between = ruled(spatial(circle(a)), |t| (b * cos(t * 1turn), b * sin(t * 1turn), a))
  part lofted = loft([spatial(circle(a)), |t| (b * cos(t * 1turn), b * sin(t * 1turn), a), |t| (bend + a * cos(t * 1turn), a * sin(t * 1turn), 2 * a)])
  part threads = [helical(a, 4 * a, b, |t| bend * sin(t * 1turn)), metric_thread(2 * a, b / 2, 3 * b),
    trapezoidal_thread(2 * a, b / 2, 3 * b, internal: true, left: true)]
  part rod_with_thread = threaded_rod(2 * a, b / 2, 3 * b)
  part outlines = {a: extruded([(0mm, 0mm), (a, bend), (b, a)], b), b: revolved([(0mm, 0mm), (a, b), (b, 2 * a), (0mm, 3 * a)])}
  part edges = {a: cove(b, a), b: cove_ring(a, b * k), c: cove_ring(a, b * k, inward: true), d: bevel(b, a),
    e: bevel_ring(a, b * k), f: bevel_ring(a, b * k, inward: true)}
  part gear = spur_gear(18, b / 2, a, b, shift: k / 4)
  let pinion = gear_tooth(24, b, shift: k / 3)
  part tooth = [extrude(pinion.left, a), extrude(pinion.right_root, a)]
  part hollow = shell(capped_cylinder(radius: a, height: b * 4), b * k / 2)
  let stem = capped_cylinder(radius: a, height: 60mm)
  part rolled = rolling_fillet(stem.wall, stem, half_space(at: (0mm, 0mm, 20mm), normal: (0, k, 1)), b * k)
  part handle = rooted(tube(arc((bend, 0mm), a * 4, -30deg, 180deg + turn), radius: b), half_space(), b * k)
  part sheet = thicken(torus(a, b * k), b * k / 3, around: true)

  // Surfaces that are moved.
  let cap = paraboloid(a, b)
  part moved = [cap.translate((a, bend, b)), cap.rotate(turn, (k, 1, n)), cap.rotate_about((a, b, bend), turn), cap.scale(k),
    cap.stretch((1, k, n)), cap.mirror((1, k, n)), cap.transform(about_x(turn)), cap.transform(about_y(turn)),
    cap.transform(about_z(turn)), place((a, b, bend), euler(turn, k * turn, n * turn))(cap),
    cap.transform(axis_angle((k, n, 1), turn)), cap.transform(basis((1, 0, k), (0, n, 0), (k, k, 1))),
    cap.transform(align((1, k, 0), (0, n, 1))), cap.transform(inverse_rotation(about_x(turn))),
    look_at((a, b, bend), (0mm, 0mm, a))(cap), frame_at(wave, k)(cap),
    compose(frame_at(wave, k), place((a, b, a)))(cap), inverse(frame_at(wave, k))(cap)]
  part patterns = [linear_pattern(cap, 2, (a, b, bend))[1], polar_pattern(cap.translate((a, b, bend)), 3, turn)[1],
    grid_pattern(cap, 2, 2, a, b)[1][1], mirror_pattern(cap, (1, k, n))[1], along_pattern(cap, wave, 3)[1],
    placed(cap, [frame_at(wave, k)])[0]]
}
