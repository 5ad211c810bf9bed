// --- an argument too many
fn double(x) = 2 * x
fn f() = double(1, 2)
// --- an argument too few
fn area_of(width: length, height: length) = width * height
fn f() = area_of(3mm)
// --- a misspelt label
fn area_of(width: length, height: length) = width * height
fn f() = area_of(width: 1mm, hieght: 2mm)
// --- the beginning of a label
model m {
  part p = sphere(rad: 3mm)
}
// --- a label that there is not
model m {
  part p = sphere(3mm, segments: 32)
}
// --- an argument given twice
fn area_of(width: length, height: length) = width * height
fn f() = area_of(1mm, width: 2mm)
// --- arguments in the wrong order
fn shell(surface: surface, thickness: length) = surface
model m {
  part p = shell(3mm, sphere(5mm))
}
// --- a value that is no function
fn f() {
  let a = 3
  a(4)
}
// --- a function that is not called
fn side() = 3mm
model m {
  part p = sphere(side)
}
// --- a method that there is not
fn f() = 3.foo()
// --- a built-in function with too many arguments
fn f() = sqrt(1, 2)
// --- a built-in function with a wrong label
fn f() = fold(init: 1, xs: 0..3, g: |a, b| a)
// --- a function of one argument for a surface
fn at(s: surface) = s(0, 0)
fn f() = at(|t| (t, t, t))
// --- a curve that gives numbers
fn start(c: curve) = c(0)
fn f() = start(|t| t)
// --- a model called in order
model leg {
  param r: length = 3mm
  part shaft = sphere(r)
}
model table {
  part leg = leg(3mm)
}
// --- a model called with a misspelt parameter
model column {
  param radius: length = 3mm
  part shaft = sphere(radius)
}
model hall {
  part left = column(raduis: 3mm)
}
// --- a lambda with too many parameters
fn each_of(xs, f) = for x in xs { f(x) }
fn f() = each_of([1, 2], |a, b| a + b)
// --- a mistake in a lambda
fn each_of(xs, f) = for x in xs { f(x) }
fn f() = each_of([1mm, 2mm], |x| x + 1)
// --- a function that calls itself without end
fn f(n: int) -> int = f(n + 1)
let a = f(0)
// --- a recursion whose type is not written
fn f(x: real) = if x < 1 { 1 } else { x * f(x - 1) }
let a = f(3.5)
// --- a choice between functions
fn f(x: real) = (if x > 0 { |t| t } else { |t| 2 * t })(x)
// --- a derivative of a number
fn f(t: real) = t'
// --- a derivative of a function of two arguments
fn f() = (|a, b| a + b)'(1, 2)
// --- a derivative in an argument that there is not
fn f() = (|a, b| a + b)'c(1, 2)
// --- a derivative of a condition
fn f() = (|t| t > 1)'(0.5)
