// --- lengths and numbers
// Error: 9-16 a bare number cannot be added to a length
// Hint: did you mean 2mm?
let a = 3mm + 2
// Error: 9-24 a length cannot be added to an area
let b = 3mm * 2mm + 1mm
let c = sqrt(3mm * 2mm) + 1mm
// Error: 9-20 a bare number cannot be subtracted from a curvature (1/length)
let d = 1 / 3mm - 2
// Error: 9-16 a length cannot be compared with a bare number
// Hint: did you mean 2mm?
let e = 3mm < 2

// --- angles
// Error: 13-15 'sin' expects an angle, but this is a bare number
// Hint: did you mean 30deg?
let a = sin(30)
let b = sin(30deg) + cos(1turn / 3)
let c = 10mm * 90deg + 1mm
let d = 2 * pi * 0.5 + 10deg
// Error: 9-22 a bare number cannot be added to an angle
// Hint: did you mean 3deg?
let e = asin(0.5) + 3

// --- powers
// Error: 42-43 the exponent of a length must be a constant, or the dimension would not be known
// Hint: divide the base by a length first, such as (r / 1mm) ^ n
fn f(x: length, n: real) -> length = x ^ n
fn g(x: length) -> volume = x ^ 3
// Error: 29-34 the result of 'h' must be a length, but this is an area
fn h(x: length) -> length = x ^ 2
fn k(x: real, n: real) -> real = x ^ n

// --- units
model m {
  require 1in == 25.4mm and 1cm == 10mm and 1m == 1000mm, "lengths"
  require abs(1turn - 360deg) < 1e-12rad and abs(180deg - pi) < 1e-12rad and 1rad * 1 == 1rad, "angles"
  part p = cylinder(1mm, 1mm)
}

// --- numbers
model m {
  require 1 / 2 == 0.5, "division"
  require 7 % 3 == 1 and -1 % 3 == 2 and 5.5 % 2 == 1.5, "remainder"
  require 2 ^ 3 ^ 2 == 512 and -2 ^ 2 == -4 and 2 ^ -1 == 0.5, "powers"
  require floor(2.7) == 2 and round(-2.5) == -3 and ceil(2.1) == 3 and int(-2.7) == -2, "whole numbers"
  part p = cylinder(1mm, 1mm)
}

// --- vectors
model m {
  let p = (1mm, 2mm, 3mm)
  let v = (1, 2, 3)
  require (p + v * 1mm).y == 4mm and (p / 2).z == 1.5mm and (-p).x == -1mm, "components"
  part q = cylinder(1mm, 1mm)
}
// Error: 9-28 a vector of 2 bare numbers cannot be added to a point in the plane
// Hint: multiply the bare vector by a length, such as 1mm
let a = (1mm, 2mm) + (1, 2)
// Error: 9-37 a point in space cannot be added to a point in the plane
// Hint: one has 2 components, the other 3
let b = (1mm, 2mm) + (1mm, 2mm, 3mm)
// Error: 9-32 a point in the plane and a point in the plane cannot be multiplied
// Hint: for vectors there are dot(a, b) and cross(a, b)
let c = (1mm, 2mm) * (1mm, 2mm)
// Error: 9-33 a point in the plane cannot be compared with a point in the plane
// Hint: compare numbers; for vectors, their lengths norm(v) or their components v.x
let d = (1mm, 2mm) == (1mm, 2mm)

// --- a default outside its bounds
model m {
  // Error: 35-39 the default of 'r', 30mm, lies outside of its bounds 10mm to 20mm
  param r: length in 10mm..20mm = 30mm
  // Error: 32-36 the default of 's', 40mm, lies outside of its bounds 10mm to 30mm
  param s: length in 10mm..r = 40mm
  // Error: 9-10 the input 'n' is 7, outside of its bounds 1 to 5
  input n: int in 1..5 = 7
  part p = cylinder(r, s)
}

// --- a default of another kind
model m {
  // Error: 21-22 the default must be a length, but this is a whole number
  // Hint: did you mean 3mm?
  param r: length = 3
  // Error: 18-21 the default must be a whole number, but this is a bare number
  input n: int = 2.5
  part p = cylinder(r, r)
}
