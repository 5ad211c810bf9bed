#version 300 es
// The report's view: moves the model's vertices to the scan, as the X3D's shaders do.
precision highp float;
precision highp int;
precision highp isampler2D;

in vec3 position;  // In the unit cube around the model.
in vec3 normal;
in vec2 st;

out vec3 eye;
out vec3 place;     // On the model, in the unit cube.
out float height;   // Above the section's plane. Millimetres.
out vec2 texCoord;
out float known;

uniform mat4 view;           // Model coordinates, in millimetres from the centre, to the eye's.
uniform mat4 projection;
uniform vec4 plane;          // Of the section: its normal, and minus its distance from the centre in millimetres.
uniform vec3 halfSize;       // Of the model's bounding box. Millimetres.
uniform float displaced;     // 1 for the scan, 0 for the model.
uniform float exaggeration;  // 1 shows deviations as they are.
uniform float step;          // Millimetres.
uniform isampler2D texels;   // The deviation in steps, and the class: 1 has a deviation.

void main() {
  // The texture's first row has t = 0, while texture coordinates count from its last.
  texCoord = vec2(st.x, 1.0 - st.y);
  ivec2 size = textureSize(texels, 0);
  ivec2 found = texelFetch(texels, clamp(ivec2(floor(texCoord * vec2(size))), ivec2(0), size - 1), 0).rg;
  known = found.y == 1 ? 1.0 : 0.0;
  float deviation = known * float(found.x) * step;
  vec3 nominal = (2.0 * position - 1.0) * halfSize;
  place = position;
  height = dot(plane.xyz, nominal) + plane.w;
  vec4 inEye = view * vec4(nominal + displaced * exaggeration * deviation * normalize(normal), 1.0);
  eye = inEye.xyz;
  gl_Position = projection * inEye;
}
