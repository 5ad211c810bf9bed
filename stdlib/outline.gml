// Outlines: closed lines of straight lines in the plane, as the built-in functions `svg_path` and `glyphs` make of a
// text, and solids of them: letters and SVG shapes, to emboss and to engrave. An outline is an array of points;
// outlines are an array of such, each with what it bounds on its left: the outer ones run counterclockwise, holes
// clockwise.

/// A prism of outlines that stands on the plane of x and y: outer ones counterclockwise, holes clockwise, none crossing
/// another, as `svg_path` and `glyphs` give them. Its surfaces are `wall[0]` on the first outline and so on, `top` and
/// `base`. Lengths of the plane are multiplied by `scale`.
/// ```gml
/// let frame = embossed(svg_path("M 0 0 H 8 V -6 H 0 Z M 2 -1 V -5 H 6 V -1 Z"), height: 3mm)
/// len(frame.wall)                     // = 2
/// inside(frame)((1mm, 3mm, 1mm))      // = -1 mm
/// inside(frame)((4mm, 3mm, 1mm))      // = 2 mm
/// ```
fn embossed(outlines, height: length, scale: real = 1) {
  require scale > 0, "the scale of outlines is positive"
  let lines = outline_lines(outlines)
  let face = transform(outlined_face(lines), |p| p * scale)
  solid(
    {
      wall: for outline in outlines {
        let line = polyline(outline, closed: true)
        |u: real, v: real| lift(line(u) * scale, height * v)
      },
      top: face.translate((0mm, 0mm, height)),
      base: flip(face),
    },
    |p| max(distance_from_lines((p.x, p.y) / scale, lines) * scale, -p.z, p.z - height),
  )
}

/// A line of letters as a solid on the plane of x and y, its base line on the x axis from the origin on: what `glyphs`
/// gives, in a size, which is that of the font's em, and as deep. `plate - {name: lettering(...)}` engraves it where
/// both overlap, `plate + {name: ...}` embosses it.
/// ```gml
/// // part name = lettering(glyphs("gmlc", "font.ttf"), size: 10mm, depth: 1mm)
/// let l = [[(0mm, 0mm), (0.4mm, 0mm), (0.4mm, 0.1mm), (0.1mm, 0.1mm), (0.1mm, 0.7mm), (0mm, 0.7mm)]]
/// inside(lettering(l, size: 20mm, depth: 2mm))((1mm, 9mm, 1mm))   // = -1 mm
/// ```
fn lettering(outlines, size: length, depth: length) = embossed(outlines, height: depth, scale: size / 1mm)

/// Outlines whose points are moved by a function of points in the plane: letters around a circle, a shape as its mirror
/// image. What they bound must stay on their left: turn a mirror image around with `backwards`.
/// ```gml
/// let square = svg_path("M 0 0 H 4 V -4 H 0 Z")
/// sum(moved_points(square, |p| p + (1mm, 2mm))[0])   // = (12, 16) mm
/// ```
fn moved_points(outlines, f) = for outline in outlines { for p in outline { f(p) } }

/// Outlines bent around the origin: the x axis becomes the circle of a radius, clockwise from its uppermost point on,
/// and what is above it lies outside. `from` is where on the line the uppermost point is: half of a line's width puts
/// its middle there. Only ends of lines are bent; `pieces` divides each line into as many first. Chords that would be
/// farther from the circle than a hundredth of its radius, and lines that are longer than a turn, are errors.
/// ```gml
/// let square = svg_path("M 0 0 H 4 V -4 H 0 Z")
/// let bent = bent_around(square, radius: 20mm, from: 2mm)
/// max(for p in bent[0] { norm(p) })      // = 24 mm
/// ```
fn bent_around(outlines, radius: length, from: length = 0mm, pieces: int = 1) = for outline in outlines {
  let n = len(outline)
  for i in 0..n * pieces {
    let (a, b) = (outline[floor(i / pieces)], outline[(floor(i / pieces) + 1) % n])
    require abs(b.x - a.x) < 0.28 * pieces * radius,
      "a line would be bent by more than a hundredth of the radius: divide the lines by 'pieces'"
    let p = mix(a, b, (i % pieces) / pieces)
    require abs(p.x - from) <= pi * radius,
      "the outlines are longer than the circle that they are bent around"
    polar2(radius + p.y, 90deg - 1rad * ((p.x - from) / radius))
  }
}

