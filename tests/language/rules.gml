// --- records
fn make(a, b = 2mm) = {a: a, b: b, inner: {c: a}}
fn square(r) -> area = r.b ^ 2
model m {
  param a: real = 2
  let r = make(a)
  let rs = for i in 0..3 { {x: i * a, y: 1mm} }
  require r.inner.c == 2 and rs[2].x == 4 and sum(for q in rs { q.x }) == 6, "fields"
  require square(r) == 4mm * 1mm, "dimensions"
  let f = {g: |x| x + 1}
  require f.g(3) == 4, "a function in a field"
  part p = disc(r.b)
}

// --- comprehensions over inputs, nested, of arrays that differ in length
model m {
  param a: real = 2
  input n: int in 1..6 = 3
  let t = for i in 0..n { for j in 0..i { i * j * a } }
  require t[2][1] == 4 and len(t[1]) == 1 and len(t[0]) == 0 and sum(t[2]) == 4, "rows of a triangle"
  let grid = for i in 0..n { for j in 0..2 { (i, j) } }
  require fold(0, grid, |acc, row| acc + fold(0, row, |acc, (i, j)| acc + i * j)) == 3, "folds in folds"
  require fold(0, 0..floor(stop(a) * 3), |acc, i| acc + i) == 15, "a range that is known at run time"
  require [1, 4, 9][floor(stop(a))] == 9, "an index that is"
  part p = disc(1mm)
}

// --- inputs of every kind
model m {
  input n: int in 1..6 = 3
  input flag: bool = true
  input s: real in 0..1 = 0.5
  require n == 3 and flag and (if flag { s } else { 1 }) == 0.5, "values"
  if flag { part p = disc(1mm) } else { part q = disc(1mm) }
}

// --- precedence
model m {
  require -2 ^ 2 == -4 and 2 ^ -1 == 0.5 and 2 ^ 3 ^ 2 == 512, "powers"
  require 7 - 2 - 1 == 4 and 2 * 3 % 4 == 2 and 8 / 4 / 2 == 1, "from the left"
  require not 1 > 2 and not (1 < 2 and 2 > 3) and (false and false or true), "conditions"
  require len(for i in 1 + 1..2 * 3 { i }) == 4, "ranges"
  require (|x| x + 1)(1) * 2 == 4 and sum([1, 2].map(|x| x * 2)) == 6, "lambdas reach far"
  require (|x| x ^ 2)'(3) ^ 2 == 36 and -(|x| x)'(1) == -1, "primes bind most"
  part p = disc(1mm)
}

// --- line ends
fn f(x) =
  x +
  1
let xs = [
  1,
  2,
]
let ys = xs
  .map(|x| x + 1)
let c = if ys[0] > 1 { 2 }
  else { 3 }
let d = (1
  + 2)
let e = f(
  2
); let g = 3
fn h(x) {
  let y = x
  (y + 1)
}
model m {
  require c == 2 and d == 3 and e == 3 and g == 3 and h(1) == 2, "as written"
  part p = disc(1mm)
}

// --- powers of length
fn second_moment(r: length) -> length ^ 4 = pi * r ^ 4 / 4
fn k(x: length ^ -1) -> real = x * 1mm
model m {
  param r: length = 2mm
  let i: length ^ 4 = second_moment(r)
  require abs(i / r ^ 4 - pi / 4) < 1e-12, "a second moment of area"
  require abs((r ^ 3) ^ (1 / 3) - r) < 1e-12mm and k(1 / r) == 0.5, "roots and curvatures"
  part p = disc(r + sqrt(sqrt(i)))
}

// --- angles widen to numbers
model m {
  param t: angle = 30deg
  let q: real = t
  require abs(t / 1deg - 30) < 1e-12 and abs(sin(t) - 0.5) < 1e-15 and t ^ 2 == q * t, "of radians"
  part p = disc(3mm * t + 1mm * (min(t, 10deg) + asin(0.5) * 2))
}

