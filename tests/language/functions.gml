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
let x = f()
let y = f(1, 2, 3)
let z = f(1, d: 3)
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
fn f(n: int) -> int = f(n + 1)
let x = f(0)

// --- what is called must be known
model m {
  param a: real = 1
  let f = if a > 0 { |x| x } else { |x| -x }
  part p = cylinder(1mm, 1mm)
}

// --- names
fn f(lenght: real) -> real = length * 2
let a = cylindre(1mm, 2mm)
let b = (1, 2).w
