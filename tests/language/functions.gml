// --- defaults, labels, methods
fn f(a: real, b: real = 2, c = 3) = a + 10 * b + 100 * c
model m {
  require f(1) == 321, "defaults"
  require f(1, c: 5) == 521, "a label"
  require f(c: 5, a: 1, b: 0) == 501, "labels in any order"
  require 1.f(4) == 341, "a method"
  part p = cylinder(1mm, 1mm)
}

// --- wrong arguments
fn f(a: real, b: real = 2) -> real = a + b
// Error: 9-12 this call of 'f' is missing 'a'
let x = f()
// Error: 17-18 'f' takes 2 arguments, but this is one more
let y = f(1, 2, 3)
// Error: 14-15 'f' has no parameter 'd'
// Hint: its parameters are a, b
let z = f(1, d: 3)
// Error: 20-21 'a' is given twice
let w = f(a: 1, a: 2)

// --- functions are values
fn twice(g, x) = g(g(x))
fn adder(n) = |x| x + n
model m {
  require twice(|x| x * 2, 3) == 12, "a lambda"
  require twice(adder(5), 1) == 11, "what it captured"
  require (|(a, b), c| a + b * c)((1, 2), 3) == 7, "a tuple as a parameter"
  part p = cylinder(1mm, 1mm)
}

// --- recursion on what is known while compiling
fn factorial(n: int) -> int = if n < 2 { 1 } else { n * factorial(n - 1) }
model m {
  require factorial(10) == 3628800, "10!"
  part p = cylinder(1mm, 1mm)
}

// --- recursion at run time
fn halvings(x: real) -> real = if x < 1 { 0 } else { 1 + halvings(x / 2) }
model m {
  param a: real = 1000
  require halvings(a) == 10, "1000 is halved ten times"
  part p = cylinder(1mm, 1mm)
}

// --- recursion without end
// Error: 23-31 calls are nested more than 400 deep; the innermost call is of 'f'
// Hint: recursion must end on a known whole number or array length, or the function's parameters and result must be annotated with their types; if it does end, raise the limit: --limit nesting=N
fn f(n: int) -> int = f(n + 1)
let x = f(0)

// --- what is called must be known
model m {
  param a: real = 1
  // Error: 11-45 a condition that is known only at run time cannot choose between functions
  // Hint: let the function choose between values: |u, v| if c { f(u, v) } else { g(u, v) }
  let f = if a > 0 { |x| x } else { |x| -x }
  part p = cylinder(1mm, 1mm)
}

// --- names
// Error: 30-36 there is no 'length' here
// Hint: did you mean 'lenght'?
fn f(lenght: real) -> real = length * 2
// Error: 9-17 there is no 'cylindre' here
// Hint: did you mean 'cylinder'?
let a = cylindre(1mm, 2mm)
// Error: 16-17 a vector of 2 bare numbers has no '.w'
// Hint: the components are .x and .y
let b = (1, 2).w
