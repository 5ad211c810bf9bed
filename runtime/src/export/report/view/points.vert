#version 300 es
// The report's view: points of the scan.
precision highp float;

in vec3 position;  // In the unit cube around the scan.

out float height;

uniform mat4 view;
uniform mat4 projection;
uniform vec4 plane;
uniform vec3 middle;      // Of the scan, from the model's centre. Millimetres.
uniform vec3 halfExtent;  // Millimetres.
uniform float size;       // Of a point, in pixels.

void main() {
  vec3 place = middle + (2.0 * position - 1.0) * halfExtent;
  height = dot(plane.xyz, place) + plane.w;
  gl_Position = projection * view * vec4(place, 1.0);
  gl_PointSize = size;
}
