/// The straight line from a to b, in the plane or in space.
fn line(a, b) = |t: real| mix(a, b, t)

/// The part of a circle in the plane from one angle to another, counterclockwise where `to` is the greater.
fn arc(center: point2, radius: length, from: angle, to: angle) = |t: real| {
  let a = mix(from, to, t)
  (center.x + radius * cos(a), center.y + radius * sin(a))
}

/// A circle in the plane.
fn circle(radius: length, center: point2 = (0mm, 0mm)) = arc(center, radius, 0deg, 360deg)

/// An ellipse in the plane with semi-axes a (along x) and b.
fn ellipse(a: length, b: length, center: point2 = (0mm, 0mm)) = |t: real|
  (center.x + a * cos(t * 1turn), center.y + b * sin(t * 1turn))

/// The Bezier curve with these control points, as many as you like (de Casteljau).
fn bezier(points) = |t: real| casteljau(points, t)

/// One point of a Bezier curve: neighbours are mixed until one is left.
fn casteljau(points, t) =
  if len(points) == 1 { points[0] }
  else { casteljau(for i in 0..len(points) - 1 { mix(points[i], points[i + 1], t) }, t) }

/// A curve with its sense reversed.
fn reversed(curve) = |t: real| curve(1 - t)

/// The curve in space: one in the plane is put into the half plane of x (its first coordinate) and z (its second).
fn spatial(curve) =
  if len(curve(0.5)) == 2 {
    |t: real| {
      let p = curve(t)
      (p.x, 0mm, p.y)
    }
  } else { curve }
