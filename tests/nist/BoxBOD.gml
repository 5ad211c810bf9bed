/// NIST StRD BoxBOD. The response.
model boxbod {
  param b1: real = 1
  param b2: real = 1

  part response = |x, _| (0mm, 0mm, 1mm * (b1 * (1 - exp(-b2 * x))))
}
