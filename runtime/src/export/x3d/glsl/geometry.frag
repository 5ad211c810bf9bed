// Desktop, third of three stages: the colour of the texel itself, not of the interpolated corners. GLSL 1.10 has no
// texelFetch; with nearest filters texture2D returns the same bytes.
varying vec3 eye;
varying vec2 texCoord;
varying float known;
varying float hits;

uniform sampler2D distances;

//!common
//!colour
//!scaled
void main() {
  vec2 found = deviation(texture2D(distances, texCoord).rgb, floor(hits + 0.5));
  if (known < 0.9999 || found.y < 0.5) discard;
  gl_FragColor = vec4(lit(scaled(found.x), eye), 1.0);
}