// --- bounds name what is above them
model m {
  param a: length in 1mm..10mm = 5mm
  let twice = 2 * a
  param b: length in a..twice = 7mm
  param c: length in a / 2..b + 1mm = 3mm
  part p = disc(b + c)
}

// --- derivatives of surfaces, mixed and of high order
model m {
  param a: real = 2
  let s = |u, v| (1mm * u ^ 3 * v ^ 2 * a, 1mm * u * v, 0mm)
  require s'u'u(1, 2).x == 48mm and s'u'v(1, 2).x == 24mm and s'v'u(1, 2).x == 24mm and s'v'v(1, 2).x == 4mm, "second"
  require s'u'u'v(1, 2).x == 48mm, "third"
  let c = |t| (t ^ 4 * 1mm, 0mm, 0mm)
  require c''''(1).x == 24mm and c'''''(1).x == 0mm, "fourth and fifth"
  part p = |u, v| s(u, v) + 1mm * normalize(cross(s'u(u + 1, v + 1), s'v(u + 1, v + 1)))
}

// --- stop
model m {
  param a: real = 2.5
  let k = floor(stop(a))
  let (p, q) = stop((a, 3mm))
  require (|x| stop(x) * x)'(a) == a and (|x| stop(x ^ 2))'(a) == 0 and p * q == 7.5mm, "has no derivative"
  part r = disc(1mm * k)
  // Error: 23-31 a value that depends on the parameter 'a' is rounded here and loses its derivative
  // Hint: if this is intended, write stop(...) around the rounded value
  part s = disc(1mm * floor(a))
}

// --- functions of functions, instantiated by recursion
fn compose(f, g) = |x| f(g(x))
fn power(f, n: int) = if n == 0 { |x| x } else { compose(f, power(f, n - 1)) }
fn gcd(a: int, b: int) -> int = if b == 0 { a } else { gcd(b, a % b) }
model m {
  param a: real = 1
  input n: int in 0..5 = 2
  require power(|x| 2 * x, 5)(a) == 32 and power(|x| 2 * x, n)'(a) == 4, "as often as is known"
  require gcd(12, 18) == 6 and gcd(floor(stop(a * 12)), 18) == 6, "known and at run time"
  part p = disc(1mm)
}

// --- models in models in loops
model shaft {
  param radius: length in 5mm..50mm = 20mm
  param height: length in radius..200mm = 100mm
  input rings: int in 0..4 = 2
  require radius < height, "a shaft is slender"
  part body = cylinder(radius, height)
  for i in 0..rings { part ring = disc(radius).translate((0mm, 0mm, height / 2 * i)) }
}
model stand {
  param r: length = 30mm
  part shaft = shaft(radius: r, rings: 1)
  part foot = disc(2 * r)
}
// Parts: left.shaft.body, left.shaft.ring[0], left.foot, leg[0].shaft.body, leg[0].shaft.ring[0], leg[0].foot, leg[1].shaft.body, leg[1].shaft.ring[0], leg[1].foot, large.body, large.ring[0], large.ring[1], one
model table {
  param size: length = 300mm
  input n: int in 1..6 = 2
  part left = stand().translate((size, 0mm, 0mm))
  for i in 0..n { part leg = stand(r: size / 10).rotate(i * 1turn / n) }
  part large = shaft(radius: 10mm).scale(2)
  part one = stand(r: 25mm).shaft.body
}

// --- what a model is given must lie within its bounds
model shaft {
  // Fails: 9-15 the value given for the parameter 'radius' is outside of its bounds
  param radius: length in 5mm..50mm = 20mm
  part body = cylinder(radius, 10mm)
}
model table {
  param size: length = 300mm
  part a = shaft(radius: size)
}

// --- a model that nothing uses is checked too
model other {
  param r: length = 3mm
  // Error: 17-22 a bare number cannot be added to a length
  // Hint: did you mean 1mm?
  part p = disc(r + 1)
}
model main {
  part p = disc(3mm)
}
