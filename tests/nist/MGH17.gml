/// NIST StRD MGH17. The response.
model mgh17 {
  param b1: real = 1
  param b2: real = 1
  param b3: real = 1
  param b4: real = 1
  param b5: real = 1

  part response = |x, _| (0mm, 0mm, 1mm * (b1 + b2 * exp(-x * b4) + b3 * exp(-x * b5)))
}
