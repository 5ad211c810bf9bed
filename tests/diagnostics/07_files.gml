// --- a module that there is not
use std.curves (bezier)
// --- a module without std
use curve (bezier)
// --- a misspelt name of a module
use std.curve (bezeir)
// --- a name of another module
use std.surface (bezier)
// --- a file that there is not
use "column.gml" (column)
fn f() = column(3mm)
// --- a name that a file does not have
use "column.gml" (colunm)
// +++ column.gml
fn column(r: length) = r
// --- a mistake in a file that is used
use "column.gml" (column)
model m {
  part p = sphere(column(3))
}
// +++ column.gml
/// The radius of a column.
fn column(r) = r + 1mm
// --- a mistake in the syntax of a file that is used
use "column.gml" (column)
model m {
  part p = sphere(column(3mm))
}
// +++ column.gml
fn column(r = r + 1mm
// --- files that use each other
use "a.gml" (a)
model m {
  part p = sphere(a())
}
// +++ a.gml
use "b.gml" (b)
fn a() = b()
// +++ b.gml
use "a.gml" (a)
fn b() = 3mm
// --- a file that uses itself
use "script.gml" (f)
fn f() = 3mm
// --- a use without a name of a file
use "" (column)
model m {
  part p = sphere(3mm)
}
// --- a font that there is not
let letters = glyphs("gmlc", "gmlc.ttf")
// --- a script as a font
let letters = glyphs("gmlc", "sizes.gml")
// +++ sizes.gml
let wall = 3mm
// --- a file that is no font
let letters = glyphs("gmlc", "gmlc.ttf")
// +++ gmlc.ttf
not a font
// --- a font that a constant names
let font = "gmlc.ttf"
let letters = glyphs("gmlc", font)
// --- a font without a text
let letters = glyphs("gmlc")
