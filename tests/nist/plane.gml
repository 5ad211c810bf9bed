/// A part of the plane z = 0, larger than the measured one.
model plane {
  /// About the size of the object, in millimetres.
  input reach: real = 10
  part face = |u, v| ((u - 1/2) * reach * 8mm, (v - 1/2) * reach * 8mm, 0mm)
}
