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
// Error: 1-6 'modle' is not a keyword
// Hint: did you mean 'model'?
modle m {
  param r: length = 3mm
}

// --- shapes need names
model m {
  // Error: 3-11 a shape needs a name
  // Hint: write 'part NAME = ...'
  cylinder(3mm, 4mm)
}

// --- values need let
model m {
  // Error: 3-4 'r' is not declared
  // Hint: write 'let r = ...' to define it
  r = 3mm
  part p = cylinder(3mm, 4mm)
}

// --- units are glued to numbers
// Error: 9-13 a unit must directly follow its number
// Hint: write '3mm'
let a = 3 mm
// Error: 9-12 'kg' is not a unit
// Hint: the units are mm, cm, m, in, deg, rad and turn; for a product write '3 * kg'
let b = 3kg
// Error: 9-15 a unit must directly follow its number
// Hint: write '30deg'
let c = 30 deg
let d = 1.5in + 2e-3m

// --- comparisons cannot be chained
// Error: 30-39 comparisons cannot be chained
// Hint: write '0 < x and x < 1'
fn inside(x: real) -> bool = 0 < x < 1

// --- words of other languages
// Error: 40-42 there is no operator '&&'
// Hint: conditions are joined with 'and'
fn f(x: real, y: real) -> bool = x > 0 && y > 0
// Error: 40-42 there is no operator '||'
// Hint: conditions are joined with 'or'
fn g(x: real, y: real) -> bool = x > 0 || y > 0
// Error: 25-26 unexpected '!'
// Hint: a condition is negated with 'not'
fn h(x: real) -> bool = !(x > 0)
// Error: 27-29 there is no operator '**'
// Hint: a power is written 'a ^ b'
fn k(x: real) -> real = x ** 2
// Error: 30-31 '=' gives a value a name; it does not compare
// Hint: write '==' to compare two values
fn l(x: real) -> real = if x = 0 { 1 } else { 2 }

// --- a prime stands at what it differentiates
// Error: 9-15 a text is written in double quotes
// Hint: use double quotes
let a = 'text'

// --- brackets
// Error: 25-26 '(' is never closed
fn f(x: real) -> real = (x + 1
// Error: 30-31 ')' has no opening bracket
// Hint: remove it
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
  let a = { param y: real = 1; y }
}
