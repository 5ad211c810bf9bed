// --- names of parts
// Parts: body, hole[0], hole[1], pin[0], hole[2], shell.inside, shell.caps[0], shell.caps[1], pair[0], pair[1]
model m {
  input n: int in 0..5 = 3
  part body = cylinder(10mm, 20mm)
  for i in 0..n {
    part hole = cylinder(1mm, 20mm).translate(polar(5mm, i * 1turn / n))
    if i % 2 == 1 { part pin = sphere(1mm).translate((0mm, 0mm, 1mm * i)) }
  }
  part shell = {inside: cylinder(8mm, 20mm), caps: [disc(1mm), disc(2mm)]}
  part pair = (disc(1mm), sphere(2mm))
}

// --- a model within another
model column {
  param radius: length in 5mm..50mm = 20mm
  param height: length = 100mm
  part shaft = cylinder(radius, height)
  part top = disc(radius).translate((0mm, 0mm, height))
}
// Parts: leg.shaft, leg.top, foot[0].shaft, foot[0].top, foot[1].shaft, foot[1].top
model table {
  param size: length = 500mm
  part leg = column(radius: 30mm).translate((size, 0mm, 0mm))
  for i in 0..2 { part foot = column(height: size / 4).rotate(i * 90deg) }
}

// --- what is no surface
model m {
  // Error: 12-15 a part must be a surface (a function of u and v), but this is a length
  part a = 3mm
  // Error: 12-35 a part must be a surface (a function of u and v), but this is a function of one argument
  // Hint: make a surface of the curve: revolve(curve), or tube(curve, radius: 5mm)
  part b = |t| (t * 1mm, 0mm, 0mm)
  // Error: 12-37 the surface 'c' must return points in space, but it returns a point in the plane
  // Hint: a surface needs three coordinates; a profile in the plane can be turned: revolve(profile)
  part c = |u, v| (u * 1mm, v * 1mm)
  // Error: 12-28 the surface 'd' must return points in space, but it returns a vector of 3 bare numbers
  // Hint: coordinates are lengths: write 0mm for 0, and multiply bare numbers by 1mm
  part d = |u, v| (u, v, 0)
  // Error: 24-27 the elements of an array must be of one kind: this is a length, the ones before are a function of 2 arguments
  part e = [disc(1mm), 3mm]
}

// --- the same name twice
model m {
  param a: length = 1mm
  let a = 2mm
  part p = disc(a)
  // Error: 8-9 there are two parts 'p'
  part p = disc(2 * a)
}

// --- tolerances
model m {
  param t: length = 0.5mm
  part p tolerance t / 2 = disc(1mm)
  // Error: 20-21 a tolerance must be a length, but this is a whole number
  // Hint: did you mean 3mm?
  part q tolerance 3 = disc(1mm)
}

// --- bounds name earlier parameters only
model m {
  // Error: 27-28 there is no 'b' here
  // Hint: it is defined below: move its definition before this line
  param a: length in 0mm..b = 1mm
  param b: length in 0mm..10mm = 5mm
  // Error: 21-22 the lower bound must be an angle, but this is a whole number
  // Hint: did you mean 0deg?
  param c: angle in 0..10deg = 1deg
  // Error: 12-15 a param must be real, length or angle, but this is a whole number
  // Hint: a value that is not fitted is an 'input'
  param d: int = 3
  part p = disc(a + b + 1mm * d * c)
}
