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
let a = f'(1, 2)
let b = f'w(1, 2)
let c = 3.0'
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

// --- a derivative that is lost
model m {
  param a: real = 2.5
  let n = floor(a)
  let k = floor(stop(a))
  part p = cylinder(1mm * n, 1mm * k)
}
