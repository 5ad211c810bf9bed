// --- a name that is misspelt, with several that are near
fn f() = sinn(30deg)
// --- a misspelt function of the library
fn f() = bezeir([(0mm, 0mm), (1mm, 1mm)])
// --- a misspelt parameter
model m {
  param radius: length = 3mm
  part p = sphere(raduis)
}
// --- a name that there is not
fn f() = q7x + 1
// --- a name that differs in case
model m {
  param r: length = 3mm
  part p = Sphere(r)
}
// --- a name before its definition
model m {
  part p = sphere(r)
  let r = 3mm
}
// --- a parameter in the bounds of an earlier one
model m {
  param a: length in 0mm..b = 1mm
  param b: length = 3mm
  part p = sphere(a + b)
}
// --- a parameter outside of its model
model m {
  param r: length = 3mm
  part p = sphere(r)
}
fn f() = r * 2
// --- a name of a block used outside of it
fn f() {
  let a = { let inner = 3; inner }
  inner + a
}
// --- what others call pi
fn f() = sin(PI / 2)
// --- the Greek letter
fn f() = sin(π / 2)
// --- what others call atan
fn f(x: real) = arctan(x)
// --- a power by a function
fn f(x: real) = pow(x, 2)
// --- the length of an array
fn f() = length([1, 2, 3])
// --- shapes of OpenSCAD
model m {
  part p = difference(sphere(3mm), sphere(2mm))
}
// --- printing
fn f() = echo(3)
// --- an empty value
fn f() = None
// --- a function defined twice
fn f() = 1
fn f() = 2
// --- a parameter declared twice
model m {
  param r: length = 3mm
  param r: length = 4mm
  part p = sphere(r)
}
// --- two parts of one name
model m {
  part p = sphere(3mm)
  part p = sphere(4mm)
}
// --- a constant defined by itself
let a = b + 1
let b = a + 1
// --- a constant of its own name
let a = a + 1
// --- a module used as a value
use std.curve
fn f() = curve
// --- an unknown function of a module
use std.curve
fn f() = curve.bezeir([1, 2])
// --- a function of another module
use std.curve
fn f() = curve.revolve(|t| (3mm, t * 1mm))
// --- a misspelt type
fn f(x: lenght) = x
// --- a type of another language
fn f(x: float) = x
// --- a type that there is not
fn f(x: solid) = x
// --- a misspelt field
fn f() = { width: 3mm, height: 4mm }.widht
// --- a field that there is not
fn f() = { width: 3mm, height: 4mm }.depth
// --- a third component of two
fn f() = (1, 2).z
// --- a field of a function
fn f() = sphere.radius
