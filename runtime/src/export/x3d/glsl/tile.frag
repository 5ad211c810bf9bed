// The colour of the texel itself, not of the interpolated vertices.
in vec3 eye;
in vec2 texCoord;
in float known;
flat in float hits;

out vec4 fragment;

uniform sampler2D distances;

//!common
//!colour
//!scaled
//!texel
void main() {
  vec2 found = deviation(texelFetch(distances, texelAt(texCoord), 0).rgb, hits);
  if (known < 0.9999 || found.y < 0.5) discard;
  fragment = vec4(lit(scaled(found.x), eye), 1.0);
}
