// --- lengths and numbers
let a = 3mm + 2
let b = 3mm * 2mm + 1mm
let c = sqrt(3mm * 2mm) + 1mm
let d = 1 / 3mm - 2
let e = 3mm < 2

// --- angles
let a = sin(30)
let b = sin(30deg) + cos(1turn / 3)
let c = 10mm * 90deg + 1mm
let d = 2 * pi * 0.5 + 10deg
let e = asin(0.5) + 3

// --- powers
fn f(x: length, n: real) -> length = x ^ n
fn g(x: length) -> volume = x ^ 3
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
let a = (1mm, 2mm) + (1, 2)
let b = (1mm, 2mm) + (1mm, 2mm, 3mm)
let c = (1mm, 2mm) * (1mm, 2mm)
let d = (1mm, 2mm) == (1mm, 2mm)

// --- a default outside its bounds
model m {
  param r: length in 10mm..20mm = 30mm
  param s: length in 10mm..r = 40mm
  input n: int in 1..5 = 7
  part p = cylinder(r, s)
}

// --- a default of another kind
model m {
  param r: length = 3
  input n: int = 2.5
  part p = cylinder(r, r)
}
