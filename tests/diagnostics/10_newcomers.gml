// --- 'in' as a comparison
model m {
  param r: length = 30mm
  require r in 20mm..50mm, "too large"
  part p = sphere(r)
}
// --- a shape moved as in OpenSCAD
model m {
  translate([0, 0, 5]) sphere(3);
}
// --- a part moved as in OpenSCAD
model m {
  part p = translate([0, 0, 5]) sphere(3)
}
// --- a union as in OpenSCAD
model m {
  union() {
    sphere(3mm);
    cylinder(1mm, 9mm);
  }
}
// --- printing as a statement
model m {
  param r: length = 3mm
  echo("r", r);
  part p = sphere(r)
}
// --- the fineness of OpenSCAD
model m {
  part p = sphere(3mm, $fn = 64)
}
// --- the labels of OpenSCAD
model m {
  part p = cylinder(h: 10mm, r: 5mm)
}
// --- labels without spaces and with equals signs
model m {
  part p = cylinder(height=10mm, radius: 5mm)
}
// --- a diameter
model m {
  part p = sphere(diameter: 10mm)
}
// --- a point in brackets
model m {
  part p = sphere(3mm).translate([0mm, 0mm, 5mm])
}
// --- a surface less another
model m {
  part p = sphere(3mm) - sphere(2mm)
}
// --- two curves added
fn f() = circle(3mm) + circle(4mm)
// --- a builder as in Python
with BuildPart() as p:
  Cylinder(5, 10)
// --- everything imported
from build123d import *
// --- a text with values in it
model m {
  param r: length = 3mm
  require r > 1mm, f"{r} is too small"
  part p = sphere(r)
}
// --- a remainder in words
fn f(i: int) = i mod 2
// --- a whole quotient in words
fn f(i: int) = i div 2
// --- a comparison in words
fn f(i: int) = if i is 2 { 1 } else { 3 }
// --- a function of Python's module
use std.math
fn f() = math.sin(30deg)
// --- a constant of Python's module
fn f() = math.pi * 2
// --- a part's name in quotes
model m {
  part "wall" = sphere(3mm)
}
// --- a part's name in quotes that cannot be one
model m {
  part "left wall" = sphere(3mm)
}
// --- a shape alone
model m {
  let ball = sphere(3mm)
  ball
}
// --- a unit for a type
model m {
  param r: mm = 3mm
  part p = sphere(r)
}
// --- an angle's unit for a type
fn f(a: degrees) = sin(a)
// --- bounds in words
model m {
  param r: length in 1mm to 5mm = 3mm
  part p = sphere(r)
}
// --- bounds with three points
model m {
  param r: length in 1mm...5mm = 3mm
  part p = sphere(r)
}
// --- bounds with a comma
model m {
  param r: length in 1mm, 5mm = 3mm
  part p = sphere(r)
}
// --- bounds by least and largest
model m {
  param r: length min 1mm max 5mm = 3mm
  part p = sphere(r)
}
// --- two parameters on one line
model m {
  param a: length = 1mm, b: length = 2mm
  part p = sphere(a)
}
// --- a range as in Python
fn f() = for i in 0:5 { i }
// --- a range as in MATLAB, in brackets
fn f() = [0:5]
// --- a slice
fn f() = [1, 2, 3][1:2]
// --- arrays joined by two pluses
fn f() = [1, 2] ++ [3]
// --- the length of an array as a field
fn f() = [1, 2].length
// --- a function of a vector as a field
fn f(v: vec3) = v.norm
// --- a unit beside a name
model m {
  param r: real = 3
  part p = sphere(r mm)
}
// --- the sign for inches
fn f() = 3"
// --- yes for true
model m {
  input lid: bool = yes
  if lid { part p = sphere(3mm) } else { part q = sphere(2mm) }
}
// --- a tolerance after the shape
model m {
  part p = sphere(3mm) tolerance 0.1mm
}
// --- a comma forgotten at the end of a line
model m {
  part p = revolve(bezier([
    (3mm, 0mm)
    (4mm, 5mm),
    (3mm, 9mm),
  ]))
}
// --- points that are no array
model m {
  part p = revolve(bezier((3mm, 0mm), (4mm, 2mm)))
}
// --- points that are no curve
model m {
  part p = extrude([(0mm, 0mm), (1mm, 0mm), (1mm, 1mm)], 5mm)
}
// --- arguments of map in the order of Python
fn f() = map(|x| x + 1, [1, 2])
// --- a library's requirement that is not met
model m {
  part p = loft([circle(3mm)])
}
// --- a value outside of the bounds of a model's parameter
model leg {
  param r: length in 1mm..5mm = 3mm
  part shaft = sphere(r)
}
model table {
  part left = leg(r: 10mm)
}
// --- a value that is not finite, in the library
model m {
  param h: length in 1mm..50mm = 20mm
  part wall = cylinder(10mm, h)
  part grip = tube(line((0mm, 0mm, h), (0mm, 9mm, h)), 1mm)
}
// --- files that use each other from folder to folder
use "parts/knob.gml" (knob)
model m { part p = knob() }
// +++ parts/knob.gml
use "../script.gml" (m)
model knob { part ball = sphere(3mm) }
// --- a point without parentheses
model m {
  part p = revolve(|t| 3mm, t * 10mm)
}
// --- a record with equals signs
let pin = {radius = 2mm, height=5mm}
// --- the arguments of fold in another order
let s = fold([1, 2, 3], 0, |a, b| a + b)
// --- a function of one argument for fold
let s = fold(0, [1, 2, 3], |a| a + 1)
// --- the sum of a function
let s = sum(|i| i)
// --- the greatest of one number
let s = max(3)
// --- two names of a loop without parentheses
let s = for i, x in [(1, 2)] { i * x }
// --- two names of a let without parentheses
fn f() {
  let a, b = (1, 2)
  a + b
}
// --- a range with a step
let s = for i in 0..10..2 { i }
// --- a file without its ending
use "sizes" (wall)
let a = wall
// +++ sizes.gml
let wall = 3mm
// --- a file under another name
use "sizes.gml" as s
// +++ sizes.gml
let wall = 3mm
// --- a parameter of a type that there is not
model m {
  param r: Length = 3mm
  part p = sphere(r)
}
// --- a derivative without its semicolon
fn f(x: real) -> real = x ^ 2
deriv f(x, dx) = 2 * x * dx
// --- a derivative by name
fn f(x: real) -> real = x ^ 2
let a = diff(f, 2)
// --- a model with its parameters in parentheses
model leg(r: length) {
  part p = sphere(r)
}
// --- a model with an equals sign
model leg = { part p = sphere(3mm) }
// --- a function without parentheses
fn wall = 3mm
// --- a value after an arrow
fn f(x) -> x + 1
// --- a factorial
let a = 5!
// --- a number with a plus
let a = +3
// --- the whole quotient of Python
model m {
  param r: length = 3mm
  let half = floor(7 // 2)
  part p = sphere(r * half)
}
