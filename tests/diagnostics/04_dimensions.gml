// --- a length and a bare number
fn f(r: length) = r + 4
// --- a bare number and a length
fn f(r: length) = 4 - r
// --- a length and a named number
fn f(r: length, k: real) = r + k
// --- a length and a sum of numbers
fn f(r: length, k: real) = r + (k - 1)
// --- a length and an angle
fn f(r: length, a: angle) = r + a
// --- a length and an area
fn f(r: length) = r + r * r
// --- an angle and a number
fn f(a: angle) = a + 30
// --- a comparison of a length with a number
fn f(r: length) = if r > 4 { 1 } else { 2 }
// --- a sine of a number
fn f() = sin(30)
// --- a sine of a named number
fn f(x: real) = sin(x)
// --- a sine of a length
fn f(x: length) = sin(x)
// --- an exponential of a length
fn f(x: length) = exp(x)
// --- an exponent with a dimension
fn f(x: real, r: length) = x ^ r
// --- a variable exponent of a length
fn f(r: length, x: real) = r ^ x
// --- a point with a bare coordinate
fn f(r: length) = (r, 0, r) + (r, r, r)
// --- a point and a vector
fn f(p: point3, v: vec3) = p + v
// --- a point in the plane and one in space
fn f(p: point2, q: point3) = p + q
// --- the product of two vectors
fn f(v: vec3, w: vec3) = v * w
// --- a number over a vector
fn f(v: vec3) = 1 / v
// --- the least of a length and a number
fn f(r: length) = min(r, 4)
// --- sides of an if that differ
fn f(r: length, c: real) = if c > 0 { r } else { 0 }
// --- elements of an array that differ
fn f(r: length) = [r, 2, 3mm]
// --- a profile of bare numbers
model m {
  param r: length = 3mm
  part p = revolve(|t| (r, 2 * t))
}
// --- a radius without a unit
model m {
  part p = sphere(30)
}
// --- a tube with a bare radius
model m {
  part p = tube(|t| (t * 1mm, t * 2), radius: 1mm)
}
// --- a mistake in a function of functions
fn inner(x) = x + 1mm
fn outer(x) = inner(2 * x)
fn f() = outer(3)
// --- a result that is not as written
fn half(x: real) -> length = x / 2
// --- an argument that is not as written
fn half(x: length) -> length = x / 2
fn f() = half(3)
// --- truth and number
fn f() = true + 1
// --- a condition that is a number
fn f(x: real) = if x { 1 } else { 2 }
// --- not of a number
fn f(x: real) = not x
// --- text and number
fn f() = "text" + 1
// --- arrays added
fn f() = [1, 2] + [3, 4]
// --- minus an array
fn f() = -[1, 2]
// --- several mistakes in one block
fn f() {
  let a = 3mm + 1
  let b = 2 + 1mm
  a + b
}
// --- a misspelt dimension
model m {
  param r: lenght = 3mm
  part p = sphere(r + 2mm)
}
// --- a dimension of another language
model m {
  param k: float = 3
  param r: Radius = 3mm
  part p = sphere(r + k * 2mm)
}
