/// NIST StRD DanWood. The response.
model danwood {
  param b1: real = 1
  param b2: real = 1

  part response = |x, _| (0mm, 0mm, 1mm * (b1 * x ^ b2))
}
