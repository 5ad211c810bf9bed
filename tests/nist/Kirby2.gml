/// NIST StRD Kirby2. The response.
model kirby2 {
  param b1: real = 1
  param b2: real = 1
  param b3: real = 1
  param b4: real = 1
  param b5: real = 1

  part response = |x, _| (0mm, 0mm, 1mm * ((b1 + b2 * x + b3 * x ^ 2) / (1 + b4 * x + b5 * x ^ 2)))
}
