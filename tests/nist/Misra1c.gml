/// NIST StRD Misra1c. The response.
model misra1c {
  param b1: real = 1
  param b2: real = 1

  part response = |x, _| (0mm, 0mm, 1mm * (b1 * (1 - (1 + 2 * b2 * x) ^ (-0.5))))
}
