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

// --- transformations apply to points, arrays of points, curves, surfaces and models
// Parts: a, b.wall, b.top, b.base, c[0], c[1]
model m {
  let p = [(1mm, 2mm), (3mm, 4mm)].translate((1mm, 1mm))
  require p[1].x == 4mm and p[1].y == 5mm, "points in the plane"
  let q = {a: (0mm, 0mm, 1mm), b: [(0mm, 0mm, 2mm)]}.scale(2)
  require q.a.z == 2mm and q.b[0].z == 4mm, "in a record"
  part a = cylinder(1mm, 2mm).rotate(90deg, (1, 0, 0)).translate((0mm, 0mm, 1mm))
  part b = capped_cylinder(radius: 3mm).mirror((0, 0, 1)).scale(z: 0.5)
  part c = mirror_pattern(sphere(2mm).translate((5mm, 0mm, 0mm)))
}

// --- parts of the library's models
// Parts: box.top, box.base, box.right, box.left, box.back, box.front, pipe.outside, pipe.inside, pipe.rim, pipe.foot
model m {
  part box = box(width: 30mm, height: 5mm)
  part pipe = pipe(outer: 5mm, inner: 4mm).translate((0mm, 0mm, 5mm))
}

// --- repetition of inputs' count
// Parts: hole[0], hole[1], hole[2], post[0][0], post[0][1]
model m {
  input n: int in 1..9 = 3
  part hole = cylinder(1mm, 5mm).translate((9mm, 0mm, 0mm)).polar_pattern(n)
  part post = cylinder(1mm, 5mm).grid_pattern(2, 1, 20mm, 20mm)
}

// --- mistakes are reported where the library is called
model m {
  // Error: 26-27 'height' must be a length, but this is a whole number
  // Hint: did you mean 3mm?
  part a = cylinder(1mm, 3)
  // Error: 12-47 'radius' must be a length, but this is a whole number
  part b = tube(|t| (t * 1mm, 0mm), radius: 3)
  // Error: 23-27 'width' must be a length, but this is an angle
  part c = box(width: 3deg)
  // Error: 32-47 the elements of an array must be of one kind: this is a point in space, the ones before are a point in the plane
  part d = bezier([(1mm, 2mm), (3mm, 4mm, 5mm)])
  // Error: 12-45 a length cannot be added to a point in space
  part e = cylinder(1mm, 3mm).translate(2mm)
}

// Fails: elsewhere: the value given for the parameter 'inner' is outside of its bounds
// Fails: elsewhere: the value given for the parameter 'inner' is outside of its bounds
// --- parameters of the library's models are within their bounds
model m {
  part b = hollow_sphere(outer: 5mm, inner: 6mm)
}

// Fails: elsewhere: the rounded corners of the polyline do not fit on its lines
// --- what a library's function requires
model m {
  part c = revolve(rounded_polyline([(1mm, 0mm), (2mm, 0mm), (2mm, 1mm)], 5mm))
}

// --- what is known while compiling is required there
let p = [(1mm, 0mm), (2mm, 1mm)]
// Error: 9-19 a B-spline needs more points than its degree
let a = bspline(p)(0.5)
// Error: 9-33 a B-spline has more knots than points: by its degree and one more
let b = bspline_knots(p, [0, 1])(0.5)
// Error: 9-34 a curve through points needs two points at least
let c = catmull_rom([(1mm, 2mm)])(0.5)
// Error: 9-27 steps(from, to, count) gives both ends, which are two numbers at least
let d = steps(0mm, 1mm, 1)
// Error: 9-31 a polyline needs two points at least
let e = polyline([(1mm, 2mm)])(0.5)
