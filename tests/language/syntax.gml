// --- a line ends a statement
fn f(x) {
  let a = x + 1
  a
    * 2
}

// --- statements that are not finished
fn f(x) {
  let a = x +
  let b = 2
  b
}
let c = (1 + 2

// --- a misspelt keyword
modle m {
  param r: length = 3mm
}

// --- shapes need names
model m {
  cylinder(3mm, 4mm)
}

// --- values need let
model m {
  r = 3mm
  part p = cylinder(3mm, 4mm)
}

// --- units are glued to numbers
let a = 3 mm
let b = 3kg
let c = 30 deg
let d = 1.5in + 2e-3m

// --- comparisons do not chain
fn inside(x: real) -> bool = 0 < x < 1

// --- words of other languages
fn f(x: real, y: real) -> bool = x > 0 && y > 0
fn g(x: real, y: real) -> bool = x > 0 || y > 0
fn h(x: real) -> bool = !(x > 0)
fn k(x: real) -> real = x ** 2
fn l(x: real) -> real = if x = 0 { 1 } else { 2 }

// --- a prime stands at what it differentiates
let a = 'text'

// --- brackets
fn f(x: real) -> real = (x + 1
fn g(x: real) -> real = x + 1)

// --- only the last line of a block is its value
fn f(x: real) -> real {
  x + 1
  x + 2
}

// --- what stands where
param x: real = 1
model m {
  use std.curve (bezier)
  let a = { param y: real = 1; y }
}
