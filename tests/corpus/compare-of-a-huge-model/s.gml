model ne {
  //
  part face = |u, v| ((u - 1/2)  * 1e38mm, (v - 1/2)  * 8mm, 0mm)
}