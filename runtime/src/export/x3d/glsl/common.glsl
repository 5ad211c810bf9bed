// What every stage knows of the distance texture. Reads as GLSL 1.10, 1.50 and GLSL ES 3.00.

uniform float distanceRows; // Rows of the texture that hold distances; below them is the model.
uniform float fineDistance; // Millimetres; what the byte 223 stands for. Up to it steps are equal,
uniform float maxDistance;  // and from it to the byte 255 and these millimetres they are equal, too, and larger.
uniform float colourRange;  // Millimetres; where the colour scale ends.
uniform float exaggeration; // 1 shows deviations as they are.

// The distance of a byte, given as the share of 255 that samplers return.
float millimetres(float share) {
  float code = floor(share * 255.0 + 0.5);
  if (code <= 223.0) return code / 223.0 * fineDistance;
  return fineDistance + (code - 223.0) / 32.0 * (maxDistance - fineDistance);
}

// Signed deviation in millimetres (x) of a texel's code, and whether there is one (y: 1 or 0). Red is the distance to
// the scan along +normal, green along -normal; blue has bit 128 for a hit outside and bit 64 for one inside. Positive
// where the scan lies outside the model. `hits` is 0 for the nearer hit, which counts in the statistics, and 1 for the
// farther of two, where a ray met the scan in both directions ([VA] sect. 7).
vec2 deviation(vec3 code, float hits) {
  float flags = floor(code.b * 255.0 + 0.5);
  bool outside = flags >= 128.0;
  bool inside = mod(flags, 128.0) >= 64.0;
  bool two = outside && inside;
  if (hits > 0.5 && !two) return vec2(0.0, 0.0);
  bool nearerOutside = outside && (!two || code.r <= code.g);
  bool isOutside = hits > 0.5 ? !nearerOutside : nearerOutside;
  if (isOutside) return vec2(millimetres(code.r), 1.0);
  if (inside) return vec2(-millimetres(code.g), 1.0);
  return vec2(0.0, 0.0);
}
