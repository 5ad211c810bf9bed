// --- an element that there is not
fn f() = [1, 2, 3][3]
// --- an element before the first
fn f() = [1, 2, 3][-1]
// --- an index that is no whole number
fn f() = [1, 2, 3][0.5]
// --- an element of a number
fn f() = 3[0]
// --- a loop over a number
fn f() = for i in 5 { i }
// --- a range of reals
fn f() = for i in 0..5.5 { i }
// --- a loop whose length is not known
fn f(x: real) = for i in 0..floor(x) { i }
// --- a loop that is too long
fn f() = for i in 0..1000000 { i }
// --- a pattern with too many names
fn f() {
  let (a, b, c) = (1, 2)
  a
}
// --- a pattern for a number
fn f() {
  let (a, b) = 3
  a
}
// --- a field given twice
fn f() = { a: 1, a: 2 }
// --- a remainder by zero
fn f() = 7 % 0
// --- a whole number that gets too large
fn f() = 2 ^ 100 * 3
// --- a fold whose value changes its kind
fn f(x: real) = fold(0mm, 0..floor(x), |a, i| a * 2mm)
// --- the least element of nothing
fn f() = min([])
// --- vectors compared
fn f(v: vec3, w: vec3) = v < w
// --- a letter in an SVG path
let outlines = svg_path("M 0 0 L 8 O Z")
// --- an SVG path that encloses nothing
let outlines = svg_path("M 0 0 L 8 4")
// --- a tolerance without a unit
let outlines = svg_path("M 0 0 H 8 V 4 Z", 0.01)
// --- a tolerance that is computed
fn tolerance(k: int) = 0.01mm * sqrt(k)
let outlines = svg_path("M 0 0 H 8 V 4 Z", tolerance(2))
// --- a number instead of a path
let outlines = svg_path(3)
// --- a text that a parameter chooses
model m {
  param a: real in 0..1 = 0.5
  let path = if a > 0.5 { "M 0 0 H 8 V 4 Z" } else { "M 0 0 H 8 V 5 Z" }
  part p = embossed(svg_path(path), height: 2mm)
}
// --- a text with too many points
let outlines = svg_path("M 0 0 A 400 400 0 0 1 800 0 Z", 0.000001mm)
