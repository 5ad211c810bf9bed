// What every stage knows of the distance texture. Reads as GLSL 1.10, 1.50 and GLSL ES 3.00.

uniform float maxDistance;  // Millimetres; what the byte 255 stands for.
uniform float colourRange;  // Millimetres; where the colour scale ends.
uniform float exaggeration; // 1 shows deviations as they are.

// Signed deviation in millimetres (x) of a texel's code, and whether there is one (y: 1 or 0). Red is the distance to
// the scan along +normal, green along -normal; blue has bit 128 for a hit outside and bit 64 for one inside. The nearer
// hit counts, as in the statistics: positive where the scan lies outside the model.
vec2 deviation(vec3 code) {
  float hits = floor(code.b * 255.0 + 0.5);
  bool outside = hits >= 128.0;
  bool inside = mod(hits, 128.0) >= 64.0;
  if (outside && (!inside || code.r <= code.g)) return vec2(code.r * maxDistance, 1.0);
  if (inside) return vec2(-code.g * maxDistance, 1.0);
  return vec2(0.0, 0.0);
}
