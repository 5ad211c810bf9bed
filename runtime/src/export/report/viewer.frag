#version 300 es
// The report's view: the colour of the texel itself, or plain grey.
precision highp float;
precision highp int;
precision highp sampler2D;

in vec3 eye;
in vec2 texCoord;
in float known;

out vec4 fragment;

uniform float displaced;
uniform float coloured;   // 1 for the colours of the deviations.
uniform float opacity;
uniform sampler2D distances;

//!common
//!colour
void main() {
  ivec2 size = textureSize(distances, 0);
  ivec2 texel = clamp(ivec2(floor(texCoord * vec2(size))), ivec2(0), size - 1);
  vec2 found = deviation(texelFetch(distances, texel, 0).rgb);
  bool missing = known < 0.9999 || found.y < 0.5;
  if (displaced > 0.5 && missing) discard;
  vec3 base = coloured > 0.5 ? (missing ? vec3(0.5) : colour(found.x)) : vec3(0.74, 0.76, 0.79);
  fragment = vec4(lit(base, eye), opacity);
}
