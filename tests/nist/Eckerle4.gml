/// NIST StRD Eckerle4. The response.
model eckerle4 {
  param b1: real = 1
  param b2: real = 1
  param b3: real = 1

  part response = |x, _| (0mm, 0mm, 1mm * (b1 / b2 * exp(-0.5 * ((x - b3) / b2) ^ 2)))
}
