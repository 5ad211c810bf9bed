model flange {
  input bolts: int in 3..16 = 6
  param r_out: length in 40mm..150mm = 80mm
  param r_in: length in 10mm..r_out = 30mm               // a bound may name an earlier parameter
  param r_circle: length in r_in..r_out = 60mm
  param d_bolt: length in 4mm..20mm = 9mm
  param thick: length in 4mm..30mm = 12mm
  require r_circle + d_bolt / 2 < r_out, "the bolt holes break the rim"
  part rim = cylinder(r_out, thick)
  for i in 0..bolts {
    part hole = cylinder(d_bolt / 2, thick).translate(polar(r_circle, i * 1turn / bolts))
  }
}

fn norm(v: vec3) -> real = sqrt(v.x^2 + v.y^2 + v.z^2)
deriv norm(v; dv) { let n = norm(v); if n > 0 { dot(v, dv) / n } else { 0 } }

fn normal(s: surface, u: real, v: real) -> vec3 = normalize(cross(s'u(u, v), s'v(u, v)))
