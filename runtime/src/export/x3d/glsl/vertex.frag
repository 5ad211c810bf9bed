#version 150
// Desktop without a geometry stage: the colour of the texel itself, not of the interpolated vertices.
in vec3 eye;
in vec2 texCoord;
in float known;

out vec4 fragment;

uniform sampler2D distances;

//!common
//!colour
void main() {
  ivec2 size = textureSize(distances, 0);
  ivec2 texel = clamp(ivec2(floor(texCoord * vec2(size))), ivec2(0), size - 1);
  vec2 found = deviation(texelFetch(distances, texel, 0).rgb);
  if (known < 0.9999 || found.y < 0.5) discard;
  fragment = vec4(lit(colour(found.x), eye), 1.0);
}
