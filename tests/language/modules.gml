// --- names of the library
use std.surface (revolve, cylinder)
use std.frame
model m {
  part a = revolve(|t| (1mm, t * 2mm))
  part b = frame.translate(cylinder(1mm, 2mm), (1mm, 2mm, 3mm))
}

// --- a file beside the script
use "bracket.gml" (bracket, thickness)
// Parts: left.base, left.wall
model m {
  param width: length = 40mm
  require thickness == 3mm, "a constant of the file"
  part left = bracket(width)
}

// --- what is not there
// Error: 5-15 there is no module 'std.curves'
// Hint: did you mean 'std.curve'?
use std.curves (bezier)
// Error: 16-21 'std.curve' has no 'bezir'
// Hint: did you mean 'bezier'?
use std.curve (bezir)
// Error: 5-18 no such file
use "missing.gml" (a)
// Error: 5-11 there is no module 'column'
// Hint: a file is named in quotes: use "column.gml" (column)
use column (b)

// Error: elsewhere: files use each other in a circle: circle_a.gml -> circle_b.gml -> circle_a.gml
// Hint: move what both need into a file that uses neither
// Error: elsewhere: this constant is defined in terms of itself
// --- files that use each other
use "circle_a.gml" (a)
let x = a

// Error: elsewhere: '(' is never closed
// --- a broken file
use "broken.gml" (a)
let x = a

// --- a name twice
fn f(x) = x
// Error: 4-5 'f' is defined twice
fn f(y) = y
// Error: 5-6 'f' is defined twice
let f = 3

// --- a script's own names go before the library's
fn norm(v) = 7
model m {
  require norm((1, 2, 3)) == 7, "its own"
  part p = disc(1mm)
}

// --- names that begin with _ are private to their file
// Error: 24-34 '_casteljau' is private to the file that defines it
// Hint: a name that begins with '_' cannot be used from another file
use std.curve (bezier, _casteljau)
use std.math
// Error: 29-34 '_half' is private to the file that defines it
// Hint: a name that begins with '_' cannot be used from another file
use "private.gml" (area_of, _half)
// Error: 14-21 '_horner' is private to the file that defines it
// Hint: a name that begins with '_' cannot be used from another file
let a = math._horner([1, 2], 3, 0)
// Error: 9-14 there is no '_turn' here
let b = _turn(3)
let c = area_of(2mm)
fn _own(x: real) = x
let d = _own(3)

// --- and are not suggested
// Error: 16-25 'std.curve' has no 'casteljau'
use std.curve (casteljau)
// Error: 9-17 there is no 'quadrant' here
let a = quadrant(3)

// --- a name from two places
use "bracket.gml" (bracket)
// Error: 18-25 'bracket' is imported from two files
// Hint: import one of them as a whole, by `use` without names in parentheses, and write MODULE.NAME
use "other.gml" (bracket)
// Error: 20-29 'thickness' is imported from another file and also defined here
use "bracket.gml" (thickness)
fn thickness() = 3
