// Surfaces that contain derivatives of first to third order of functions with loops, folds, recursion, branches and
// captured values. The tests differentiate them once more with respect to the parameters, forward and in reverse
// (compiler/tests/suite/gradients.rs).

fn power(x: real, n: int) -> real = if n == 0 { 1.0 } else { x * power(x, n - 1) }
/// Recursion with depth `left`, which is not unrolled.
fn depth(x: real, left: real) -> real = if left < 0.4 { x ^ 3 } else { 3 * depth(x / 2, left / 2) + x ^ 4 }
fn folded(x: real, k: real) -> real = fold(1.0, 1..4, |acc, i| acc * sin(x * k * i * 1rad) + x ^ i)
/// A loop that is too long to be unrolled.
fn iterated(x: real, k: real) -> real = loop(x, 200, |y, i| y + 0.01 * sin((y + k) * 1rad))
fn summed(x: real, k: real) -> real = sum(for i in 1..5 { exp(-i * x * k) })
/// A branch at a place that no parameter moves.
fn branched(x: real, m: real, k: real) -> real = if x > 0.5 { (x * m) ^ 5 * k } else { sin(x * m * 1rad) * k ^ 2 }
fn curve_of(k: real) = |t| (t ^ 4 * k, cos(t * k * 1rad), ln(1 + t * k))
fn by_hand(x: real) -> real = x ^ 4
deriv by_hand(x; dx) = 4 * x ^ 3 * dx
/// A surface of three functions of one argument.
fn of(f, g, h) = |u, v| (1mm * f(u + v) + 1mm * v, 1mm * g(u + 0.5 * v) + 1mm * u, 1mm * h(u * v + 0.2))

model orders {
  param k: real in 0.6..1.4 = 1.1
  param m: real in 0.5..1.5 = 0.9
  let f = |x| folded(x, k)
  let g = |x| iterated(m * x, k)
  let h = |x| power(x * k, 5)
  let d = |x| depth(2 * x * m, 2 * x)
  let s = |x| summed(x, m)
  let b = |x| branched(x, m, k)
  let y = |x| by_hand(x * k)
  part first = of(f', g', h')
  part second = of(f'', g'', h'')
  part third = of(f''', g''', h''')
  part fourth = of(d', d'', d''')
  part fifth = of(s''', b'', b''')
  part sixth = of(y''', |x| curve_of(k)'''(x).x, |x| curve_of(m)'''(x).z)
  // With respect to a captured value, and mixed.
  part seventh = of(|x| (|c| curve_of(c)'(x).y)''(k), |x| (|c| (|t| folded(t, c))'(x))''(m), |x| (|p, q| p ^ 3 * sin(q * k * 1rad))'p'q'p(x, m))
  part eighth = |p, q| {
    let surface = |u, v| (1mm * u ^ 3 * v ^ 2 * k, 1mm * sin(u * v * m * 1rad), 1mm * exp(u * k + v))
    surface(p, q) + surface'u(p, q) * m + surface'u'v(p, q) + surface'u'v'v(p, q) * k
  }
}
