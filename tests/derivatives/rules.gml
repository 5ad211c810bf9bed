/// Powers, products, quotients and roots, each differentiated with respect to its parameter.
model derivatives {
  param a: real = 2; param b: real = 3; param c: real in 0..10 = 1

  part power = |u, v| (1mm * a^3, 1mm * u^a, 1mm / a^2)
  part product = |u, v| (1mm * a * b * u, 1mm * (a * u + b) * (a * v - b), 1mm * (a * u) / (b * v + 2))
  part root = |u, v| (1mm * sqrt(a^2 + b^2), 1mm * abs(a) * u, 1mm * exp(-a * u) * cos(1rad * b * v))
  part chosen = |u, v| (1mm * (if u < a { a * u } else { u }), 1mm * max(a * u, b * v), 1mm * clamp(a, 0, c))
  part summed = |u, v| (1mm * fold(0.0, 1..4, |s, i| s + a^i * u), 0mm, 1mm * loop(1.0, 40, |s, i| s * a * u + b))
  part logarithm = |u, v| (1mm * ln(a + u), 1mm * tan(1rad * a * u), 1mm * a ^ (b * u))
  part angle = |u, v| (1mm * atan2(a * u, b + v) / 1rad, 1mm * sinh(a * u), 1mm * asin(u / a) / 1rad)
  part slope = |u, v| (1mm * (|t| t^3 * a)'(u), 1mm * (|t| sin(1rad * a * t))''(v), 0mm)
}
