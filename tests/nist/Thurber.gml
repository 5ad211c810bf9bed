/// NIST StRD Thurber. The response.
model thurber {
  param b1: real = 1
  param b2: real = 1
  param b3: real = 1
  param b4: real = 1
  param b5: real = 1
  param b6: real = 1
  param b7: real = 1

  part response = |x, _| (
    0mm,
    0mm,
    1mm * ((b1 + b2 * x + b3 * x ^ 2 + b4 * x ^ 3) / (1 + b5 * x + b6 * x ^ 2 + b7 * x ^ 3)),
  )
}
