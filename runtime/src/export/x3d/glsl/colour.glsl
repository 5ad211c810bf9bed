// Colour of a deviation on the document's diverging scale, piecewise linear between samples of it.
vec3 colour(float millimetres) {
  float t = clamp(0.5 + 0.5 * millimetres / colourRange, 0.0, 1.0);
//!scale
}

// Blinn-Phong's reflection, a pixel at a time, of a light at the viewer's left shoulder. The normal comes from the
// screen-space derivatives of the position, because the scan's surface, not the model's, is what is lit; both sides are
// lit alike. The highlight is weak, so that colours can be read.
vec3 lit(vec3 base, vec3 eye) {
  vec3 view = normalize(-eye);
  vec3 normal = normalize(cross(dFdx(eye), dFdy(eye)));
  if (dot(normal, view) < 0.0) normal = -normal;
  vec3 light = normalize(view + vec3(-0.35, 0.45, 0.0));
  float diffuse = max(dot(normal, light), 0.0);
  float specular = pow(max(dot(normal, normalize(light + view)), 0.0), 40.0);
  return base * (0.35 + 0.65 * diffuse) + vec3(0.12 * specular);
}
