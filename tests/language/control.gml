// --- comprehensions, sums and folds
model m {
  let squares = for i in 0..5 { i * i }
  require sum(squares) == 30 and len(squares) == 5 and squares[4] == 16, "an array"
  require sum(for (a, b) in [(1, 2), (3, 4)] { a * b }) == 14, "patterns"
  require fold(0, 0..100, |acc, i| acc + i) == 4950, "a fold"
  require fold(1.0, squares, |acc, x| acc + x) == 31, "a fold over an array"
  part p = cylinder(1mm, 1mm)
}

// --- conditions
model m {
  param a: real = 2
  require (if a > 1 { 3 } else { 4 }) == 3, "if"
  require (if a > 3 { 3 } else if a > 1 { 4 } else { 5 }) == 4, "else if"
  require a > 1 and not a > 3 or false, "and, not, or"
  require a > 0 or 1 / (a - 2) > 0, "the second condition"
  part p = cylinder(1mm, 1mm)
}

// --- conditions of the wrong kind
// Error: 28-29 a condition must be a truth value, but this is a bare number
// Hint: write a comparison, such as x > 0
fn f(x: real) -> real = if x { 1 } else { 2 }
// Error: 47-50 the branches of this 'if' differ: a whole number and a length
// Hint: did you mean 1mm?
fn g(x: real) -> real = if x > 0 { 1 } else { 1mm }
// Error: 25-39 this 'if' has no 'else', so it has no value where the condition is false
// Hint: add `else { ... }`
fn h(x: real) -> real = if x > 0 { 1 }
// Error: 25-26 a condition must be a truth value, but this is a bare number
// Hint: write a comparison, such as x > 0
fn k(x: real) -> bool = x and true

// --- sides of an `if` on literals must be of one type
// Error: 37-40 the branches of this 'if' differ: a whole number and a length
// Hint: did you mean 1mm?
fn literal() = if true { 1 } else { 2mm }
// Error: 43-47 the branches of this 'if' differ: a length and a truth value
fn of_numbers() = if 2 < 1 { 1mm } else { true }

// --- sides of an `if` on literals may be functions, and on what a call or an input gives, anything
fn of_functions() = if true { |x| x } else { |x| 2 * x }
fn of_a_call(x) = if arity(x) == 1 { x(1) } else { x }
model m {
  input thick: bool = true
  let a = if thick { 2 } else { (1mm, 2mm) }
  require a == 2 and of_functions()(3) == 3 and of_a_call(|x| 2 * x) == 2 and of_a_call(5mm) == 5mm, "one side only"
  for i in 0..(if true { 2 } else { 3 }) {
    part p = cylinder(1mm, 1mm)
  }
}

// --- parts on conditions of lengths and angles
// Parts: p, large, wide
model m {
  input size: length = 10mm
  input angle: angle = 30deg
  param r: length = 10mm
  let double = 2 * size
  part p = sphere(r)
  if double > 15mm { part large = sphere(r) } else { part small = sphere(r) }
  if sin(angle) < 0.4 { part narrow = sphere(r) } else { part wide = sphere(r) }
}

// --- blocks
model m {
  let a = { let b = 2; fn f(x) = x * b; f(3) }
  require a == 6, "a function in a block"
  require { let a = 1; a } == 1, "a name within a block"
  require a == 6, "hides the one outside only there"
  part p = cylinder(1mm, 1mm)
}

// --- an index beyond the array
let xs = [1, 2, 3]
// Error: 12-13 there is no element 3: the array has 3, counted from 0
let a = xs[3]
// Error: 12-14 there is no element -1: the array has 3, counted from 0
let b = xs[-1]
// Error: 12-15 an index must be a whole number, but this is a bare number
// Hint: floor(...) makes a whole number
let c = xs[0.5]

// --- requirements
model m {
  param a: real = 1
  // Fails: 3-34 a is too small
  require a > 2, "a is too small"
  part p = cylinder(1mm, 1mm)
}

// --- a function's requirement
// Fails: 28-74 no root of a negative number
fn root(x: real) -> real { require x >= 0, "no root of a negative number"; sqrt(x) }
model m {
  param a: real = -1
  require root(a) > 0, "never said"
  part p = cylinder(1mm, 1mm)
}

// --- parts of loops and conditions
model m {
  input n: int in 0..5 = 3
  for i in 0..n {
    if i % 2 == 0 { part even = cylinder(1mm, 1mm * (i + 1)) } else { part odd = cylinder(1mm, 1mm) }
  }
}

// --- how many parts there are cannot depend on a parameter
model m {
  param a: real = 3
  // Error: 12-23 the length of this array is known only at run time; it must be known at compile time
  // Hint: loop over a range whose bounds are literals or inputs, or use fold
  for i in 0..floor(a) { part p = cylinder(1mm, 1mm) }
}

// --- a loop is not written out
fn power(x: real, n: int) = loop(1.0, n, |product, i| product * x)
model m {
  param a: real = 2
  require power(a, 10) == 1024 and power(a, 0) == 1, "as often as said"
  require loop([0, 0], 3, |acc, i| [acc[1], acc[0] + i])[1] == 2, "with an array"
  require loop(0, 500000, |acc, i| acc + i) == 124999750000, "many turns"
  part p = disc(1mm * a)
}

// --- how often a loop turns
// Error: 17-20 the number of iterations must be a whole number, but this is a bare number
let a = loop(0, 2.5, |acc, i| acc + i)
// Error: 9-38 a loop's accumulator must stay of one kind: it starts as a whole number and becomes a vector of 2 bare numbers
let b = loop(0, 3, |acc, i| (acc, i))
