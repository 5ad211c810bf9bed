// --- a line ends a statement
fn f(x) {
  let a = x + 1
  a
    * 2
}

// --- statements that are not finished
fn f(x) {
  // Error: 14-14 expected a value, found the end of the line
  let a = x +
  let b = 2
  b
}
// Error: 9-10 '(' is never closed
let c = (1 + 2

// --- a misspelt keyword
// Error: 1-6 expected a declaration ('let', 'param', 'part', ...), found 'modle'
// Hint: did you mean 'model'?
modle m {
  param r: length = 3mm
}

// --- shapes need names
model m {
  // Error: 3-11 expected a declaration ('let', 'param', 'part', ...), found 'cylinder'
  // Hint: a shape gets a name: 'part NAME = ...'
  cylinder(3mm, 4mm)
}

// --- values need let
model m {
  // Error: 3-4 expected a declaration ('let', 'param', 'part', ...), found 'r'
  // Hint: 'let r = ...' names a value
  r = 3mm
  part p = cylinder(3mm, 4mm)
}

// --- units are glued to numbers
// Error: 11-13 expected an operator or the end of the line, found 'mm'
// Hint: a unit is glued to its number: '3mm'
let a = 3 mm
// Error: 9-12 'kg' is no unit
// Hint: the units are mm, cm, m, in, deg, rad and turn; a product is written '3 * kg'
let b = 3kg
// Error: 12-15 expected an operator or the end of the line, found 'deg'
// Hint: a unit is glued to its number: '30deg'
let c = 30 deg
let d = 1.5in + 2e-3m

// --- comparisons do not chain
// Error: 30-39 comparisons do not chain
// Hint: write '0 < x and x < 1'
fn inside(x: real) -> bool = 0 < x < 1

// --- words of other languages
// Error: 40-41 '&' means nothing here
// Hint: 'and' joins two conditions
fn f(x: real, y: real) -> bool = x > 0 && y > 0
// Error: 40-41 expected an operator or the end of the line, found '|'
// Hint: 'or' joins two conditions
fn g(x: real, y: real) -> bool = x > 0 || y > 0
// Error: 25-26 '!' means nothing here
// Hint: 'not' negates a condition
fn h(x: real) -> bool = !(x > 0)
// Error: 28-29 expected a value, found '*'
// Hint: a power is written 'a ^ b'
fn k(x: real) -> real = x ** 2
// Error: 30-31 expected '{', found '='
// Hint: '==' compares two values
fn l(x: real) -> real = if x = 0 { 1 } else { 2 }

// --- a prime stands at what it differentiates
// Error: 9-14 a prime must directly follow what it differentiates, as in f' or s'u
// Hint: texts are written in double quotes
let a = 'text'

// --- brackets
// Error: 25-26 '(' is never closed
fn f(x: real) -> real = (x + 1
// Error: 30-31 ')' closes nothing
fn g(x: real) -> real = x + 1)

// --- only the last line of a block is its value
fn f(x: real) -> real {
  // Error: 3-8 this value is not used: only the last line of a block is its value
  // Hint: give it a name with 'let', or remove it
  x + 1
  x + 2
}

// --- what stands where
// Error: 1-18 this belongs in a model
// Hint: write it between the braces of `model name { ... }`
param x: real = 1
model m {
  // Error: 3-25 this belongs at the top of the file
  use std.curve (bezier)
  // Error: 13-30 this belongs in the body of a model
  // Hint: write it directly between the braces of `model name { ... }`
  // Error: 32-33 there is no 'y' here
  let a = { param y: real = 1; y }
}
