// --- a brace that is never closed
model m {
  param r: length = 3mm
  part p = sphere(r)
// --- a brace of a block that is never closed
model m {
  fn f(x: real) -> real {
    let y = x + 1
    y

  part p = sphere(3mm)
}
// --- a parenthesis that is never closed
model m {
  param r: length = 3mm
  part p = sphere((r + 1mm) * 2
  part q = sphere(r)
}
// --- a bracket too many
fn f(x: real) = (x + 1)) * 2
// --- a bracket of the wrong kind
fn f(x: real) = [x + 1, 2)
// --- a stray operator
fn f(x: real) = x + * 2
// --- an operator at the end
model m {
  let a = 3mm +
  part p = sphere(a)
}
// --- '=' for '=='
fn f(x: real) = if x = 1 { 2 } else { 3 }
// --- '==' for '='
let a == 3
// --- ':=' for '='
let a := 3
// --- '=>' for '>='
fn f(x: real) = if x => 1 { 2 } else { 3 }
// --- a chain of comparisons
fn f(x: real) = if 0 < x < 1 { 2 } else { 3 }
// --- a loop as in C
model m {
  for (i = 0; i < 3; i++) {
    part p = sphere(3mm)
  }
}
// --- a loop as in OpenSCAD
model m {
  for (i = [0:3]) {
    part p = sphere(3mm)
  }
}
// --- a loop with parentheses
model m {
  for (i in 0..3) {
    part p = sphere(3mm)
  }
}
// --- a loop as in Python
fn f() = [i * 2 for i in 0..3]
// --- a range with an equals sign
fn f() = for i in 0..=3 { i }
// --- return
fn f(x: real) -> real {
  return x + 1
}
// --- a function as in Python
def f(x):
  return x + 1
// --- a function as in JavaScript
function f(x) { x + 1 }
// --- a function as in OpenSCAD
function f(x) = x + 1;
// --- a module as in OpenSCAD
module cup(r = 3) {
  sphere(r);
}
// --- a variable as in JavaScript
var a = 3
// --- a mutable variable
fn f() {
  let mut a = 3
  a
}
// --- a constant as in C
const a = 3
// --- an assignment without let
model m {
  r = 3mm
  part p = sphere(r)
}
// --- an assignment to what there is
fn f() {
  let a = 1
  a = 2
  a
}
// --- adding to a variable
fn f() {
  let a = 1
  a += 2
  a
}
// --- while
fn f() {
  while true { 1 }
}
// --- if without braces
fn f(x: real) = if x > 0 1 else 2
// --- if with then
fn f(x: real) = if x > 0 then 1 else 2
// --- else if in one word
fn f(x: real) = if x > 0 { 1 } elif x < -1 { 2 } else { 3 }
// --- an if without else
fn f(x: real) = if x > 0 { 1 }
// --- a lambda as in Python
fn f() = map([1, 2], lambda x: x + 1)
// --- a lambda with an arrow
fn f() = map([1, 2], x => x + 1)
// --- a lambda with parentheses
fn f() = map([1, 2], (x) -> x + 1)
// --- a shape without a name
model m {
  sphere(3mm)
}
// --- a part without a shape
model m {
  part p
}
// --- a misspelt keyword
model m {
  parm r: length = 3mm
  part p = sphere(r)
}
// --- a misspelt keyword at the top
modle m {
  part p = sphere(3mm)
}
// --- a keyword as a name
model m {
  param in: length = 3mm
  part p = sphere(3mm)
}
// --- a parameter without a type
model m {
  param r = 3mm
  part p = sphere(r)
}
// --- bounds before the type
model m {
  param r in 1mm..5mm: length = 3mm
  part p = sphere(r)
}
// --- bounds in brackets
model m {
  param r: length in [1mm, 5mm] = 3mm
  part p = sphere(r)
}
// --- the default before the bounds
model m {
  param r: length = 3mm in 1mm..5mm
  part p = sphere(r)
}
// --- an argument labelled with an equals sign
fn f() = sphere(radius = 3mm)
// --- a colon after if
fn f(x: real) = if x > 0: 1 else: 2
// --- a comma forgotten
fn f() = [1 2, 3]
// --- a comma forgotten between arguments
fn f() = max(1 2)
// --- a block without a value
fn f() { let a = 1 }
// --- a value that nobody uses
fn f() {
  1 + 2
  3
}
// --- nothing in parentheses
fn f() = ()
// --- a type in the wrong place
fn f(length x) = x
// --- a return type with a colon
fn f(x: real): real = x
// --- a return type with an arrow of the wrong kind
fn f(x: real) => x + 1
// --- use without parentheses
use std.curve bezier
// --- import
import std.curve
// --- from import
from std.curve import bezier
// --- include as in OpenSCAD
include <column.gml>
// --- use of a path without quotes
use column.gml (column)
// +++ column.gml
fn column() = 3mm
// --- semicolons end statements
let a = 1;
let b = 2;
fn f() = a + b;
// --- several mistakes in one file
fn f(x: real) = x + * 2
let a = = 3
model m {
  parm r: length = 3mm
  part p = sphere(3mm))
}
// --- a line that begins with a minus
fn f(a: real) {
  let b = a
  - b
}
// --- an index on the next line
fn f() {
  let a = [1, 2]
  [0]
}
// --- nested too deeply
fn f() = ((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((1))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))
