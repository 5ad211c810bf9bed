model m{param r:length in 0mm..50mm = 20mm
  param k: real in 0..1 = 1e-100
  part p = sphere(r / k)
}
