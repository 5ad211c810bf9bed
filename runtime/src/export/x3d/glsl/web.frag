#version 300 es
// Web (X_ITE): the colour of the texel itself, not of the interpolated vertices.
precision highp float;
precision highp int;
precision highp sampler2D;

in vec3 eye;
in vec2 texCoord;
in float known;

out vec4 x3d_FragColor;

uniform sampler2D distances;

//!common
//!colour
void main() {
  ivec2 size = textureSize(distances, 0);
  ivec2 texel = clamp(ivec2(floor(texCoord * vec2(size))), ivec2(0), size - 1);
  vec2 found = deviation(texelFetch(distances, texel, 0).rgb);
  if (known < 0.9999 || found.y < 0.5) discard;
  x3d_FragColor = vec4(lit(colour(found.x), eye), 1.0);
}
