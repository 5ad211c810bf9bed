#version 300 es
// Web (X_ITE): moves the model's own vertices, for WebGL has no geometry stage.
precision highp float;
precision highp int;
precision highp sampler2D;

in vec4 x3d_Vertex;
in vec3 x3d_Normal;
in vec4 x3d_TexCoord0;

out vec3 eye;       // Position in front of the eye.
out vec2 texCoord;
out float known;    // 1 where the scan was met; the fragment stage drops what lies between.

uniform mat4 x3d_ModelViewMatrix;
uniform mat4 x3d_ProjectionMatrix;
uniform sampler2D distances;

//!common
void main() {
  // Here the picture's first row has t = 0, while texture coordinates count from its last.
  texCoord = vec2(x3d_TexCoord0.x, 1.0 - x3d_TexCoord0.y);
  ivec2 size = textureSize(distances, 0);
  ivec2 texel = clamp(ivec2(floor(texCoord * vec2(size))), ivec2(0), size - 1);
  vec2 found = deviation(texelFetch(distances, texel, 0).rgb);
  known = found.y;
  vec3 moved = x3d_Vertex.xyz + exaggeration * found.x * normalize(x3d_Normal);
  vec4 inEye = x3d_ModelViewMatrix * vec4(moved, 1.0);
  eye = inEye.xyz;
  gl_Position = x3d_ProjectionMatrix * inEye;
}
