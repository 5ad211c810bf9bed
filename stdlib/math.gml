/// The value between a (t = 0) and b (t = 1), for numbers, points and vectors: a + (b - a) t.
fn mix(a, b, t) = a + (b - a) * t

/// x, but not below lower and not above upper.
fn clamp(x, lower, upper) = min(max(x, lower), upper)

/// 0 below `from`, 1 above `to`, and 3 t^2 - 2 t^3 in between, so that there is no corner.
fn smoothstep(from, to, x) {
  let t = clamp((x - from) / (to - from), 0, 1)
  t * t * (3 - 2 * t)
}

/// The length of the hypotenuse: sqrt(a^2 + b^2).
fn hypot(a, b) = sqrt(a * a + b * b)

/// a where the condition holds, else b.
fn select(condition: bool, a, b) = if condition { a } else { b }

/// f of every element of xs.
fn map(xs, f) = for x in xs { f(x) }

/// `count` numbers from `from` to `to`, evenly spaced, both ends among them.
fn steps(from, to, count: int) = for i in 0..count { mix(from, to, i / (count - 1)) }
