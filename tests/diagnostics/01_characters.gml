// --- a text that is not closed
use "column.gml (column)
// +++ column.gml
fn column() = 3mm
// --- a text in single quotes
use 'column.gml' (column)
// +++ column.gml
fn column() = 3mm
// --- a text over two lines
model m {
  require 1 > 2, "this goes
  on"
}
// --- an escape that means nothing
use ".\column.gml" (column)
// +++ .\column.gml
fn column() = 3mm
// --- smart quotes
use “column.gml” (column)
// +++ column.gml
fn column() = 3mm
// --- the sign for degrees
fn f() = sin(30°)
// --- a hash begins no comment
# a comment
fn f() = 1
// --- a block comment
/* a comment
   of two lines */
fn f() = 1
// --- two ampersands
fn f(a: real, b: real) = if a > 0 && b > 0 { 1 } else { 2 }
// --- two bars
fn f(a: real, b: real) = if a > 0 || b > 0 { 1 } else { 2 }
// --- an exclamation mark
fn f(a: bool) = if !a { 1 } else { 2 }
// --- a question mark and a colon
fn f(a: real) = a > 0 ? 1 : 2
// --- a power with two stars
fn f(a: real) = a ** 2
// --- a backslash at the end of a line
fn f(a: real) = a + \
  1
// --- a multiplication sign
fn f(a: real) = 2 × a
// --- less or equal as one sign
fn f(a: real) = if a ≤ 1 { 1 } else { 2 }
// --- a long dash for a minus
fn f(a: real) = a – 1
// --- the square sign
fn f(a: length) = a²
// --- a number that begins with a point
fn f() = .5
// --- a number that ends with a point
fn f() = 2. * 3
// --- a number with a comma
fn f() = 2,5 * 3
// --- a number that is too large
fn f() = 99999999999999999999
// --- a unit that there is not
fn f() = 3kg
// --- degrees written out
fn f() = sin(30degrees)
// --- micrometres
fn f() = 200um
// --- a space before the unit
fn f() = 3 mm
// --- a product without a sign
fn f(x: real) = 2x
// --- a product with a space
fn f(x: real) = 2 x
// --- a product of parentheses
fn f(x: real) = (x + 1)(x - 1)
// --- tabs before a mistake
model m {
{TAB}param r: length = 3mm
{TAB}part p = sphere(r{TAB}+{TAB}2)
}
// --- carriage returns
model m {{CR}
  param r: length = 3mm{CR}
  part p = sphere(r + 2){CR}
}{CR}
// --- a byte order mark
{BOM}model m {
  part p = sphere(3)
}
// --- wide characters before a mistake
model m {
  /* 直径 */ param größe: length = 3mm
  part 部品 = sphere(größe + 2)
}
// --- a space that does not break
fn f() = 3{NBSP}mm
// --- an empty file
{EOF}
// --- only a comment
// nothing here{EOF}
// --- the end of the file without a line end
fn f() = 3 +{EOF}
// --- a very long line
fn f() = sum([1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31, 32, 33, 34, 35, 36, 37, 38, 39, 40, 41, wrong, 42, 43, 44, 45, 46, 47, 48, 49, 50, 51, 52, 53, 54, 55, 56, 57, 58, 59, 60, 61, 62, 63, 64, 65, 66, 67, 68])
// --- a control of the direction of writing
fn f() = 3 // ‮ a comment
