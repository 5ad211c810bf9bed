#version 150
// Desktop without a geometry stage: moves the model's own vertices.
in vec4 castle_Vertex;
in vec3 castle_Normal;
in vec4 castle_MultiTexCoord0;

out vec3 eye;       // Position in front of the eye.
out vec2 texCoord;
out float known;    // 1 where the scan was met; the fragment stage drops what lies between.

uniform mat4 castle_ModelViewMatrix;
uniform mat4 castle_ProjectionMatrix;
uniform sampler2D distances;

//!common
void main() {
  texCoord = castle_MultiTexCoord0.xy;
  ivec2 size = textureSize(distances, 0);
  ivec2 texel = clamp(ivec2(floor(texCoord * vec2(size))), ivec2(0), size - 1);
  vec2 found = deviation(texelFetch(distances, texel, 0).rgb);
  known = found.y;
  vec3 moved = castle_Vertex.xyz + exaggeration * found.x * normalize(castle_Normal);
  vec4 inEye = castle_ModelViewMatrix * vec4(moved, 1.0);
  eye = inEye.xyz;
  gl_Position = castle_ProjectionMatrix * inEye;
}
