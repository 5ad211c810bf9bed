/// NIST StRD Chwirut2. The response.
model chwirut2 {
  param b1: real = 1
  param b2: real = 1
  param b3: real = 1

  part response = |x, _| (0mm, 0mm, 1mm * (exp(-b1 * x) / (b2 + b3 * x)))
}
