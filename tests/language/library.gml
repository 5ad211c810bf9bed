// --- numbers
model m {
  require mix(1mm, 3mm, 0.25) == 1.5mm and clamp(7, 1, 3) == 3, "mix, clamp"
  require smoothstep(0, 2, 1) == 0.5 and smoothstep(0mm, 2mm, -1mm) == 0 and smoothstep(0, 2, 3) == 1, "smoothstep"
  require hypot(3mm, 4mm) == 5mm and select(1 < 2, 3, 4) == 3, "hypot, select"
  require sum(map([1, 2, 3], |x| x * x)) == 14 and steps(0, 1, 5)[3] == 0.75, "map, steps"
  part p = disc(1mm)
}

// --- vectors
model m {
  let (a, b) = ((1, 2, 3), (4, -5, 6))
  require dot(a, b) == 12 and norm((2, 3, 6)) == 7 and distance((1mm, 1mm), (4mm, 5mm)) == 5mm, "dot, norm"
  require cross(a, b).x == 27 and cross(a, b).y == 6 and cross(a, b).z == -13, "cross"
  require abs(norm(normalize(b)) - 1) < 1e-15, "normalize"
  require abs(polar(2mm, 90deg).y - 2mm) < 1e-15mm and polar(2mm, 0deg, 3mm).z == 3mm, "polar"
  part p = disc(1mm)
}

// --- frames
model m {
  let r = euler(90deg, 0deg, 90deg)
  let p = r((0mm, 1mm, 0mm))
  require distance(p, (0mm, 0mm, 1mm)) < 1e-15mm, "about x, then about z"
  let q = euler(0deg, 90deg, 0deg)((0, 0, 1))
  require distance(q, (1, 0, 0)) < 1e-15, "about y"
  let s = axis_angle((0, 0, 1), 90deg)((1, 0, 0))
  require distance(s, (0, 1, 0)) < 1e-15, "about an axis"
  let c = place((1mm, 2mm, 3mm), euler(0deg, 0deg, 90deg))(|t| (t * 1mm, 0mm, 0mm))
  require distance(c(1), (1mm, 3mm, 3mm)) < 1e-15mm, "a curve, placed"
  part p = disc(1mm)
}

// --- curves
model m {
  let c = bezier([(0mm, 0mm), (0mm, 2mm), (2mm, 2mm)])
  require distance(c(0.5), (0.5mm, 1.5mm)) < 1e-15mm and distance(c(1), (2mm, 2mm)) == 0mm, "bezier"
  require distance(arc((1mm, 0mm), 2mm, 0deg, 180deg)(0.5), (1mm, 2mm)) < 1e-15mm, "arc"
  require distance(reversed(line((0mm, 0mm), (1mm, 0mm)))(0.25), (0.75mm, 0mm)) == 0mm, "line, reversed"
  part p = revolve(c)
}
