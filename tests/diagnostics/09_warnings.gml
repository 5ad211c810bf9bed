// --- a parameter that nothing uses
model m {
  param r: length = 3mm
  param h: length = 3mm
  part p = sphere(r)
}
// --- an input that nothing uses
model m {
  input n: int = 3
  param r: length = 3mm
  part p = sphere(r)
}
// --- a name that nothing uses
model m {
  param r: length = 3mm
  let twice = 2 * r
  part p = sphere(r)
}
// --- a name of a block that nothing uses
fn f(x: real) {
  let y = x + 1
  let z = x + 2
  y
}
// --- a name that is brought and not used
use std.curve (line, circle)
fn f() = circle(3mm)
// --- a function that hides one of the library
fn mix(a: real, b: real) = (a + b) / 2
// --- a function that hides one of the language
fn max(a: real, b: real) = if a > b { a } else { b }
// --- a part in the place of a parameter
model m {
  param rim: length = 20mm
  input foot: length = 5mm
  part rim = sphere(rim)
  part foot = sphere(foot).translate((0mm, 0mm, 30mm))
  part lid = rim.translate((0mm, 0mm, 30mm))
}
// --- a part in the place of a parameter that is meant afterwards
model m {
  param rim: length = 20mm
  part rim = sphere(rim)
  part lid = sphere(rim - 2mm)
}
// --- a parameter without influence
model m {
  param r: length = 3mm
  param h: length = 3mm
  require h > 0mm, "a height"
  part p = sphere(r)
}
// --- a range that may be empty
model m {
  param a: length in 0mm..50mm = 10mm
  param b: length in a..30mm = 20mm
  part p = cone(a, b, 20mm)
}
// --- an upper bound that is never reached
model m {
  param r: length in 10mm..50mm = 20mm
  require r < 30mm, "too large for the box"
  part p = sphere(r)
}
// --- a lower bound that is never reached
model m {
  param inner: length in 1mm..50mm = 20mm
  param outer: length in 1mm..50mm = 40mm
  require outer > inner + 5mm, "the wall is too thin"
  part p = annulus(inner, outer)
}
// --- a part that jumps
model m {
  param k: real in -1..1 = 0.5
  let size = if k > 0.25 { 2 } else { 1 }
  part p = sphere(10mm * size + 1mm * k)
}
// --- a derivative that jumps
model m {
  param k: real in -1..1 = 0.5
  let bend = if k > 0 { 1 + 2 * k } else { 1 + k }
  part p = sphere(10mm * bend)
}
// --- a derivative that jumps in a function
fn soft(x) = if x < 0 { 0 } else { x }
model m {
  param k: real in -1..1 = 0.5
  part p = sphere(10mm + 1mm * soft(k))
}
// --- a parameter that only decides
model m {
  param k: length in 10mm..50mm = 20mm
  param r: length in 10mm..50mm = 20mm
  param h: length in 10mm..50mm = 20mm
  part p = cylinder(if k > 30mm { r } else { r + 5mm }, h)
}
// --- a parameter that cancels
model m {
  param k: length in 10mm..50mm = 20mm
  param r: length in 10mm..50mm = 20mm
  part p = sphere(r + k - k)
}
// --- a parameter that stands behind a stop
model m {
  param k: real in 1..5 = 2
  param r: length in 10mm..50mm = 20mm
  part p = sphere(r + 1mm * stop(k))
}
// --- a parameter whose bounds keep it without influence
model m {
  param r: length in 1mm..10mm = 5mm
  param h: length in 1mm..50mm = 5mm
  part p = cylinder(max(r, 12mm), h)
}
// --- a parameter without influence at the defaults
model m {
  param r: length in 1mm..20mm = 5mm
  param h: length in 11mm..30mm = 15mm
  part p = cylinder(smooth(r, h), h)
}
fn smooth(r: length, h: length) = h + max(r - h, 0mm) ^ 2 / 1mm
// --- a step that moves over the surface
model m {
  param r: real in 0..1 = 0.5
  part p = |u, v| (10mm * u, 10mm * v, if u < r { 0mm } else { 5mm })
}
// --- a jump that two parameters make together
model m {
  param a: length in 0mm..20mm = 5mm
  param b: length in 0mm..20mm = 5mm
  param c: length in 5mm..20mm = 5mm
  part p = sphere(c + if a + b > 30mm { 3mm } else { 6mm } + (a + b) / 10)
}
// --- a cut that two parameters cross together
model m {
  param a: length in -20mm..20mm = -15mm
  param b: length in -20mm..20mm = -15mm
  param r: length in 10mm..50mm = 20mm
  part p = cylinder(r + 1mm * radians(atan2(a + b - 10mm, -30mm)), r)
}
// --- a kink of an absolute value
model m {
  param k: length in 10mm..50mm = 20mm
  param r: length in 10mm..50mm = 25mm
  part p = sphere(10mm + abs(r - k))
}
// --- a kink of a maximum far from the default
model m {
  param k: length in -50mm..50mm = 20mm
  part p = sphere(10mm + max(k, 0mm))
}
// --- a maximum that its bounds decide
model m {
  param k: length in 0mm..50mm = 20mm
  part p = sphere(10mm + max(k, 0mm) + abs(k))
}
// --- a rounding that jumps
model m {
  param k: real in 0..0.9 = 0.2
  part p = sphere(10mm + 1mm * k + 1mm * round(stop(k)))
}
// --- a smoothstep
model m {
  param k: real in -1..2 = 0.5
  part p = sphere(10mm + 1mm * k + 1mm * smoothstep(0, 1, k))
}
// --- a smooth branch
model m {
  param k: real in -1..1 = 0.5
  let bend = if k > 0 { k ^ 2 } else { 0 }
  part p = sphere(10mm * (1 + bend))
}
// --- a requirement that the defaults do not meet
model m {
  param r: length in 1mm..50mm = 20mm
  param h: length in 1mm..50mm = 10mm
  require r + h > 40mm, "too small to be held"
  part p = sphere(r + h)
}
// --- a value that is not finite
model m {
  param r: length in 0mm..50mm = 20mm
  param k: real in 0..1 = 0
  part p = sphere(r / k)
}
// --- a division by zero whose result the library multiplies
model m {
  param k: real in 0..2 = 0
  param r: length in 1mm..50mm = 20mm
  part p = sphere(1mm * (1 / k)).translate((r, 0mm, 0mm))
}
// --- a division by an input that is zero
model m {
  input n: real = 0
  param r: length in 1mm..50mm = 20mm
  part p = sphere(1mm * (1 / n)).translate((r, 0mm, 0mm))
}
// --- a value that the library makes of finite ones
model m {
  param k: real in 0..2 = 1
  param r: length in 1mm..50mm = 20mm
  part p = |u, v| normalize((k - 1, 0, 0)) * r
}
// --- a border that is not finite
model m {
  param r: length in 1mm..50mm = 20mm
  part p = |u, v| (r * u, r * sqrt(v) / v, 0mm)
}
// --- a pole
model m {
  param r: length in 1mm..50mm = 20mm
  let profile = |t| (r * (1 - t), r * t ^ 2)
  part p = offset(revolve(profile), 3mm)
  part q = |u, v| (r * u, r * sqrt(v), 0mm)
}
// --- an index that is out of range
model m {
  param r: length in 1mm..50mm = 20mm
  part p = |u, v| (r * [1, 2, 3][stop_floor(u * 4)], r * v, 0mm)
}
fn stop_floor(x) = floor(stop(x))
// --- a name that looks like another one
model m {
  let radius = 10mm
  let rаdius = 20mm
  part p = sphere(radius + rаdius)
}
// --- solids that touch
use std.frame (rotate, translate)
use std.solid (capped_cylinder)

model cross {
  param height: length in 10mm..90mm = 30mm
  let post = capped_cylinder(radius: 5mm, height: height)
  let bar = capped_cylinder(radius: 4mm, height: 10mm).rotate(90deg, (1, 0, 0))
  part body = post + {bar: bar.translate((0mm, 5mm, height / 2))}
}
// --- holes that miss
use std.frame (translate)
use std.solid (box, capped_cylinder)

model plate {
  param x: length in 0mm..90mm = 60mm
  part plate = box(width: 80mm) - {
    hole: for i in 0..2 { capped_cylinder(radius: 3mm).translate((i * x, 0mm, 0mm)) },
  }
}
// --- a floor below the foot
use std.frame (translate)
use std.surface (annulus, cylinder, disc, flip)
model tin {
  param floor: length in -5mm..5mm = -1mm
  part outside = cylinder(30mm, 40mm)
  part foot = flip(disc(30mm))
  part rim = annulus(28mm, 30mm).translate((0mm, 0mm, 40mm))
  part inside = flip(cylinder(28mm, 40mm - floor)).translate((0mm, 0mm, floor))
  part bottom = disc(28mm).translate((0mm, 0mm, floor))
}
