#version 300 es
// The report's view: the colour of the texel itself, or plain grey.
precision highp float;
precision highp int;
precision highp isampler2D;

in vec3 eye;
in vec2 texCoord;
in float known;

out vec4 fragment;

uniform float displaced;
uniform float coloured;     // 1 for the colours of the deviations.
uniform float opacity;
uniform float step;         // Millimetres.
uniform float colourRange;  // Millimetres; where the colour scale ends.
uniform vec3 classes[5];    // The colours of what has no deviation, from class 2 on.
uniform isampler2D texels;  // The deviation in steps, and the class: 1 has a deviation.

//!colour
void main() {
  ivec2 size = textureSize(texels, 0);
  ivec2 found = texelFetch(texels, clamp(ivec2(floor(texCoord * vec2(size))), ivec2(0), size - 1), 0).rg;
  bool missing = found.y != 1;
  if (displaced > 0.5 && (missing || known < 0.9999)) discard;
  vec3 scale = missing ? classes[clamp(found.y - 2, 0, 4)] : colour(float(found.x) * step);
  fragment = vec4(lit(coloured > 0.5 ? scale : vec3(0.74, 0.76, 0.79), eye), opacity);
}
