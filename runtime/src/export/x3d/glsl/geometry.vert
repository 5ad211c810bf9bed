// Desktop, first of three stages: hands the vertex of the model on as it is. No version line: Castle Game Engine
// prepends a define of its own.
attribute vec4 castle_Vertex;
attribute vec3 castle_Normal;
attribute vec4 castle_MultiTexCoord0;

varying vec3 modelNormal;
varying vec2 modelTexCoord;

void main() {
  gl_Position = castle_Vertex;
  modelNormal = castle_Normal;
  modelTexCoord = castle_MultiTexCoord0.xy;
}
