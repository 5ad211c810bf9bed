#version 300 es
// The report's view: the colour of the texel itself, or plain grey; or the numbers of what is seen (NUMBERS).
precision highp float;
precision highp int;
precision highp isampler2D;

in vec3 eye;
in vec3 place;
in float height;
in vec2 texCoord;
in float known;

#ifdef NUMBERS
layout(location = 0) out uvec4 where;  // The place in 65535ths of the model's box, and the part from 1 on.
layout(location = 1) out uvec4 texel;  // Column and row, from the left and the top.
uniform uint part;
#else
layout(location = 0) out vec4 fragment;
uniform float coloured;     // 1 for the colours of the deviations, 2 for those of the scan, 0 for grey.
uniform float opacity;
uniform float step;         // Millimetres.
uniform float bands;        // Steps of the scale on either side; 0 for none.
uniform vec2 neutral;       // Millimetres: the deviations that have the colour of zero; none where the first is larger.
uniform vec3 classes[5];    // The colours of what has no deviation, from class 2 on.
#ifdef SCAN_COLOURS
uniform sampler2D scanColours;
#endif
#endif
uniform float colourRange;  // Millimetres; where the colour scale ends.
uniform float displaced;
uniform isampler2D texels;  // The deviation in steps, and the class: 1 has a deviation.

//!colour
void main() {
  ivec2 size = textureSize(texels, 0);
  ivec2 at = clamp(ivec2(floor(texCoord * vec2(size))), ivec2(0), size - 1);
  ivec2 found = texelFetch(texels, at, 0).rg;
  bool missing = found.y != 1;
  if (height > 0.0 || (displaced > 0.5 && (missing || known < 0.9999))) discard;
#ifdef NUMBERS
  where = uvec4(uvec3(clamp(place, 0.0, 1.0) * 65535.0 + 0.5), part);
  texel = uvec4(at, 0, 0);
#else
  vec3 scale;
  if (missing) {
    scale = classes[clamp(found.y - 2, 0, 4)];
    // Stripes: shaded grey is not to pass for a deviation of zero.
    if (fract((gl_FragCoord.x + gl_FragCoord.y) / 9.0) < 0.3) scale *= 0.55;
  } else {
    float deviation = float(found.x) * step;
    if (deviation >= neutral.x && deviation <= neutral.y) deviation = 0.0;
    else if (bands > 0.5 && neutral.x <= neutral.y) {
      // Steps of one width on both sides, from the limits on; data.js says the same.
      float width = max(colourRange - max(abs(neutral.x), abs(neutral.y)), 1e-9) / bands;
      float excess = deviation > neutral.y ? deviation - neutral.y : neutral.x - deviation;
      deviation = (deviation > neutral.y ? 1.0 : -1.0) * min(ceil(excess / width - 0.00001), bands) / bands * colourRange;
    } else if (bands > 0.5) deviation = sign(deviation) * (floor(min(abs(deviation) / colourRange, 0.9999) * bands) + 0.5) / bands * colourRange;
    scale = colour(deviation);
  }
#ifdef SCAN_COLOURS
  if (coloured > 1.5 && !missing) scale = texture(scanColours, texCoord).rgb;
#endif
  fragment = vec4(lit(coloured > 0.5 ? scale : vec3(0.74, 0.76, 0.79), eye), opacity);
#endif
}
