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
// Error: 9-11 'f' has 2 arguments: say in which one to derive
// Hint: name it after the prime, as in f'u
let a = f'(1, 2)
// Error: 11-12 'f' has no argument 'w' to derive in
// Hint: its arguments are u, v
let b = f'w(1, 2)
// Error: 12-13 a prime must directly follow what it differentiates, as in f' or s'u
// Hint: texts are written in double quotes
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