/// All lines of closed outlines, each as its two ends.
/// ```gml
/// outline_lines([[(0mm, 0mm), (4mm, 0mm), (0mm, 3mm)]])[2][0]    // = (0, 3) mm
/// ```
fn outline_lines(outlines) = fold([], outlines, |lines, outline| {
  let n = len(outline)
  concat(lines, for i in 0..n { (outline[i], outline[(i + 1) % n]) })
})

/// The plane of x and y within closed outlines, given as their lines: a rectangle that is somewhat larger, trimmed.
/// ```gml
/// let face = outlined_face(outline_lines([[(0mm, 0mm), (4mm, 0mm), (0mm, 3mm)]]))
/// face(0.5, 0.5).z    // = 0 mm
/// ```
fn outlined_face(lines) = plane_within(for (a, b) in lines { a }, |p| distance_from_lines(p, lines))

/// The plane of x and y where a function of its points is negative, which lies within the box of some points made
/// larger by a factor: the box, trimmed.
/// ```gml
/// let corners = [(-3mm, -3mm), (3mm, 3mm)]
/// plane_within(corners, |p| norm(p) - 3mm)(0.5, 0.5)   // = (0, 0, 0) mm
/// ```
fn plane_within(points, distance, larger: real = 1.05) {
  let (x, y) = (_extent(for p in points { p.x }, larger), _extent(for p in points { p.y }, larger))
  |u: real, v: real| {
    let p = (x.middle + (2 * u - 1) * x.half, y.middle + (2 * v - 1) * y.half)
    keep(lift(p), -distance(p))
  }
}

/// Distance of a point of the plane from closed outlines, given as their lines, negative inside; from the first `sides`
/// lines if the others bound nothing, as the axis within a body of revolution.
/// ```gml
/// let lines = outline_lines([[(0mm, 0mm), (4mm, 0mm), (0mm, 3mm)]])
/// distance_from_lines((1mm, 0.5mm), lines)    // = -0.5 mm
/// distance_from_lines((7mm, 4mm), lines)      // = 5 mm
/// ```
fn distance_from_lines(p, lines, sides: int = len(lines)) {
  // Over an array, not a range: written out, the ends of each line are constants, where an index would be looked up.
  let bounding = for i in 0..len(lines) { (lines[i][0], lines[i][1], i < sides) }
  let (square, beside, is_beside, side) = fold(
    (1000m * 1000m, 0mm, false, 1),
    bounding,
    |best, (a, b, bounds)| {
      let (along, from) = (b - a, p - a)
      let t = dot(from, along) / dot(along, along)
      let nearest = from - along * clamp(t, 0, 1)
      let square = if bounds { dot(nearest, nearest) } else { 1000m * 1000m }
      // Beside a line the distance has a sign of its own; beside corners a ray that leaves the outline gives it.
      let beside = cross2(from, along) / norm(along)
      let crossed = (a.y > p.y) != (b.y > p.y) and a.x + (p.y - a.y) / (b.y - a.y) * along.x > p.x
      (
        min(square, best[0]),
        if square < best[0] { beside } else { best[1] },
        if square < best[0] { t > 0 and t < 1 } else { best[2] },
        if crossed { -best[3] } else { best[3] },
      )
    },
  )
  // A corner itself, too, has derivatives.
  if is_beside { beside } else { side * sqrt(square + 1e-12mm * 1e-12mm) }
}

/// The middle of some lengths, and the largest distance from it by a factor at least: both without jumps in
/// derivatives.
fn _extent(xs, larger: real) {
  let middle = sum(xs) / len(xs)
  let largest = stop(max(for x in xs { abs(x - middle) }))
  {middle: middle, half: larger * largest * sum(for x in xs { ((x - middle) / largest) ^ 8 }) ^ (1/8)}
}
