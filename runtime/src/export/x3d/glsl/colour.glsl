// Colour of a deviation on the document's diverging scale, piecewise linear between samples of it.
vec3 colour(float millimetres) {
  float t = clamp(0.5 + 0.5 * millimetres / colourRange, 0.0, 1.0);
//!scale
}

// A headlight on the displaced surface. Its normal comes from the screen-space derivatives of the position, because
// the scan's surface, not the model's, is what is lit; both sides are lit alike.
vec3 lit(vec3 base, vec3 eye) {
  vec3 normal = normalize(cross(dFdx(eye), dFdy(eye)));
  float facing = abs(dot(normal, normalize(eye)));
  return base * (0.3 + 0.7 * facing);
}
