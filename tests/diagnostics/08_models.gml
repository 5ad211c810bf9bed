// --- a default outside of its bounds
model m {
  param r: length in 10mm..20mm = 30mm
  part p = sphere(r)
}
// --- bounds the wrong way round
model m {
  param r: length in 20mm..10mm = 15mm
  part p = sphere(r)
}
// --- a default outside of bounds that depend on a parameter
model m {
  param a: length in 0mm..10mm = 1mm
  param r: length in 0mm..2 * a = 3mm
  part p = sphere(r)
}
// --- bounds without units
model m {
  param r: length in 1..20 = 10mm
  part p = sphere(r)
}
// --- a default without a unit
model m {
  param r: length = 10
  part p = sphere(r)
}
// --- no default
model m {
  param r: length
  part p = sphere(r)
}
// --- a whole number as a parameter
model m {
  param n: int = 3
  part p = sphere(n * 1mm)
}
// --- a point as a parameter
model m {
  param at: point3 = (0mm, 0mm, 0mm)
  part p = sphere(3mm).translate(at)
}
// --- a curve as a part
model m {
  part p = circle(3mm)
}
// --- a number as a part
model m {
  part p = 3mm
}
// --- a surface of bare numbers
model m {
  part p = |u, v| (u, v, 0)
}
// --- a surface in the plane
model m {
  part p = |u, v| (u * 1mm, v * 1mm)
}
// --- a model as a part, not called
model leg {
  part shaft = sphere(3mm)
}
model table {
  part leg = leg
}
// --- parts that depend on a parameter
model m {
  param r: length = 10mm
  if r > 5mm { part p = sphere(r) }
}
// --- parts that depend on a length of a model within another
model inner {
  input size: length = 10mm
  if size > 5mm { part p = sphere(size) }
}
model m {
  param r: length = 10mm
  part a = inner(size: r)
}
// --- a number of parts that depends on a parameter
model m {
  param n: real = 3
  for i in 0..n {
    part p = sphere(i * 1mm)
  }
}
// --- a parameter in a loop
model m {
  for i in 0..3 {
    param r: length = 10mm
    part p = sphere(r)
  }
}
// --- a parameter outside of a model
param r: length = 3mm
// --- a part in a function
fn f() {
  part p = sphere(3mm)
  p
}
// --- a model in a model
model m {
  model n { part p = sphere(3mm) }
  part q = sphere(2mm)
}
// --- an input outside of its bounds
model m {
  input n: int in 1..4 = 7
  part p = sphere(n * 1mm)
}
// --- a requirement that is a number
model m {
  param r: length = 10mm
  require r, "a radius"
  part p = sphere(r)
}
// --- a requirement that never holds
model m {
  input n: int = 2
  require n > 2, "a polygon has three corners at least"
  part p = sphere(n * 1mm)
}
// --- a rounded parameter
model m {
  param r: length = 10mm
  part p = sphere(floor(r / 1mm) * 1mm)
}
// --- a parameter rounded in a function
fn whole(x: length) = round(x / 1mm) * 1mm
model m {
  param r: length = 10mm
  part p = sphere(whole(2 * r))
}
// --- a model that contains itself
model m {
  part p = m()
}
// --- a model without parts
model m {
  param r: length = 3mm
}
// --- several mistakes in a model
model m {
  param r: length in 10mm..20mm = 30mm
  param n: int = 3
  part p = sphere(r + 1)
  part q = sphere(raduis: r)
}
