#version 300 es
// The report's view: moves the model's vertices to the scan, as the X3D's shaders do.
precision highp float;
precision highp int;
precision highp sampler2D;

in vec3 position;  // In the unit cube around the model.
in vec3 normal;
in vec2 st;

out vec3 eye;
out vec2 texCoord;
out float known;

uniform mat4 view;        // Model coordinates, in millimetres from the centre, to the eye's.
uniform mat4 projection;
uniform vec3 halfSize;    // Of the model's bounding box. Millimetres.
uniform float displaced;  // 1 for the scan, 0 for the model.
uniform sampler2D distances;

//!common
void main() {
  // The picture's first row has t = 0, while texture coordinates count from its last.
  texCoord = vec2(st.x, 1.0 - st.y);
  ivec2 size = textureSize(distances, 0);
  ivec2 texel = clamp(ivec2(floor(texCoord * vec2(size))), ivec2(0), size - 1);
  vec2 found = deviation(texelFetch(distances, texel, 0).rgb);
  known = found.y;
  vec3 moved = (2.0 * position - 1.0) * halfSize + displaced * exaggeration * found.x * normalize(normal);
  vec4 inEye = view * vec4(moved, 1.0);
  eye = inEye.xyz;
  gl_Position = projection * inEye;
}
