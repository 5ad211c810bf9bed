/// NIST StRD Nelson. The logarithm of the response.
model nelson {
  param b1: real = 1
  param b2: real = 1
  param b3: real = 1

  part response = |x1, x2| (0mm, 0mm, 1mm * (b1 - b2 * x1 * exp(-b3 * x2)))
}
