/// NIST StRD MGH10. The response.
model mgh10 {
  param b1: real = 1
  param b2: real = 1
  param b3: real = 1

  part response = |x, _| (0mm, 0mm, 1mm * (b1 * exp(b2 / (x + b3))))
}
