// --- of one argument
fn f(x: real) -> real = x ^ 3
fn area_of(r: length) -> area = r ^ 2
model m {
  param a: real = 2
  require f'(a) == 12 and f''(a) == 12 and f'''(a) == 6, "powers"
  require abs((|t| sin(t * 1rad))'(a) - cos(a * 1rad)) < 1e-14, "a lambda"
  require abs(area_of'(3mm) - 6mm) < 1e-12mm, "has the dimension of a quotient"
  part p = cylinder(1mm, 1mm)
}

// --- partial derivatives
fn f(u: real, v: real) -> (real, real) = (u * v ^ 2, u - v)
model m {
  param a: real = 3
  require f'u(a, 2).x == 4 and f'u(a, 2).y == 1, "in u"
  require f'v(a, 2).x == 12 and f'v(a, 2).y == -1, "in v"
  require f'u'v(a, 2).x == 4 and f'u'v(a, 2).y == 0, "in both"
  part p = cylinder(1mm, 1mm)
}

// --- wrong primes
fn f(u: real, v: real) -> real = u * v
// Error: 9-11 'f' has 2 arguments: name the one to differentiate by
// Hint: name it after the prime, as in f'u
let a = f'(1, 2)
// Error: 11-12 'f' has no argument 'w' to differentiate by
// Hint: its arguments are u, v
let b = f'w(1, 2)
// Error: 12-13 a prime must directly follow what it differentiates, as in f' or s'u
// Hint: a text is written in double quotes
let c = 3.0'
// Error: 23-24 the result of 'g' must be a whole number, but this is a bare number
fn g(n: int) -> int = n
let d = g'(3)

// --- through conditions, loops and recursion
fn f(x: real) -> real = if x > 0 { x ^ 2 } else { -x }
fn g(x: real) -> real = fold(1.0, 0..100, |acc, i| acc + x * i)
fn power(x: real, n: int) -> real = if n == 0 { 1.0 } else { x * power(x, n - 1) }
fn h(x: real) -> real = power(x, 5)
fn depth(x: real) -> real = if x < 1 { x } else { 3 * depth(x / 2) }
model m {
  param a: real = 3
  require f'(a) == 6 and f'(-a) == -1, "conditions"
  require g'(a) == 4950, "loops"
  require h'(a) == 5 * a ^ 4, "recursion on what is known"
  require depth'(a) == 9 / 4, "recursion at run time"
  part p = cylinder(1mm, 1mm)
}

// --- through closures, of derivatives, with respect to what was captured
fn curve_of(k: real) = |t| (t ^ 2 * k, t * k ^ 3)
model m {
  param a: real = 2
  require curve_of(a)'(3).x == 12 and curve_of(a)''(3).x == 4, "a closure"
  require (|k| curve_of(k)'(3).y)'(a) == 3 * a ^ 2, "what it captured"
  require (|x| (|y| x * y ^ 2)'(x))'(a) == 4 * a, "the inner variable is another"
  part p = disc(1mm)
}

// --- special points
model m {
  param z: real = 0
  require (|x| abs(x))'(z) == 0, "abs at 0"
  require (|x| max(x, -x))'(z) == 0 and (|x| min(x, 3 * x))'(z) == 2, "max and min split a tie"
  require (|x| (x + z) ^ 3)''(z) == 0 and (|y| z ^ y)'(2) == 0, "powers of 0"
  require (|x| if x > 0 { sqrt(x) } else { 2 * x })'(z) == 2, "the other side is not touched"
  part p = disc(1mm)
}

// --- of the library
model m {
  let c = bezier([(0mm, 0mm), (0mm, 2mm), (2mm, 2mm), (5mm, 1mm)])
  require distance(c'(0), (0mm, 6mm)) < 1e-14mm and distance(c'(1), (9mm, -3mm)) < 1e-14mm, "ends of a Bezier curve"
  let s = sphere(2mm)
  let n = normalize(cross(s'u(0.2, 0.3), s'v(0.2, 0.3)))
  require distance(n * 2mm, s(0.2, 0.3)) < 1e-14mm, "a sphere's normal"
  let b = tube(line((10mm, 0mm), (10mm, 5mm)), radius: 2mm)
  require abs(norm(b(0.3, 0.5) - (10mm, 0mm, 2.5mm)) - 2mm) < 1e-14mm, "a tube's radius"
  part p = b
}

// --- by hand
fn norm_of(v) = sqrt(v.x ^ 2 + v.y ^ 2)
deriv norm_of(v; dv) { let n = norm_of(v); if n > 0 * n { (v.x * dv.x + v.y * dv.y) / n } else { 0 * n } }
fn area_of(r: length) -> area = pi * r ^ 2
deriv area_of(r; dr) = 2 * pi * r * dr
fn scaled(x, n: int) = x * n
deriv scaled(x, n; dx) = dx * n
// Not the derivative, so that it is seen which one is taken.
fn odd(x) = x
deriv odd(x; dx) = 7 * dx
fn pair(a, b = 2) = (a * b, a + b)
deriv pair(a, b; da, db) = (a * db + b * da, da + db)
model m {
  param a: real = 3
  require (|x| norm_of((x, 4)))'(a) == 0.6 and (|x| norm_of((x, 0)))'(a - 3) == 0, "of a vector"
  require abs((|x| norm_of((x, 4)))''(a) - 16 / 125) < 1e-15, "the derivative is differentiated"
  require abs(area_of'(3mm) - 6mm * pi) < 1e-14mm and abs(area_of''(3mm) - 2 * pi) < 1e-14, "with dimensions"
  require scaled'x(a, 3) == 3 and (|x| scaled(x * x, 2))'(a) == 12, "whole numbers have no tangent"
  require odd'(a) == 7 and (|x| odd(x * odd(x)))'(a) == 168 and odd''(a) == 0, "by hand, not by its operations"
  require (|x| fold(0, 0..100, |s, i| s + odd(x)))'(a) == 700, "in a loop"
  require (|x| if x > 2 { odd(x) } else { x })'(a) == 7, "in a branch"
  require (|x| pair(x, x).x)'(a) == 6 and (|x| pair(x).x)'(a) == 2, "several arguments and results"
  part p = disc(1mm * odd(a))
}

// --- by hand, of a function in a block
model m {
  param a: real = 3
  fn odd(x: real) -> real = x
  deriv odd(x; dx) = 5 * dx
  let b = { fn even(x) = x; deriv even(x; dx) = 2 * dx; (|x| even(odd(x)))'(a) }
  require b == 10, "both"
  part p = disc(1mm * odd(a))
}

// --- a function whose derivative is given may round
fn steps_of(x: real) -> real = real(floor(x))
deriv steps_of(x; dx) = dx
model m {
  param a: real = 3.5
  require steps_of(a) == 3 and steps_of'(a) == 1, "straight through"
  part p = disc(1mm * steps_of(a))
}

// --- wrong derivatives by hand
fn f(x: length) -> area = x ^ 2
// Error: 18-23 the derivative of 'f' must be an area, as its value is, but this is a length
deriv f(x; dx) = 2 * x
fn g(x: real, y: real) -> real = x * y
// Error: 7-8 'g' has 2 arguments that can vary, and this names one tangent
// Hint: write: deriv g(x, y; dx, dy)
deriv g(x, y; dx) = y * dx
fn h(x: real) -> real = x
// Error: 7-8 this names 2 of the arguments of 'h', which has 1
deriv h(x, y; dx) = dx
// Error: 7-9 there is no function 'hh' here for this derivative
// Hint: a derivative must be in the same block or file as its function
deriv hh(x; dx) = dx
fn k(x: real) -> bool = x > 0
// Error: 7-8 only numbers have derivatives, but 'k' returns a truth value
deriv k(x; dx) = dx
fn l(x: real) -> real = x
deriv l(x; dx) = dx
// Error: 7-8 'l' has two derivatives
deriv l(x; dx) = dx
fn n(x: real) -> real = x
// Error: 18-20 there is no 'dy' here
// Hint: did you mean 'dx'?
deriv n(x; dx) = dy

// --- a derivative by hand must say all
model m {
  param a: real = 3
  fn f(x: real) -> real = a * x
  // Error: 9-10 'f' uses 'a' from outside, which its custom derivative does not take into account
  // Hint: make 'a' an argument of the function
  deriv f(x; dx) = a * dx
  part p = disc(1mm * f(2))
}
// Error: 19-24 this default depends on 'x', which the custom derivative of 'g' does not take into account
fn g(x: real, y = 2 * x) -> real = x * y
deriv g(x, y; dx, dy) = x * dy + y * dx
let a = g(3)
