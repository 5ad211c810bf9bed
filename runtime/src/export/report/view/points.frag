#version 300 es
// The report's view: points of the scan, in a colour that the scale does not contain.
precision highp float;

in float height;

layout(location = 0) out vec4 fragment;

void main() {
  if (height > 0.0) discard;
  fragment = vec4(0.48, 0.24, 0.62, 1.0);
}
