/// NIST StRD Gauss1. The response.
model gauss1 {
  param b1: real = 1
  param b2: real = 1
  param b3: real = 1
  param b4: real = 1
  param b5: real = 1
  param b6: real = 1
  param b7: real = 1
  param b8: real = 1

  part response = |x, _| (
    0mm,
    0mm,
    1mm * (b1 * exp(-b2 * x) + b3 * exp(-((x - b4) / b5) ^ 2) + b6 * exp(-((x - b7) / b8) ^ 2)),
  )
}
