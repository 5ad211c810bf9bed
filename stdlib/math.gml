// Numbers: mixing, ranges, smooth steps and easing. Arguments may be numbers of any dimension where nothing else is
// said, and points and vectors where that makes sense. Roots, powers and the functions of angles are built in.

/// The value between a (t = 0) and b (t = 1): a + (b - a) t. For numbers, points and vectors of any dimension
/// (elsewhere called lerp); t may lie outside of 0..1.
/// ```gml
/// mix(2mm, 4mm, 0.5)              // = 3 mm
/// mix((0mm, 0mm), (8mm, 4mm), 0.25)   // = (2, 1) mm
/// ```
fn mix(a, b, t) = a + (b - a) * t

/// Where x lies between a (0) and b (1): the inverse of mix. a and b must differ.
/// ```gml
/// unmix(2mm, 4mm, 3.5mm)   // = 0.75
/// ```
fn unmix(a, b, x) = (x - a) / (b - a)

/// x carried from one range to another: from_low becomes to_low, from_high becomes to_high, the rest in proportion.
/// ```gml
/// remap(25, 0, 100, 10mm, 30mm)   // = 15 mm
/// ```
fn remap(x, from_low, from_high, to_low, to_high) = mix(to_low, to_high, unmix(from_low, from_high, x))

/// x, but not below lower and not above upper.
/// ```gml
/// clamp(12mm, 2mm, 10mm)   // = 10 mm
/// ```
fn clamp(x, lower, upper) = min(max(x, lower), upper)

/// x, but not below 0 and not above 1.
/// ```gml
/// saturate(1.25)   // = 1
/// ```
fn saturate(x: real) -> real = clamp(x, 0, 1)

/// As clamp, but the derivative stays that of x itself: for an x that only rounding takes beyond its bounds.
/// ```gml
/// keep_within(1.0000001, 0, 1)   // = 1
/// (|x: real| keep_within(x, 0, 1))'(1)   // = 1
/// ```
fn keep_within(x, lower, upper) = x + stop(clamp(x, lower, upper) - x)

/// x brought into lower..upper by whole multiples of the range's length; upper itself becomes lower.
/// ```gml
/// wrap(370deg, 0deg, 360deg)     // = 10 deg
/// wrap(-0.25, 0, 1)              // = 0.75
/// ```
fn wrap(x, lower, upper) = lower + (x - lower) % (upper - lower)

/// 0 where x is below the edge, else 1. It jumps, so that its derivative, which is 0, does not tell of the edge.
/// ```gml
/// step(2mm, 1mm)   // = 0
/// step(2mm, 3mm)   // = 1
/// ```
fn step(edge, x) -> real = if x < edge { 0 } else { 1 }

/// 0 below `from`, 1 above `to`, and 3 t^2 - 2 t^3 in between: no corner.
/// ```gml
/// smoothstep(0mm, 4mm, 1mm)   // = 0.15625
/// ```
fn smoothstep(from, to, x) {
  let t = clamp(unmix(from, to, x), 0, 1)
  t * t * (3 - 2 * t)
}

/// 0 below `from`, 1 above `to`, and 6 t^5 - 15 t^4 + 10 t^3 in between: the curvature does not jump either (Perlin
/// 2002).
/// ```gml
/// smootherstep(0mm, 4mm, 1mm)   // = 0.103515625
/// ```
fn smootherstep(from, to, x) {
  let t = clamp(unmix(from, to, x), 0, 1)
  t ^ 3 * (10 - 15 * t + 6 * t * t)
}

/// The absolute value without its corner: sqrt(x^2 + width^2). It is `width` at 0 and nears abs(x) away from it, by
/// less than width^2 / (2 abs(x)). `width` has the dimension of x and is greater than 0.
/// ```gml
/// smooth_abs(-4mm, 3mm)   // = 5 mm
/// ```
fn smooth_abs(x, width) = sqrt(x * x + width * width)

/// The smaller of a and b without a corner: too small by width / 2 where they are equal, by ever less where they
/// differ.
/// ```gml
/// smooth_min(2mm, 6mm, 3mm)   // = 1.5 mm
/// ```
fn smooth_min(a, b, width) = (a + b - smooth_abs(a - b, width)) / 2

/// The greater of a and b without a corner: too great by width / 2 where they are equal, by ever less where they
/// differ.
/// ```gml
/// smooth_max(2mm, 6mm, 3mm)   // = 6.5 mm
/// ```
fn smooth_max(a, b, width) = (a + b + smooth_abs(a - b, width)) / 2

/// The length of the hypotenuse: sqrt(a^2 + b^2).
/// ```gml
/// hypot(3mm, 4mm)   // = 5 mm
/// ```
fn hypot(a, b) = sqrt(a * a + b * b)

/// a where the condition holds, else b: as a function what `if` is as an expression, but both are computed.
/// ```gml
/// select(2 > 1, 3mm, 4mm)   // = 3 mm
/// ```
fn select(condition: bool, a, b) = if condition { a } else { b }

/// t^power: starts slowly. t runs from 0 to 1, power is greater than 1; 2 is quadratic easing, 3 cubic.
/// ```gml
/// ease_in(0.5)             // = 0.25
/// ease_in(0.5, power: 3)   // = 0.125
/// ```
fn ease_in(t: real, power = 2) = t ^ power

/// 1 - (1 - t)^power: ends slowly. t runs from 0 to 1, power is greater than 1.
/// ```gml
/// ease_out(0.5)   // = 0.75
/// ```
fn ease_out(t: real, power = 2) = 1 - (1 - t) ^ power

/// Starts and ends slowly: ease_in in the first half of t, ease_out in the second.
/// ```gml
/// ease_in_out(0.25)   // = 0.125
/// ease_in_out(0.5)    // = 0.5
/// ```
fn ease_in_out(t: real, power = 2) =
  if t < 0.5 { ease_in(2 * t, power) / 2 }
  else { 0.5 + ease_out(2 * t - 1, power) / 2 }

/// The number of degrees in an angle.
/// ```gml
/// degrees(0.25turn)   // = 90
/// ```
fn degrees(angle: angle) = angle / 1deg

/// The number of radians in an angle.
/// ```gml
/// radians(180deg)   // = 3.14159265
/// ```
fn radians(angle: angle) = angle / 1rad

/// The logarithm of x to a base: log(x, 10), log(x, 2). x and base are greater than 0; ln is the natural one.
/// ```gml
/// log(1000, 10)   // = 3
/// ```
fn log(x: real, base: real) = ln(x) / ln(base)

/// The polynomial c[0] + c[1] x + c[2] x^2 + ... by Horner's scheme. The coefficients are of one dimension, x is a bare
/// number.
/// ```gml
/// polynomial([1mm, 2mm, 3mm], 2)   // = 17 mm
/// ```
fn polynomial(coefficients, x) = _horner(coefficients, x, 0)

/// c[i] + c[i + 1] x + ...
fn _horner(coefficients, x, i: int) =
  if i == len(coefficients) - 1 { coefficients[i] }
  else { coefficients[i] + _horner(coefficients, x, i + 1) * x }

/// Which of n equal spans of 0..1 a number is in, counted from 0, and how far it is in it from 0 to 1. Where two spans
/// meet it is in the second; what is below 0 or above 1 counts to the first or last span.
/// ```gml
/// span_of(0.625, 4).x   // = 2
/// span_of(0.625, 4).y   // = 0.5
/// ```
fn span_of(t: real, n: int) {
  let i = clamp(floor(stop(t * n)), 0, n - 1)
  (i, t * n - i)
}
